"""Given values that a record knows better are fitted with their errors; the others stay."""

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME
from channel_records import three_channels
from records import UNIT, config, found_in

from exfit import Record
from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.results.verdict import GOOD, MATCHES
from exfit.workflows import fit

K, A = 4.0, 2.0
NOISE = 1e-3  # of the response, which ends at 2


def response(a):
    return K * -np.expm1(-a * np.maximum(TIME - 0.5, 0.0)) / a


def first_order(true_a, size=1.0, seed=5, **sections):
    """Return the smallest case on a record of another a, or another size of the step."""
    samples = size * response(true_a) + np.random.default_rng(seed).normal(0.0, NOISE, TIME.size)
    content = {
        **FIRST_ORDER,
        "given": "uncertain",
        "parameters": {"free": {"k": found_in(K, 0.1, 100.0)}, "fixed": {"a": A}},
        "record": {"channels": {"vt": "vt"}},
        **sections,
    }
    return Case.from_dict(content, Record.from_arrays(TIME, {"vt": samples}))


@pytest.mark.parametrize("share", [-0.15, 0.1, 0.2])
def test_a_value_that_the_record_knows_better_is_found(share):
    """The setting a, given without a source, has an error of 10 %."""
    result = fit(first_order(A * (1.0 + share)))
    a, k = result.parameters["a"], result.parameters["k"]
    for parameter, truth in ((a, A * (1.0 + share)), (k, K)):
        low, high = parameter.interval
        assert abs(parameter.value - truth) < high - low < 0.02 * truth
    assert (a.start, a.given_error) == (A, 0.1 * A)
    assert a.moved == pytest.approx(10.0 * share, abs=0.1)
    assert result.verdict.verdict == GOOD


def test_a_value_that_lies_far_beyond_its_error_is_refuted():
    result = fit(first_order(1.5 * A))
    assert result.verdict.verdict == MATCHES
    assert result.verdict.reason == "the record contradicts a = 2"
    assert result.verdict.causes[0].cause.startswith("a is 2.99")
    assert result.parameters["a"].interval[0] < 1.5 * A < result.parameters["a"].interval[1]


def test_a_value_that_the_record_bears_out_stays_as_it_is():
    result = fit(first_order(A))
    assert [*result.parameters] == ["k"]
    assert result.fixed["a"] == A
    assert result.verdict.verdict == GOOD


def test_exact_values_stay_as_they_are():
    result = fit(first_order(1.1 * A), given="exact")
    assert [*result.parameters] == ["k"]
    assert result.knowledge.given_errors == {}
    assert result.parameters["k"].noise_interval is None


def test_what_the_test_explains_better_moves_no_value():
    """With k tied, no parameter makes up for the size of the step."""
    free, tied = {"a": found_in(A, 0.1, 100.0)}, {"k": 4.0}
    parameters = {"free": free, "fixed": tied, "std_errors": {"k": 0.004}}
    result = fit(first_order(A, size=1.1, parameters=parameters))
    assert [*result.parameters] == ["a"]
    assert "k = 4" not in result.verdict.reason
    assert result.verdict.causes[0].cause.startswith(("the size of the step", "the base of vt"))


def test_values_that_explain_a_record_together_are_fitted_in_place_of_a_base():
    """Another base of efd would explain more than each of them, but not more than all."""
    case = three_channels(weights="balanced", noise={"vt": 1e-4, "efd": 2e-2})
    data = {f"machine.{name}": case.values()[f"machine.{name}"] for name in ("S10", "S12", "Tpd0")}
    off = dict(zip(data, (0.75, 1.3, 0.85), strict=True))  # each by one of its errors
    values = {name: value / off[name] for name, value in data.items()}
    result = fit(case, given="uncertain", values=values)
    assert result.verdict.verdict == GOOD
    truth = UNIT | data
    for name, parameter in result.parameters.items():
        low, high = parameter.interval
        assert low < truth[name] < high, name
    assert data.keys() <= result.parameters.keys()
    named = [cause.cause for cause in result.verdict.causes]
    assert any("or as likely the base of efd" in cause for cause in named)


@pytest.mark.long
def test_values_of_a_machine_are_refined_and_the_intervals_hold_the_truth():
    """AC1A, whose T'd0 is given 12 % too low: the record was made with 6 s."""
    content = config("ac1a_typical")
    del content["validate"]
    content["given"] = "uncertain"
    content["plant"]["parameters"]["Tpd0"] = 5.3
    content["plant"]["sources"] = dict.fromkeys(content["plant"]["parameters"], "measured")
    del content["plant"]["sources"]["Tpd0"]
    content["parameters"]["sources"] = dict.fromkeys(content["parameters"]["fixed"], "measured")
    case = Case.from_dict(content)
    assert "machine.Tpd0" in given_std_errors(case)
    truth = fit(case, given="exact", values={"machine.Tpd0": 6.0})
    result = fit(case)
    for name, parameter in truth.parameters.items():
        found = result.parameters[name]
        if found.determined:
            assert found.interval[0] < parameter.value < found.interval[1]
