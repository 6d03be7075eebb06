"""Profile likelihood: how far a parameter can move if all others may follow.

Source: Venzon & Moolgavkar 1988; Bates & Watts 1988, chapter 6; Raue et al. 2009.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.answer import Progress
from exfit.estimate.linear import linearise
from exfit.estimate.lockstep import finish, finish_all
from exfit.estimate.problem import (
    Array,
    Box,
    Function,
    Functions,
    OneByOne,
    Problem,
    Steps,
    checked,
)
from exfit.estimate.profile_side import NOTHING, ProfileEnd, Side, Spot, Valley
from exfit.estimate.solver import Descent

POINTS = 5  # from the minimum to the rise: enough for a smooth figure
LOWER = 1e-3  # of the rise: what is farther below the minimum refutes it
MOST_MINIMA = 5


@dataclass(frozen=True)
class LowerMinimum:
    """A minimum whose profiles are known: its cost, and the intervals of parameters there."""

    cost: float
    intervals: Mapping[int, tuple[float, float]]


@dataclass(frozen=True)
class CostProfile:
    """The least cost for given values of one parameter, the others fitted anew for each.

    index      which parameter
    at         its values (K,), increasing
    costs      (K,)
    xs         all parameters (K, N)
    low, high  where the cost is ``rise`` above the minimum; None where it never is
    ends       why it ends below and above
    x, cost    the minimum (N,) that it starts from
    moved      whether that is a lower one than was given, met on the way
    """

    index: int
    at: Array
    costs: Array
    xs: Array
    low: float | None
    high: float | None
    ends: tuple[ProfileEnd, ProfileEnd]
    x: Array
    cost: float
    moved: bool


def profile(
    fun: Function,
    jac: Function,
    x: ArrayLike,
    index: int,
    bounds: tuple[ArrayLike, ArrayLike],
    rise: float,
    *,
    points: int = POINTS,
    x_scale: ArrayLike | None = None,
    watch: Callable[[Progress], object] = lambda _: None,
) -> CostProfile:
    """Return the profile of one parameter about the minimum x (N,); see `profiles`."""
    functions, rises = OneByOne(fun, jac), {index: rise}
    return profiles(
        functions, x, rises, bounds, points=points, workers=1, x_scale=x_scale, watch=watch
    )[0]


def profiles(
    functions: Functions,
    x: ArrayLike,
    rises: Mapping[int, float],
    bounds: tuple[ArrayLike, ArrayLike],
    *,
    beside: LowerMinimum | None = None,
    points: int = POINTS,
    workers: int | None = None,
    x_scale: ArrayLike | None = None,
    watch: Callable[[Progress], object] = lambda _: None,
) -> tuple[CostProfile, ...]:
    """Return the profiles of some parameters about the minimum x (N,) of f, half the square sum.

    On either side a parameter moves in about ``points`` steps, up to where the cost has risen by
    its own of ``rises`` or to its bound, and after each the others are fitted anew. All sides are
    advanced together, in ``workers`` threads (as many as there are processors by default). A rise
    is s^2 q / 2 for an interval at the level of which q is the quantile of chi^2 with one degree
    of freedom, or that of t squared. It counts from the cost at x or, where x lies ``beside`` a
    lower minimum, from the cost there; then a side ends where it enters the interval of that one.

    Where a cost lower than that turns up, all begin anew from the minimum there. watch gets the
    Progress, in sides; KeyboardInterrupt, raised there or anywhere, ends it with what is done.

    Raises ValueError for bounds that cross, x outside them, residuals not finite there, rise <= 0.

    Source: Venzon & Moolgavkar 1988; Raue et al. 2009.
    """
    start, box = checked(x, bounds, x_scale)
    for rise in rises.values():
        if not rise > 0.0:
            raise ValueError(f"rise: {rise} is not above 0")
    valley_at = partial(valley_about, functions, box, x_scale is not None, points)
    valley = finish(valley_at(start, inf if beside is None else beside.cost))
    known = {} if beside is None else beside.intervals
    for restarts in range(MOST_MINIMA + 1):
        sides = sides_of(valley, rises, known)
        margin = LOWER * max(rises.values()) if restarts < MOST_MINIMA else inf
        whole = finish_sides(sides, valley.lowest - margin, workers, watch)
        deepest = deepest_of(sides)
        if not whole or deepest.cost >= valley.lowest - margin:
            break
        valley, known = finish(valley_at(bottom_near(valley, deepest.x), inf)), {}
    pairs = zip(sides[::2], sides[1::2], strict=True)
    return tuple(joined(below, above, valley, restarts > 0) for below, above in pairs)


def valley_about(
    functions: Functions, box: Box, scaled: bool, points: int, x: Array, lowest: float
) -> Steps[Valley]:
    """Describe a minimum to the profiles about it."""
    problem = Problem(functions, None, box, scaled)
    point = yield from problem.evaluate(x)
    if point.cost == inf:
        raise ValueError("the residuals at x are not finite")
    bottom = yield from linearise(problem, point)
    return Valley(functions, box, scaled, bottom, min(point.cost, lowest), points)


def sides_of(
    valley: Valley, rises: Mapping[int, float], known: Mapping[int, tuple[float, float]]
) -> list[Side]:
    """Return both sides of each profile, the lower one first."""
    return [
        Side(valley, index, sign, rise, known.get(index, NOTHING))
        for index, rise in rises.items()
        for sign in (-1, 1)
    ]


def deepest_of(sides: Sequence[Side]) -> Spot:
    """Return the point of the lowest cost so far."""
    return min((spot for side in sides for spot in tuple(side.spots)), key=lambda spot: spot.cost)


def finish_sides(
    sides: Sequence[Side],
    limit: float,
    workers: int | None,
    watch: Callable[[Progress], object],
) -> bool:
    """Walk all sides; return whether none was interrupted.

    A side that falls below the limit ends there. The others go on: where they end must not depend
    on when that was, as threads advance them.
    """
    done = 0

    def receive(_: int, side: Side) -> None:
        nonlocal done
        if side.end is not ProfileEnd.INTERRUPTED:
            done += 1
            watch(Progress("profiling", done, len(sides), deepest_of(sides).cost))

    return finish_all([side.walk(limit) for side in sides], workers, receive)


def bottom_near(valley: Valley, x: Array) -> Array:
    """Return the minimum that all parameters together find from a point."""
    descent = Descent(
        functions=valley.functions,
        bounds=(valley.box.low, valley.box.high),
        method="lm-then-dgn",
        x_scale=valley.box.unit if valley.scaled else None,
    )
    return finish(descent.begin(x)).x


def joined(below: Side, above: Side, valley: Valley, moved: bool) -> CostProfile:
    """Return the profile of two sides."""
    spots = [*below.spots[:0:-1], *above.spots]
    return CostProfile(
        index=below.index,
        at=np.array([spot.place for spot in spots]),
        costs=np.array([spot.cost for spot in spots]),
        xs=np.stack([spot.x for spot in spots]),
        low=below.crossing,
        high=above.crossing,
        ends=(below.end, above.end),
        x=valley.bottom.point.x,
        cost=valley.bottom.point.cost,
        moved=moved,
    )
