"""The methods of the thesis, typed here a second time as its chapter 3 states them."""

from dataclasses import replace

import numpy as np
import pytest
from places import CONFIGS
from scipy.optimize import lsq_linear

from exfit.case.load import load_case
from exfit.case.schema import Estimate
from exfit.estimate import least_squares
from exfit.fitting.search import UNIT, fitted, searches_of

LITERAL = {"dgn": {"step": "full", "cut": "half"}, "lm": {"update": "ratio"}}
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


def levenberg_marquardt(fun, jac, x, count, nu=None, least=1e-3, up=2.0, down=0.5):
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
            s = np.linalg.lstsq(np.vstack([jacobian, rows_of_nu]), -both, rcond=None)[0]
            ratio = (f - fun(x + s) @ fun(x + s) / 2) / (-(gradient @ s) / 2)
            nu = max(up * nu, least) if ratio < 0.25 else nu
            trials += 1
        if ratio > 0.75:
            nu = down * nu if down * nu >= least else 0.0
        x = x + s
        rows.append((x, trials))
    return rows


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


@pytest.mark.parametrize(("name", "method", "logarithmic", "count"), CASES)
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
    lm = {"update": "ratio", "nu": 0.05, "nu_min": 1e-9, "increase": 2.5, "decrease": 0.2}
    result = searched(residuals, "lm", 12, {"lm": lm})
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
    low, high = residuals.bounds

    def within(jacobian, r, x):
        return lsq_linear(jacobian, -r, (low - x, high - x), method="bvls", tol=1e-15).x

    result = searched(residuals, "dgn", 6, bounds=(low, high))
    rows = damped_gauss_newton(residuals, residuals.exact, residuals.start, result.nit, within)
    assert_same(result, rows, "dgn")
    assert result.history[1].inner > 0
