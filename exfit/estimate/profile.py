"""Profile likelihood: how far a parameter can move if all others may follow.

Source: Venzon & Moolgavkar 1988; Bates & Watts 1988, chapter 6; Raue et al. 2009.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum
from math import inf, isfinite, sqrt
from threading import Event

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.answer import Progress, Stop
from exfit.estimate.arrays import UNSEEN, Array
from exfit.estimate.box import Box, checked
from exfit.estimate.problem import half_square
from exfit.estimate.requests import Function, OneByOne
from exfit.estimate.solver import least_squares
from exfit.estimate.threads import side_by_side, until

POINTS = 10  # from the minimum to the rise: enough for a smooth figure
REFIT = 30  # iterations: a refit starts near its end
MOST_POINTS = 3  # times the points: a side that needs more is flat
MOST_GROWTH = 2.0  # of a step
LEAPS = 3.0  # times the rise of root cost that a step aims at: take a shorter one instead
MOST_HALVINGS = 5  # of a step: what then remains is a jump
FINE = 1e-4  # of the rise: what a refit may leave
CLOSE = 1e-3  # of the root of the rise: how near a refit must come to the crossing
MOST_REFITS = 12  # to come as near
SECANTS = 4  # of them, then halves: a jump lets no secant come near
LOWER = 1e-3  # of the rise: what is farther below the minimum refutes it
MOST_MINIMA = 5


class ProfileEnd(Enum):
    """Why one side of a profile ends."""

    RISE = "the cost has risen as far as asked"
    BOUND = "the parameter is at its bound"
    FLAT = "the cost hardly rises"
    FAILED = "no residuals beyond are finite"
    INTERRUPTED = "interrupted"


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


@dataclass(frozen=True)
class Spot:
    """A point of a profile; ``height`` is the root of its cost's rise, in units of that asked."""

    x: Array
    cost: float
    height: float


@dataclass(frozen=True)
class Valley:
    """What all profiles about one minimum share."""

    fun: Function
    jac: Function
    box: Box
    scaled: bool
    bottom: Spot
    slopes: Array
    rise: float
    points: int

    def spot(self, x: Array, cost: float) -> Spot:
        """Return a point of a profile."""
        return Spot(x, cost, sqrt(max(0.0, cost - self.bottom.cost) / self.rise))

    def refit(self, index: int, guess: Array) -> Spot | None:
        """Fit all parameters but one, from a guess; None where the residuals are not finite."""
        rest = np.arange(len(guess)) != index

        def whole(z: Array) -> Array:
            x = guess.copy()
            x[rest] = z
            return x

        if len(guess) == 1 or half_square(OneByOne(self.fun).residuals([guess])[0]) == inf:
            cost = half_square(OneByOne(self.fun).residuals([guess])[0])
            return self.spot(guess, cost) if isfinite(cost) else None
        result = least_squares(
            lambda z: self.fun(whole(z)),
            guess[rest],
            lambda z: np.asarray(self.jac(whole(z)))[:, rest],
            (self.box.low[rest], self.box.high[rest]),
            "lm-then-dgn",
            max_iterations=REFIT,
            ftol=FINE * self.rise / max(self.bottom.cost, self.rise),
            x_scale=self.box.unit[rest] if self.scaled else None,
        )
        if result.stop is Stop.INTERRUPTED:
            raise KeyboardInterrupt
        return self.spot(whole(result.x), result.cost)

    def tangent(self, index: int) -> tuple[Array, float]:
        """Return how all move with one parameter (N,), and by how much it moves up to the rise.

        Both as the linear model at the minimum says.
        """
        direction = (np.arange(len(self.bottom.x)) == index).astype(np.float64)
        column, others = self.slopes[:, index], self.slopes[:, direction == 0.0]
        if not np.isfinite(self.slopes).all():
            return direction, inf
        direction[direction == 0.0] = -np.linalg.lstsq(others, column, rcond=UNSEEN)[0]
        effect = float(np.linalg.norm(self.slopes @ direction))
        flat = effect <= UNSEEN * float(np.linalg.norm(column))
        return direction, inf if flat else sqrt(2.0 * self.rise) / effect


@dataclass
class Side:
    """One side of a profile, as far as it has come; ``sign`` is -1 below the minimum."""

    index: int
    sign: int
    spots: list[Spot]
    end: ProfileEnd = ProfileEnd.INTERRUPTED
    crossing: float | None = None

    def place(self, k: int) -> float:
        """Return the parameter's value at a point."""
        return float(self.spots[k].x[self.index])


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
    return profiles(
        fun, jac, x, (index,), bounds, rise, points=points, workers=1, x_scale=x_scale, watch=watch
    )[0]


def profiles(
    fun: Function,
    jac: Function,
    x: ArrayLike,
    indices: Sequence[int],
    bounds: tuple[ArrayLike, ArrayLike],
    rise: float,
    *,
    points: int = POINTS,
    workers: int | None = None,
    x_scale: ArrayLike | None = None,
    watch: Callable[[Progress], object] = lambda _: None,
) -> tuple[CostProfile, ...]:
    """Return the profiles of some parameters about the minimum x (N,) of 1/2 sum(fun^2).

    On either side a parameter moves in about ``points`` steps, up to where the cost has risen by
    ``rise`` or to its bound, and after each the others are fitted anew. All sides go side by side
    in ``workers`` threads (as many as there are processors by default). ``rise`` is s^2 q / 2 for
    an interval at the level of which q is the quantile of chi^2 with one degree of freedom, or
    that of t squared.

    Where a cost lower than at x turns up, all begin anew from the minimum there. watch gets the
    Progress, in sides; KeyboardInterrupt, raised there or anywhere, ends it with what is done.

    Raises ValueError for bounds that cross, x outside them, residuals not finite there, rise <= 0.

    Source: Venzon & Moolgavkar 1988; Raue et al. 2009.
    """
    start, box = checked(x, bounds, x_scale)
    if not rise > 0.0:
        raise ValueError(f"rise: {rise} is not above 0")
    stop, lower_found = Event(), False
    counted = until(stop, fun), until(stop, jac)
    for restarts in range(MOST_MINIMA + 1):
        cost = half_square(OneByOne(fun).residuals([start])[0])
        if cost == inf:
            raise ValueError("the residuals at x are not finite")
        bottom = Spot(start, cost, 0.0)
        slopes = OneByOne(fun, jac).jacobians([start])[0]
        valley = Valley(*counted, box, x_scale is not None, bottom, slopes, rise, points)
        limit = cost - LOWER * rise if restarts < MOST_MINIMA else -inf
        sides = [Side(index, sign, [bottom]) for index in indices for sign in (-1, 1)]
        lowest = walk_all(valley, sides, limit, workers, watch, stop)
        if stop.is_set() or lowest.cost >= limit:
            break
        start, lower_found = bottom_near(valley, lowest.x), True
    pairs = zip(sides[::2], sides[1::2], strict=True)
    return tuple(joined(below, above, bottom, lower_found) for below, above in pairs)


def bottom_near(valley: Valley, x: Array) -> Array:
    """Return the minimum that all parameters together find from a point."""
    bounds = (valley.box.low, valley.box.high)
    unit = valley.box.unit if valley.scaled else None
    return least_squares(valley.fun, x, valley.jac, bounds, "lm-then-dgn", x_scale=unit).x


def joined(below: Side, above: Side, bottom: Spot, lower_found: bool) -> CostProfile:
    """Return the profile of two sides."""
    spots = [*below.spots[:0:-1], *above.spots]
    return CostProfile(
        index=below.index,
        at=np.array([spot.x[below.index] for spot in spots]),
        costs=np.array([spot.cost for spot in spots]),
        xs=np.stack([spot.x for spot in spots]),
        low=below.crossing,
        high=above.crossing,
        ends=(below.end, above.end),
        x=bottom.x,
        cost=bottom.cost,
        moved=lower_found,
    )


def walk_all(
    valley: Valley,
    sides: Sequence[Side],
    limit: float,
    workers: int | None,
    watch: Callable[[Progress], object],
    stop: Event,
) -> Spot:
    """Walk all sides, until one falls below the limit; return the lowest point of all."""
    fallen, done = Event(), [0]

    def walk(side: Side) -> None:
        while not fallen.is_set() and go_on(valley, side):
            if side.spots[-1].cost < limit:
                fallen.set()
        if side.end is ProfileEnd.RISE and not fallen.is_set():
            side.crossing = crossing(valley, side)

    def report(_: None) -> None:
        done[0] += 1
        watch(Progress("profiling", done[0], len(sides), lowest().cost))

    def lowest() -> Spot:
        return min((spot for side in sides for spot in tuple(side.spots)), key=lambda s: s.cost)

    side_by_side(walk, sides, workers, report, stop)
    return lowest()


def go_on(valley: Valley, side: Side) -> bool:
    """Add a point to a side; return whether there are more to come."""
    here, bound = side.place(-1), (valley.box.low, valley.box.high)[side.sign > 0][side.index]
    if here == bound:
        side.end = ProfileEnd.BOUND
        return False
    if len(side.spots) > MOST_POINTS * valley.points:
        side.end = ProfileEnd.FLAT
        return False
    direction, step = ahead(valley, side, abs(bound - here))
    for _ in range(MOST_HALVINGS + 1):
        arrives = step >= abs(bound - here)
        guess = valley.box.inside(side.spots[-1].x + side.sign * step * direction)
        guess[side.index] = bound if arrives else here + side.sign * step
        spot = valley.refit(side.index, guess)
        if spot and spot.height - side.spots[-1].height <= LEAPS / valley.points:
            break
        step *= 0.5
    if spot is None:
        side.end = ProfileEnd.FAILED
        return False
    side.spots.append(spot)
    if spot.height >= 1.0:
        side.end = ProfileEnd.RISE
    return spot.height < 1.0


def ahead(valley: Valley, side: Side, room: float) -> tuple[Array, float]:
    """Return how all parameters move with the one, and how far it goes next."""
    if len(side.spots) == 1:
        direction, width = valley.tangent(side.index)
        width = min(width, room)
        unit = float(valley.box.unit[side.index])
        return direction, (width if isfinite(width) else unit) / valley.points
    before, last = side.spots[-2:]
    step = abs(side.place(-1) - side.place(-2))
    gained = max((last.height - before.height) * valley.points, 1.0 / MOST_GROWTH)
    return (last.x - before.x) / (step * side.sign), step * max(1.0 / gained, 1.0 / MOST_GROWTH)


def crossing(valley: Valley, side: Side) -> float:
    """Return where the cost has risen as far as asked, by refits between the last two points."""
    inside, outside = side.spots[-2:]
    for count in range(MOST_REFITS):
        if min(1.0 - inside.height, outside.height - 1.0) <= CLOSE:
            break
        share = (1.0 - inside.height) / (outside.height - inside.height) if count < SECANTS else 0.5
        spot = valley.refit(side.index, inside.x + share * (outside.x - inside.x))
        if spot is None:
            break
        side.spots.append(spot)
        inside, outside = (inside, spot) if spot.height >= 1.0 else (spot, outside)
    side.spots.sort(key=lambda spot: side.sign * float(spot.x[side.index]))
    ends = [float(spot.x[side.index]) for spot in (inside, outside)]
    return float(np.interp(1.0, [inside.height, outside.height], ends))
