"""The descents from the start of a case, and the choice among the ends that they and others found.

Strategy auto judges its ends: what casts doubt on one is passed as a function, which knows the
records, their noise and the validations.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.estimate import STATUS, Descent, OneByOne, Result, SolverIteration, Stop
from exfit.fitting.parameters import UNIT
from exfit.fitting.residuals import Residuals

Array = NDArray[np.float64]
Announce = Callable[[SolverIteration], None]
Doubt = Callable[[Result], str]  # why an end may not be the one looked for; "" where it is

STAGES = ("dgn", "lm-then-dgn")
CONFIRMED = 2  # descents that must lead to a minimum which is in doubt


class Descents(NamedTuple):
    """The descents from the start of a case: their ends, why each was in doubt, the best of them.

    ``best`` has Stop.INTERRUPTED where an interruption ended them.
    """

    ends: tuple[Result, ...]
    doubts: tuple[str, ...]
    best: Result

    @property
    def history(self) -> tuple[SolverIteration, ...]:
        """The iterations of all of them, those of the best last."""
        return joined(self.ends, self.best)

    @property
    def interrupted(self) -> bool:
        """Whether an interruption ended them."""
        return self.best.stop is Stop.INTERRUPTED


class SearchMethods(Protocol):
    """The searches of a case."""

    def one(self, method: str, announce: Announce) -> Result:
        """Return the end of a descent from the start of the case."""

    def margin(self, cost: float) -> float:
        """Return by how much a cost may exceed this one and the records do not tell them apart."""


def no_doubt(_: Result) -> str:
    """Doubt no end."""
    return ""


def from_start(
    searches: SearchMethods, methods: Sequence[str], doubt: Doubt, announce: Announce
) -> Descents:
    """Return the descents by one method after the other, until one ends without doubt.

    An interruption ends them with the best point so far.
    """
    ends, doubts = list[Result](), list[str]()
    try:
        for method in methods:
            ends.append(searches.one(method, announce))
            if ends[-1].stop is Stop.INTERRUPTED:
                raise KeyboardInterrupt
            best, reason = chosen(searches, doubt, ends)
            doubts.append(reason)
            if not reason:
                break
    except KeyboardInterrupt:
        if not ends:
            raise
        best = stopped(min(ends, key=lambda end: end.cost), Stop.INTERRUPTED)
    return Descents(tuple(ends), tuple(doubts), best)


def chosen(searches: SearchMethods, doubt: Doubt, ends: Sequence[Result]) -> tuple[Result, str]:
    """Return the lowest end and its doubt, or one like it without doubt, if there is one."""
    lowest, *others = sorted(ends, key=lambda end: end.cost)
    reason = doubt(lowest)
    if reason:
        for other in others:
            if other.cost <= lowest.cost + searches.margin(lowest.cost) and not doubt(other):
                return other, ""
    return lowest, reason


def count_like(cost: float, costs: ArrayLike, searches: SearchMethods) -> int:
    """Return how many costs the records do not tell from one that is lower than all of them."""
    return int(np.count_nonzero(np.asarray(costs) <= cost + searches.margin(cost)))


def confirmed(best: Result, doubt: str, like: int) -> Result:
    """Return the best end: one in doubt has converged only if several descents led there."""
    unconfirmed = bool(doubt) and best.success and like < CONFIRMED
    return stopped(best, Stop.UNCONFIRMED) if unconfirmed else best


def stopped(end: Result, stop: Stop) -> Result:
    """Return an end for another reason, which is no convergence."""
    return replace(end, stop=stop, status=STATUS[stop], message=stop.value, success=False)


def counted(best: Result, ends: Sequence[Result]) -> Result:
    """Return the best end with the calls of all descents that led to it, one after the other."""
    others = [end for end in ends if end.history is not best.history]
    return replace(
        best,
        nfev=best.nfev + sum(end.nfev for end in others),
        njev=best.njev + sum(end.njev for end in others),
    )


def joined(ends: Sequence[Result], best: Result) -> tuple[SolverIteration, ...]:
    """Return the iterations of the descents as those of one, those of the best end last."""
    lines = list[SolverIteration]()
    histories = [end.history for end in ends if end.history is not best.history]
    for history in (*histories, best.history):
        lines += [following(lines[-1], line) if lines else line for line in history]
    return tuple(lines)


def following(last: SolverIteration, line: SolverIteration) -> SolverIteration:
    """Return a line of a descent as it stands behind those of an earlier one."""
    return replace(
        line,
        number=last.number + 1 + line.number,
        nfev=last.nfev + line.nfev,
        njev=last.njev + line.njev,
    )


def notes_of(doubts: Sequence[str], best: Result, like: int, costs: ArrayLike) -> Iterator[str]:
    """Yield why auto went beyond its first stage, and what it left in doubt.

    ``doubts`` are those after each stage and of the result; ``like`` of the descents, which ended
    at ``costs``, led to the lowest minimum or to one like it.
    """
    first, last = doubts[0], doubts[-1]
    lowest, count = float(np.nanmin(costs)), int(np.count_nonzero(np.isfinite(costs)))
    if first:
        yield f"auto took dgn and lm-then-dgn, because after dgn: {first}"
    if first and not last and best.cost > lowest:
        yield (
            f"the cost is {best.cost / lowest:.4g} times the lowest one found: the records do not "
            "tell the two minima apart, and this one was taken because the validation holds on it; "
            "it is no independent test then"
        )
    if last:
        yield (
            f"{last}; {like} of {count} descents led to this minimum or to one like it, and none "
            "lower"
        )


def minimum_near(residuals: Residuals, theta: Array) -> Array:
    """Return the end (N,) of one descent from scaled parameters theta (N,), without announcements.

    Raises KeyboardInterrupt at an interruption.
    """
    return descent_near(residuals, theta).x


def descent_near(residuals: Residuals, theta: Array) -> Result:
    """Return one descent from scaled parameters theta (N,), without announcements.

    Raises KeyboardInterrupt at an interruption.
    """
    descent = Descent(
        functions=OneByOne(residuals, residuals.exact), bounds=residuals.bounds, x_scale=UNIT
    )
    end = descent.run(theta)
    if end.stop is Stop.INTERRUPTED:
        raise KeyboardInterrupt
    return end
