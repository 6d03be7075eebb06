"""Values given in place of those of a case: what the fit starts from, and what the result says."""

import numpy as np
import pytest
from cases import FIRST_ORDER, TIME, TRUTH

import exfit
from exfit.errors import CaseError
from exfit.workflows.given_values import read_parameters, with_given_values

BACKGROUND = 1e-3 * np.random.default_rng(1).standard_normal(len(TIME))


def case(**sections):
    """Return a first-order system with a record of k = 4 and a = 2."""
    record = exfit.Record.from_arrays(TIME, {"vt": TRUTH + BACKGROUND})
    return exfit.Case.from_dict({**FIRST_ORDER, **sections}, record)


def test_a_fit_starts_from_the_values_given_and_says_that_these_are_not_the_cases():
    result = exfit.fit(case(), values={"k": 30.0, "a": 1.0})
    assert result.parameters["k"].start == 30.0
    assert result.history[0].values["k"] == pytest.approx(30.0, rel=1e-12)  # exp(log(30))
    changed = result.given_values["k"]
    assert (changed.value, changed.in_case, changed.start, changed.source) == (
        30.0,
        1.0,
        True,
        "values",
    )
    assert "a" not in result.given_values  # as the case has it
    assert any("starts from k 30 (case: 1), given by values" in note for note in result.notes)


def test_a_fit_without_given_values_says_nothing_of_them():
    result = exfit.fit(case(), values={"k": 1.0})
    assert result.given_values == {}
    assert not any("given by" in note for note in result.notes)


def test_the_result_of_a_fit_is_a_start_for_another():
    first = exfit.fit(case())
    second = exfit.fit(case(), values=first)
    start = {name: parameter.start for name, parameter in second.parameters.items()}
    assert start == {name: parameter.value for name, parameter in first.parameters.items()}
    assert second.start_cost == pytest.approx(first.cost, rel=1e-9)


def test_a_result_of_another_model_is_refused():
    other = {"free": {"Tpd0": {"start": 6.0, "min": 2.0, "max": 9.0}}}
    machine = {
        "plant": {"type": "machine-playback", "machine": "ONE_AXIS", **other},
        "test": {"vt0": 1.0, "steady_until": 0.5},
        "record": {"file": "x.csv", "time": "t", "channels": {"vt": "v", "efd": "e"}},
    }
    target = exfit.Case.from_dict(machine)
    with pytest.raises(CaseError, match=r"values: model: FIRST_ORDER, but .* has ONE_AXIS"):
        exfit.fit(target, values=exfit.fit(case()))


def test_a_start_out_of_its_bounds_is_refused_with_value_and_limits():
    with pytest.raises(CaseError, match=r"values: k: 200 lies outside its bounds 0\.1 \.\.\. 100"):
        exfit.fit(case(), values={"k": 200.0})


def test_a_fixed_value_replaces_that_of_the_case_and_all_that_follows_it():
    """a = 2 k is fitted with k fixed beside a helper; then the helper is given another value."""
    tied = case(
        parameters={
            "fixed": {"k": "=2*half"},
            "free": {
                "a": FIRST_ORDER["parameters"]["free"]["a"],
                "half": {"start": 1.0, "min": 0.1, "max": 10.0},
            },
        }
    )
    changed = with_given_values(tied, {"half": 3.0}, "--set")
    assert changed.values()["k"] == 6.0
    freed = with_given_values(tied, {"k": 5.0}, "--set")
    assert freed.values()["k"] == 5.0
    assert not freed.ties.by_name
    assert freed.given_values["k"].before == 2.0


def test_a_value_that_was_typical_is_given_then():
    plain = case(parameters={"free": {"k": FIRST_ORDER["parameters"]["free"]["k"]}})
    assert plain.typical() == ("a",)
    result = exfit.fit(plain, values={"a": 2.5})
    assert result.typical == ()
    assert result.fixed["a"] == 2.5
    assert any("takes a 2.5 (case: 2), given by values" in note for note in result.notes)


def test_what_a_fit_finds_about_a_record_may_start_elsewhere():
    instant = {"start": 0.5, "min": 0.3, "max": 0.8}
    unknown = case(test={"vt0": 0.0, "vref": [{"at": instant, "step": 1.0}]})
    result = exfit.fit(unknown, values={"vref.at": 0.6})
    assert result.parameters["vref.at"].start == result.history[0].values["vref.at"] == 0.6
    assert result.given_values["vref.at"].start
    with pytest.raises(CaseError, match=r"values: vref\.at: 0\.9 lies outside its bounds 0\.3"):
        exfit.fit(unknown, values={"vref.at": 0.9})


def test_the_latest_value_counts_and_the_cases_own_is_remembered():
    twice = with_given_values(with_given_values(case(), {"k": 2.0}, "first"), {"k": 3.0}, "second")
    assert twice.values()["k"] == 3.0
    assert twice.given_values["k"] == (3.0, 1.0, "second")


def test_the_result_of_a_fit_is_not_read_for_its_parameters(tmp_path):
    """Of any size: a large one holds more values than YAML is read of."""
    result = tmp_path / "result.json"
    result.write_text('{"samples": [' + "1.0, " * 60_000 + "1.0]}")
    for path in (result, tmp_path):
        with pytest.raises(CaseError, match=r"the result of a fit; give the parameters\.yaml"):
            read_parameters(case(), path)
