"""Many starts over the bounds, each refined to a minimum, and the distinct minima they lead to."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import ceil, inf, log2, nan
from threading import Event

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.answer import Progress, Result, SolverIteration, Stop
from exfit.estimate.arrays import Array
from exfit.estimate.box import checked
from exfit.estimate.problem import Function, exact, half_square, residuals_at
from exfit.estimate.searches import USUAL, Searches
from exfit.estimate.solver import least_squares
from exfit.estimate.stopping import MOST_ITERATIONS
from exfit.estimate.threads import side_by_side, until
from exfit.util.strategies import DEFAULT_STRATEGY

SEED = 1  # any: what matters is that a run can be repeated
SCREENED_AT_ONCE = 256  # points screened between two reports
INDISTINGUISHABLE = 0.5  # standard errors: a difference that no record shows


@dataclass(frozen=True)
class LocalMinimum:
    """A minimum: its point x (N,), its cost, how many starts led there, the best of their ends."""

    x: Array
    cost: float
    starts: int
    result: Result


@dataclass(frozen=True)
class MultistartResult:
    """What a search from many starts found: the distinct ``minima``, the lowest first.

    best         of the lowest minimum; after an interruption of the lowest point seen: that may be
                 one of a refinement that was cut short, or a start that was only screened, with
                 Stop.INTERRUPTED then; None where no point has a cost
    start_costs  (count,) of the starts, the user's own first; inf where not finite, nan where an
                 interruption came before
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


Screen = Callable[[Array], ArrayLike]
Watch = Callable[[Progress], object]


def multistart(
    fun: Function,
    jac: Function,
    bounds: tuple[ArrayLike, ArrayLike],
    count: int,
    *,
    x0: ArrayLike | None = None,
    screen: Screen | None = None,
    refine: int | None = None,
    workers: int | None = None,
    seed: int = SEED,
    watch: Watch = lambda _: None,
    method: str = DEFAULT_STRATEGY,
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS,
    gtol: float = 1e-8,
    gtol_absolute: float | None = None,
    ftol: float = 1e-8,
    xtol: float = 1e-10,
    x_scale: ArrayLike | None = None,
    jacobian_error: float | None = None,
    good_enough: float | None = None,
    matches: Callable[[Array], bool] | None = None,
    searches: Searches = USUAL,
    earlier: Sequence[Result] = (),
) -> MultistartResult:
    """Minimise f(x) = 1/2 sum(fun(x)^2) from ``count`` starts spread over finite bounds (N,).

    The starts are x0, if there is one, and points of a scrambled Sobol sequence. The ``refine``
    best of them (all by default), x0 always among them, are refined by `least_squares`, whose
    method and tolerances these are (the cost's is wider: to distinguish minima needs less), in
    ``workers`` threads (as many as there are processors by default); fun and jac must bear being
    called from several at a time.

    screen  gives the costs (K,) of many points (K, N) at once; without it fun is called for each
    watch   gets every Progress; KeyboardInterrupt, raised there or anywhere, ends the search
            with what is done
    earlier results of `least_squares` with the same fun: their starts and ends count, too, as the
            first ones

    Two ends are one minimum where half a standard error, in cost f / 4 (M - N), exceeds both the
    difference of their costs and what the linear model at the better one makes of their distance:
    then no record tells them apart, however flat the valley. Costs below gtol^2 times the starts'
    median are all nothing.

    Raises ValueError for bounds that are not finite or cross, x0 outside them, or count < 1.

    Source: Sobol 1967; Owen 1998 (scrambling).
    """
    points = spread(bounds, count, x0, seed)
    stop, ends, cut_short = Event(), dict[int, StartOutcome](), list[Result]()
    costs = screened(until(stop, fun), points, screen, workers, watch, stop)
    order = np.argsort(costs, kind="stable")[: np.count_nonzero(np.isfinite(costs))]
    if x0 is not None and np.isfinite(costs[0]):
        order = np.append(0, order[order != 0])
    chosen = [] if stop.is_set() else [int(k) for k in order[:refine]]
    nothing = gtol**2 * float(np.median(costs[chosen])) if chosen else 0.0

    def descend(k: int) -> None:
        result = least_squares(
            until(stop, fun),
            points[k],
            until(stop, jac),
            bounds,
            method,
            max_iterations=max_iterations,
            gtol=gtol,
            gtol_absolute=gtol_absolute,
            ftol=ftol,
            xtol=xtol,
            x_scale=x_scale,
            jacobian_error=jacobian_error,
            good_enough=good_enough,
            matches=matches,
            searches=searches,
        )
        if result.stop is Stop.INTERRUPTED:
            cut_short.append(result)
            raise KeyboardInterrupt
        ends[k] = end_of(result, nothing)

    def report(_: None) -> None:
        lowest = min(end.result.cost for end in tuple(ends.values()))
        watch(Progress("refining", len(ends), len(chosen), lowest))

    side_by_side(descend, chosen, workers, report, stop)
    end_costs = np.full(count, nan)
    end_costs[list(ends)] = [end.result.cost for end in ends.values()]
    failed = int(np.count_nonzero(np.isinf(costs)))
    before = [end_of(result, nothing) for result in earlier]
    minima = minima_of([*before, *(ends[k] for k in sorted(ends))], fun, jac)
    candidates = [local.result for local in minima[:1]]
    if stop.is_set() and np.isfinite(costs).any():
        start = points[np.nanargmin(costs)]
        candidates += [*cut_short, interrupted_at(fun, jac, bounds, start, x_scale)]
    return MultistartResult(
        minima=minima,
        best=min(candidates, key=lambda result: result.cost, default=None),
        start_costs=np.append(starts_of(earlier), costs),
        end_costs=np.append(ends_of(earlier), end_costs),
        failed=failed,
        unrefined=count - failed - len(ends),
        interrupted=stop.is_set(),
    )


def spread(
    bounds: tuple[ArrayLike, ArrayLike], count: int, x0: ArrayLike | None, seed: int
) -> Array:
    """Return the starts (count, N), x0 first, or raise ValueError."""
    from scipy.stats import qmc

    if count < 1:
        raise ValueError(f"count: {count} is below 1")
    low, high = (np.array(bound, dtype=np.float64, ndmin=1) for bound in bounds)
    low, high = np.broadcast_arrays(low, high)
    if not (np.isfinite(low).all() and np.isfinite(high).all()):
        raise ValueError("bounds must be finite: the starts are spread over them")
    first = checked(0.5 * (low + high) if x0 is None else x0, (low, high), None)[0]
    # balanced only in powers of two
    shares = qmc.Sobol(len(low), seed=seed).random_base2(ceil(log2(count)))[:count]
    points = np.clip(low + (high - low) * shares, low, high)
    return points if x0 is None else np.vstack([first, points])[:count]


def screened(
    fun: Function,
    points: Array,
    screen: Screen | None,
    workers: int | None,
    watch: Watch,
    stop: Event,
) -> Array:
    """Return the cost of every point; inf where it is not finite, nan where ``stop`` came first."""
    costs = np.full(len(points), nan)

    def look(part: slice) -> int:
        some = one_by_one(fun, points[part]) if screen is None else screen(points[part])
        costs[part] = np.where(np.isfinite(some), some, inf)
        return len(points[part])

    def report(_: int) -> None:
        done = int(np.count_nonzero(~np.isnan(costs)))
        watch(Progress("screening", done, len(points), float(np.nanmin(costs))))

    parts = [
        slice(first, first + SCREENED_AT_ONCE) for first in range(0, len(points), SCREENED_AT_ONCE)
    ]
    side_by_side(look, parts, workers if screen is None else 1, report, stop)
    return costs


def one_by_one(fun: Function, points: Array) -> list[float]:
    """Return the cost of each point."""
    return [half_square(residuals_at(fun, x)) for x in points]


def interrupted_at(
    fun: Function,
    jac: Function,
    bounds: tuple[ArrayLike, ArrayLike],
    start: Array,
    x_scale: ArrayLike | None,
) -> Result:
    """Return a start as the result of a search that was interrupted there."""

    def interrupt(_: SolverIteration) -> None:
        raise KeyboardInterrupt

    return least_squares(fun, start, jac, bounds, x_scale=x_scale, callback=interrupt)


@dataclass(frozen=True)
class StartOutcome:
    """Where a refinement ended, without residuals and J: thousands would not fit into the memory.

    ``triangle`` (N, N) has the lengths of J; ``step`` is what half a standard error costs.
    """

    result: Result
    triangle: Array
    step: float


def end_of(result: Result, nothing: float) -> StartOutcome:
    """Return the end that a refinement came to; ``nothing`` is what a perfect match may cost."""
    freedom = max(1, len(result.fun) - len(result.x))
    step = INDISTINGUISHABLE**2 * result.cost / freedom + nothing
    triangle = np.asarray(np.linalg.qr(result.jac, mode="r"), dtype=np.float64)
    return StartOutcome(
        replace(result, fun=np.zeros(0), jac=np.zeros((0, len(result.x)))), triangle, step
    )


def distinct(ends: Iterable[StartOutcome]) -> list[list[StartOutcome]]:
    """Return the ends of each minimum, the best first."""
    groups: list[list[StartOutcome]] = []
    for end in sorted(ends, key=lambda end: end.result.cost):
        for group in groups:
            if same(group[0], end):
                group.append(end)
                break
        else:
            groups.append([end])
    return groups


def same(best: StartOutcome, other: StartOutcome) -> bool:
    """Return whether two ends are one minimum, by the rule that `multistart` states."""
    way = best.triangle @ (other.result.x - best.result.x)
    rise = other.result.cost - best.result.cost
    return max(rise, 0.5 * float(way @ way)) <= best.step


def starts_of(earlier: Sequence[Result]) -> list[float]:
    """Return the costs at which searches began."""
    return [result.history[0].cost for result in earlier]


def ends_of(earlier: Sequence[Result]) -> list[float]:
    """Return the costs at which searches ended."""
    return [result.cost for result in earlier]


def minima_of(
    ends: Iterable[StartOutcome], fun: Function, jac: Function
) -> tuple[LocalMinimum, ...]:
    """Return the distinct minima that ends are, the lowest first."""
    return tuple(minimum(group, fun, jac) for group in distinct(ends))


def minimum(group: Sequence[StartOutcome], fun: Function, jac: Function) -> LocalMinimum:
    """Return the minimum that some ends are, with its residuals and Jacobian again."""
    best = group[0].result
    result = replace(best, fun=residuals_at(fun, best.x), jac=exact(jac, best.x))
    return LocalMinimum(best.x, best.cost, len(group), result)
