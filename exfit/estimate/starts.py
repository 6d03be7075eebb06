"""Many starts, each refined to a minimum, and the distinct minima they lead to."""

import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import count, islice
from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.lockstep import finish_all
from exfit.estimate.problem import Progress, Result, Steps, Stop, checked
from exfit.estimate.solver import Descent, NotFinite
from exfit.util.arrays import Array, median

BITS = 30  # of each number


def sobol(number: int, dimensions: int, seed: int) -> Array:
    """Return the first points (number, dimensions) of a sequence in the unit cube.

    Of 2^k points each interval of length 2^-k of every side holds one. The initial direction
    numbers, and the digital shift that takes the first point away from the corner, are drawn at
    random.

    Source: Sobol 1967; Bratley & Fox 1988 (direction numbers, Gray code); Matousek 1998 (shift).
    """
    draw = random.Random(seed)
    directions = np.array(
        [_directions(polynomial, draw) for polynomial in islice(_primitive(), dimensions)]
    )
    points = np.zeros((number, dimensions), dtype=np.int64)
    points[0] = [draw.getrandbits(BITS) for _ in range(dimensions)]
    for k in range(1, number):
        lowest_zero = (k & -k).bit_length() - 1
        points[k] = points[k - 1] ^ directions[:, lowest_zero]
    return np.asarray((points + 0.5) / 2.0**BITS, dtype=np.float64)


def _primitive() -> Iterator[int]:
    """Yield polynomials over GF(2) as bits, the first of degree zero, then all primitive ones."""
    yield 1
    for polynomial in count(3, 2):
        degree = polynomial.bit_length() - 1
        power, order = 1, 0
        while (order == 0 or power > 1) and order < 1 << degree:
            power <<= 1
            if power >> degree:
                power ^= polynomial
            order += 1
        if power == 1 and order == (1 << degree) - 1:
            yield polynomial


def _directions(polynomial: int, draw: random.Random) -> list[int]:
    """Return the direction numbers that a polynomial and random odd initial numbers give."""
    degree = polynomial.bit_length() - 1
    numbers = [2 * draw.getrandbits(k) + 1 for k in range(degree)] if degree else [1] * BITS
    for k in range(len(numbers), BITS):
        following = numbers[k - degree] ^ (numbers[k - degree] << degree)
        for j in range(1, degree):
            if polynomial >> (degree - j) & 1:
                following ^= numbers[k - j] << j
        numbers.append(following)
    return [value << (BITS - 1 - k) for k, value in enumerate(numbers)]


SEED = 1  # any: what matters is that a run can be repeated
INDISTINGUISHABLE = 0.5  # standard errors: a difference that no record shows

Watch = Callable[[Progress], object]


class LocalMinimum(NamedTuple):
    """A minimum: its point x (N,), its cost, how many starts led there, the best of their ends."""

    x: Array
    cost: float
    starts: int
    result: Result


class MultistartResult(NamedTuple):
    """What a search from many starts found: the distinct ``minima``, the lowest first.

    best         of the lowest minimum; after an interruption of the lowest point seen: that may be
                 one of a refinement that was cut short, with Stop.INTERRUPTED then; None where no
                 start led anywhere
    start_costs  (count,) of the starts, those of ``earlier`` first; inf where not finite, nan where
                 an interruption came before
    end_costs    (count,) of what each start led to; nan where it was not refined
    failed       starts whose residuals are not finite
    unrefined    other starts that were not refined, or not to their end
    """

    minima: tuple[LocalMinimum, ...]
    best: Result | None
    start_costs: Array
    end_costs: Array
    failed: int
    unrefined: int
    interrupted: bool


def multistart(
    starts: ArrayLike,
    legs: Sequence[Descent],
    *,
    first_legs: Sequence[int] | None = None,
    merged: float | None = None,
    workers: int | None = None,
    watch: Watch = lambda _: None,
    earlier: Sequence[Result] = (),
) -> MultistartResult:
    """Refine each of some starts (S, N) to a minimum, and return the distinct minima.

    A start goes down one leg after the other: from where a descent on one form of the problem ended
    the next one goes on. A leg that has no finite residuals where it would begin is left out; the
    last one is what all costs and minima refer to. All starts are advanced together, in ``workers``
    threads (as many as there are processors by default); no result depends on their number. The
    functions of the legs must bear being called from several threads at a time.

    first_legs  which leg each start begins with (by default with the first one)
    merged  standard errors by which the ends of the first leg may differ whose starts go on as one,
            from the best of them; by default each goes on by itself
    watch   gets every Progress; KeyboardInterrupt, raised there or anywhere, ends the search
            with what is done
    earlier results of the last leg from other starts: their starts and ends count as the first

    Two ends are one minimum where half a standard error, in cost f / 4 (M - N), exceeds both the
    difference of their costs and what the linear model at the better one makes of their distance:
    then no record tells them apart, however flat the valley. Costs below gtol^2 times the starts'
    median are all nothing.

    Raises ValueError for bounds that cross or starts outside them.
    """
    points = np.array(starts, dtype=np.float64, ndmin=2)
    firsts = [0] * len(points) if first_legs is None else first_legs
    joining = [merged is not None and first == 0 for first in firsts]
    near, ends = dict[int, RefinedStart](), dict[int, RefinedStart]()

    def receive(place: int, end: RefinedStart) -> None:
        if not joining[place]:
            take([place], end)
            return
        near[place] = end
        if end.cut_short is not None:
            raise KeyboardInterrupt

    def take(places: Sequence[int], end: RefinedStart) -> None:
        ends.update(dict.fromkeys(places, end))
        if end.cut_short is not None:
            raise KeyboardInterrupt
        lowest = min((end.cost for end in ends.values() if end.end is not None), default=inf)
        watch(Progress("refining", len(ends), len(points), lowest))

    ways = zip(points, firsts, joining, strict=True)
    begun = [refined(x, legs[:1] if joins else legs[first:]) for x, first, joins in ways]
    whole = finish_all(begun, workers, receive)
    if whole and near:
        groups = _alike(near, merged or 0.0)
        ways_on = ((points[own[0]], near[own[0]].end) for own in groups)
        begins = [x if end is None else end.result.x for x, end in ways_on]
        going_on = [refined(x, legs[1:]) for x in begins]
        whole = finish_all(going_on, workers, lambda k, end: take(groups[k], end))
    every = [
        *(RefinedStart(result.history[0].cost, outcome_of(result)) for result in earlier),
        *(ends.get(k, RefinedStart(nan)) for k in range(len(points))),
    ]
    return summary(every, legs[-1], interrupted=not whole)


def _alike(near: Mapping[int, "RefinedStart"], merged: float) -> list[list[int]]:
    """Starts whose ends lie within so many standard errors, the best first; others alone."""
    there = {k: start.end for k, start in sorted(near.items()) if start.end is not None}
    places = [*there]
    groups = [[places[k] for k in own] for own in distinct([*there.values()], merged)]
    return groups + [[k] for k, start in sorted(near.items()) if start.end is None]


class RefinedStart(NamedTuple):
    """What a start led to: its cost at first, and the end of the last leg if it came there.

    That is ``end``, or ``cut_short`` where an interruption ended it.
    """

    first_cost: float
    end: "StartOutcome | None" = None
    cut_short: Result | None = None

    @property
    def cost(self) -> float:
        """The cost where it ended, nan where it did not come to an end of its own."""
        return nan if self.end is None else self.end.result.cost


def refined(x: Array, legs: Sequence[Descent]) -> Steps[RefinedStart]:
    """Return the way of one start down its legs, to be advanced by `lockstep`."""
    first_cost, calls = inf, (0, 0)
    result: Result | None = None
    for number, leg in enumerate(legs, start=1):
        last = number == len(legs)
        try:
            end = yield from leg.begin(x)
        except NotFinite:
            continue
        first = end.history[0].cost if end.history else end.cost
        first_cost, x = min(first_cost, first), end.x
        calls = (calls[0] + end.nfev, calls[1] + end.njev)
        if last:
            result = end._replace(nfev=calls[0], njev=calls[1])
        elif end.stop is Stop.INTERRUPTED:
            raise KeyboardInterrupt
    if result is not None and result.stop is Stop.INTERRUPTED:
        return RefinedStart(first_cost, cut_short=result)
    if result is None or result.stop is Stop.HIGH:
        return RefinedStart(first_cost)
    return RefinedStart(first_cost, outcome_of(result))


def summary(starts: Sequence[RefinedStart], leg: Descent, interrupted: bool) -> MultistartResult:
    """Summarise the ends of some starts; minima get their residuals and Jacobian again."""
    ends = [start.end for start in starts if start.end is not None]
    first_costs = [start.first_cost for start in starts if start.end is not None]
    nothing = leg.gtol**2 * float(median(first_costs or [0.0]))
    minima = list[LocalMinimum]()
    for group in distinct(ends, nothing=nothing):
        best = ends[group[0]].result
        (residuals,), (J,) = leg.functions.residuals([best.x]), leg.functions.jacobians([best.x])
        whole = best._replace(fun=residuals, jac=J)
        minima.append(LocalMinimum(best.x, best.cost, len(group), whole))
    cut_short = [start.cut_short for start in starts if start.cut_short is not None]
    candidates = [*(local.result for local in minima[:1]), *cut_short]
    failed = sum(start.first_cost == inf for start in starts)
    return MultistartResult(
        minima=tuple(minima),
        best=min(candidates, key=lambda result: result.cost, default=None),
        start_costs=np.array([start.first_cost for start in starts]),
        end_costs=np.array([start.cost for start in starts]),
        failed=failed,
        unrefined=len(starts) - failed - len(ends),
        interrupted=interrupted,
    )


def spread(
    bounds: tuple[ArrayLike, ArrayLike],
    count: int,
    x0: ArrayLike | None = None,
    seed: int = SEED,
) -> Array:
    """Return starts (count, N) over finite bounds: x0, if there is one, and a Sobol sequence.

    Raises ValueError for bounds that are not finite or cross, x0 outside them, or count < 1.
    """
    if count < 1:
        raise ValueError(f"count: {count} is below 1")
    low, high = (np.array(bound, dtype=np.float64, ndmin=1) for bound in bounds)
    low, high = np.broadcast_arrays(low, high)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise ValueError("bounds must be finite: the starts are spread over them")
    first = checked(0.5 * (low + high) if x0 is None else x0, (low, high), None)[0]
    points = np.clip(low + (high - low) * sobol(count, len(low), seed), low, high)
    return points if x0 is None else np.vstack([first, points])[:count]


class StartOutcome(NamedTuple):
    """Where a refinement ended, without residuals and J: thousands would not fit into the memory.

    ``triangle`` (N, N) has the lengths of J; ``variance`` is half that of the residuals.
    """

    result: Result
    triangle: Array
    variance: float


def outcome_of(result: Result) -> StartOutcome:
    """Locate the end of a refinement, with its linear model."""
    freedom = max(1, len(result.fun) - len(result.x))
    triangle = np.asarray(np.linalg.qr(result.jac, mode="r"), dtype=np.float64)
    small = result._replace(fun=np.zeros(0), jac=np.zeros((0, len(result.x))))
    return StartOutcome(small, triangle, result.cost / freedom)


def distinct(
    ends: Sequence[StartOutcome], errors: float = INDISTINGUISHABLE, nothing: float = 0.0
) -> list[list[int]]:
    """Group ends by their minimum, the best first."""
    groups: list[list[int]] = []
    for k in sorted(range(len(ends)), key=lambda k: ends[k].result.cost):
        for group in groups:
            if same(ends[group[0]], ends[k], errors, nothing):
                group.append(k)
                break
        else:
            groups.append([k])
    return groups


def same(
    best: StartOutcome,
    other: StartOutcome,
    errors: float = INDISTINGUISHABLE,
    nothing: float = 0.0,
) -> bool:
    """Tell whether two ends are within so many standard errors, as `multistart` measures them.

    ``nothing`` is what a perfect match may cost.
    """
    way = best.triangle @ (other.result.x - best.result.x)
    rise = other.result.cost - best.result.cost
    return max(rise, 0.5 * float(way @ way)) <= errors**2 * best.variance + nothing
