"""Intervals with the given values free as well, where the first order of their errors fails.

That is where a parameter on a bound would leave it, where a limit acts for other values that are as
likely, or where the record asks for more of the values at once than chance does.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import inf, isfinite, sqrt

import numpy as np

from exfit.errors import SimulationError
from exfit.estimate import half_square
from exfit.fitting.descents import short_descent
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import LARGEST_FACTOR, freed_within
from exfit.fitting.residuals import Residuals, with_freed
from exfit.fitting.uncertainty import slopes_of
from exfit.inference.confidence import NORMAL
from exfit.simulation.limits import extremes
from exfit.util.arrays import Array

MOST_ITERATIONS, TOLERANCE = 25, 1e-3  # of a descent: the end of an interval is no estimate
MOST_HELD = 4  # parameters on bounds that may leave them
ROUNDING = 1e-9  # of a bound
LEAST_WIDTH = 1e-6  # of scaled bounds


def starts_of_values(
    residuals: Residuals,
    theta: Array,
    std_errors: Mapping[str, float],
    setups: Sequence[ExperimentSetup],
) -> Iterator[dict[str, float]]:
    """Yield each limit that the response would meet within 1.96 of its errors, as it then acts."""
    values, reached = residuals.values(theta), dict[str, float]()
    for setup in setups:
        try:
            for each in extremes(*setup.experiment.at(values)):
                reached[each.limit] = max(each.share, reached.get(each.limit, 0.0))
        except SimulationError:
            continue
    for name, share in reached.items():
        given = residuals.fixed.get(name, 0.0)
        if given and name in std_errors:
            least = 1.0 - NORMAL * std_errors[name] / abs(given)
            if least < share < 1.0:
                yield {name: 0.5 * (least + share) * given}


def sides_with_values(
    residuals: Residuals,
    theta: Array,
    std_errors: Mapping[str, float],
    spread: Array,
    starts: Sequence[Mapping[str, float]],
    given: Mapping[str, float],
) -> dict[str, tuple[float, float]]:
    """Return how far down and up from theta (N,) each parameter, and each value, may lie at 95 %.

    The values are fitted with their errors as priors, from each start, which gives what differs
    from theta and from the values; about each minimum that is likely enough these are the ends of
    the profiles of the linear model there, in which the ``spread`` (M,) is the standard deviation
    of the errors. ``given`` are values that were moved: a minimum is then also likely by its width.

    Source: Raue et al. 2009, Bioinformatics 25, 1923-1929 (profiles with nuisances and priors).
    """
    fixed = residuals.fixed
    added = [
        replace(freed_within(name, given.get(name, value), LARGEST_FACTOR, error), start=value)
        for name, error in std_errors.items()
        if (value := fixed.get(name))
    ]
    whole, at = with_freed(residuals, added), residuals.values(theta)
    points = [
        np.array([each.scaled(start.get(each.name, at[each.name])) for each in whole.free])
        for start in starts
    ]
    ends = [short_descent(whole, point, MOST_ITERATIONS, tolerance=TOLERANCE) for point in points]
    found = [(end.x, end.cost) for end in ends if end is not None]
    here = np.array([each.scaled(at[each.name]) for each in whole.free])
    less = _less_likely(whole, found, half_square(whole(here)), by_width=bool(given))
    spread = np.append(spread[: whole.count], np.full(len(whole.priors), whole.noise))
    sides = np.zeros((len(whole.free), 2))
    for (x, _), beyond in zip(found, less, strict=True):
        if beyond < NORMAL**2:
            values = whole.values(x)
            slopes = whole.exact(x) / slopes_of(whole, x)  # in their own units
            rows = np.column_stack([slopes, whole(x)]) / spread[:, None]
            own = sides_within(_room(residuals, values), rows, NORMAL**2 - beyond)
            moved = np.array([values[each.name] - at[each.name] for each in whole.free])
            sides = np.maximum(sides, own + moved[:, None] * [-1.0, 1.0])
    pairs = zip(whole.free, sides.tolist(), strict=True)
    return {each.name: (down, up) for each, (down, up) in pairs}


def _less_likely(
    whole: Residuals, found: Sequence[tuple[Array, float]], here: float, by_width: bool
) -> list[float]:
    """Return by how much of chi-square minima are less likely than the lowest, or the widest.

    These are ``found`` at x (N,) with a cost; ``here`` is that of the result.
    """
    least = min([here, *(cost for _, cost in found)])
    beyond = [2.0 * (cost - least) / whole.noise**2 for _, cost in found]
    if not by_width:
        return beyond
    shares = [improbability(whole, x, cost) for x, cost in found]
    return [min(own, share - min(shares)) for own, share in zip(beyond, shares, strict=True)]


def improbability(residuals: Residuals, theta: Array, cost: float) -> float:
    """Return -2 ln of the share that a minimum theta (N,) has of all, but for a constant.

    It counts how low the minimum is, and how wide: of a parameter without a prior its bounds.

    Source: MacKay 2003, chapter 27 (Laplace's method).
    """
    low, high = residuals.bounds
    jacobian = residuals.exact(theta) / residuals.noise
    precision = jacobian.T @ jacobian + np.diag(np.maximum(high - low, LEAST_WIDTH) ** -2.0)
    return 2.0 * cost / residuals.noise**2 + float(np.linalg.slogdet(precision)[1])


def _room(residuals: Residuals, values: Mapping[str, float]) -> dict[int, tuple[float, float]]:
    """Return how far the parameters on bounds may move down and up, by their places."""
    return {
        k: (each.low - values[each.name], each.high - values[each.name])
        for k, each in enumerate(residuals.free)
        if each.bound(values[each.name]) is not None
    }


def sides_within(room: Mapping[int, tuple[float, float]], rows: Array, rise: float) -> Array:
    """Return how far down and up (N, 2) the profiles of N parameters reach.

    The ``rows`` (M, N + 1) are a linear model, in standard deviations: the derivatives by the
    parameters, and the errors; the sum of squares rises by ``rise``. Parameters with ``room`` stay
    within it: each lies on one of its ends, or between them.

    Source: Venzon & Moolgavkar 1988, of a quadratic form.
    """
    count = rows.shape[1] - 1
    left = np.asarray(np.linalg.qr(rows, mode="r"))
    size = np.linalg.norm(left[:, :count], axis=0)
    size[size == 0.0] = 1.0
    matrix, errors = left[:, :count] / size, left[:, count]
    low, high = np.full(count, -inf), np.full(count, inf)
    for k, ends in room.items():
        low[k], high[k] = np.multiply(ends, size[k])

    def is_within(at: Array) -> bool:
        return bool(np.all((at >= low - ROUNDING * size) & (at <= high + ROUNDING * size)))

    cases, least, held = list[tuple[float, Array, Array]](), inf, [*room][:MOST_HELD]
    choices = [[*filter(isfinite, (low[k], high[k])), None] for k in held]
    for bounds in product(*choices):
        at, free = np.zeros(count), np.ones(count, dtype=bool)
        for k, bound in zip(held, bounds, strict=True):
            if bound is not None:
                at[k], free[k] = bound, False
        inverse, root = np.linalg.pinv(matrix[:, free]), np.zeros((count, len(matrix)))
        at[free] = -inverse @ (errors + matrix @ at)
        root[free] = inverse
        cost = float(np.sum((errors + matrix @ at) ** 2))
        cases.append((cost, at, root @ root.T))
        least = min(least, cost) if is_within(at) else least
    sides = np.zeros((count, 2))
    for cost, at, covariance in cases:
        reach = sqrt(max(least + rise - cost, 0.0)) if cost < least + rise < inf else 0.0
        for k, sign in product(range(count), (-1.0, 1.0) if reach else ()):
            end = at + sign * reach * covariance[k] / sqrt(covariance[k, k] or 1.0)
            if is_within(end):
                side = int(sign > 0.0)
                sides[k, side] = max(sides[k, side], sign * end[k] / size[k])
    return sides
