"""The methods of the thesis, typed here a second time as its chapter 3 states them."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from known_minima import CERTIFIED, random_problem
from places import CONFIGS
from scipy.optimize import least_squares as scipy_least_squares
from scipy.optimize import lsq_linear
from tiers import few_of

from exfit.case.load import load_case
from exfit.case.schema import Estimate
from exfit.estimate import RatioDamping, Searches, least_squares
from exfit.fitting.parameters import UNIT
from exfit.fitting.search import fitted, searches_of

LITERAL = {"dgn": {"step": "full", "cut": "half"}, "lm": {"update": "ratio"}}
ARMIJO = {"lm": {"update": "armijo"}}
# Both solve the same linear problems, by other factorisations: an iterate differs by the rounding
# of the machine times the condition of J, 1e3 here, and the differences add up.
SAME = 1e-10


def unbounded_direction(jacobian, residuals, x):
    """d = -(R'^T R')^-1 R'^T R, in the least-squares form: the product would square rounding."""
    return np.linalg.lstsq(jacobian, -residuals, rcond=None)[0]


def damped_gauss_newton(fun, jac, x, count, direction=unbounded_direction, alpha=1e-4):
    """Section 3.4: x_0, and after each iteration x and how often lambda was halved."""
    rows = [(x, 0)]
    for _ in range(count):
        residuals, jacobian = fun(x), jac(x)
        f, gradient = residuals @ residuals / 2, jacobian.T @ residuals
        d = direction(jacobian, residuals, x)
        step, halvings = 1.0, 0
        while fun(x + step * d) @ fun(x + step * d) / 2 > f + alpha * step * (gradient @ d):
            step, halvings = step / 2, halvings + 1
        x = x + step * d
        rows.append((x, halvings))
    return rows


def levenberg_marquardt(fun, jac, x, count, nu=None, least=1e-3, up=2.0, down=0.5, bounds=None):
    """Section 3.5 with the trust-region test of Kelley 1999: x, and how many trials there were."""
    rows = [(x, 0)]
    for _ in range(count):
        residuals, jacobian = fun(x), jac(x)
        f, gradient = residuals @ residuals / 2, jacobian.T @ residuals
        nu = np.linalg.norm(gradient) if nu is None else nu
        both = np.append(residuals, np.zeros(len(x)))
        ratio, trials = -1.0, 0
        while ratio < 0.0:
            rows_of_nu = np.sqrt(nu) * np.eye(len(x))
            A = np.vstack([jacobian, rows_of_nu])
            s = (
                np.linalg.lstsq(A, -both, rcond=None)[0]
                if bounds is None
                else within(A, both, x, bounds)
            )
            ratio = (f - fun(x + s) @ fun(x + s) / 2) / (-(gradient @ s) / 2)
            nu = max(up * nu, least) if ratio < 0.25 else nu
            trials += 1
        if ratio > 0.75:
            nu = down * nu if down * nu >= least else 0.0
        x = x + s
        rows.append((x, trials))
    return rows


def within(A, b, x, bounds):
    """The s that minimises |A s + b| within the bounds of x + s, by SciPy."""
    low, high = bounds
    return lsq_linear(A, -b, (low - x, high - x), method="bvls", tol=1e-15).x


def residuals_of(name, logarithmic):
    """The residuals of a case, whose parameters are on one scale, and within no bounds."""
    residuals = fitted(load_case(CONFIGS / f"{name}.yaml"))[1].compressed
    scales = [replace(parameter, logarithmic=logarithmic) for parameter in residuals.free]
    return replace(residuals, free=scales)


def searched(residuals, method, count, settings=LITERAL, bounds=(-np.inf, np.inf)):
    return least_squares(
        residuals,
        residuals.start,
        residuals.exact,
        bounds,
        method,
        max_iterations=count,
        x_scale=UNIT,
        searches=searches_of(Estimate.model_validate(settings)),
    )


# On the log scale the thesis' DGN stalls at ac1a_typical after the first iteration: the Jacobian
# becomes singular, and the rounding is enlarged by more and more.
CASES = [
    ("first_order", "dgn", False, 10),
    ("first_order", "dgn", True, 10),
    ("first_order", "lm", False, 20),
    ("first_order", "lm", True, 20),
    ("ac1a_typical", "dgn", False, 10),
    ("ac1a_typical", "dgn", True, 5),
    ("ac1a_typical", "lm", False, 20),
    ("ac1a_typical", "lm", True, 20),
]


def assert_same(result, rows, method):
    for line, (x, counted) in zip(result.history, rows, strict=True):
        assert line.x == pytest.approx(x, rel=SAME, abs=SAME)
        trials = line.inner + (line.step_norm > 0.0)
        assert (line.inner if method == "dgn" else trials) == counted


@pytest.mark.parametrize(("name", "method", "logarithmic", "count"), few_of(CASES, 4))
def test_goes_from_iterate_to_iterate_as_the_thesis_says(name, method, logarithmic, count):
    residuals = residuals_of(name, logarithmic)
    result = searched(residuals, method, count)
    typed_again = damped_gauss_newton if method == "dgn" else levenberg_marquardt
    rows = typed_again(residuals, residuals.exact, residuals.start, result.nit)
    assert result.nit >= 5
    assert_same(result, rows, method)


def test_armijos_constant_decides_how_often_a_step_is_halved():
    residuals, alpha = residuals_of("ac1a_typical", logarithmic=False), 0.4
    result = searched(residuals, "dgn", 5, {**LITERAL, "armijo": alpha})
    rows = damped_gauss_newton(residuals, residuals.exact, residuals.start, result.nit, alpha=alpha)
    assert_same(result, rows, "dgn")
    usual = searched(residuals, "dgn", 5)
    assert [line.inner for line in result.history] != [line.inner for line in usual.history]


def test_the_damping_starts_and_changes_as_it_is_told():
    residuals = residuals_of("ac1a_typical", logarithmic=True)
    searches = Searches(lm=RatioDamping(0.05, 1e-9, 2.5, 0.2))
    result = least_squares(
        residuals,
        residuals.start,
        residuals.exact,
        method="lm",
        max_iterations=12,
        x_scale=UNIT,
        searches=searches,
    )
    rows = levenberg_marquardt(
        residuals, residuals.exact, residuals.start, result.nit, 0.05, 1e-9, 2.5, 0.2
    )
    assert_same(result, rows, "lm")
    # every rule has its turn: rejected, poor, fair and good trials, and no ratio is at a limit
    ratios = np.array([line.quality for line in result.history[1:]])
    assert max(line.inner for line in result.history) > 1
    assert {*np.digitize(ratios, [0.25, 0.75])} == {0, 1, 2}
    assert np.abs(ratios[:, None] - [0.0, 0.25, 0.75]).min() > 0.05


def test_within_bounds_the_direction_is_the_best_that_they_allow():
    residuals = residuals_of("ac1a_typical", logarithmic=True)
    direction = partial(within, bounds=residuals.bounds)
    result = searched(residuals, "dgn", 6, bounds=residuals.bounds)
    rows = damped_gauss_newton(residuals, residuals.exact, residuals.start, result.nit, direction)
    assert_same(result, rows, "dgn")
    assert result.history[1].inner > 0


@pytest.mark.parametrize("seed", [0, 3])
def test_within_bounds_the_damped_step_is_the_best_that_they_allow(seed):
    fun, jac, start, bounds = random_problem(seed)
    settings = searches_of(Estimate.model_validate(LITERAL))
    result = least_squares(
        fun, start, jac, bounds, "lm", max_iterations=6, x_scale=UNIT, searches=settings
    )
    rows = levenberg_marquardt(fun, jac, start, result.nit, bounds=bounds)
    assert_same(result, rows, "lm")
    assert any(((line.x == bounds[0]) | (line.x == bounds[1])).any() for line in result.history)


@pytest.mark.parametrize(
    ("ratio", "after"),
    [(0.0, 2.0), (0.249, 2.0), (0.25, 1.0), (0.75, 1.0), (0.751, 0.5)],
)
def test_the_damping_follows_the_ratio(ratio, after):
    assert RatioDamping().after(1.0, ratio) == after
    assert RatioDamping(least=0.8).after(1.0, ratio) == (0.0 if after < 0.8 else after)
    assert RatioDamping(least=3.0).after(1.0, ratio) == {2.0: 3.0, 1.0: 1.0, 0.5: 0.0}[after]


@pytest.mark.parametrize(("slope", "accepted"), [(1e-3, True), (-1e-3, False)])
def test_a_trial_that_lowers_the_cost_at_all_is_accepted(slope, accepted):
    """The Jacobian promises a thousand times as much, or the decrease of what rises."""
    result = least_squares(
        lambda x: [1.0 + slope * x[0]],
        [0.0],
        lambda x: [[1.0]],
        method="lm",
        max_iterations=1,
        searches=Searches(lm=RatioDamping()),
    )
    assert (result.history[1].inner == 0) == accepted


METHODS = [("dgn", LITERAL), ("lm", LITERAL), ("lm", ARMIJO)]


@pytest.mark.parametrize(("method", "settings"), METHODS)
@pytest.mark.parametrize("seed", few_of(range(12), 4))
def test_active_bounds_cost_no_more_than_scipy_finds(seed, method, settings):
    fun, jac, start, bounds = random_problem(seed)
    points = []

    def watched(x):
        points.append(x)
        return fun(x)

    searches = searches_of(Estimate.model_validate(settings))
    result = least_squares(watched, start, jac, bounds, method, searches=searches)
    other = scipy_least_squares(fun, start, jac, bounds, ftol=1e-14, xtol=1e-14, gtol=1e-14)
    assert result.success, result.message
    assert result.cost <= other.cost * (1.0 + 1e-8)
    assert all((bounds[0] <= x).all() and (x <= bounds[1]).all() for x in points)


NAMES = ("Misra1a", "MGH09", "Eckerle4", "BoxBOD", "Thurber")
SMALL = NAMES[:3]  # residuals: with others nu = |g| is large, and steps are short


@pytest.mark.parametrize(
    ("name", "method", "settings"),
    [
        *((name, method, LITERAL) for name in NAMES for method in ("dgn", "lm")),
        *((name, "lm", ARMIJO) for name in SMALL),
    ],
)
def test_finds_the_certified_minimum(name, method, settings):
    case = CERTIFIED[name]
    searches = searches_of(Estimate.model_validate(settings))
    result = least_squares(case.fun, case.starts[-1], case.jac, method=method, searches=searches)
    assert result.success, result.message
    assert 2.0 * result.cost == pytest.approx(case.squares, rel=1e-7)
