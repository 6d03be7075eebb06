"""The descents from the start of a case, and the choice among the ends that they and others found.

Of ends that the records do not tell apart it is one on which the validations hold. Strategy auto
asks more of an end. What speaks against one is passed as a judge, which knows the records, their
noise and the validations.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.errors import SimulationError
from exfit.estimate import STATUS, Descent, OneByOne, Result, SolverIteration, Stop
from exfit.estimate.solver import NotFinite
from exfit.fitting.residuals import Residuals

Array = NDArray[np.float64]
Announce = Callable[[SolverIteration], None]
Doubt = Callable[[Result], str]  # what speaks against an end; "" where nothing does

METHODS_OF_AUTO = ("dgn", "lm-then-dgn")
CONFIRMED = 2  # descents that must lead to a minimum which is in doubt


class Judge(NamedTuple):
    """What speaks against an end: ``refused`` why a validation does not hold on it.

    ``doubt`` says why else it may not be the one looked for: strategy auto goes on then.
    """

    refused: Doubt
    doubt: Doubt


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

    def margin(self, lowest: Result) -> float:
        """Excess of a cost over the lowest up to which the records do not tell the two apart."""


def no_doubt(_: Result) -> str:
    """Doubt no end."""
    return ""


NO_JUDGE = Judge(no_doubt, no_doubt)


def from_start(
    searches: SearchMethods, methods: Sequence[str], judge: Judge, announce: Announce
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
            best = chosen(searches, judge, ends)
            doubts.append(judge.doubt(best))
            if not doubts[-1]:
                break
    except KeyboardInterrupt:
        if not ends:
            raise
        best = stopped(min(ends, key=lambda end: end.cost), Stop.INTERRUPTED)
    return Descents(tuple(ends), tuple(doubts), best)


def chosen(searches: SearchMethods, judge: Judge, ends: Sequence[Result]) -> Result:
    """Return the lowest end, or one like it if the validations hold on that one alone."""
    lowest, *others = sorted(ends, key=lambda end: end.cost)
    if others and others[0].cost > lowest.cost and judge.refused(lowest):
        highest = lowest.cost + searches.margin(lowest)
        like = (other for other in others if other.cost <= highest)
        return next((other for other in like if not judge.refused(other)), lowest)
    return lowest


def count_like(lowest: Result, costs: ArrayLike, searches: SearchMethods) -> int:
    """Count the costs that the records do not tell from the lowest of them."""
    return int(np.count_nonzero(np.asarray(costs) <= lowest.cost + searches.margin(lowest)))


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


def taken_for_validation(times: float) -> str:
    """Explain a minimum so many times as high as the lowest one, taken for its validation."""
    return (
        f"the cost is {times:.4g} times the lowest one found: the records do not tell the two "
        "minima apart, and this one was taken because the validation holds on it; it is no "
        "independent test then"
    )


def notes_of(doubts: Sequence[str], best: Result, like: int, costs: ArrayLike) -> Iterator[str]:
    """Explain the stages of auto after its first one, and the doubts that it left.

    ``doubts`` are those after each stage and of the result; ``like`` of the descents, which ended
    at ``costs``, led to the lowest minimum or to one like it.
    """
    first, last = doubts[0], doubts[-1]
    count = int(np.count_nonzero(np.isfinite(costs)))
    if first:
        yield f"auto took dgn and lm-then-dgn, because after dgn: {first}"
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
    """Run one descent from scaled parameters theta (N,), without announcements.

    Raises KeyboardInterrupt at an interruption.
    """
    descent = Descent(
        functions=OneByOne(residuals, residuals.exact),
        bounds=residuals.bounds,
        x_scale=residuals.units,
    )
    end = descent.run(theta)
    if end.stop is Stop.INTERRUPTED:
        raise KeyboardInterrupt
    return end


def short_descent(
    residuals: Residuals,
    theta: Array,
    most_iterations: int,
    watch: Announce = lambda _: None,
    tolerance: float | None = None,
    matches: Callable[[Array], bool] | None = None,
) -> Result | None:
    """Run one descent of few iterations in each phase, from scaled parameters theta (N,).

    It may end early: by a ``tolerance`` of the step and of the gradient, in the units of the
    search, or where the residuals match. None where there is no response.
    """
    descent = Descent(
        functions=OneByOne(residuals, residuals.exact),
        bounds=residuals.bounds,
        method="lm-then-dgn",
        max_iterations=most_iterations,
        x_scale=residuals.units,
        matches=matches,
    )
    if tolerance is not None:
        descent = replace(descent, gtol=tolerance, xtol=tolerance)
    try:
        return descent.run(theta, watch)
    except (SimulationError, NotFinite):
        return None
