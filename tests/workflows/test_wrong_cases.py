"""Cases in which something is wrong: a few of the 400 of tests/studies/wrong_cases.py."""

import pytest
from planted_cases import Task, cause_line, drawn
from truths import holds

from exfit.results.verdict import GOOD
from exfit.workflows import fit

LINES = 2  # in which the cause stands

pytestmark = pytest.mark.long


def holding(result, truth):
    """Return for each interval whose truth is known whether it holds that."""
    intervals = {name: own.interval for name, own in result.parameters.items() if own.interval}
    return {
        name: holds(interval, truth[name]) for name, interval in intervals.items() if name in truth
    }


@pytest.mark.parametrize("unit", ["AC1A", "DC4B"])
def test_a_case_with_certificates_stays_good(unit):
    case = drawn(Task("right", 0, unit, (2026, {"AC1A": 0, "DC4B": 4}[unit])))
    result = fit(case.case)
    assert result.verdict.verdict == GOOD
    held = holding(result, case.truth)
    assert len(held) >= 3
    assert all(held.values()), held


@pytest.mark.parametrize(
    ("level", "unit", "number"), [(0, "EXAC1", 94), (1, "AC1A", 161), (2, "AC8B", 117)]
)
def test_intervals_hold_the_truth_where_four_given_values_are_off(level, unit, number):
    """2 to 5, 5 to 10 and 10 to 15 %: of a case that states no source."""
    case = drawn(Task("values", level, unit, (2026, number)))
    held = holding(fit(case.case), case.truth)
    assert len(held) >= 4
    assert all(held.values()), held


@pytest.mark.parametrize(
    ("kind", "level", "unit", "number"),
    [
        ("base", 1, "EXAC1", 251),
        ("delay", 1, "EXAC1", 311),
        ("ripple", 1, "AC8B", 266),
        ("model", 0, "REXS", 388),
    ],
)
def test_a_fault_is_named_and_not_called_good(kind, level, unit, number):
    case = drawn(Task(kind, level, unit, (2026, number)))
    verdict = fit(case.case).verdict
    assert verdict.verdict != GOOD
    assert 0 < cause_line(case.names, verdict.causes) <= LINES, verdict.causes


@pytest.mark.parametrize(
    ("kind", "level", "unit", "number", "fitted"),
    [
        ("speed", 2, "AC8B", 348, "machine.Tpd0"),
        ("speed", 1, "EXAC1", 344, "machine.Tpd0"),
        ("values", 2, "AC8B", 189, "machine.S10"),
    ],
)
def test_what_a_record_does_not_tell_from_the_value_that_is_fitted_is_named(
    kind, level, unit, number, fitted
):
    """With vt alone a speed is a gain and another saturation: n times the flux, n times efd."""
    case = drawn(Task(kind, level, unit, (92417, number)))
    result = fit(case.case)
    assert fitted in result.parameters
    assert fitted not in case.names
    assert cause_line(case.names, result.verdict.causes) == 1, result.verdict.causes
