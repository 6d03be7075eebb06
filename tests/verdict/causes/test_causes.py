"""The likeliest causes of a poor fit: faults made on purpose are named."""

import pytest
from faulty_cases import KINDS, WORDS, cause_rank, drawn

from exfit.errors import RecordError
from exfit.records.record import Record
from exfit.verdict.causes import channels
from exfit.workflows import fit

LINES = 2  # in which the cause stands
COARSE, STATIC = (15, 1, 7), (16, 1, 7)  # seeds: AC8B every 20 ms, ST1A with efd


@pytest.mark.long
@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        ("step off by 20 %", COARSE),
        pytest.param("spikes", COARSE, marks=pytest.mark.long),
        ("limit not of the unit", COARSE),
        pytest.param("ripple", STATIC, marks=pytest.mark.long),
        pytest.param("Tpd0", STATIC, marks=pytest.mark.long),
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


@pytest.mark.parametrize(
    ("measured", "matched", "suspected"),
    [(1.0, 0.9565, False), (0.99, 1.02, False), (0.92, 1.0, True), (1.732, 1.01, True)],
)
def test_a_base_is_suspected_only_if_it_brings_vt_nearer_to_rated(measured, matched, suspected):
    assert channels.nearer_to_rated((measured, measured), matched) == suspected


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


@pytest.mark.long
def test_a_drift_is_named_with_its_sign():
    fault = drawn("drift", (2026, 16, 7))  # -1.0e-3 pu, ten times the noise
    first = fit(fault.faulty, search="local").verdict.causes[0].cause
    assert first.startswith("a drift of vt: -")
