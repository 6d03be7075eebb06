"""Intervals that allow for the errors of given values: they hold the truth as often as they say."""

from dataclasses import replace

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH
from records import found_in

from exfit import Record
from exfit.case.case import Case
from exfit.fitting.search import fitted
from exfit.fitting.uncertainty import GivenError, uncertainty_at
from exfit.results.intervals.many_values import LARGER, beyond_linear, errors_beyond_linear
from exfit.results.intervals.value_errors import (
    ErrorsOfValues,
    allowing_for,
    errors_of_values,
    influence_of_values,
)
from exfit.results.io import load_result, result_text
from exfit.workflows import fit

K, A = 4.0, 2.0  # those of TRUTH
NOISE = 0.05  # of the response, which ends at 2: moves k by 0.016
A_ERROR = 0.02  # moves k by twice that
DRAWS = 4000  # 95 % of them is known to 0.35 %
Z = 1.96  # of a normal error at 95 %


def first_order(a=A, std_errors=None, seed=5, start=K, low=0.1, high=100.0, fixed=None):
    """Return the smallest case on a noisy record, with k free on the linear scale and a given."""
    samples = TRUTH + np.random.default_rng(seed).normal(0.0, NOISE, TIME.size)
    parameters = {
        "free": {"k": found_in(start, low, high) | {"scale": "linear"}},
        "fixed": fixed or {"a": a},
        "std_errors": std_errors or {},
    }
    channels = {"vt": {"column": "vt", "noise": NOISE}}
    content = {**FIRST_ORDER, "parameters": parameters, "record": {"channels": channels}}
    return Case.from_dict(content, Record.from_arrays(TIME, {"vt": samples}))


def minimum(case):
    """Return the problem of a case and its minimum: the response is linear in k."""
    _, problem = fitted(case)
    residuals, start = problem.residuals, problem.residuals.start
    return problem, start + np.linalg.lstsq(residuals.exact(start), -residuals(start))[0]


def uncertainties(case):
    """Return the uncertainty at the minimum by the record alone, and with the errors given."""
    problem, theta = minimum(case)
    alone = uncertainty_at(problem, theta, ())
    errors = errors_of_values(case, problem, theta, alone.confidence.noise)
    return alone, allowing_for(errors, alone, problem, theta, ())


def half_width(uncertainty):
    low, high = uncertainty.confidence.parameters["k"].interval
    return 0.5 * (high - low)


def estimates_of_k(records, a, error):
    """Return what least squares gives for k (DRAWS,), and half of its interval with a's error.

    By the closed form of the response, k times its shape: that of a given a, whose derivative by a
    tells how much of the error the record (DRAWS, M) leaves, and about where.
    """
    gone = np.exp(-a * np.maximum(TIME - 0.5, 0.0))
    shape = (1.0 - gone) / a
    size = np.sum(shape**2)
    k = records @ shape / size
    by_a = -shape / a + np.maximum(TIME - 0.5, 0.0) * gone / a
    moved = -(by_a @ shape) / size * k * error  # of k, by one error of a
    beyond = (k * error)[:, None] * (by_a - (by_a @ shape) / size * shape) / NOISE
    left = (records - k[:, None] * shape) / NOISE
    information = 1.0 + np.sum(beyond**2, axis=1)
    mean = np.sum(beyond * left, axis=1) / information
    given = np.hypot(moved / np.sqrt(information), moved * mean)
    return k, Z * np.hypot(NOISE / np.sqrt(size), given)


def records_of(a, seed=7):
    """Return records (DRAWS, M) with noise, of k and each of a (DRAWS,)."""
    late = np.maximum(TIME - 0.5, 0.0)
    responses = K * -np.expm1(-a[:, None] * late) / a[:, None]
    return responses + np.random.default_rng(seed).normal(0.0, NOISE, responses.shape)


@pytest.mark.parametrize("error", [A_ERROR, 10.0 * A_ERROR])
def test_the_intervals_hold_the_truth_where_a_given_value_is_wrong_by_its_error(error):
    """Within three standard deviations of the share of the draws, and what the first order takes.

    The larger error is one that the record knows better: the interval is narrower than without, and
    holds the truth more often, as the shift that the record shows counts on both sides.
    """
    a = A + error * np.random.default_rng(3).standard_normal(DRAWS)
    k, half = estimates_of_k(records_of(a), A, error)
    assert 0.935 < np.mean(np.abs(k - K) <= half) < 0.99
    alone, _ = uncertainties(first_order())
    assert np.mean(np.abs(k - K) <= half_width(alone)) < 0.75


@pytest.mark.parametrize("error", [A_ERROR, 10.0 * A_ERROR])
def test_the_intervals_are_those_of_the_closed_form(error):
    case = first_order(std_errors={"a": error})
    _, wider = uncertainties(case)
    record = TRUTH + np.random.default_rng(5).normal(0.0, NOISE, TIME.size)
    _, half = estimates_of_k(record[None, :], A, error)
    assert half_width(wider) == pytest.approx(half[0], rel=0.02)  # its noise is estimated


def test_a_value_moves_a_parameter_by_the_derivative_of_the_minimum():
    """But for second derivatives times the noise: 0.2 % here, by central differences."""
    problem, theta = minimum(first_order())
    influence = influence_of_values(problem.compressed, theta, {"a": A_ERROR})
    (_, above), (_, below) = (minimum(first_order(A + d)) for d in (1e-3, -1e-3))
    width = 100.0 - 0.1  # k is scaled by it
    shift = A_ERROR * width * float(above[0] - below[0]) / 2e-3
    assert float(influence.shifts[0, 0]) == pytest.approx(shift, rel=0.01)


def test_what_lies_on_a_bound_moves_as_if_it_were_let_go():
    problem, _ = minimum(first_order(start=7.0, low=6.0))
    low, _ = problem.residuals.bounds
    influence = influence_of_values(problem.compressed, low, {"a": A_ERROR})
    assert influence.shifts != 0.0
    assert not influence.moving.any()


def test_a_value_that_others_follow_carries_its_error_on():
    """With a = b^2/2 the error of b counts by da/db = b = 2."""
    _, direct = uncertainties(first_order(std_errors={"a": A_ERROR}))
    fixed = {"a": "=b*b/2", "b": 2.0}
    _, tied = uncertainties(first_order(fixed=fixed, std_errors={"b": A_ERROR / 2.0}))
    assert half_width(tied) == pytest.approx(half_width(direct), rel=1e-9)


def test_without_errors_of_values_nothing_changes():
    alone, same = uncertainties(first_order())
    assert same is alone
    assert fit(first_order()).knowledge.given_errors == {}


def widened(uncertainty, interval, shift, case, method="profile"):
    """Return what is known of k with another interval, widened by an error that moves k."""
    problem, theta = minimum(case)
    own = uncertainty.confidence.parameters["k"]._replace(interval=interval, method=method)
    confidence = replace(uncertainty.confidence, parameters={"k": own})
    errors = ErrorsOfValues({"a": GivenError(A_ERROR, {"k": shift})}, {"k": shift})
    changed = replace(uncertainty, confidence=confidence)
    return allowing_for(errors, changed, problem, theta, ()).confidence.parameters["k"]


def test_each_side_is_widened_by_itself_within_the_bounds_and_an_open_one_stays_open():
    case = first_order(low=3.0, high=4.1)
    alone, _ = uncertainties(case)
    value = fit(case).parameters["k"].value
    shift = 0.05
    low, high = widened(alone, (value - 0.2, None), shift, case).interval
    assert value - low == pytest.approx(np.hypot(0.2, Z * shift), rel=1e-4)
    assert high is None
    low, high = widened(alone, (value - 0.01, value + 0.02), 0.4, case).interval
    assert high == 4.1  # the bound
    assert value - low == pytest.approx(np.hypot(0.01, Z * 0.4), rel=1e-4)


def test_a_parameter_that_an_error_moves_by_30_percent_is_not_determined():
    case = first_order()
    alone, _ = uncertainties(case)
    value = fit(case).parameters["k"].value
    for method in ("linear", "profile"):
        near = widened(alone, (value - 0.1, value + 0.1), 0.29 * value, case, method)
        assert near.determined
        far = widened(alone, (value - 0.1, value + 0.1), 0.31 * value, case, method)
        assert far.interval is None
        assert "is not determined for the errors of a: standard error 31 %" in far.why


def test_derivatives_that_are_not_finite_leave_no_interval(monkeypatch):
    case = first_order(std_errors={"a": A_ERROR})
    problem, theta = minimum(case)
    alone = uncertainty_at(problem, theta, ())
    monkeypatch.setattr(
        "exfit.results.intervals.value_errors.influence_of_values", lambda *_, **__: None
    )
    errors = errors_of_values(case, problem, theta, alone.confidence.noise)
    none = allowing_for(errors, alone, problem, theta, ()).confidence.parameters["k"]
    assert none.interval is None
    assert "no finite derivatives by a" in none.why


def test_a_fit_says_for_which_errors_it_allows_and_keeps_them(tmp_path):
    result = fit(first_order(std_errors={"a": A_ERROR}))
    (note,) = (note for note in result.notes if note.startswith("the intervals include"))
    assert note.startswith("the intervals include the errors of a (given): that of k is 2.")
    assert result.parameters["k"].noise_interval is not None
    (tmp_path / "result.json").write_text(result_text(result), encoding="utf-8")
    read = load_result(tmp_path / "result.json")
    assert read.knowledge.given_errors == result.knowledge.given_errors
    assert read.parameters["k"].interval == result.parameters["k"].interval


def test_errors_of_many_values_are_larger_than_by_linear_theory_on_both_sides():
    case = first_order()
    problem, theta = minimum(case)
    values = problem.residuals.values(theta)
    uncertainty = uncertainty_at(problem, theta, ())
    own = uncertainty.confidence.parameters["k"]
    larger = beyond_linear(uncertainty, problem.residuals, values).confidence.parameters["k"]
    at = values["k"]
    assert larger.std_error == pytest.approx(LARGER * own.std_error)
    assert [end - at for end in larger.interval] == pytest.approx(
        [LARGER * (end - at) for end in own.interval]
    )
    assert larger.by_noise == own.interval
    errors = ErrorsOfValues({}, {}, sides={"a": (1.0, 2.0)}, left={"a": 0.5})
    errors = errors_beyond_linear(errors)
    assert errors.sides["a"] == pytest.approx((LARGER, 2.0 * LARGER))
    assert errors.left["a"] == pytest.approx(0.5 * LARGER)
