"""The criteria of a report: what meets them, what misses them, what the noise leaves open."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from exfit.dsp.features import features
from exfit.results.comparisons import Comparison, Overlay, PlayedRecord, StepFeatures, match_of
from exfit.results.criteria import judged_by_criteria
from exfit.util.vocabulary import Criteria

TIME = np.arange(0.0, 10.0, 0.01)
STEP = 0.05  # pu, at 1 s


def response(frequency=1.0, damping=0.4, size=STEP):
    """Return vt of a second-order system after a step; its overshoot is 25 % by default."""
    t = np.maximum(TIME - 1.0, 0.0)
    omega = 2.0 * np.pi * frequency
    own = omega * np.sqrt(1.0 - damping**2)
    decay = np.exp(-damping * omega * t)
    swing = np.cos(own * t) + damping * omega / own * np.sin(own * t)
    return 1.0 + size * (1.0 - decay * swing)


def comparison(simulated, errors=(), name="up", **entries):
    """Return a simulated response beside the record of the default one."""
    measured = response()
    overlay = Overlay(measured, simulated)
    of_record = replace(features(TIME, measured, 1.0, 10.0), errors=dict(errors))
    return Comparison(
        name=name,
        record="up.csv",
        cost=0.0,
        accepted=True,
        channels={"vt": match_of(overlay)},
        features=StepFeatures(of_record, features(TIME, simulated, 1.0, 10.0)),
        time=TIME,
        overlays={"vt": overlay},
        **entries,
    )


def judged(*matches, validation=(), criteria=None):
    return judged_by_criteria(
        SimpleNamespace(comparisons=matches, validation=validation, criteria=criteria or Criteria())
    )


def by_label(verdict):
    return {criterion.label: criterion for criterion in verdict.criteria}


def test_of_a_grid_event_p_and_q_are_judged_and_no_feature_of_a_step():
    p, q = Overlay(response(), response(damping=0.1)), Overlay(response(), response())
    overlays = {"p": p, "q": q, "efd": q}
    event = replace(
        comparison(response()),
        channels={name: match_of(overlay) for name, overlay in overlays.items()},
        features=StepFeatures(None, None),
        overlays=overlays,
        played=PlayedRecord(1.0, {}, {}),
    )
    met = {criterion.label: criterion.met for criterion in judged(event).criteria}
    assert met == {"rms of the difference, p": False, "rms of the difference, q": True}


def test_a_response_that_is_its_record_meets_all_criteria():
    verdict = judged(comparison(response()))
    assert len(verdict.criteria) == 6
    assert all(criterion.difference == pytest.approx(0.0) for criterion in verdict.criteria)
    assert verdict.passed
    assert verdict.sentence == "all 6 criteria are met"


@pytest.mark.parametrize(
    ("simulated", "missed"),
    [
        (response(size=1.04 * STEP), {"final value"}),
        (response(damping=0.5), {"overshoot"}),
        (response(frequency=0.8), {"rise time 10-90 %", "peak time", "settling time 2 %"}),
    ],
)
def test_what_differs_misses_its_criterion(simulated, missed):
    verdict = judged(comparison(simulated))
    labels = {criterion.label for criterion in verdict.failed}
    assert missed <= labels
    assert verdict.passed is False
    assert all(label in verdict.sentence for label in missed)


def test_the_rms_of_the_difference_is_a_share_of_the_step():
    moved = response() + 0.06 * STEP
    rms = by_label(judged(comparison(moved)))["rms of the difference, vt"]
    # the record's final value is a mean of its tail, which still swings by some 1e-5 of the step
    assert rms.difference == pytest.approx(6.0, rel=1e-3)
    assert rms.met is False


@pytest.mark.parametrize(("share", "met"), [(0.99, True), (1.01, False)])
def test_a_limit_is_met_up_to_itself(share, met):
    limits = Criteria()
    moved = response() + 0.01 * share * limits.rmse * STEP
    assert by_label(judged(comparison(moved)))["rms of the difference, vt"].met is met


def test_a_case_may_give_other_limits():
    swinging = comparison(response(damping=0.5))
    wide = Criteria(rmse=50.0, overshoot=50.0, rise_time=90.0, peak_time=90.0, settling_time=90.0)
    assert judged(swinging).passed is False
    assert judged(swinging, criteria=wide).passed


def test_what_the_noise_hides_is_neither_met_nor_missed():
    verdict = judged(comparison(response(frequency=0.8), errors={"rise_time": 1.0}))
    rise = by_label(verdict)["rise time 10-90 %"]
    assert (rise.met, "±1 s" in rise.why) == (None, True)


def test_an_open_criterion_is_no_pass():
    verdict = judged(comparison(response(), errors={"rise_time": 1.0}))
    assert verdict.passed is None
    assert "5 of 6 criteria are met" in verdict.sentence


def test_a_peak_that_is_no_overshoot_has_no_time_to_be_judged():
    limits = Criteria(overshoot=30.0)
    assert "peak time" not in by_label(judged(comparison(response()), criteria=limits))


def test_a_response_that_does_not_settle_misses_the_settling_time():
    verdict = judged(comparison(response(damping=0.01)))
    settling = by_label(verdict)["settling time 2 %"]
    assert (settling.met, settling.difference) == (False, None)


def test_validations_are_judged_by_the_same_criteria():
    unseen = comparison(response(damping=0.5), name="down")
    verdict = judged(comparison(response()), validation=(unseen,))
    assert {criterion.record for criterion in verdict.failed} == {"down"}
    assert {criterion.fitted for criterion in verdict.failed} == {False}


def test_a_record_without_a_step_is_judged_by_its_rms_over_its_range():
    still = StepFeatures(None, None)
    match = replace(comparison(response() + 0.001), features=still)
    (criterion,) = judged(match).criteria
    span = np.ptp(response())
    assert criterion.difference == pytest.approx(100.0 * 0.001 / span)


def test_a_record_in_which_nothing_moves_is_not_judged():
    flat = np.ones(len(TIME))
    match = replace(
        comparison(flat), features=StepFeatures(None, None), overlays={"vt": Overlay(flat, flat)}
    )
    verdict = judged(match)
    assert (verdict.criteria, verdict.passed) == ((), None)
    assert verdict.sentence == "no record could be judged by the criteria"
