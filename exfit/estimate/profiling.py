"""Profile likelihood: how far a parameter can move if all others may follow.

From point to point the others are predicted along the tangent of the profile and its bend, then
refitted as far as the cost needs. A point has the slope of the profile as well as its cost, so that
few are enough to find where the cost has risen as far as asked.

Source: Bates & Watts 1988, sections 6.1 (profile t, profile traces) and A3.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import partial
from math import inf, isfinite, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.linear import LinearModel, bounded_minimum, linearise, solve
from exfit.estimate.lockstep import finish, finish_all
from exfit.estimate.problem import (
    TINY,
    UNSEEN,
    Box,
    Function,
    Functions,
    OneByOne,
    Point,
    Problem,
    Progress,
    Steps,
    checked,
    half_square,
)
from exfit.estimate.solver import Descent
from exfit.util.arrays import Array

FINE = 2e-3  # of the rise: what a refit may leave, a thousandth of the way to the crossing
MOST_CORRECTIONS = 15  # of a refit: it starts near its end
NEXT_TO = 1e-3  # units: a variable no farther from its bound lies on it
REACH = 1.0  # of a correction, in units of each variable
FAR = 30.0  # rises that a correction promises: where it fails, take a shorter step instead
ENOUGH = 0.1  # of what a correction promises: it is not too long
DAMPINGS = tuple(10.0**-k for k in range(2, 9))  # of the largest squared singular value
AS_PROMISED = 0.05  # of a gain: the model that promised it still holds where it leads
LENGTHS = (0.5, 0.2, 0.05)  # of a correction that is too long
SHARES = (0.1, 0.3, 0.5, 0.7, 0.9)  # of the linear model on the other side of a kink
LAST = 1.05  # height that the last step aims at: beyond the crossing
LEAPS = 2.5  # times the height that a step aims at: take a shorter one instead
MOST_HALVINGS = 5  # of a step: what then remains is a jump
MOST_GROWTH = 2.0  # of a step
MOST_POINTS = 4  # times the points: a side that needs more is flat
CLOSE = 0.005  # of the way from the minimum: how certain the crossing must be
MOST_REFITS = 12  # to make it so
CUBICS = 4  # of them, then halves: a jump lets no interpolation come near


NOTHING = (inf, -inf)  # an interval that holds no value


class Spent(Exception):
    """A side of a profile has taken as many iterations as it may."""


class ProfileEnd(Enum):
    """Why one side of a profile ends."""

    RISE = "the cost has risen as far as asked"
    BOUND = "the parameter is at its bound"
    FLAT = "the cost hardly rises"
    FAILED = "no residuals beyond are finite"
    KNOWN = "the interval about another minimum begins"
    SPENT = "it took as many iterations as it may"
    INTERRUPTED = "interrupted"


@dataclass(frozen=True, eq=False)
class Spot:
    """A point x (N,) of a profile, the others refitted.

    place    the parameter's value
    height   the root of the rise of the cost, in units of the rise asked
    slope    of the height over the distance from the minimum; 0 where it has none, as at a kink
    best     all parameters where the linear model here has its minimum (N,)
    tangent  how fast all move with the parameter (N,)
    """

    x: Array
    cost: float
    place: float
    height: float
    slope: float
    best: Array
    tangent: Array


@dataclass(frozen=True, eq=False)
class Valley:
    """What all profiles about one minimum share.

    ``lowest`` is the cost that rises count from, ``most`` how many iterations a side may take.
    """

    functions: Functions
    box: Box
    scaled: bool
    bottom: LinearModel
    lowest: float
    points: int
    most: float


@dataclass(eq=False)
class Side:
    """One side of a profile, as far as it has come; ``sign`` is -1 below the minimum.

    ``stride`` is how far the last step aimed, ``failed`` where residuals were not finite. It ends
    where it enters an interval that is ``known``, as from another minimum.
    """

    valley: Valley
    index: int
    sign: int
    rise: float
    known: tuple[float, float] = NOTHING
    spots: list[Spot] = field(init=False)
    curvature: float = field(init=False)
    end: ProfileEnd = ProfileEnd.INTERRUPTED
    crossing: float | None = None
    stride: float = 0.0
    failed: float = inf
    iterations: int = 0

    def __post_init__(self) -> None:
        """Begin at the minimum."""
        linear = self.valley.bottom
        x, cost = linear.point.x, linear.point.cost
        tangent, effect = self.tangent(linear, x)
        self.curvature = effect / sqrt(2.0 * self.rise)
        height = self.height(cost)
        slope = 0.0 if height > 0.0 else self.curvature
        self.spots = [Spot(x, cost, float(x[self.index]), height, slope, x, tangent)]

    def walk(self, limit: float) -> Steps["Side"]:
        """Go to where the cost has risen as far as asked, or as far as there is a way.

        An interruption ends it, and so does a point with a cost below the limit.
        """
        try:
            end = None
            while end is None and self.spots[-1].cost >= limit:
                end = yield from self.go_on()
            if end is ProfileEnd.RISE:
                self.crossing = yield from self.crossed()
            self.end = end or ProfileEnd.INTERRUPTED
        except KeyboardInterrupt:
            self.end = ProfileEnd.INTERRUPTED
        except Spent:
            self.end = ProfileEnd.SPENT
        return self

    def go_on(self) -> Steps[ProfileEnd | None]:
        """Add a point, predicted by the tangent of the profile and its bend.

        Return why there are no more to come, if so.
        """
        box, points, last = self.valley.box, self.valley.points, self.spots[-1]
        bound = float((box.high if self.sign > 0 else box.low)[self.index])
        if last.place == bound:
            return ProfileEnd.BOUND
        low, high = self.known
        if low <= last.place <= high and not low <= self.spots[0].place <= high:
            return ProfileEnd.KNOWN
        if abs(self.failed - last.place) <= CLOSE * abs(last.place - self.spots[0].place):
            return ProfileEnd.FAILED
        if len(self.spots) > MOST_POINTS * points:
            return ProfileEnd.FLAT
        room = abs(bound - last.place)
        self.stride = self.step(room)
        step = min(self.stride, self.way_to_corner())
        for tries in range(MOST_HALVINGS + 1):
            move = self.sign * step
            x = last.best + move * last.tangent
            if len(self.spots) > 1:
                before = self.spots[-2]
                x += 0.5 * move**2 * (last.tangent - before.tangent) / (last.place - before.place)
            guess = self.at(bound if step >= room else last.place + move, x)
            spot = yield from self.refit(guess, patient=tries == MOST_HALVINGS)
            if spot is not None and spot.height - last.height <= LEAPS / points:
                break
            self.stride = step = 0.5 * step
        if spot is None:
            return ProfileEnd.FAILED
        self.spots.append(spot)
        return ProfileEnd.RISE if spot.height >= 1.0 else None

    def step(self, room: float) -> float:
        """Length of the step to the next height, by the slope of the profile and its bend."""
        last, share = self.spots[-1], 1.0 / self.valley.points
        higher = last.height + share
        gain = (LAST if higher > 1.0 - 0.5 * share else higher) - last.height
        if len(self.spots) == 1:  # the cost is a parabola there
            way = inf
            if self.curvature > 0.0:
                way = sqrt((last.height + gain) ** 2 - last.height**2) / self.curvature
            unit = float(self.valley.box.unit[self.index])
            return way if isfinite(way) else min(unit, room) / self.valley.points
        before = self.spots[-2]
        risen = last.height - before.height
        longest = MOST_GROWTH * max(1.0, gain / share) * self.stride
        way = abs(last.place - before.place)
        steepness = last.slope or (risen / way if way else 0.0)
        if not steepness > 0.0:
            return longest
        straight = min(gain / steepness, longest)
        if not min(last.slope, before.slope, risen) > 0.0:
            return straight
        bend = (1.0 / last.slope - 1.0 / before.slope) / risen
        bent = straight + 0.5 * bend * (straight * steepness) ** 2
        return min(max(bent, 0.5 * straight), longest)

    def way_to_corner(self) -> float:
        """Length of the way until another variable, which follows, meets its bound."""
        last, box = self.spots[-1], self.valley.box
        moves = self.sign * last.tangent
        room = np.where(moves > 0.0, box.high - last.best, last.best - box.low)
        meeting = (moves != 0.0) & (room > 0.0)
        meeting[self.index] = False
        return float(np.min(room[meeting] / np.abs(moves[meeting]), initial=inf))

    def at(self, place: float, x: Array) -> Array:
        """Return x within the bounds, with the parameter at a place."""
        inside = self.snapped(x)
        inside[self.index] = place
        return inside

    def snapped(self, x: Array) -> Array:
        """Return x within the bounds, on those that it is next to."""
        box = self.valley.box
        near = NEXT_TO * box.unit
        return np.where(x <= box.low + near, box.low, np.where(x >= box.high - near, box.high, x))

    def refit(self, guess: Array, patient: bool = True) -> Steps[Spot | None]:
        """Fit all parameters but one, from a guess; None where the residuals are not finite.

        Not ``patient``: also where the full step fails far from the minimum.
        """
        valley, fine, place = self.valley, FINE * self.rise, float(guess[self.index])
        low, high = self.at(place, valley.box.low), self.at(place, valley.box.high)
        held = valley.box._replace(low=low, high=high)
        problem = Problem(valley.functions, None, held, valley.scaled)
        point = yield from problem.evaluate(guess)
        if point.cost == inf:
            self.failed = place
            return None
        linear, before = (yield from self.linearised(problem, point, valley.bottom)), None
        for _ in range(MOST_CORRECTIONS):
            if not linear.finite or linear.full.promise <= fine:
                break
            trial = yield from problem.evaluate(solve(linear, reach=REACH).target)
            if trial.cost > point.cost - ENOUGH * linear.full.promise:
                if not patient and linear.full.promise > FAR * self.rise:
                    return None
                shorter = yield from best_of_shorter(problem, linear, before)
                trial = min(trial, shorter, key=lambda point: point.cost)
            gain = point.cost - trial.cost
            if gain > 0.0:
                if abs(gain - linear.full.promise) <= AS_PROMISED * gain:
                    carried = linear.carried_to(trial)
                    if carried.full.promise <= fine:
                        return self.spot(carried)
                point, before = trial, linear
                linear = yield from self.linearised(problem, point, linear)
            if gain <= fine:
                break
        return self.spot(linear)

    def linearised(self, problem: Problem, point: Point, before: LinearModel) -> Steps[LinearModel]:
        """Linearise at a point; raises Spent where the side may take no further iteration."""
        if self.iterations >= self.valley.most:
            raise Spent
        self.iterations += 1
        return (yield from linearise(problem, point, before))

    def spot(self, linear: LinearModel) -> Spot:
        """Return the point of the profile that a linear model with the parameter held shows."""
        x, cost = linear.point.x, linear.point.cost
        place = float(x[self.index])
        if not linear.finite:
            return Spot(x, cost, place, self.height(cost), 0.0, x, np.eye(len(x))[self.index])
        smooth = linear.full.promise <= FINE * self.rise
        best, left = (self.snapped(linear.full.target), linear.full.promise) if smooth else (x, 0.0)
        tangent, _ = self.tangent(linear, best)
        height = self.height(cost - left)
        moved, along = effect_of(linear, best - x), effect_of(linear, tangent)
        steepness = self.sign * float(along @ (linear.amounts + moved))
        slope = steepness / (2.0 * self.rise * height) if smooth and height > FINE else 0.0
        return Spot(x, cost, place, height, slope, best, tangent)

    def height(self, cost: float) -> float:
        """Return the root of the rise of a cost, in units of that asked."""
        return sqrt(max(0.0, cost - self.valley.lowest) / self.rise)

    def tangent(self, linear: LinearModel, x: Array) -> tuple[Array, float]:
        """Rates of all variables along the parameter (N,), and of the residuals with them.

        Others on a bound stay there.
        """
        box, direction = self.valley.box, np.eye(len(x))[self.index]
        others = (x > box.low) & (x < box.high) & (direction == 0.0)
        alone = effect_of(linear, direction)
        if others.any():
            scale = linear.scale[others]
            rows = linear.singular[:, None] * linear.directions[:, others]
            direction[others] = -np.linalg.lstsq(rows, alone, rcond=UNSEEN)[0] / scale
        effect = float(np.linalg.norm(effect_of(linear, direction)))
        flat = effect <= UNSEEN * float(np.linalg.norm(alone)) + TINY
        return direction, 0.0 if flat else effect

    def crossed(self) -> Steps[float]:
        """Find the point where the cost has risen as asked, by refits between the last points."""
        inside, outside = self.spots[-2:]
        for count in range(MOST_REFITS):
            place, doubt = interpolated(inside, outside)
            if doubt <= CLOSE * abs(place - self.spots[0].place):
                break
            if count >= CUBICS:
                place = 0.5 * (inside.place + outside.place)
            share = (place - inside.place) / (outside.place - inside.place)
            guess = self.at(place, inside.best + share * (outside.best - inside.best))
            spot = yield from self.refit(guess)
            if spot is None:
                break
            self.spots.append(spot)
            inside, outside = (inside, spot) if spot.height >= 1.0 else (spot, outside)
        self.spots.sort(key=lambda spot: self.sign * spot.place)
        return interpolated(inside, outside)[0]


def effect_of(linear: LinearModel, direction: Array) -> Array:
    """Change of the residuals by a move, in the directions that these have (K,)."""
    along: Array = linear.directions @ (linear.scale * direction)
    return linear.singular * along


def best_of_shorter(
    problem: Problem, linear: LinearModel, before: LinearModel | None
) -> Steps[Point]:
    """Return the best of many steps that are shorter than the full one, tried at once.

    At a kink, whose other side the linear model ``before`` shows, steps along it are among them.
    """
    largest = float(linear.singular[0]) ** 2
    targets = [solve(linear, share * largest, REACH).target for share in DAMPINGS]
    targets += [linear.full.at(length) for length in LENGTHS]
    if before is not None:
        targets += [along_kink(linear, before, share) for share in SHARES]
    residuals = yield from problem.residuals(targets)
    points = [Point(x, r, half_square(r)) for x, r in zip(targets, residuals, strict=True)]
    return min(points, key=lambda point: point.cost)


def along_kink(linear: LinearModel, before: LinearModel, share: float) -> Array:
    """Minimise the weighted mean of two linear models within the bounds."""
    x, box = linear.point.x, linear.box
    rows = np.vstack(
        [
            sqrt(1.0 - share) * (linear.singular[:, None] * linear.directions * linear.scale),
            sqrt(share) * (before.singular[:, None] * before.directions * before.scale),
        ]
    )
    amounts = np.append(
        sqrt(1.0 - share) * linear.amounts,
        sqrt(share) * (before.amounts + effect_of(before, x - before.point.x)),
    )
    unit = box.unit
    low, high = np.maximum(box.low - x, -REACH * unit), np.minimum(box.high - x, REACH * unit)
    y = bounded_minimum(rows * unit, amounts, low / unit, high / unit, linear.unseen)
    return box.inside(x + y * unit)


def interpolated(inside: Spot, outside: Spot) -> tuple[float, float]:
    """Find the point of height one between two points, and its uncertainty.

    The place is a cubic of the height, which both places and slopes give; without slopes a line.
    """
    risen, way = outside.height - inside.height, outside.place - inside.place
    share = (1.0 - inside.height) / risen
    straight = inside.place + share * way
    near = min(share, 1.0 - share)
    if not min(inside.slope, outside.slope) > 0.0:
        return straight, abs(way) * near
    bends = [risen / spot.slope / abs(way) - 1.0 for spot in (inside, outside)]
    cubic = share + share * (1.0 - share) * ((1.0 - share) * bends[0] - share * bends[1])
    if not 0.0 <= cubic <= 1.0:
        return straight, abs(way)
    # less the parabola through both places with the slope at the nearer one
    doubt = share * (1.0 - share) * near * abs(sum(bends))
    return inside.place + cubic * way, doubt * abs(way)


POINTS = 5  # from the minimum to the rise: enough for a smooth figure
LOWER = 1e-3  # of the rise: what is farther below the minimum refutes it
MOST_MINIMA = 5


class LowerMinimum(NamedTuple):
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
    most: float = inf,
    workers: int | None = None,
    x_scale: ArrayLike | None = None,
    watch: Callable[[Progress], object] = lambda _: None,
) -> tuple[CostProfile, ...]:
    """Return the profiles of some parameters about the minimum x (N,) of f, half the square sum.

    On either side a parameter moves in about ``points`` steps, up to where the cost has risen by
    its own of ``rises`` or to its bound, and after each the others are fitted anew; it ends open
    where that would take more than ``most`` Jacobians. All sides are advanced together, in
    ``workers`` threads (as many as there are processors by default). A rise is s^2 q / 2 for an
    interval at the level of which q is the quantile of chi^2 with one degree of freedom, or that of
    t squared. It counts from the cost at x or, where x lies ``beside`` a lower minimum, from the
    cost there; then a side ends where it enters the interval of that one.

    Where a cost lower than that turns up, all begin anew from the minimum there. watch gets the
    Progress, in sides; KeyboardInterrupt, raised there or anywhere, ends it with what is done.

    Raises ValueError for bounds that cross, x outside them, residuals not finite there, rise <= 0.

    Source: Venzon & Moolgavkar 1988; Raue et al. 2009.
    """
    start, box = checked(x, bounds, x_scale)
    for rise in rises.values():
        if not rise > 0.0:
            raise ValueError(f"rise: {rise} is not above 0")
    valley_at = partial(valley_about, functions, box, x_scale is not None, points, most=most)
    valley = finish(valley_at(start, inf if beside is None else beside.cost))
    known = {} if beside is None else beside.intervals
    for restarts in range(MOST_MINIMA + 1):
        sides = sides_of(valley, rises, known)
        margin = LOWER * max(rises.values()) if restarts < MOST_MINIMA else inf
        whole = finish_sides(sides, valley.lowest - margin, workers, watch)
        deepest = deepest_of(sides)
        if not whole or deepest.cost >= valley.lowest - margin:
            break
        descent = Descent(
            functions=functions,
            bounds=(box.low, box.high),
            method="lm-then-dgn",
            x_scale=None if x_scale is None else box.unit,
        )
        lower = finish(descent.begin(deepest.x)).x
        valley, known = finish(valley_at(lower, inf)), {}
    profiles = []
    for below, above in zip(sides[::2], sides[1::2], strict=True):
        spots = [*below.spots[:0:-1], *above.spots]
        own = CostProfile(
            index=below.index,
            at=np.array([spot.place for spot in spots]),
            costs=np.array([spot.cost for spot in spots]),
            xs=np.stack([spot.x for spot in spots]),
            low=below.crossing,
            high=above.crossing,
            ends=(below.end, above.end),
            x=valley.bottom.point.x,
            cost=valley.bottom.point.cost,
            moved=restarts > 0,
        )
        profiles.append(own)
    return tuple(profiles)


def valley_about(
    functions: Functions,
    box: Box,
    scaled: bool,
    points: int,
    x: Array,
    lowest: float,
    most: float = inf,
) -> Steps[Valley]:
    """Describe a minimum to the profiles about it."""
    problem = Problem(functions, None, box, scaled)
    point = yield from problem.evaluate(x)
    if point.cost == inf:
        raise ValueError("the residuals at x are not finite")
    bottom = yield from linearise(problem, point)
    return Valley(functions, box, scaled, bottom, min(point.cost, lowest), points, most)


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
