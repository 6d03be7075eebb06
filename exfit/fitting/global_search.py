"""The global search: the descent from the start of a case, then others from further starts."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import nan
from typing import Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.estimate import (
    Descent,
    LocalMinimum,
    MultistartResult,
    Result,
    SolverIteration,
    Stop,
    spread,
)
from exfit.fitting.descents import (
    Announce,
    Descents,
    Judge,
    SearchMethods,
    chosen,
    confirmed,
    count_like,
    counted,
    following,
    from_start,
    notes_of,
    stopped,
    taken_for_validation,
)
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import SideBySide, SimulationCounter
from exfit.util.strategies import DEFAULT_STRATEGY, FROM_FURTHER_STARTS

Array = NDArray[np.float64]
Way = Literal["strategy", "linear", "direct"]

DIRECT = 3  # every third start goes without the linear phase, which misleads where limits are met
MERGED = 3.0  # standard errors: linear phases that end so near lead to one minimum, 480 of 480 did
MOST_ITERATIONS = 50  # of a phase of the last leg: what takes more creeps along a valley
TO_DISTINGUISH = 1e-8  # of the cost: what a search may leave where minima are compared


@dataclass(frozen=True)
class FurtherStarts:
    """The points (S, N) from which a search goes, and the legs that the descents from them take.

    ``ways`` says what each descent begins with: "linear" the linear phase, "direct" the model
    itself. ``why_direct`` is the reason where the linear phase has no meaning.
    """

    points: Array
    legs: tuple[Descent, ...]
    ways: tuple[Way, ...]
    why_direct: str

    @property
    def merged(self) -> float | None:
        """Within how many standard errors the ends of linear phases go on as one."""
        return None if self.why_direct else MERGED

    @property
    def first_legs(self) -> tuple[int, ...]:
        """The leg that each descent begins with."""
        linear = not self.why_direct
        return tuple(int(linear and way == "direct") for way in self.ways)


def further_starts(
    problem: FitProblem, count: int, counter: SimulationCounter | None
) -> FurtherStarts:
    """Return ``count`` starts: that of the case by way of the linear phase, others over the bounds.

    ``counter`` counts the simulations of their descents.
    """
    from exfit.fitting.further_starts import legs_of  # which a local search does not need

    residuals = problem.residuals.counted_by(counter)
    legs = legs_of(residuals, last_leg(problem, counter))
    direct: tuple[Way, ...] = ("direct",)
    if legs.no_linear_phase:
        points = spread(residuals.bounds, count)
        return FurtherStarts(points, legs.direct, direct * count, legs.no_linear_phase)
    by_linear: tuple[Way, ...] = ("linear",)
    ways = (by_linear * (DIRECT - 1) + direct) * count
    points = spread(residuals.bounds, count, residuals.start)
    return FurtherStarts(points, legs.linear, ways[:count], "")


def last_leg(problem: FitProblem, counter: SimulationCounter | None = None) -> Descent:
    """Return the descent of a further start on the case's own grid."""
    return Descent(
        functions=SideBySide(problem.compressed.counted_by(counter)),
        bounds=problem.residuals.bounds,
        method=DEFAULT_STRATEGY,
        max_iterations=MOST_ITERATIONS,
        ftol=TO_DISTINGUISH,
        x_scale=problem.residuals.units,
    )


PERFECT = 1e-16  # of the cost at a start: what a perfect match may leave of it
AT_TOLERANCE = (Stop.MATCH, Stop.FLAT)


class SearchResult(NamedTuple):
    """The best point of a search, and how it was found.

    ``minima`` are those of all descents, None where there were no further starts; ``history`` leads
    from the start of the case to ``best``, which is that at ``place`` of the minima, None where it
    is none of them; ``own`` is the best end of the descents from the start of the case. ``ways``
    says what each descent began with: the strategy of the case, its linear phase, or the model
    itself. ``for_validation`` where ``best`` was taken in place of a lower minimum, as the
    validations hold on it alone.
    """

    best: Result
    minima: MultistartResult | None
    history: tuple[SolverIteration, ...]
    own: Result
    place: int | None = None
    ways: tuple[Way, ...] = ()
    notes: tuple[str, ...] = ()
    for_validation: bool = False

    @property
    def interrupted(self) -> bool:
        """Whether an interruption ended the search from further starts."""
        return self.minima is not None and self.minima.interrupted

    @property
    def goes_on(self) -> bool:
        """Whether the path goes on from a point that further starts led to."""
        return any(line.phase == FROM_FURTHER_STARTS for line in self.history)


class FurtherDescents(NamedTuple):
    """The minima from further starts and of earlier descents.

    ``ways`` says what the descent from each further start began with; ``why_direct`` is the reason
    where there was no linear phase.
    """

    minima: MultistartResult
    ways: tuple[Way, ...]
    why_direct: str


class GlobalSearchMethods(SearchMethods, Protocol):
    """The searches of a case, those from further starts among them."""

    @property
    def unbounded(self) -> tuple[str, ...]:
        """The parameters without finite bounds: there no starts can be distributed."""

    def further(self, earlier: Sequence[Result]) -> FurtherDescents:
        """Return the minima from further starts and of earlier descents."""

    def refined(self, end: Result, announce: Announce) -> Result:
        """Return the descent from an end with the full tolerances of the case."""


def local_search(
    searches: SearchMethods, methods: Sequence[str], judge: Judge, announce: Announce
) -> SearchResult:
    """Return the best point of the descents from the start of a case."""
    return best_of(searches, from_start(searches, methods, judge, announce))


def global_search(
    searches: GlobalSearchMethods, methods: Sequence[str], judge: Judge, announce: Announce
) -> SearchResult:
    """Return the best point of the descents from the start of a case and from further starts.

    Of minima that the records do not tell apart it is one on which the validations hold, if there
    is one. Where the descents of the case came to the same minimum, theirs is the result; else a
    last descent from the end found. An interruption keeps the best point so far.
    """
    descents = from_start(searches, methods, judge, announce)
    if descents.interrupted:
        return best_of(searches, descents)
    reason = why_local(searches, descents.best)
    if reason:
        alone = best_of(searches, descents)
        return alone._replace(notes=(*alone.notes, f"no search from further starts: {reason}"))
    return beyond(searches, descents, searches.further(descents.ends), judge, announce)


def why_local(searches: GlobalSearchMethods, own: Result) -> str:
    """Reason against a search from further starts, "" where there is none."""
    if own.stop in AT_TOLERANCE:
        return "a tolerance that the case gives ended the descent from its start"
    if searches.unbounded:
        names = ", ".join(searches.unbounded)
        return f"they are distributed between bounds, and {names} has no min or no max"
    return ""


def best_of(searches: SearchMethods, descents: Descents) -> SearchResult:
    """Return the best of the descents from the start of a case."""
    best, notes = descents.best, tuple[str, ...]()
    if not descents.interrupted:
        costs = [end.cost for end in descents.ends]
        lowest = min(descents.ends, key=lambda end: end.cost)
        reason = descents.doubts[-1]
        like = count_like(lowest, costs, searches) if reason else len(costs)
        best = confirmed(best, reason, like)
        notes = tuple(notes_of(descents.doubts, best, like, costs))
        if best.cost > lowest.cost:
            notes = (*notes, taken_for_validation(best.cost / lowest.cost))
    best = counted(best, descents.ends)
    return SearchResult(best, None, descents.history, best, notes=notes)


def beyond(
    searches: GlobalSearchMethods,
    descents: Descents,
    further: FurtherDescents,
    judge: Judge,
    announce: Announce,
) -> SearchResult:
    """Return the best of the descents from the start of a case and of the minima found with it."""
    minima, ways = further.minima, ways_of(further, descents)
    ends = [minimum.result for minimum in minima.minima]
    try:
        if minima.interrupted:
            raise KeyboardInterrupt
        best = chosen(searches, judge, ends)
        reason = judge.doubt(best)
    except KeyboardInterrupt:
        best = min([*descents.ends, *filter(None, [minima.best])], key=lambda end: end.cost)
        return interrupted(descents, minima, ways, best, announce)
    like = count_like(ends[0], minima.end_costs, searches) if reason else len(ends)
    own = own_end(descents, best)
    if own is None:
        path, last = refined(searches, descents.history, best, announce)
    else:
        path, last = descents._replace(best=own).history, counted(own, descents.ends)
    last = confirmed(last, reason, like)
    notes = [*notes_of((*descents.doubts, reason), last, like, minima.end_costs)]
    if further.why_direct:
        notes.append(f"the search goes without its linear phase: {further.why_direct}")
    place = next(k for k, end in enumerate(ends) if end is best)
    return SearchResult(last, minima, path, descents.best, place, ways, tuple(notes), place > 0)


def continued(
    searches: GlobalSearchMethods,
    found: SearchResult,
    point: Array,
    announce: Announce,
    phase: str = FROM_FURTHER_STARTS,
) -> SearchResult:
    """Return a search that goes on from a point (N,) with a lower cost than its best.

    ``phase`` says in its history how that point was found.
    """
    path, last = refined(searches, found.history, replace(found.best, x=point), announce, phase)
    if found.minima is None:
        return found._replace(best=last, history=path)
    alike, others = list[LocalMinimum](), list[LocalMinimum]()
    for local in found.minima.minima:
        same_minimum = is_same(last, local.result) or is_same(local.result, last)
        (alike if same_minimum else others).append(local)
    lowest = LocalMinimum(last.x, last.cost, sum(local.starts for local in alike), last)
    minima = replace(found.minima, minima=(lowest, *others), best=last)
    return found._replace(best=last, history=path, minima=minima, place=0)


def judged_again(
    searches: GlobalSearchMethods, found: SearchResult, judge: Judge, announce: Announce
) -> SearchResult:
    """Return a search whose best minimum is a new one, or one like it if validations hold there."""
    ends = [] if found.minima is None else [local.result for local in found.minima.minima]
    best = chosen(searches, judge, ends) if ends else found.best
    if not ends or best is ends[0]:
        return found._replace(for_validation=False)
    path, last = refined(searches, found.history, best, announce)
    place = next(k for k, end in enumerate(ends) if end is best)
    return found._replace(best=last, history=path, place=place, for_validation=True)


def own_end(descents: Descents, best: Result) -> Result | None:
    """Return the end of the descents from the start of a case in a minimum, None where none is."""
    for end in descents.ends:
        if end.history is best.history:
            return end
    ends = [end for end in descents.ends if end.success and is_same(best, end)]
    return min(ends, key=lambda end: end.cost, default=None)


def is_same(best: Result, other: Result) -> bool:
    """Tell whether an end of a descent is in the minimum that has this best one."""
    from exfit.estimate.starts import outcome_of, same

    nothing = PERFECT * other.history[0].cost
    lowest, higher = outcome_of(best), outcome_of(other)
    return other.cost >= best.cost and same(lowest, higher, nothing=nothing)


def refined(
    searches: GlobalSearchMethods,
    history: Sequence[SolverIteration],
    end: Result,
    announce: Announce,
    phase: str = FROM_FURTHER_STARTS,
) -> tuple[tuple[SolverIteration, ...], Result]:
    """Return a last descent from an end that was found elsewhere, behind the path before."""
    path = [*history]
    last = path[-1]

    def join(line: SolverIteration) -> None:
        first = path[-1] is last
        path.append(after_search(last, line, phase) if first else following(last, line))
        announce(path[-1])

    result = searches.refined(end, join)
    return tuple(path), replace(result, nfev=last.nfev + result.nfev, njev=last.njev + result.njev)


def after_search(
    last: SolverIteration, point: SolverIteration, phase: str = FROM_FURTHER_STARTS
) -> SolverIteration:
    """Return the line of a point that further starts led to, behind the last one of the case."""
    line = following(last, replace(point, number=0))
    return replace(line, phase=phase, step_norm=0.0, damping=nan, inner=0, capped=None)


def ways_of(further: FurtherDescents, descents: Descents) -> tuple[Way, ...]:
    """List the beginnings of all descents, those from the start of the case first."""
    own: tuple[Way, ...] = ("strategy",)
    return own * len(descents.ends) + further.ways


def interrupted(
    descents: Descents,
    minima: MultistartResult,
    ways: tuple[Way, ...],
    best: Result,
    announce: Announce,
) -> SearchResult:
    """Return the best point of a search that an interruption ended."""
    minima, own = replace(minima, interrupted=True), own_end(descents, best)
    if own is not None:
        path = descents._replace(best=own).history
        ends = enumerate(minima.minima)
        place = next((k for k, end in ends if is_same(end.result, own)), None)
        return SearchResult(counted(own, descents.ends), minima, path, own, place, ways)
    last = descents.history[-1]
    line = after_search(last, replace(best.history[-1], nfev=0, njev=0))
    announce(line)
    best = replace(stopped(best, Stop.INTERRUPTED), nfev=last.nfev, njev=last.njev)
    return SearchResult(best, minima, (*descents.history, line), descents.best, ways=ways)
