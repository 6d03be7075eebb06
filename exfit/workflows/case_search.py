"""The search for the parameters of a case: stages, each of which takes the state further.

They are read from top to bottom, in `SEARCH` and `STAGES`; why each is there stands in it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.errors import CaseError, SimulationError
from exfit.fitting.channel_weights import (
    MOST_SEARCHES,
    as_fitted,
    balanced,
    other_deviations,
    weighted_alike,
)
from exfit.fitting.compression import compressed, is_as_all
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.global_search import Judge, SearchResult
from exfit.fitting.memory import check_memory
from exfit.fitting.noise import LEAST_NOISE, MISFIT, noise_of
from exfit.fitting.problem import FitProblem, problem_of, residuals_of, with_setups
from exfit.fitting.program import Program
from exfit.fitting.residuals import SimulationCounter
from exfit.fitting.search import names_of_records, search
from exfit.fitting.uncertainty import not_served_by_linear_theory
from exfit.inference.noise import LEAST_P, SURPRISING, whiteness
from exfit.registry import parts
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison
from exfit.results.intervals.determination import (
    NEEDS_PROFILE,
    Determination,
    determination,
    uncertainty_of_solution,
    without_linear_intervals,
)
from exfit.results.intervals.samples_at_steps import without_contradicting_samples
from exfit.util.arrays import Array
from exfit.util.text import digits
from exfit.util.vocabulary import (
    COMPRESSED_ANEW,
    ON_FINER_GRID,
    WEIGHTED_BY_NOISE,
)
from exfit.workflows.responses import aligned, validation_of
from exfit.workflows.search_state import SearchState, Stage, ignore, in_turn

Values = Mapping[str, float]

MOST_MINIMA = 3  # that profiles lead to, each below the other: two are rare


def lines(state: SearchState) -> SearchState:
    """Fit sines to the periodic disturbances that the residuals of a first search show.

    Before that search nothing tells them from a response. Raises KeyboardInterrupt where an
    interruption ends it.
    """
    if not any(setup.automatic_sines for setup in state.setups):
        return state
    from exfit.fitting.sines import with_found_lines

    first = in_turn((*WEIGHTED, samples_at_steps), replace(state, announce=ignore))
    if first.interrupted:
        raise KeyboardInterrupt
    at = first.problem.residuals, first.found.best.x
    setups, notes = with_found_lines(state.setups, *at)
    problem = problem_of(residuals_of(state.case, setups))
    return replace(state, setups=setups, problem=problem, line_notes=notes)


def weights(state: SearchState) -> SearchState:
    """Balance the channels, where the case asks for it, by the minimum near its start.

    What a model can match of each signal is known in a minimum only.
    """
    if state.options.weights != "balanced":
        return state
    start = state.problem.residuals.start
    return replace(state, problem=balanced(state.problem, start, state.counter))


def descents(state: SearchState) -> SearchState:
    """Descend from the start of the case and, in a global search, from others.

    Of minima that the records do not tell apart it is one on which the validations hold.
    """
    case, problem, judge = state.case, state.problem, None
    if state.program is None:  # whose runs are too dear to judge its ends
        judge = judge_of(case, problem, state.setups, state.unseen)
    settings = state.counter, state.options, judge, state.program
    found = search(case, problem, state.method, state.on_line, state.watch, *settings)
    return on_all_samples(on_finer_grid(replace(state, searched=found)))


def on_finer_grid(state: SearchState) -> SearchState:
    """Search on with shorter steps where the response found needs them for its accuracy."""
    if state.program is not None or state.interrupted:
        return state
    x, fitted = state.found.best.x, state.fitted
    values = state.problem.residuals.values(x)
    fine = tuple(setup.with_enough_substeps(values) for setup in fitted)
    steps = [[setup.experiment.simulator.step for setup in setups] for setups in (fitted, fine)]
    if steps[0] == steps[1]:
        return state
    try:
        check_memory(state.case, [setup.experiment for setup in fine])
    except CaseError as fault:  # what was found is kept
        note = f"not simulated with the shorter steps that simulation.accuracy needs: {fault}"
        notes = (*state.found.notes, note)
        return replace(state, searched=state.found._replace(notes=notes))
    residuals = with_setups(state.problem, fine).residuals
    problem = FitProblem(residuals, compressed(residuals, x))
    searched = state.continued(problem, state.found, x, ON_FINER_GRID)
    return replace(state, setups=fine, problem=problem, searched=searched)


def on_all_samples(state: SearchState) -> SearchState:
    """Search on where compressed records do not have the minimum of all their samples.

    They are compressed anew, at the end of the search.
    """
    problem, found = state.problem, state.found
    x = found.best.x
    if state.interrupted or is_as_all(problem.compressed, problem.residuals, x):
        return state
    problem = FitProblem(problem.residuals, compressed(problem.residuals, x))
    return replace(
        state, problem=problem, searched=state.continued(problem, found, x, COMPRESSED_ANEW)
    )


def judge_of(
    case: Case,
    problem: FitProblem,
    setups: Sequence[ExperimentSetup],
    unseen: Sequence[ExperimentSetup],
) -> Judge:
    """Make the judge of the ends of a search.

    ``setups`` are the tests of the fit, ``unseen`` those of the validations. An end is refused
    where one of these is not accepted. It is in doubt there, where the search did not converge, and
    where its errors are not white or larger than the noise (or larger than good_enough, where the
    case gives that).
    """
    residuals, good_enough = problem.residuals, case.estimate.good_enough

    def fitted(end: estimate.Result) -> tuple[Values, list[Comparison]]:
        values = residuals.values(end.x)
        fine = (setup.with_enough_substeps(values) for setup in setups)
        return values, [compare_with_record(setup, values, described=False) for setup in fine]

    def refusals(values: Values, matches: Sequence[Comparison]) -> Iterator[str]:
        for setup in unseen:
            yield validation_of(case, matches, *aligned(case, setup, values)).reason

    def doubts(end: estimate.Result) -> Iterator[str]:
        if not end.success:
            yield f"the search had not converged: {end.message}"
        values, matches = fitted(end)
        if good_enough is None:
            for setup, match in zip(setups, matches, strict=True):
                yield from _beyond_noise(setup, match)
        else:
            rmse = float(np.sqrt(2.0 * end.cost / (residuals.count + len(residuals.priors))))
            if rmse > good_enough.rmse:
                yield f"the error, {rmse:.3e} pu, exceeded good_enough, {good_enough.rmse:g} pu"
        yield from refusals(values, matches)

    def first(objections: Callable[[estimate.Result], Iterator[str]], end: estimate.Result) -> str:
        try:
            return next(filter(None, objections(end)), "")
        except SimulationError as fault:
            return str(fault)

    return Judge(partial(first, lambda end: refusals(*fitted(end))), partial(first, doubts))


def _beyond_noise(setup: ExperimentSetup, comparison: Comparison) -> Iterator[str]:
    """Yield the signals whose error is larger than the noise of their record, or not white."""
    for channel in setup.channels:
        overlay = comparison.overlays[channel.signal]
        if overlay.rmse <= LEAST_NOISE:
            continue
        times = overlay.rmse / noise_of(channel)
        if times > MISFIT:
            yield f"the error of {channel.signal} was {times:.2g} times the noise of its record"
        p_value = whiteness(overlay.error[np.isfinite(overlay.error)])
        if p_value is not None and p_value < SURPRISING:
            p = digits(p_value) if p_value > LEAST_P else f"below {LEAST_P:.0e}"
            yield f"the residuals of {channel.signal} were not white (Ljung-Box p {p})"


def weights_of_minimum(state: SearchState) -> SearchState:
    """Balance and search anew where the search ended in a minimum with other weights."""
    if state.options.weights != "balanced":
        return state
    for _ in range(MOST_SEARCHES - 1):
        if state.interrupted:
            break
        x = state.found.best.x
        deviations = other_deviations(state.problem, x)
        if deviations is None:
            break
        problem = balanced(state.problem, x, state.counter, deviations)
        state = descents(replace(state, problem=problem))
    return state


def samples_at_steps(state: SearchState) -> SearchState:
    """Leave out samples at the instant of a step that contradict all others, and search anew.

    A recorder may have taken them before the step or after it. Notes name them.
    """
    if state.interrupted:
        return state
    problem, notes = without_contradicting_samples(state.problem, state.found.best.x)
    if not notes:
        return state
    fewer = replace(state, problem=problem, setups=as_fitted(state.setups, problem))
    again = in_turn(WEIGHTED, fewer)
    found = again.found._replace(notes=(*again.found.notes, *notes))
    return replace(again, setups=state.setups, searched=found)


def driving_noise(state: SearchState) -> SearchState:
    """Weight the errors by the noise of recorded signals that drive the simulation.

    It is in the errors of all signals at once, and biases the parameters.
    """
    if state.interrupted or not state.case.kind.finds_rest:
        return state

    def proceed(problem: FitProblem, found: SearchResult, point: Array) -> SearchResult:
        return state.continued(problem, found, point, WEIGHTED_BY_NOISE)

    stage = parts("INPUT_NOISE")["weighted search"].load()
    problem, found = stage(state.problem, state.fitted, state.found, proceed, state.watch)
    return replace(state, problem=problem, searched=found)


def settled(state: SearchState) -> SearchState:
    """Prepare the tests for what follows: no run of a program more, validations weighted alike."""
    problem, unseen = state.problem, state.unseen
    if state.program is not None:
        values = problem.residuals.values(state.found.best.x)
        setups = state.program.settled(state.fitted, values, problem.residuals)
        problem, unseen = with_setups(problem, setups), state.program.settled(unseen, values)
    if state.options.weights == "balanced":
        unseen = weighted_alike(unseen, problem.residuals)
    return replace(state, problem=problem, unseen=unseen)


def profiles(state: SearchState) -> SearchState:
    """Determine the parameters, by profiles where linear theory does not serve.

    Where these lead to a lower minimum the search goes on from there.
    """
    if state.program is not None:
        return _profiles_by_twin(state, state.program)
    problem, found, setups = state.problem, state.found, state.fitted
    profiled = state.options.search != "local"
    determined = determination(problem, found, setups, profiled, state.watch)
    judge = judge_of(state.case, problem, setups, state.unseen)
    for _ in range(MOST_MINIMA):
        if determined.lower is None:
            break
        found = state.continued(problem, found, determined.lower, judge=judge)
        determined = determination(problem, found, setups, profiled, state.watch)
    return replace(state, searched=found, determined=determined)


def _profiles_by_twin(state: SearchState, program: Program) -> SearchState:
    """Determine the parameters of a program, by its corrected twin.

    Profiles take no run. Where they lead to a lower cost, which the program need not have, the
    result is not at the minimum of the corrected twin. The intervals are those of linear theory
    then, which is judged at that minimum; without a twin they are so as well.
    """
    problem, found, setups = state.problem, state.found, state.fitted
    determined = determination(problem, found, setups, program.has_twin, state.watch)
    if determined.lower is None:
        return replace(state, determined=determined)
    of_record = names_of_records(setups)
    try:
        quiet = replace(state, announce=ignore, counter=SimulationCounter())
        of_twin = quiet.continued(problem, found, determined.lower).best
        own = uncertainty_of_solution(problem, found.best.x, of_record)
        there = uncertainty_of_solution(problem, of_twin.x, of_record)
    except KeyboardInterrupt:
        return replace(state, determined=Determination(None, interrupted=True))
    if own is None or there is None:
        return replace(state, determined=Determination(None))
    if found.best.cost - of_twin.cost > max(own.rises.values(), default=0.0):  # another minimum
        determined = determination(problem, found, setups, False, state.watch)
        return replace(state, determined=determined)
    names = not_served_by_linear_theory(problem.residuals, of_twin.x, there, of_record)
    own = replace(own, nonlinear=there.nonlinear)
    determined = Determination(without_linear_intervals(own, names, NEEDS_PROFILE))
    return replace(state, determined=determined)


def refined_values(state: SearchState) -> SearchState:
    """Fit those given values, too, of which the records say more than that they are as given."""
    if state.interrupted or state.program is not None or not given_std_errors(state.case):
        return state
    from exfit.workflows.refined_values import with_refined_values  # where values are uncertain

    return with_refined_values(state)


WEIGHTED: tuple[Stage, ...] = (weights, descents, weights_of_minimum)
SEARCH: tuple[Stage, ...] = (lines, *WEIGHTED, samples_at_steps, driving_noise)
STAGES: tuple[Stage, ...] = (*SEARCH, refined_values, settled, profiles)
