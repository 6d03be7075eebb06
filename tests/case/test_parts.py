"""How far a fit may move a parameter, and what it holds at zero."""

from math import inf

import numpy as np
import pytest
from records import case_of, config

from exfit.case.parts import is_held, search_bounds
from exfit.errors import CaseError
from exfit.fitting.problem import free_parameters
from exfit.models import MODELS
from exfit.models.blocks import SHORTEST
from exfit.workflows import check, fit
from exfit.workflows.given_values import with_given_values

ROWS = {row.symbol: row for row in MODELS["AC1A"].sheet}


@pytest.mark.parametrize(
    ("name", "bounds"),
    [
        ("KA", (0.01, inf)),
        ("KD", (-inf, inf)),
        ("TE", (0.01, inf)),
        ("TA", (SHORTEST, inf)),
        ("VRMAX", (-9999.0, 9999.0)),
        ("SE1", (0.0, 1000.0)),
    ],
)
def test_a_missing_bound_is_the_limit_of_the_equations(name, bounds):
    assert search_bounds(None, None, ROWS[name]) == bounds
    assert search_bounds(1.0, None, ROWS[name]) == (1.0, bounds[1])
    assert search_bounds(None, 2.0, ROWS[name]) == (bounds[0], 2.0)
    assert search_bounds(None, None, None) == (-inf, inf)


def test_only_a_block_that_can_be_bypassed_is_held():
    held = [symbol for symbol, row in ROWS.items() if is_held(0.0, row)]
    assert held == ["TR", "TB", "TC", "TA"]
    assert not is_held(SHORTEST, ROWS["TA"])
    assert not is_held(None, ROWS["TA"])
    assert not is_held(0.0, None)


def ac8b(folder, time, scale=None):
    """Return the case of the thesis' AC8B, in which TA is as given: fixed, or a section of free."""
    content = config("ac8b_unit1")
    content["parameters"]["free"] = {
        name: content["parameters"]["free"][name] for name in ("KPR", "TE")
    }
    kind = "free" if isinstance(time, dict) else "fixed"
    del content["parameters"]["fixed"]["TA"]
    content["parameters"][kind]["TA"] = time
    content["parameters"]["fixed"] |= scale or {}
    return case_of(content, folder)


@pytest.mark.parametrize(
    "time",
    [{"start": 0}, {"start": 0, "min": 0, "max": 1}, {"start": 0, "scale": "linear", "max": 1}],
)
def test_a_time_constant_that_starts_from_zero_is_held_there_and_said_to_be(tmp_path, time):
    case = ac8b(tmp_path, time)
    assert case.held() == ("TA",)
    assert list(case.free()) == ["KPR", "TE"]
    assert case.values()["TA"] == 0.0
    (note,) = [note for note in check(case).notes if note.startswith("TA")]
    assert "held at 0 and not fitted" in note


@pytest.mark.long
def test_a_fit_that_holds_it_is_that_of_a_case_which_fixes_it(tmp_path):
    result = fit(ac8b(tmp_path, {"start": 0}))
    assert any(note.startswith("TA = 0") for note in result.notes)
    assert result.fixed["TA"] == 0.0
    fixed = fit(ac8b(tmp_path, 0.0))
    assert dict(result.parameters) == dict(fixed.parameters)


@pytest.mark.parametrize("time", [{"start": 0}, {"start": 0, "min": 0, "max": 1}])
def test_a_start_given_beside_the_case_frees_it_where_its_block_acts(tmp_path, time):
    case = with_given_values(ac8b(tmp_path, time), {"TA": 0.01}, "--set")
    assert case.held() == ()
    parameter = {free.name: free for free in free_parameters(case)}["TA"]
    assert (parameter.start, parameter.low) == (0.01, SHORTEST)
    assert np.isfinite(parameter.scaled(parameter.low))
    with pytest.raises(CaseError, match="TA: 5e-05 lies outside its bounds"):
        with_given_values(case, {"TA": 5e-5}, "--set")


def test_what_follows_a_held_time_follows_zero(tmp_path):
    values = ac8b(tmp_path, {"start": 0}, {"TR": "=0.5*TA"}).values()
    assert values["TR"] == values["TA"] == 0.0


@pytest.mark.parametrize(
    ("name", "section", "text"),
    [
        ("TA", {"start": 0, "min": 0.001, "max": 0.1}, "0 lies outside its bounds"),
        ("TA", {"start": 0.02, "min": 0, "max": 1, "scale": "linear"}, "must not cross it"),
        ("TE", {"start": 0}, r"0 is below 0\.01 s"),
        ("KPR", {"start": 0, "min": 0, "max": 1}, "0 is not above 0"),
    ],
)
def test_no_other_zero_is_held(tmp_path, name, section, text):
    content = config("ac8b_unit1")
    content["parameters"]["fixed"].pop(name, None)
    content["parameters"]["free"][name] = section
    with pytest.raises(CaseError, match=text):
        case_of(content, tmp_path)
