"""Intervals with the given values free as well: the profiles of a linear model within bounds."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.optimize import brentq, lsq_linear

from exfit.results.intervals.free_values import improbability, sides_within

COUNT, VALUES, ROWS = 3, 2, 12  # of parameters, given values, errors
RISE = 3.84
FAR = 1e3  # beyond every end


def profile_end(matrix, errors, low, high, k, sign):
    """Return how far a parameter can go until the least cost of bounded least squares has risen."""
    others = np.delete(np.arange(matrix.shape[1]), k)

    def least(at):
        left = -errors - matrix[:, k] * at
        bounds = low[others], high[others]
        return 2.0 * lsq_linear(matrix[:, others], left, bounds, method="bvls").cost

    best = lsq_linear(matrix, -errors, (low, high), method="bvls")
    end = float(np.clip(sign * FAR, low[k], high[k]))
    allowed = 2.0 * best.cost + RISE
    if least(end) > allowed:
        end = brentq(lambda at: least(at) - allowed, best.x[k], end, xtol=1e-10)
    return sign * end


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("bounded", [(), (1,), (0, 2)])
def test_profiles_within_bounds_are_those_of_bounded_least_squares(seed, bounded):
    """To the tolerances of these, where a parameter lies on its bound and may leave it."""
    rng = np.random.default_rng([seed, *bounded])
    rows = rng.normal(size=(ROWS, COUNT + VALUES + 1))
    rows = np.vstack([rows, np.eye(VALUES, COUNT + VALUES + 1, COUNT)])
    room = dict.fromkeys(bounded, (0.0, 0.4 if seed % 2 else np.inf))
    low, high = np.full(COUNT + VALUES, -np.inf), np.full(COUNT + VALUES, np.inf)
    for k, ends in room.items():
        low[k], high[k] = ends
    sides = sides_within(room, rows, RISE)
    for k in range(COUNT + VALUES):
        for side, sign in enumerate((-1.0, 1.0)):
            end = profile_end(rows[:, :-1], rows[:, -1], low, high, k, sign)
            assert sides[k, side] == pytest.approx(max(end, 0.0), abs=1e-5)


def test_a_minimum_is_as_likely_as_the_integral_about_it():
    """A wide one that is higher may hold more than a narrow one that is lower."""
    noise, far = 0.3, 60.0
    linear = [(np.array([[4.0, 1.0], [0.5, 3.0]]), 0.02), (np.array([[0.4, 0.1], [0.0, 0.2]]), 0.1)]
    integrals, improbabilities = [], []
    for jacobian, cost in linear:

        def density(y, x, jacobian=jacobian, cost=cost):
            return np.exp(-(cost + 0.5 * np.sum((jacobian @ [x, y]) ** 2)) / noise**2)

        integrals.append(dblquad(density, -6.0, 6.0, -6.0, 6.0)[0])
        residuals = SimpleNamespace(
            bounds=(np.full(2, -far), np.full(2, far)), exact=lambda _, j=jacobian: j, noise=noise
        )
        improbabilities.append(improbability(residuals, np.zeros(2), cost))
    narrow, wide = improbabilities
    assert wide < narrow
    assert wide - narrow == pytest.approx(-2.0 * np.log(integrals[1] / integrals[0]), abs=1e-2)
