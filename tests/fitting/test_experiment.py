"""Weighted errors of a test, and what a fit takes from them: laws of weights and losses."""

from dataclasses import replace

import numpy as np
import pytest
from records import SAMPLES, UNIT, case_of, config, found_in, recording, several

from exfit.dsp.filtering import Filtering, LowPass, Median, MovingAverage
from exfit.fitting.build import build_experiments
from exfit.fitting.experiment import Channel
from exfit.fitting.noise import noise_of
from exfit.fitting.problem import problem_of, residuals_of
from exfit.fitting.uncertainty import uncertainty_at
from exfit.results.compare_with_record import compare_with_record
from exfit.workflows import fit

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
    return residuals_of(
        case, [one.with_enough_substeps(case.values()) for one in build_experiments(case)]
    )


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
        courses = uncertainty_at(problem_of(residuals), residuals.start, ()).sensitivity
        moved.append(np.concatenate([line for one in courses for line in one.moved.values()]))
    assert np.ptp(moved[0]) > 0.1
    assert moved[1] == pytest.approx(moved[0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("lost", [np.nan, 1e6])
def test_what_is_left_out_does_not_tell_the_noise(lost):
    measured = 1e-3 * np.random.default_rng(1).standard_normal(300)
    time, kept = np.arange(300.0), np.ones(300, dtype=bool)
    kept[100:220] = False
    spoiled = np.where(kept, measured, lost)
    without = noise_of(Channel("vt", measured[kept]))
    assert noise_of(Channel("vt", spoiled, filtering=Filtering(time, kept))) == without


WINDOW = 0.1  # s: so wide that what it does is far above rounding


def averaged(setup, filter=None, kept=None):
    """Return a setup whose record holds averages already."""
    time = setup.record.time
    kept = np.ones(len(time), dtype=bool) if kept is None else kept
    alike = Filtering(time, kept, filter, MovingAverage(WINDOW))
    channels = tuple(replace(one, filtering=alike) for one in setup.channels)
    return replace(setup, experiment=replace(setup.experiment, channels=channels))


def averaged_case(folder, filter=None, lost=0):
    """Return the case of the step up, and its setup with a record of averages."""
    content = several(
        recording("up"), free={name: found_in(*where) for name, where in NEAR.items()}
    )
    content["records"][0]["test"]["vt0"] = 1.0
    content["parameters"]["fixed"] |= {name: UNIT[name] for name in UNIT if name not in NEAR}
    case = case_of(content, folder)
    setup = build_experiments(case)[0].with_enough_substeps(case.values())
    kept = np.ones(len(setup.record.time), dtype=bool)
    kept[100 : 100 + lost] = False
    return case, averaged(setup, filter, kept)


NEAR = {name: (UNIT[name], UNIT[name] / 5, UNIT[name] * 5) for name in ("KA", "TE", "KF")}


@pytest.mark.parametrize("every", [1, 4, 10, 20])
def test_a_record_of_averages_is_held_against_the_averaged_simulation(every, tmp_path):
    """However few samples a window holds; lines through 16 of them err by 1 % of what it does."""
    case, setup = averaged_case(tmp_path)
    values, whole = case.values(), setup.experiment.simulator
    time = setup.record.time[::every]
    fine = time[:, None] + np.linspace(-0.5 * WINDOW, 0.5 * WINDOW, 201)
    (channel,), signals = setup.channels, setup.experiment.signals
    own = setup.experiment.parameters(values)

    def at(times):
        return whole.at_times(times.ravel()).samples(own, signals)[0][:, 0].reshape(times.shape)

    about = at(fine)
    mean = np.trapezoid(about, axis=1) / (about.shape[1] - 1)
    alike = Filtering(time, np.ones(len(time), dtype=bool), averaged=MovingAverage(WINDOW))
    recorded = replace(channel, measured=mean, filtering=alike)
    simulator = whole.at_times(time)
    there = replace(setup.experiment, simulator=simulator, channels=(recorded,))
    inside = slice(1, -1) if every > 1 else slice(5, -5)  # a simulation ends where its record does
    off = np.abs(mean - at(time))[inside].max()
    assert off > 1e-4
    assert np.abs(there.errors(values)[0][inside]).max() < 0.02 * off


@pytest.mark.parametrize("lost", [0, 30])
@pytest.mark.parametrize("filter", [None, LowPass(5.0), Median(5)], ids=str)
def test_the_derivatives_of_averaged_simulations_are_exact(tmp_path, filter, lost):
    case, setup = averaged_case(tmp_path, filter, lost)
    residuals = residuals_of(case, [setup])
    theta = residuals.start
    # central differences of a limited response: some 1e-6 of the largest derivative
    central = residuals.central(theta)
    scale = np.abs(central).max()
    assert residuals.exact(theta) == pytest.approx(central, abs=1e-5 * scale)


def test_what_is_drawn_is_what_is_compared(tmp_path):
    case, setup = averaged_case(tmp_path, lost=30)
    values = case.values()
    start = {**values, "KA": 0.5 * values["KA"]}
    found = compare_with_record(setup, values, start)
    vt = found.overlays["vt"]
    errors = setup.channels[0].weight * (vt.simulated - vt.measured)
    assert 0.5 * np.nansum(errors**2) == pytest.approx(found.cost, rel=1e-12)
    assert np.isnan(errors).sum() == 30
    first = compare_with_record(setup, start).overlays["vt"].simulated
    assert np.array_equal(vt.start, first, equal_nan=True)


@pytest.mark.long
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


@pytest.mark.long
def test_of_many_starts_the_first_is_that_of_the_case(tmp_path):
    content = several(recording("up"), free={"KA": found_in(310.0, 76.6, 7660.0)})
    content["records"][0]["test"]["vt0"] = 1.0
    content["parameters"]["fixed"] |= {name: UNIT[name] for name in UNIT if name != "KA"}
    alone = fit(case_of(content, tmp_path))
    many = fit(case_of({**content, "estimate": {"search": "global", "starts": 3}}, tmp_path))
    assert many.minima.start_costs[0] == pytest.approx(alone.start_cost, rel=1e-12)
    assert many.cost <= alone.cost * (1.0 + 1e-6)
