"""The verdict on a fit: what the record shows decides, and nothing is called better than it is."""

from dataclasses import replace

import pytest
from records import TEST, TIME, UNIT, case_of, config, one, synthetic, write
from tiers import few_of

from exfit import workflows
from exfit.estimate import Stop
from exfit.results.verdict import GOOD, MATCHES, MISSES, NO_MATCH, NOT_CONVERGED
from exfit.verdict import rule

FREE = ["KA", "TE", "TA"]


def verdict(content, folder):
    return workflows.fit(case_of(content, folder)).verdict


def ac8b_record(**changes):
    """The AC8B's case on its sample record, without its validation."""
    content = config("ac8b_unit1")
    del content["validate"]
    return {**content, **changes}


def sexs_on_ac8b():
    fixed = dict(config("models/sexs")["parameters"]["fixed"])
    free = {name: fixed.pop(name) for name in ("K", "TB", "TE", "TATB")}
    bounds = {n: {"start": x, "min": x / 20.0, "max": x * 20.0} for n, x in free.items()}
    content = ac8b_record(model="SEXS", parameters={"fixed": fixed, "free": bounds})
    del content["saturation"]
    return content


@pytest.mark.long
def test_another_model_misses_the_record(tmp_path):
    found = verdict(sexs_on_ac8b(), tmp_path)
    assert found.verdict == MISSES
    assert not found.matches
    assert found.causes[1].cause.startswith("the model")
    (tests,) = found.residuals
    assert tests.times > 1.5
    assert tests.are_seen


@pytest.mark.long
def test_a_step_of_the_other_sign_is_no_match(tmp_path):
    test = {"vt0": 1.0, "vref": [{"at": 1.0, "step": -0.05}]}
    found = verdict(ac8b_record(test=test), tmp_path)
    assert found.sentence == "no match: the response goes the other way"


@pytest.mark.parametrize(
    "changes",
    few_of([{}, {"noise": 1e-3}, {"filter": {"lowpass": 10.0}}, {"filter": {"median": 5}}], 2),
    ids=str,
)
def test_noise_alone_is_good_whatever_is_done_to_the_channel(tmp_path, changes):
    synthetic(tmp_path, TEST, TIME, seed=1)
    channels = {"vt": {"column": "vt", **changes}}
    assert verdict(one(TEST, channels, FREE), tmp_path).verdict == GOOD


@pytest.mark.long
def test_a_noise_that_the_case_gives_hides_no_misfit(tmp_path):
    synthetic(tmp_path, {**TEST, "vref": [{"at": 1.0, "step": 0.04}]}, TIME)
    for noise in (1e-4, 1e-2):
        content = one(TEST, {"vt": {"column": "vt", "noise": noise}}, ["TE"])
        assert verdict(content, tmp_path).verdict == MISSES


@pytest.mark.long
@pytest.mark.parametrize(
    ("at", "step", "drift", "missed"),
    [
        (1.0, 0.05, 0.0, False),
        (0.93, 0.05, 0.0, True),
        (1.0, 0.04, 0.0, True),
        (1.0, 0.05, 1e-4, True),
    ],
)
def test_an_error_far_above_the_noise_misses_the_record(tmp_path, at, step, drift, missed):
    """Of a step that the case has 70 ms early or a fifth too small, and of a record that drifts."""
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    write(tmp_path / "record.csv", t=TIME, vt=shown + drift * TIME)
    test = {"vt0": 1.0, "vref": [{"at": at, "step": step}]}
    found = verdict(one(test, free=["KA", "TE", "TA"]), tmp_path)
    assert (found.verdict == MISSES) == missed


@pytest.mark.long
def test_what_is_masked_does_not_count(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME, seed=1)["vt"]
    shown[(TIME > 3.0) & (TIME < 3.5)] += 0.01
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    assert verdict(one(TEST, free=FREE), tmp_path).verdict == MISSES
    assert verdict(one(TEST, free=FREE, mask=[[2.99, 3.51]]), tmp_path).verdict == GOOD


@pytest.mark.long
def test_spikes_are_no_misfit_to_a_robust_loss_yet_no_noise_to_a_plain_one(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME, seed=1)["vt"]
    shown[::40] += 0.02
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    plain = one(TEST, free=["KA", "TE"])
    assert verdict(plain, tmp_path).verdict == MATCHES
    robust = verdict({**plain, "estimate": {"loss": "huber"}}, tmp_path)
    assert robust.verdict in (GOOD, MATCHES)


@pytest.mark.long
def test_a_robust_loss_does_not_take_another_model_for_spikes(tmp_path):
    assert verdict({**sexs_on_ac8b(), "estimate": {"loss": "huber"}}, tmp_path).verdict == MISSES


@pytest.mark.long
def test_the_worst_channel_is_named(tmp_path):
    """Field current in another base: vt is matched as before."""
    shown = synthetic(tmp_path, TEST, TIME, signals=("vt", "ifd"))
    write(tmp_path / "record.csv", t=TIME, vt=shown["vt"], ifd=1.2 * shown["ifd"])
    channels = {"vt": "vt", "ifd": {"column": "ifd", "weight": 0.001}}
    found = verdict(one(TEST, channels, FREE), tmp_path)
    assert not found.matches
    assert "ifd" in found.reason


@pytest.mark.long
def test_an_inverted_channel_is_no_match(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME, signals=("vt", "ifd"))
    write(tmp_path / "record.csv", t=TIME, vt=shown["vt"], ifd=-shown["ifd"])
    channels = {"vt": "vt", "ifd": {"column": "ifd", "weight": 0.001}}
    found = verdict(one(TEST, channels, FREE), tmp_path)
    assert found.verdict == NO_MATCH
    assert found.reason == "the response goes the other way (ifd)"


def test_what_is_not_determined_is_not_good(tmp_path):
    synthetic(tmp_path, TEST, TIME, seed=1)
    found = verdict(one(TEST, free=[*FREE, "KC", "KD", "KF", "TF"]), tmp_path)
    assert found.verdict == MATCHES
    assert "not determined" in found.reason
    assert all(test.are_noise for test in found.residuals)


@pytest.mark.long
def test_a_search_that_is_cut_short_is_not_converged(tmp_path):
    synthetic(tmp_path, TEST, TIME, seed=1)
    content = one(TEST, free=FREE)
    content["parameters"]["free"]["KA"]["start"] = 0.3 * UNIT["KA"]
    found = verdict({**content, "estimate": {"iterations": 2}}, tmp_path)
    assert found.verdict == NOT_CONVERGED


@pytest.mark.long
@pytest.mark.parametrize(
    ("stop", "verdict_of_it"),
    [(Stop.STALLED, MISSES), (Stop.ITERATIONS, NOT_CONVERGED), (Stop.LOST, NOT_CONVERGED)],
)
def test_a_search_that_stalled_where_a_misfit_is_seen_misses(
    tmp_path, monkeypatch, stop, verdict_of_it
):
    def ended_by(evidence):
        solution = evidence.solution._replace(stop=stop, success=False, message=stop.value)
        return replace(evidence, solution=solution)

    judged = rule._judged
    monkeypatch.setattr(rule, "_judged", lambda evidence, tests: judged(ended_by(evidence), tests))
    synthetic(tmp_path, TEST, TIME, seed=1)
    wrong = {**TEST, "vref": [{"at": 1.0, "step": 0.04}]}
    assert verdict(one(wrong, free=["TE"]), tmp_path).verdict == verdict_of_it
    assert verdict(one(TEST, free=["TE"]), tmp_path).verdict == NOT_CONVERGED


@pytest.mark.long
def test_what_drives_carries_its_noise_into_the_response(tmp_path):
    """The field voltage's own noise, integrated by the machine, is no error of the model."""
    content = config("machine_playback")
    found = verdict(content, tmp_path)
    assert found.matches
    assert all(tests.are_noise for tests in found.residuals)
    tests = found.residuals[0]
    assert tests.whiteness < 0.01 < tests.excess
    assert tests.carried > 0.1
    content["plant"]["free"] = {"Tpd0": content["plant"]["free"]["Tpd0"]}
    content["plant"]["parameters"] |= {"S10": 0.06, "S12": 0.4}
    assert not verdict(content, tmp_path).matches
