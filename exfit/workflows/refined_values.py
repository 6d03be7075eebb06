"""Given values that the records refine: they are fitted, with their standard errors as priors."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from exfit.case.given_errors import given_std_errors
from exfit.estimate import Progress, Stop, half_square
from exfit.fitting.channel_weights import balanced, residual_deviations
from exfit.fitting.compression import compressed
from exfit.fitting.descents import short_descent, stopped
from exfit.fitting.global_search import SearchResult, extended
from exfit.fitting.noise import MISFIT, noise_of
from exfit.fitting.parameters import LARGEST_FACTOR, freed_within
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import with_freed
from exfit.fitting.search import CaseSearches
from exfit.fitting.system import parameters_of
from exfit.results.compare_with_record import compare_with_record
from exfit.results.intervals.free_values import improbability
from exfit.results.intervals.value_errors import RefinedValues, Refinement
from exfit.util.arrays import Array
from exfit.util.vocabulary import REFINING_VALUES
from exfit.verdict.causes import Evidence, FittedRecord
from exfit.verdict.score_tests import value_that_the_record_refines
from exfit.workflows.case_search import driving_noise
from exfit.workflows.search_state import SearchState, ignore

Values = Mapping[str, float]

NEGLIGIBLE = 1e-2  # of its error: a value that moves less stays as it was given
MOST_VALUES = 8  # each the one that explains most of what is left
STARTS, SEED = 12, 0  # of all values of an event
MOST_HALVINGS, MOST_ITERATIONS, TOLERANCE = 6, 30, 1e-3  # of a start, and of its descent
AS_LIKELY = 10.0  # chi-square: weights may yet change
ALIKE = 0.1  # chi-square: what is likelier by less is the same minimum
SAME = 1e-2  # of a scaled parameter: ends that are no further apart are one minimum
HOPELESS = 10.0  # times the noise with all values free: neither weights nor other starts mend that
BEYOND_NOISE = 1.3  # times the cost of the noise, whose variance is known to 12 %
MOST_OF_EVENT = 2  # an event shows so many values that all are off where it asks for more


def with_refined_values(state: SearchState) -> SearchState:
    """Fit those given values, too, of which the records say more than that they are as given.

    One after the other, each with its standard error: the one that would explain most of the
    residuals beyond their noise. Where an event asks for more than a few, or is missed, all at
    once, if that explains it, and better than what a test or a record holds: these stay where they
    then are most likely.
    """
    event, given = state.case.kind.finds_rest, _given(state)
    steps = list[Refinement]()
    evidence = _evidence(state)
    found = value_that_the_record_refines(evidence)
    most = MOST_OF_EVENT if event else MOST_VALUES
    while found.names and len(steps) < most and not state.interrupted:
        steps.append(found)
        freed = {name: given[name] for name in found.names if name in given}
        state = driving_noise(_with_freed(state, freed))
        evidence = _evidence(state)
        found = value_that_the_record_refines(evidence)
    asks_for_more = found.names or evidence.cost > BEYOND_NOISE * evidence.noise_cost
    if event and not state.interrupted and (asks_for_more or _misses(evidence)):
        return _with_all(state, given, steps, found)
    return replace(state, refined=RefinedValues(steps=(*steps,)))


def _with_all(
    state: SearchState, given: Values, steps: Sequence[Refinement], found: Refinement
) -> SearchState:
    """Fit all values at once, where that explains an event, and better than what was ``found``."""
    values, before = _given(state), state.found
    without = replace(state, refined=RefinedValues(steps=(*steps,)))
    wider = _with_freed(replace(state, searched=before._replace(minima=None)), values)
    if not wider.interrupted and _misses(_evidence(wider), HOPELESS):
        return without
    after, others = _from_other_starts(driving_noise(wider), before, values)
    if after.interrupted:
        best = stopped(before.best, Stop.INTERRUPTED)
        return replace(without, searched=before._replace(best=best))
    if _misses(_evidence(after)) or _fall(state, after, values) <= found.by_rival:
        return without
    whole = after.found._replace(minima=before.minima, place=before.place)
    refined = RefinedValues(given, (*steps, found), others)
    return _held(replace(after, searched=whole), refined)


def _given(state: SearchState) -> dict[str, float]:
    """Return the given values that have a standard error and do something, but for fitted ones."""
    fixed, used = state.problem.residuals.fixed, parameters_of(state.case)
    names = [name for name in given_std_errors(state.case) if name in used]
    return {name: fixed[name] for name in names if fixed.get(name)}


def _fall(before: SearchState, after: SearchState, values: Values) -> float:
    """Return by how much chi-square falls where values are fitted, too."""
    residuals, x = after.problem.residuals, before.found.best.x
    as_given = [free.scaled(values[free.name]) for free in residuals.free[len(x) :]]
    cost = half_square(residuals(np.append(x, as_given)))
    return residuals.count * (cost / after.found.best.cost - 1.0)


def _misses(evidence: Evidence, times: float = MISFIT) -> bool:
    """Test whether the errors of a signal are so many times the noise of its record."""
    if evidence.weighted_by_noise:
        return evidence.cost > times**2 * evidence.noise_cost
    return any(
        record.comparison.overlays[channel.signal].rmse > times * noise_of(channel)
        for _, record, _, channel in evidence.channels
    )


def _evidence(state: SearchState) -> Evidence:
    residuals, best = state.problem.residuals, state.found.best
    values = residuals.values(best.x)
    tests = zip(state.case.recordings, state.fitted, strict=True)
    records = tuple(
        FittedRecord(each.test, setup, compare_with_record(setup, values, described=False))
        for each, setup in tests
    )
    return Evidence(state.case, residuals, best, records, uncertainty=None)


def _with_freed(state: SearchState, values: Values) -> SearchState:
    """Search on with values as parameters, from where the search has come to."""
    counter, std_errors = state.problem.residuals.counter, given_std_errors(state.case)
    added = [
        freed_within(name, value, LARGEST_FACTOR, std_errors[name])
        for name, value in values.items()
    ]
    residuals = with_freed(state.problem.residuals, added).counted_by(counter)
    more = np.array([free.scaled(free.start) for free in added])
    point = np.append(state.found.best.x, more)
    problem = FitProblem(residuals, compressed(residuals, point))
    by_noise = any(each.whitening is not None for each in residuals.experiments)
    if state.options.weights == "balanced" and not by_noise:  # until now by what a value explains
        deviations = residual_deviations(problem.compressed, point)
        problem = balanced(problem, point, counter, deviations)
    return _searched(state, problem, lambda x: np.append(x, more))


def _from_other_starts(
    state: SearchState, before: SearchResult, values: Values
) -> tuple[SearchState, tuple[Values, ...]]:
    """Search on from other values, drawn by their errors; return other minima that are as likely.

    So many values may be likely in several places, and the first one found need not be the
    likeliest.
    """
    if state.interrupted:
        return state, ()
    residuals, best = state.problem.residuals, state.found.best
    ends = [best]
    for number, start in enumerate(_drawn_starts(state, before, values)):
        state.watch(Progress("refining", number, STARTS, min(end.cost for end in ends)))
        end = short_descent(residuals, start, MOST_ITERATIONS, tolerance=TOLERANCE)
        if end is not None and end.stop is Stop.INTERRUPTED:
            return replace(state, searched=state.found._replace(best=stopped(best, end.stop))), ()
        if end is not None:
            ends.append(end)
    shares = [improbability(residuals, end.x, end.cost) for end in ends]
    place = int(np.argmin(shares))
    if shares[place] > shares[0] - ALIKE:
        place = 0  # it is the same
    else:
        searched = state.continued(state.problem, state.found, ends[place].x)
        state = driving_noise(replace(state, searched=searched))
    others = [ends[place].x]
    for end, share in zip(ends, shares, strict=True):
        higher = 2.0 * (end.cost - ends[place].cost) / residuals.noise**2
        likely = min(higher, share - shares[place]) < AS_LIKELY
        if likely and not any(np.allclose(end.x, x, atol=SAME) for x in others):
            others.append(end.x)
    itself: tuple[Values, ...] = ({},) if len(others) > 1 else ()
    return state, (*itself, *(residuals.values(x) for x in others[1:]))


def _drawn_starts(state: SearchState, before: SearchResult, values: Values) -> Iterator[Array]:
    """Yield starts with values drawn by their errors.

    The parameters start from the minimum, from the case's start and from the minima ``before``. A
    start without a response is drawn nearer.
    """
    residuals, best = state.problem.residuals, state.found.best
    generator, std_errors = np.random.default_rng(SEED), given_std_errors(state.case)
    count = len(before.best.x)
    points = [best.x[:count], residuals.start[:count]]
    points += [] if before.minima is None else [local.x for local in before.minima.minima]
    for number in range(STARTS):
        start = best.x.copy()
        start[:count] = points[number % len(points)]
        for k, free in enumerate(residuals.free):
            if free.name in values:
                drawn = values[free.name] + std_errors[free.name] * generator.standard_normal()
                start[k] = free.scaled(min(max(drawn, free.low), free.high))
        for _ in range(MOST_HALVINGS):
            if np.isfinite(residuals.costs([start])[0]):
                break
            start = 0.5 * (start + best.x)
        yield start


def _held(state: SearchState, refined: RefinedValues) -> SearchState:
    """Hold the given values where they are most likely: what follows is of the other parameters."""
    residuals, x, given = state.problem.residuals, state.found.best.x, refined.given
    values, std_errors = residuals.values(x), given_std_errors(state.case)
    moved = {
        name: value
        for name, value in given.items()
        if abs(values[name] - value) > NEGLIGIBLE * std_errors[name]
    }
    own = [free for free in residuals.free if free.name not in given]
    fixed = {**residuals.fixed, **given, **{name: values[name] for name in moved}}
    held = replace(residuals, free=own, fixed=fixed)
    problem = FitProblem(held, compressed(held, x[: len(own)]))
    state = replace(state, refined=refined._replace(given=moved))
    return _searched(state, problem, lambda x: x[: len(own)])


def _searched(
    state: SearchState,
    problem: FitProblem,
    point_of: Callable[[Array], Array],
) -> SearchState:
    state = replace(state, problem=problem)
    searches = CaseSearches(problem, state.options, ignore, state.counter)
    own = point_of, state.on_line, REFINING_VALUES
    return replace(state, searched=extended(searches, state.found, *own))
