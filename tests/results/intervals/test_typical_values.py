"""What typical values move: predicted from derivatives, and found again by fits that have them."""

from dataclasses import replace

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH
from records import config, found_in

from exfit import Record
from exfit.case.case import Case
from exfit.features.report.model import parameters
from exfit.features.report.page import html
from exfit.fitting.search import fitted
from exfit.fitting.system import typical_values_used
from exfit.fitting.uncertainty import uncertainty_at
from exfit.output.blocks import Table
from exfit.results.influences import DEVIATION, by_weight, first_of, moved_parameters
from exfit.results.intervals.value_errors import influence_of_typical_values
from exfit.results.verdict import GOOD, MATCHES
from exfit.workflows import fit

NOISE = 1e-3  # of the response of the smallest model, which ends at 2
FREE = {
    "KA": found_in(766.0, 10.0, 5000.0),
    "TA": found_in(0.02, 0.001, 1.0),
    "TE": found_in(1.3, 0.1, 10.0),
    "KF": found_in(0.024, 0.001, 1.0),
    "TF": found_in(1.0, 0.1, 10.0),
}


def first_order(seed=5, fixed=None, sources=None, **free):
    """Return the smallest case on a noisy record, with some of its parameters free."""
    samples = TRUTH + np.random.default_rng(seed).normal(0.0, NOISE, TIME.size)
    sections = {name: found_in(start, 0.01, 100.0) for name, start in free.items()}
    content = {
        **FIRST_ORDER,
        "parameters": {"free": sections, "fixed": fixed or {}, "sources": sources or {}},
        "record": {"channels": {"vt": "vt"}},
    }
    return Case.from_dict(content, Record.from_arrays(TIME, {"vt": samples}))


@pytest.fixture(scope="module")
def exciter():
    """Return a function that makes the case of the AC1A with other values of its machine.

    KC and KD are fixed: the record then determines all that is free.
    """

    def made(sources=None, **machine):
        content = config("ac1a_typical")
        del content["validate"]
        content["parameters"]["free"] = FREE
        content["parameters"]["fixed"] |= {"KC": 0.486, "KD": 0.36}
        content["plant"]["parameters"] |= machine
        content["plant"]["sources"] = {"Tpd0": "typical"} if sources is None else sources
        content["estimate"] = {"search": "local"}
        return Case.from_dict(content)

    return made


@pytest.fixture(scope="module")
def found(exciter):
    return fit(exciter())


def shares(result, name):
    """Return the predicted shift of each parameter, as a share of its value for 100 % of one."""
    shifts = result.typical_values[name].shifts
    return {key: shift / result.parameters[key].value / DEVIATION for key, shift in shifts.items()}


def half_width(result, name):
    """Return half of a parameter's interval, twice its standard error where it has none."""
    parameter = result.parameters[name]
    if not parameter.determined:
        return 2.0 * parameter.std_error
    low, high = parameter.interval
    return 0.5 * (high - low)


def refitted(exciter, found, relative):
    """Return the values of a fit with another T'd0 from where the first one ended, as shares."""
    start = {name: parameter.value for name, parameter in found.parameters.items()}
    result = fit(exciter(Tpd0=found.machine["Tpd0"] * (1.0 + relative)), values=start)
    return {name: each.value / start[name] for name, each in result.parameters.items()}


def test_the_prediction_is_the_derivative_of_a_fit(exciter, found):
    """Of central differences of two fits: 2 % leaves their curvature, the noise second order."""
    predicted = shares(found, "machine.Tpd0")
    above, below = refitted(exciter, found, 0.02), refitted(exciter, found, -0.02)
    largest = max(map(abs, predicted.values()))
    for name, share in predicted.items():
        slope = (above[name] - below[name]) / 0.04
        assert slope == pytest.approx(share, rel=0.05, abs=0.03 * largest)


def test_a_value_that_is_20_percent_off_moves_a_fit_as_far_as_predicted(exciter, found):
    """To first order: a fifth is no small change; the curvature takes a sixth of that of TE."""
    predicted = shares(found, "machine.Tpd0")
    moved = refitted(exciter, found, DEVIATION)
    weighty = [name for name, share in predicted.items() if abs(share) > 0.5]
    assert weighty == ["TE", "TF"]
    for name in weighty:
        assert (moved[name] - 1.0) / DEVIATION == pytest.approx(predicted[name], rel=0.3)


def test_what_the_response_does_not_depend_on_moves_nothing(found):
    used = {*found.typical_values}
    assert "machine.Tpd0" in used
    assert not {"machine.H", "machine.Xq", "machine.Tpq0"} & used  # they act on load alone
    assert {"machine.H", "machine.Xq"} <= {*found.typical}


def test_a_value_with_a_source_is_none_of_them(exciter):
    assert "machine.Tpd0" not in typical_values_used(exciter(sources={"Tpd0": "maker"}))


def test_it_is_worked_out_in_closed_form():
    """With a larger, the final value k/a is held by a larger k: dk/da = k/a where time is long."""
    result = fit(first_order(fixed={"a": 2.0}, sources={"a": "typical"}, k=1.0))
    a = result.typical_values["a"]
    # Gauss-Newton: the projection of -dv/da on dv/dk, on the samples of the record
    at = np.maximum(TIME - 0.5, 0.0)
    gone = np.exp(-2.0 * at)
    by_k, by_a = (1.0 - gone) / 2.0, 4.0 * (-(1.0 - gone) / 4.0 + at * gone / 2.0)
    slope = -float(by_k @ by_a) / float(by_k @ by_k)
    assert a.value == 2.0
    # the value that was fitted differs from 4 by the noise
    assert a.shifts["k"] == pytest.approx(slope * DEVIATION * 2.0, rel=1e-2)
    low, high = result.parameters["k"].interval
    assert a.matters_to["k"] == pytest.approx(2.0 * a.shifts["k"] / (high - low))


def test_a_tied_value_goes_along():
    tied = fit(first_order(fixed={"k": "=2*a*gain", "a": 2.0}, sources={"a": "typical"}, gain=1.0))
    apart = fit(first_order(fixed={"a": 2.0}, sources={"a": "typical"}, k=1.0))
    # k = 2 a gain: d gain / gain = d k / k - d a / a
    gain, k = (
        result.typical_values["a"].shifts[name] / result.parameters[name].value
        for result, name in ((tied, "gain"), (apart, "k"))
    )
    assert gain == pytest.approx(k - DEVIATION, rel=1e-6)


def test_what_lies_on_a_bound_stays_there():
    case = first_order(fixed={"k": 4.0}, sources={"k": "typical"}, a=5.0)
    above_the_truth = case.parameters.free["a"].model_copy(update={"min": 3.0})
    bounded = case.parameters.model_copy(update={"free": {"a": above_the_truth}})
    result = fit(replace(case, parameters=bounded))
    assert result.parameters["a"].at_bound == "min"
    assert result.typical_values["k"].shifts == {"a": 0.0}
    assert result.typical_values["k"].matters_to == {}


def mattering(result):
    """Return the table of typical values that matter; None where there is none."""
    tables = [block for block in parameters(result) if isinstance(block, Table)]
    return next((each for each in tables if each.title.startswith("Typical values")), None)


@pytest.mark.parametrize("source", ["typical", "nameplate"])
def test_a_fit_is_not_good_while_a_typical_value_matters(source, tmp_path):
    result = fit(first_order(fixed={"a": 2.0}, sources={"a": source}, k=1.0))
    assert result.parameters["k"].determined
    assert result.verdict.verdict == (MATCHES if source == "typical" else GOOD)
    causes = [cause.cause for cause in result.verdict.causes]
    if source == "typical":
        assert result.verdict.reason == "typical values matter: a"
        assert any(cause.startswith("a is typical: if a (2) were 20 % off") for cause in causes)
        ((name, value, moves, _),) = mattering(result).rows
        assert (name.text, value.text) == ("a", "2")
        assert moves.text.startswith("k by ")
        assert f">{moves.text}</td>" in html(result, tmp_path)
    else:
        assert result.typical_values == {}
        assert mattering(result) is None


def test_a_value_that_is_left_out_is_as_typical_as_one_that_is_marked():
    marked = fit(first_order(fixed={"a": 2.0}, sources={"a": "typical"}, k=1.0))
    left_out = fit(first_order(k=1.0))  # the typical value of a is 2
    assert left_out.typical_values == marked.typical_values


def test_what_weighs_most_comes_first(found):
    weights = [max(value.matters_to.values()) for value in by_weight(found.typical_values).values()]
    assert weights == sorted(weights, reverse=True)
    for value in found.typical_values.values():
        assert [*value.matters_to.values()] == sorted(value.matters_to.values(), reverse=True)
        for name, times in value.matters_to.items():
            assert times == pytest.approx(abs(value.shifts[name]) / half_width(found, name))
            assert times > 1.0
    moved = value._replace(
        shifts={"a": 0.5, "b": -3.0, "c": 0.12345}, matters_to=dict.fromkeys("abc")
    )
    fitted_values = {"a": 2.0, "b": 1.0, "c": 0.0}
    assert moved_parameters(moved, fitted_values) == "a by 25 %, b by more than 100 % and c by 0.12"
    assert first_of("ABCD") == "A, B, C and D"
    assert first_of("ABCDE") == "A, B, C and 2 more"


def test_without_an_interval_twice_the_standard_error_counts():
    """KC and KD free: linear theory does not hold over the intervals, a local fit prints none."""
    content = config("ac1a_typical")
    del content["validate"]
    content["plant"]["sources"] = {"Xppd": "typical"}
    content["estimate"] = {"search": "local"}
    result = fit(Case.from_dict(content))
    (value,) = result.typical_values.values()
    without = [name for name in value.matters_to if not result.parameters[name].determined]
    assert without
    for name, times in value.matters_to.items():
        assert times == pytest.approx(abs(value.shifts[name]) / half_width(result, name))


def test_derivatives_that_are_not_finite_give_nothing(monkeypatch):
    case = first_order(fixed={"a": 2.0}, sources={"a": "typical"}, k=1.0)
    _, problem = fitted(case)
    theta = problem.residuals.start
    uncertainty = uncertainty_at(problem, theta, ())
    assert influence_of_typical_values(case, problem.residuals, theta, uncertainty)
    monkeypatch.setattr(
        "exfit.fitting.residuals.Residuals.exact",
        lambda residuals, theta: np.full((2, len(theta)), np.nan),
    )
    assert influence_of_typical_values(case, problem.residuals, theta, uncertainty) == {}
