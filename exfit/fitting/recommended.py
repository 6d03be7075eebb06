"""Strategy auto: dgn, then lm and dgn, then more starts, each where the end before is in doubt.

What casts doubt on an end is passed as a function: it knows the records, their noise and the
validations.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

from exfit.estimate import STATUS, MultistartResult, Result, SolverIteration, Stop

Announce = Callable[[SolverIteration], None]
Doubt = Callable[[Result], str]  # why an end may not be the one looked for; "" where it is

STAGES = ("dgn", "lm-then-dgn")
MORE_STARTS = 16  # a power of two: the starts are balanced
CONFIRMED = 2  # starts that must lead to a minimum which is in doubt


class SearchResult(NamedTuple):
    """The best point of a search, the minima of many starts, the iterations, what to know of it."""

    best: Result
    minima: MultistartResult | None
    history: tuple[SolverIteration, ...]
    notes: tuple[str, ...] = ()


class SearchMethods(Protocol):
    """The searches of a case."""

    def one(self, method: str, announce: Announce) -> Result:
        """Return the end of a search from the start of the case."""

    def many(self, method: str, count: int, earlier: Sequence[Result]) -> MultistartResult | None:
        """Return the minima from starts over the bounds; None where these are not finite."""

    def margin(self, cost: float) -> float:
        """Return by how much a cost may exceed this one and the records do not tell them apart."""


def recommended(searches: SearchMethods, doubt: Doubt, announce: Announce) -> SearchResult:
    """Return the best point that strategy auto finds.

    Of minima that the records do not tell apart it is one without doubt, if there is one. A minimum
    that stays in doubt has converged only if another start led there, too. An interruption ends
    the search with the best point so far.
    """
    ends, doubts, minima = list[Result](), list[str](), None
    try:
        for candidates, minima in stages(searches, announce, ends):
            if interrupted(ends, minima):
                raise KeyboardInterrupt
            best, reason = chosen(searches, doubt, candidates)
            doubts.append(reason)
            if not reason:
                break
    except KeyboardInterrupt:
        if not ends:
            raise
        best = stopped(min(candidates, key=lambda end: end.cost), Stop.INTERRUPTED)
        return SearchResult(best, minima, joined(ends, best))
    costs = [end.cost for end in ends] if minima is None else [*minima.end_costs]
    found = count_like(min(costs), costs, searches)
    if reason and best.success and found < CONFIRMED:
        best = stopped(best, Stop.UNCONFIRMED)
    notes = tuple(notes_of(doubts, best, found, costs))
    return SearchResult(counted(best, ends), minima, joined(ends, best), notes)


def interrupted(ends: Sequence[Result], minima: MultistartResult | None) -> bool:
    """Return whether the last search was interrupted."""
    if minima is not None:
        return minima.interrupted
    return ends[-1].stop is Stop.INTERRUPTED


def count_like(cost: float, costs: Sequence[float], searches: SearchMethods) -> int:
    """Return how many costs the records do not tell from one that is lower than all of them."""
    limit = cost + searches.margin(cost)
    return sum(other <= limit for other in costs)


def stages(
    searches: SearchMethods, announce: Announce, ends: list[Result]
) -> Iterator[tuple[list[Result], MultistartResult | None]]:
    """Yield all ends so far after each stage, and the minima of many starts after the last one.

    Those from the start of the case are added to ``ends``.
    """
    for method in STAGES:
        ends.append(searches.one(method, announce))
        yield ends, None
    minima = searches.many(STAGES[-1], MORE_STARTS, ends)
    if minima is not None:
        best = () if minima.best is None else (minima.best,)
        yield [*best, *(each.result for each in minima.minima[len(best) :])], minima


def chosen(searches: SearchMethods, doubt: Doubt, ends: Sequence[Result]) -> tuple[Result, str]:
    """Return the lowest end and its doubt, or one like it without doubt, if there is one."""
    lowest, *others = sorted(ends, key=lambda end: end.cost)
    reason = doubt(lowest)
    if reason:
        for other in others:
            if other.cost <= lowest.cost + searches.margin(lowest.cost) and not doubt(other):
                return other, ""
    return lowest, reason


def stopped(end: Result, stop: Stop) -> Result:
    """Return an end for another reason, which is no convergence."""
    return replace(end, stop=stop, status=STATUS[stop], message=stop.value, success=False)


def counted(best: Result, ends: Sequence[Result]) -> Result:
    """Return the best end with the calls of all searches that led to it, one after the other."""
    others = [end for end in ends if end.history is not best.history]
    return replace(
        best,
        nfev=best.nfev + sum(end.nfev for end in others),
        njev=best.njev + sum(end.njev for end in others),
    )


def joined(ends: Sequence[Result], best: Result) -> tuple[SolverIteration, ...]:
    """Return the iterations of the searches as those of one, those of the best end last."""
    lines = list[SolverIteration]()
    histories = [end.history for end in ends if end.history is not best.history]
    for history in (*histories, best.history):
        calls = (lines[-1].nfev, lines[-1].njev) if lines else (0, 0)
        lines += [
            replace(line, number=number, nfev=calls[0] + line.nfev, njev=calls[1] + line.njev)
            for number, line in enumerate(history, start=len(lines))
        ]
    return tuple(lines)


def notes_of(
    doubts: Sequence[str], best: Result, found: int, costs: Sequence[float]
) -> Iterator[str]:
    """Yield why the search went beyond its first stage, and what it left in doubt.

    ``doubts`` are those after each stage; ``found`` of the searches, which ended at ``costs``, led
    to the lowest minimum or to one like it.
    """
    first, last = doubts[0], doubts[-1]
    more = len(costs) - len(STAGES)
    if first:
        stages = f", lm-then-dgn and {more} more starts" if more > 0 else " and lm-then-dgn"
        yield f"auto took dgn{stages}, because after dgn: {first}"
    if not last and best.cost > min(costs):
        yield (
            f"the cost is {best.cost / min(costs):.4g} times the lowest one found: the records do "
            "not tell the two minima apart, and this one was taken because the validation holds on "
            "it; it is no independent test then"
        )
    if last:
        yield (
            f"{last}; {found} of {len(costs)} searches of auto led to this minimum or to one like "
            "it, and none lower"
        )
