"""Weighted errors of a test, and what a fit takes from them: laws of weights and losses."""

import numpy as np
import pytest
from records import SAMPLES, UNIT, case_of, config, found_in, recording, several

from exfit.conditioning import Conditioning
from exfit.experiment import Channel
from exfit.knowledge import knowledge
from exfit.residuals import noise_of
from exfit.study import fit
from exfit.trial import fitted_trials, residuals_of

LOSSES = ("least-squares", "huber", "soft-l1")
WEIGHT = 40.0
FAR = 1.05  # times the values that fit: errors beyond the noise


def open_case(folder, weight=1.0, loss="least-squares"):
    """Return residuals of two signals of the step up, with what is known of TE beforehand."""
    content = {**config("ac1a_typical"), "validate": [], "estimate": {"loss": loss}}
    content["record"]["file"] = str(SAMPLES / "ac1a_up.csv")
    content["record"]["channels"] = {
        "vt": {"column": "vt", "weight": weight},
        "efd": {"column": "efd", "weight": 0.02 * weight},
    }
    free = {name: found_in(FAR * UNIT[name], UNIT[name] / 5, UNIT[name] * 5) for name in UNIT}
    free["TE"]["prior"] = {"mean": UNIT["TE"], "std": "10 %"}
    content["parameters"]["free"] = free
    case = case_of(content, folder)
    return residuals_of(case, [one.secured(case.values()) for one in fitted_trials(case)])


@pytest.mark.parametrize("loss", LOSSES)
def test_a_weight_common_to_all_signals_scales_all_residuals_alike(tmp_path, loss):
    """The prior's too, and those that the loss bends: so it moves no minimum."""
    plain, heavy = (open_case(tmp_path, weight, loss) for weight in (1.0, WEIGHT))
    assert heavy(heavy.start) == pytest.approx(WEIGHT * plain(plain.start), rel=1e-9)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_influence_of_the_errors_is_the_gradient_of_the_cost(tmp_path, loss):
    residuals = open_case(tmp_path, loss=loss)
    theta = residuals.start
    errors, slopes = residuals.errors(theta)
    count = residuals.count
    gradient = residuals.exact(theta)[:count].T @ residuals(theta)[:count]
    influence, _ = residuals.influence(errors)
    assert slopes.T @ influence == pytest.approx(gradient, rel=1e-9)


def test_how_far_a_signal_moves_in_per_unit_does_not_depend_on_its_weight(tmp_path):
    moved = []
    for weight in (1.0, WEIGHT):
        residuals = open_case(tmp_path, weight)
        courses = knowledge(residuals, residuals.start, ()).sensitivity
        moved.append(np.concatenate([one.moved for one in courses]))
    assert np.ptp(moved[0]) > 0.1
    assert moved[1] == pytest.approx(moved[0], rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("lost", [np.nan, 1e6])
def test_what_is_left_out_does_not_tell_the_noise(lost):
    measured = 1e-3 * np.random.default_rng(1).standard_normal(300)
    time, kept = np.arange(300.0), np.ones(300, dtype=bool)
    kept[100:220] = False
    spoiled = np.where(kept, measured, lost)
    without = noise_of(Channel("vt", measured[kept]))
    assert noise_of(Channel("vt", spoiled, conditioning=Conditioning(time, kept))) == without


def test_one_record_that_is_not_described_is_not_made_up_for_by_another(tmp_path):
    """Its step is given the wrong way round; as it hardly counts, the other one fits well."""
    wrong = recording("down", step=0.05, channels={"vt": {"column": "vt", "weight": 0.01}})
    records = (recording("up"), wrong)
    for one, level in zip(records, (1.0, 1.0495), strict=True):
        one["test"]["vt0"] = level
    content = several(*records, free={"KA": found_in(300.0, 76.6, 7660.0)})
    content["parameters"]["fixed"] |= {name: UNIT[name] for name in UNIT if name != "KA"}
    found = fit(case_of(content, tmp_path))
    assert found.success
    assert found.comparisons[0].fit_percent > 95.0 > 0.0 > found.comparisons[1].fit_percent
    assert not found.describes


def test_of_many_starts_the_first_is_that_of_the_case(tmp_path):
    content = several(recording("up"), free={"KA": found_in(310.0, 76.6, 7660.0)})
    content["records"][0]["test"]["vt0"] = 1.0
    content["parameters"]["fixed"] |= {name: UNIT[name] for name in UNIT if name != "KA"}
    alone = fit(case_of(content, tmp_path))
    many = fit(case_of({**content, "estimate": {"starts": 3}}, tmp_path))
    assert many.minima.start_costs[0] == pytest.approx(alone.start_cost, rel=1e-12)
    assert many.cost <= alone.cost * (1.0 + 1e-6)
