"""Acceptance criteria: what meets them, what misses them, what is open, what is not judged."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from exfit.dsp.features import features
from exfit.results.comparisons import Comparison, Overlay, PlayedRecord, StepFeatures, match_of
from exfit.results.criteria import CriteriaVerdict, SignalToJudge, judged_by_criteria, with_criteria
from exfit.util.vocabulary import QUANTITIES, Criteria, Criterion

TIME = np.arange(0.0, 10.0, 0.01)
STEP = 0.05  # pu, at 1 s


def response(frequency=1.0, damping=0.4, size=STEP, late=0.0):
    """Return vt of a second-order system after a step; its overshoot is 25 % by default."""
    t = np.maximum(TIME - 1.0 - late, 0.0)
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


def judged(*matches, criteria=None, stepped=True, event=1.0):
    """Judge comparisons by criteria, by default the usual ones."""
    found = []
    for match in matches:
        signals = {
            name: SignalToJudge(
                TIME, each.measured, each.simulated, event, stepped, lambda end, m=match: m.features
            )
            for name, each in match.overlays.items()
        }
        found.append(with_criteria(match, criteria or Criteria(), signals))
    return CriteriaVerdict(tuple(each for match in found for each in match.criteria))


def one(quantity, **entries):
    """Return a single criterion of a case."""
    return Criteria((Criterion(quantity, **entries),), "a planner", given=True)


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
    found = {each.label: each.outcome for each in judged(event, stepped=False).criteria}
    assert found == {"rms of the difference, p": "not met", "rms of the difference, q": "met"}


def test_a_response_that_is_its_record_meets_all_criteria():
    verdict = judged(comparison(response()))
    assert len(verdict.criteria) == 6
    assert all(criterion.difference == pytest.approx(0.0) for criterion in verdict.criteria)
    assert verdict.passed
    assert verdict.sentence == "all 6 criteria are met"


@pytest.mark.parametrize(
    ("simulated", "missed"),
    [
        (response(size=1.04 * STEP), {"final value, vt"}),
        (response(damping=0.5), {"overshoot, vt"}),
        (
            response(frequency=0.8),
            {"rise time 10-90 %, vt", "peak time, vt", "settling time 2 %, vt"},
        ),
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
    assert rms.difference == pytest.approx(0.06 * STEP, rel=1e-12)
    assert rms.limit == pytest.approx(0.05 * STEP, rel=1e-3)
    assert rms.outcome == "not met"


@pytest.mark.parametrize(("share", "met"), [(0.99, True), (1.01, False)])
def test_a_limit_is_met_up_to_itself(share, met):
    moved = comparison(response() + share * 0.003)
    (found,) = judged(moved, criteria=one("rms", limit=0.003)).criteria
    assert found.outcome == ("met" if met else "not met")


def test_a_case_may_give_other_limits():
    swinging = comparison(response(damping=0.5))
    wide = Criteria(tuple(row._replace(percent=90.0) for row in Criteria().rows))
    assert judged(swinging).passed is False
    assert judged(swinging, criteria=wide).passed


def test_what_the_noise_hides_is_neither_met_nor_missed():
    verdict = judged(comparison(response(frequency=0.8), errors={"rise_time": 1.0}))
    rise = by_label(verdict)["rise time 10-90 %, vt"]
    assert (rise.outcome, "±1 s" in rise.why) == ("open", True)


def test_an_open_criterion_is_no_pass():
    verdict = judged(comparison(response(), errors={"rise_time": 1.0}))
    assert verdict.passed is None
    assert "5 of 6 criteria are met" in verdict.sentence


def test_a_peak_that_is_no_overshoot_has_no_time_to_be_judged():
    rows = Criterion("overshoot", limit=30.0), Criterion("peak_time", limit=0.1)
    match = comparison(response())
    given = by_label(judged(match, criteria=Criteria(rows, "a planner", given=True)))
    assert given["peak time, vt"].outcome == "not judged"
    assert "25 % is within its own limit" in given["peak time, vt"].why
    assert "peak time, vt" not in by_label(judged(match, criteria=Criteria(rows)))


def test_a_response_that_does_not_settle_misses_the_settling_time():
    verdict = judged(comparison(response(damping=0.01)))
    settling = by_label(verdict)["settling time 2 %, vt"]
    assert (settling.outcome, settling.difference) == ("not met", None)


def test_a_record_without_a_step_is_judged_by_its_rms_over_its_range():
    match = replace(comparison(response() + 0.001), features=StepFeatures(None, None))
    (criterion,) = judged(match, stepped=False).criteria
    assert criterion.difference == pytest.approx(0.001)
    assert criterion.limit == pytest.approx(0.05 * np.ptp(response()))


def test_a_record_in_which_nothing_moves_is_not_judged():
    flat = np.ones(len(TIME))
    match = replace(
        comparison(flat), features=StepFeatures(None, None), overlays={"vt": Overlay(flat, flat)}
    )
    verdict = judged(match, stepped=False)
    assert (verdict.criteria, verdict.passed) == ((), None)
    assert verdict.sentence == "no record could be judged by the criteria"


# ---- criteria that a case gives


def read(quantity, simulated, **entries):
    """Judge a response by a single criterion."""
    (found,) = judged(comparison(simulated), criteria=one(quantity, **entries)).criteria
    return found


def test_each_quantity_differs_by_what_closed_forms_say():
    """vt of another second-order response less the record's; the figures of both are known."""
    limits = {"limit": 1e9}
    at = {"damping": 0.4, "frequency": 1.0}, {"damping": 0.5, "frequency": 0.8}
    root = [np.sqrt(1.0 - each["damping"] ** 2) for each in at]
    over = [100.0 * np.exp(-np.pi * each["damping"] / r) for each, r in zip(at, root, strict=True)]
    peak = [0.5 / each["frequency"] / r for each, r in zip(at, root, strict=True)]
    other = response(**at[1])
    # read at 100 samples a second; tests/dsp has 1e-6 at 5,000
    assert read("overshoot", other, **limits).difference == pytest.approx(
        over[1] - over[0], abs=1e-2
    )
    assert read("peak_time", other, **limits).difference == pytest.approx(
        peak[1] - peak[0], abs=1e-4
    )
    assert read("damping_ratio", other, **limits).difference == pytest.approx(0.1, abs=2e-3)
    assert read("delay", response(late=0.07), **limits).difference == pytest.approx(0.07, abs=1e-9)
    assert read("final_value", response() + 0.004, **limits).difference == pytest.approx(0.004)


@pytest.mark.parametrize(
    ("quantity", "value"),
    [
        ("rms", 2e-3 / np.sqrt(2.0)),
        ("largest", -2e-3),
        ("mean", 0.0),
        ("mean_absolute", 4e-3 / np.pi),
    ],
)
def test_differences_of_samples_are_those_of_a_sine(quantity, value):
    """A sine of 2e-3 pu over whole periods of 100,000 samples, as closed forms have it."""
    time = np.arange(100_000) * 1e-4
    sine = -2e-3 * np.sin(2.0 * np.pi * time)
    signal = SignalToJudge(time, np.ones(100_000), 1.0 + sine, None, False, None)
    match = with_criteria(comparison(response()), one(quantity, limit=1.0), {"vt": signal})
    (found,) = match.criteria
    assert found.difference == pytest.approx(value, abs=1e-6)


def test_a_part_of_the_record_begins_and_ends_after_the_event():
    """An error from 1.2 to 2 s after the step counts only where the part has it."""
    wrong = response() + np.where((TIME > 2.2) & (TIME < 3.0), 0.01, 0.0)
    assert read("largest", wrong, limit=0.001, end=1.0).outcome == "met"
    assert read("largest", wrong, limit=0.001, begin=1.0, end=3.0).outcome == "not met"
    assert read("largest", wrong, limit=0.001, begin=2.5).outcome == "met"
    assert read("largest", wrong, limit=0.001, end=3.0).label.endswith("vt, start ... 3 s")


def test_of_two_limits_the_larger_counts():
    late = response(frequency=0.9)
    rise = read("rise_time", late, limit=1e-6, percent=50.0)
    assert (rise.outcome, rise.limit) == ("met", pytest.approx(0.5 * rise.recorded))
    assert read("rise_time", late, limit=1.0, percent=1e-6).limit == 1.0


@pytest.mark.parametrize(
    "quantity", [name for name, each in QUANTITIES.items() if not each.of_samples]
)
def test_what_a_record_does_not_show_is_said_and_is_no_pass(quantity):
    still = replace(comparison(response()), features=StepFeatures(None, None))
    verdict = judged(still, criteria=one(quantity, limit=1.0), stepped=False)
    (found,) = verdict.criteria
    assert (found.outcome, verdict.passed) == ("not judged", None)
    assert "the record shows no" in found.why


def test_a_record_that_none_of_the_criteria_given_can_judge_is_not_accepted():
    signals = {"vt": SignalToJudge(TIME, response(), response(), None, False, None)}
    found = with_criteria(comparison(response()), one("rms", limit=1.0, end=2.0), signals)
    assert not found.accepted
    assert found.reason == "no criterion can be judged on up"
    assert found.criteria[0].why == "the record shows no event"


@pytest.mark.parametrize("given", [True, False])
def test_only_criteria_of_the_case_decide_whether_a_record_is_accepted(given):
    criteria = one("rms", limit=1e-3)._replace(given=given)
    signals = {"vt": SignalToJudge(TIME, response(), response() + 0.01, 1.0, False, None)}
    match = replace(comparison(response()), features=StepFeatures(None, None))
    found = with_criteria(match, criteria, signals)
    assert found.accepted is not given
    assert ("rms of the difference, vt: +0.01, the limit is 0.001 pu" in found.reason) is given


def test_a_signal_that_no_record_has_is_named():
    result = SimpleNamespace(
        comparisons=(comparison(response()),), validation=(), criteria=one("rms", signals=("p",))
    )
    (found,) = judged_by_criteria(result).criteria
    assert (found.outcome, found.why) == ("not judged", "no record compares p")
