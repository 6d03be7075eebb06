"""The likeliest causes of a poor fit: faults made on purpose are named."""

import pytest
from faulty_cases import KINDS, WORDS, cause_rank, drawn
from records import TEST, TIME, case_of, one, synthetic

from exfit.errors import RecordError
from exfit.records.record import Record
from exfit.workflows import fit

LINES = 2  # in which the cause stands
COARSE, STATIC = (15, 1, 7), (16, 1, 7)  # seeds: AC8B every 20 ms, ST1A with efd


@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("step off by 20 %", COARSE),
        ("spikes", COARSE),
        ("limit not of the unit", COARSE),
        ("ripple", STATIC),
        ("Tpd0", STATIC),
        ("sign of the step", STATIC),
    ],
)
def test_a_fault_is_among_the_likeliest_causes(kind, seed):
    fault = drawn(kind, seed)
    verdict = fit(fault.faulty, search="local").verdict
    assert cause_rank(KINDS[kind].causes, verdict.causes[:LINES]), verdict.causes
    assert verdict.verdict != "good"


def test_a_case_without_a_fault_has_no_cause():
    verdict = fit(drawn("ripple", STATIC).sound, search="local").verdict
    assert verdict.verdict == "good"
    assert verdict.causes == ()


def test_no_base_is_suspected_that_would_bring_vt_farther_from_rated(tmp_path):
    """Of a step that the case has a fifth too small, from 1 pu: it looks like another base."""
    synthetic(tmp_path, TEST, TIME)
    case = case_of(one({"vref": [{"at": 1.0, "step": 0.04}]}, free=["KA", "TE"]), tmp_path)
    causes = [each.cause for each in fit(case, search="local").verdict.causes]
    assert any("size of the step" in cause for cause in causes)
    assert not any("base of vt" in cause for cause in causes)


def test_every_cause_of_the_study_has_its_words():
    assert {cause for kind in KINDS.values() for cause in kind.causes} == WORDS.keys()


@pytest.mark.parametrize("factor", [1e-3, 1e3])
def test_a_time_column_in_another_unit_is_asked_for(factor):
    """Before a fit, which would simulate for hours or has no step in its record."""
    case = drawn("ripple", STATIC).sound
    (record,) = case.given_records.values()
    other = Record.from_arrays(factor * record.time, record.signals)
    with pytest.raises(RecordError, match=r"is the time column in another unit\?"):
        fit(case.with_record(other))
