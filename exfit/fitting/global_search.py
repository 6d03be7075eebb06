"""The search for the best point: descents from the start of a case, then from further starts.

Of ends that the records do not tell apart it is one on which the validations hold. Strategy auto
asks more of an end. What speaks against one is passed as a judge, which knows the records, their
noise and the validations.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from math import nan
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.errors import SimulationError
from exfit.estimate import (
    AT_TOLERANCE,
    LocalMinimum,
    MultistartResult,
    Result,
    SolverIteration,
    Stop,
)
from exfit.estimate.solver import NotFinite
from exfit.fitting.descents import Announce, following, stopped
from exfit.util.arrays import Array
from exfit.util.vocabulary import FROM_FURTHER_STARTS

if TYPE_CHECKING:
    from exfit.fitting.search import CaseSearches

Way = Literal["strategy", "linear", "direct"]
Doubt = Callable[[Result], str]  # what speaks against an end; "" where nothing does

METHODS_OF_AUTO = ("dgn", "lm-then-dgn")
CONFIRMED = 2  # descents that must lead to a minimum which is in doubt
PERFECT = 1e-16  # of the cost at a start: what a perfect match may leave of it


class Judge(NamedTuple):
    """What speaks against an end: ``refused`` why a validation does not hold on it.

    ``doubt`` says why else it may not be the one looked for: strategy auto goes on then.
    """

    refused: Doubt
    doubt: Doubt


def no_doubt(_: Result) -> str:
    """Doubt no end."""
    return ""


NO_JUDGE = Judge(no_doubt, no_doubt)


class FurtherDescents(NamedTuple):
    """The minima from further starts and of earlier descents.

    ``ways`` says what the descent from each further start began with; ``why_direct`` is the reason
    where there was no linear phase.
    """

    minima: MultistartResult
    ways: tuple[Way, ...]
    why_direct: str


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


class _Descents(NamedTuple):
    """The descents from the start of a case: their ends, why each was in doubt, the best of them.

    ``best`` has Stop.INTERRUPTED where an interruption ended them.
    """

    ends: tuple[Result, ...]
    doubts: tuple[str, ...]
    best: Result

    def joined(self, best: Result) -> tuple[tuple[SolverIteration, ...], Result]:
        """Join their iterations, those of the best last; that one gets the calls of all of them."""
        lines = list[SolverIteration]()
        others = [end for end in self.ends if end.history is not best.history]
        for history in (*(end.history for end in others), best.history):
            lines += [following(lines[-1], line) if lines else line for line in history]
        nfev, njev = sum(end.nfev for end in others), sum(end.njev for end in others)
        return tuple(lines), best._replace(nfev=best.nfev + nfev, njev=best.njev + njev)


def local_search(
    searches: "CaseSearches", methods: Sequence[str], judge: Judge, announce: Announce
) -> SearchResult:
    """Find the best point of the descents from the start of a case."""
    return _best_of(searches, _from_start(searches, methods, judge, announce))


def global_search(
    searches: "CaseSearches", methods: Sequence[str], judge: Judge, announce: Announce
) -> SearchResult:
    """Find the best point of the descents from the start of a case and from further starts.

    Of minima that the records do not tell apart it is one on which the validations hold, if there
    is one. Where the descents of the case came to the same minimum, theirs is the result; else a
    last descent from the end found. An interruption keeps the best point so far.
    """
    descents = _from_start(searches, methods, judge, announce)
    if descents.best.stop is Stop.INTERRUPTED:
        return _best_of(searches, descents)
    why_local = ""
    if descents.best.stop in AT_TOLERANCE:
        why_local = "a tolerance of the case ended the run from its start"
    elif searches.unbounded:
        names = ", ".join(searches.unbounded)
        why_local = f"{names} has no min or no max"
    if why_local:
        alone = _best_of(searches, descents)
        return alone._replace(notes=(*alone.notes, f"no search from further starts: {why_local}"))
    further = searches.further(descents.ends)
    own_ways: tuple[Way, ...] = ("strategy",)
    minima, ways = further.minima, own_ways * len(descents.ends) + further.ways
    ends = [minimum.result for minimum in minima.minima]
    try:
        if minima.interrupted:
            raise KeyboardInterrupt
        best = _chosen(searches, judge, ends)
        doubt = judge.doubt(best)
    except KeyboardInterrupt:
        return _interrupted(descents, minima, ways, announce)
    like = _count_like(ends[0], minima.end_costs, searches) if doubt else len(ends)
    own = _own_end(descents, best)
    if own is None:
        path, last = _refined(searches, descents.joined(descents.best)[0], best, announce)
    else:
        path, last = descents.joined(own)
    last = _confirmed(last, doubt, like)
    notes = [*_notes((*descents.doubts, doubt), like, minima.end_costs)]
    if further.why_direct:
        notes.append(f"the search has no linear phase: {further.why_direct}")
    place = next(k for k, end in enumerate(ends) if end is best)
    return SearchResult(last, minima, path, descents.best, place, ways, tuple(notes), place > 0)


def continued(
    searches: "CaseSearches", found: SearchResult, point: Array, announce: Announce, phase: str
) -> SearchResult:
    """Return a search that goes on from a point (N,) below its best, which a ``phase`` led to."""
    path, last = _refined(searches, found.history, found.best._replace(x=point), announce, phase)
    if found.minima is None:
        return found._replace(best=last, history=path)
    alike, others = list[LocalMinimum](), list[LocalMinimum]()
    # its cost may be that of another form of the problem
    begun = found.place if np.array_equal(point, found.best.x) else None
    for place, local in enumerate(found.minima.minima):
        same_minimum = place == begun or is_same(last, local.result)
        same_minimum = same_minimum or is_same(local.result, last)
        (alike if same_minimum else others).append(local)
    lowest = LocalMinimum(last.x, last.cost, sum(local.starts for local in alike), last)
    minima = found.minima._replace(minima=(lowest, *others), best=last)
    return found._replace(best=last, history=path, minima=minima, place=0)


def extended(
    searches: "CaseSearches",
    found: SearchResult,
    point_of: Callable[[Array], Array],
    announce: Announce,
    phase: str,
) -> SearchResult:
    """Return a search among more or fewer parameters, from the ends of another.

    ``point_of`` gives its points of those of the other one. Each minimum is descended from anew.
    """

    def own(end: Result) -> Result:
        return end._replace(x=point_of(end.x))

    history = [line._replace(x=point_of(line.x)) for line in found.history]
    path, last = _refined(searches, history, own(found.best), announce, phase)
    if found.minima is None:
        return found._replace(best=last, own=last, history=path)
    minima = list[LocalMinimum]()
    for k, local in enumerate(found.minima.minima):
        with suppress(SimulationError, NotFinite):  # it has no response with these parameters
            end = last if k == found.place else searches.refined(own(local.result), _unseen)
            minima.append(local._replace(x=end.x, cost=end.cost, result=end))
    minima.sort(key=lambda local: local.cost)
    place = next((k for k, local in enumerate(minima) if local.result is last), None)
    whole = found.minima._replace(minima=tuple(minima), best=last)
    return found._replace(best=last, own=last, history=path, minima=whole, place=place)


def _unseen(_: SolverIteration) -> None:
    """Ignore a line of a path that leads elsewhere."""


def judged_again(
    searches: "CaseSearches", found: SearchResult, judge: Judge, announce: Announce
) -> SearchResult:
    """Return a search whose best minimum is a new one, or one like it if validations hold there."""
    ends = [] if found.minima is None else [local.result for local in found.minima.minima]
    best = _chosen(searches, judge, ends) if ends else found.best
    if not ends or best is ends[0]:
        return found._replace(for_validation=False)
    path, last = _refined(searches, found.history, best, announce)
    place = next(k for k, end in enumerate(ends) if end is best)
    return found._replace(best=last, history=path, place=place, for_validation=True)


def is_same(best: Result, other: Result) -> bool:
    """Tell whether an end of a descent is in the minimum that has this best one."""
    from exfit.estimate.starts import outcome_of, same

    nothing = PERFECT * other.history[0].cost
    lowest, higher = outcome_of(best), outcome_of(other)
    return other.cost >= best.cost and same(lowest, higher, nothing=nothing)


def taken_for_validation(times: float) -> str:
    """Explain a minimum so many times as high as the lowest one, taken for its validation."""
    return (
        f"the cost is {times:.4g} times the lowest one: the records do not distinguish the two "
        "minima, and this one was taken because the validation accepts it, which is therefore no "
        "independent test"
    )


# ---- the descents from the start


def _from_start(
    searches: "CaseSearches", methods: Sequence[str], judge: Judge, announce: Announce
) -> _Descents:
    """Descend by one method after the other, until one ends without doubt or an interruption."""
    ends, doubts = list[Result](), list[str]()
    try:
        for method in methods:
            ends.append(searches.one(method, announce))
            if ends[-1].stop is Stop.INTERRUPTED:
                raise KeyboardInterrupt
            best = _chosen(searches, judge, ends)
            doubts.append(judge.doubt(best))
            if not doubts[-1]:
                break
    except KeyboardInterrupt:
        if not ends:
            raise
        best = stopped(min(ends, key=_cost), Stop.INTERRUPTED)
    return _Descents(tuple(ends), tuple(doubts), best)


def _best_of(searches: "CaseSearches", descents: _Descents) -> SearchResult:
    best, notes = descents.best, tuple[str, ...]()
    if best.stop is not Stop.INTERRUPTED:
        costs = [end.cost for end in descents.ends]
        lowest = min(descents.ends, key=_cost)
        doubt = descents.doubts[-1]
        like = _count_like(lowest, costs, searches) if doubt else len(costs)
        best = _confirmed(best, doubt, like)
        notes = tuple(_notes(descents.doubts, like, costs))
        if best.cost > lowest.cost:
            notes = (*notes, taken_for_validation(best.cost / lowest.cost))
    history, best = descents.joined(best)
    return SearchResult(best, None, history, best, notes=notes)


def _own_end(descents: _Descents, best: Result) -> Result | None:
    """Find the end of the descents from the start of a case in a minimum, None where none is."""
    for end in descents.ends:
        if end.history is best.history:
            return end
    ends = [end for end in descents.ends if end.success and is_same(best, end)]
    return min(ends, key=_cost, default=None)


def _interrupted(
    descents: _Descents, minima: MultistartResult, ways: tuple[Way, ...], announce: Announce
) -> SearchResult:
    """Return the best point of a search that an interruption ended."""
    best = min([*descents.ends, *filter(None, [minima.best])], key=_cost)
    minima, own = minima._replace(interrupted=True), _own_end(descents, best)
    if own is not None:
        path, last = descents.joined(own)
        ends = enumerate(minima.minima)
        place = next((k for k, end in ends if is_same(end.result, own)), None)
        return SearchResult(last, minima, path, own, place, ways)
    path, _ = descents.joined(descents.best)
    line = _after_search(path[-1], best.history[-1]._replace(nfev=0, njev=0), FROM_FURTHER_STARTS)
    announce(line)
    best = stopped(best, Stop.INTERRUPTED)._replace(nfev=path[-1].nfev, njev=path[-1].njev)
    return SearchResult(best, minima, (*path, line), descents.best, ways=ways)


# ---- ends and the path to them


def _cost(end: Result) -> float:
    return end.cost


def _chosen(searches: "CaseSearches", judge: Judge, ends: Sequence[Result]) -> Result:
    """Choose the lowest end, or one like it if the validations hold on that one alone."""
    lowest, *others = sorted(ends, key=_cost)
    if others and others[0].cost > lowest.cost and judge.refused(lowest):
        highest = lowest.cost + searches.margin(lowest)
        like = (other for other in others if other.cost <= highest)
        return next((other for other in like if not judge.refused(other)), lowest)
    return lowest


def _count_like(lowest: Result, costs: ArrayLike, searches: "CaseSearches") -> int:
    """Count the costs that the records do not tell from the lowest of them."""
    return int(np.count_nonzero(np.asarray(costs) <= lowest.cost + searches.margin(lowest)))


def _confirmed(best: Result, doubt: str, like: int) -> Result:
    """Return the best end: one in doubt has converged only if several descents led there."""
    unconfirmed = bool(doubt) and best.success and like < CONFIRMED
    return stopped(best, Stop.UNCONFIRMED) if unconfirmed else best


def _notes(doubts: Sequence[str], like: int, costs: ArrayLike) -> Iterator[str]:
    """Explain the stages of auto after its first one, and the doubts that it left.

    ``doubts`` are those after each stage and of the result; ``like`` of the descents, which ended
    at ``costs``, led to the lowest minimum or to one like it.
    """
    if doubts[0]:
        yield f"auto took dgn and lm-then-dgn, because after dgn: {doubts[0]}"
    if doubts[-1]:
        count = int(np.count_nonzero(np.isfinite(costs)))
        yield (
            f"{doubts[-1]}; {like} of {count} runs converged to this minimum or one like it, none "
            "to a lower one"
        )


def _refined(
    searches: "CaseSearches",
    history: Sequence[SolverIteration],
    end: Result,
    announce: Announce,
    phase: str = FROM_FURTHER_STARTS,
) -> tuple[tuple[SolverIteration, ...], Result]:
    """Make a last descent from an end that was found elsewhere, behind the path before."""
    path = [*history]
    last = path[-1]

    def join(line: SolverIteration) -> None:
        first = path[-1] is last
        path.append(_after_search(last, line, phase) if first else following(last, line))
        announce(path[-1])

    result = searches.refined(end, join)
    return tuple(path), result._replace(nfev=last.nfev + result.nfev, njev=last.njev + result.njev)


def _after_search(last: SolverIteration, point: SolverIteration, phase: str) -> SolverIteration:
    """Return the line of a point that further starts led to, behind the last one of the case."""
    line = following(last, point._replace(number=0))
    return line._replace(phase=phase, step_norm=0.0, damping=nan, inner=0, capped=None)
