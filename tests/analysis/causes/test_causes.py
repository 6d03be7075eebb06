"""The likeliest causes of a poor fit: faults made on purpose are named."""

import pytest
from faulty_cases import KINDS, WORDS, cause_rank, drawn

from exfit.errors import RecordError
from exfit.records.record import Record
from exfit.workflows import fit

SEED = 14
LINES = 2  # in which the cause stands


@pytest.mark.parametrize(
    "kind",
    ["sign of the step", "step off by 20 %", "base of ifd", "vt0", "ripple", "spikes", "Tpd0",
     "limit not of the unit"],
)  # fmt: skip
def test_a_fault_is_among_the_likeliest_causes(kind):
    fault = drawn(kind, (SEED, 1))
    verdict = fit(fault.faulty, search="local").verdict
    assert cause_rank(KINDS[kind].causes, verdict.causes[:LINES]), verdict.causes
    assert verdict.verdict != "good"


def test_a_case_without_a_fault_has_no_cause():
    verdict = fit(drawn("ripple", (SEED, 1)).sound, search="local").verdict
    assert verdict.verdict == "good"
    assert verdict.causes == ()


def test_every_cause_of_the_study_has_its_words():
    assert {cause for kind in KINDS.values() for cause in kind.causes} == WORDS.keys()


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_time_column_in_another_unit_is_asked_for(factor):
    """Before a fit, which would simulate for hours or has no step in its record."""
    case = drawn("ripple", (SEED, 1)).sound
    (record,) = case.given_records.values()
    other = Record.from_arrays(factor * record.time, record.signals)
    with pytest.raises(RecordError, match=r"is the time column in another unit\?"):
        fit(case.with_record(other))
