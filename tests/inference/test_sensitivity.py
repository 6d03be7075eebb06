"""Which parameter matters first, against what the response itself does."""

import csv
import io
import json

import numpy as np
import pytest
from linearised import linearised
from places import CONFIGS
from records import SAMPLES, case_of, config

from exfit.case.load import load_case
from exfit.features.design.experiment_design import identify
from exfit.fitting.search import fitted
from exfit.fitting.uncertainty import linearisation
from exfit.inference.confidence import confidence
from exfit.inference.identifiability import effects
from exfit.inference.linear import ResidualBlock
from exfit.output.fits import ranking
from exfit.results.io import result_text
from exfit.results.tables import effects_table
from exfit.workflows import fit, simulate

SMALL = 1e-4  # relative: a central difference over it is off by about its square
CURVED = 1e-4  # relative: what that leaves, with room


@pytest.fixture(scope="module")
def design():
    return identify(CONFIGS / "ac1a_typical.yaml", {"vt": 2e-4})


def near_zero(tmp_path):
    """Return a case with a parameter on the linear scale that is small against its interval."""
    content = config("ac8b_unit2_ka_free")
    content["parameters"]["free"]["KD"]["start"] = 0.05
    return case_of(content, tmp_path)


@pytest.mark.long
def test_the_effect_is_by_how_much_the_simulated_voltage_moves(design, tmp_path):
    small = near_zero(tmp_path)
    planned = identify(small, {"vt": 2e-4})
    for case, own in ((load_case(CONFIGS / "ac1a_typical.yaml"), design.own), (small, planned.own)):
        for effect in own.effects:
            start = case.values()[effect.parameter]
            sides = [
                simulate(case, {effect.parameter: start * (1.0 + side)}).response.signals["vt"]
                for side in (-SMALL, SMALL)
            ]
            slope = (sides[1] - sides[0]) / (2.0 * SMALL)
            rms = 0.01 * float(np.sqrt(np.mean(slope**2)))
            assert abs(effect.rms["vt"] - rms) <= CURVED * rms, effect.parameter
            assert effect.of_noise == pytest.approx(effect.rms["vt"] / 2e-4)


def test_the_strongest_comes_first_and_none_is_missing(design):
    strengths = [effect.of_noise for effect in design.own.effects]
    assert strengths == sorted(strengths, reverse=True)
    assert {effect.parameter for effect in design.own.effects} == {*design.own.confidence.names}


@pytest.mark.parametrize("seed", range(5))
def test_channels_count_by_their_noise_and_weights_do_not_matter(seed):
    rng = np.random.default_rng(seed)
    slopes, noises = rng.standard_normal((60, 2)), (1e-3, 1e-1)
    values = np.array([2.0, -3.0])
    for weights in ((1.0, 1.0), (3.0, 0.02)):
        each = np.repeat(weights, (20, 40))
        blocks = tuple(
            ResidualBlock(label, rows, noise * weight, weight)
            for label, rows, noise, weight in zip(
                ("vt", "efd"), (slice(0, 20), slice(20, 60)), noises, weights, strict=True
            )
        )
        errors = each * np.repeat(noises, (20, 40)) * rng.standard_normal(60)
        lin = linearised(values, errors, slopes * each[:, None], channels=blocks, width=np.ones(2))
        noise = confidence(lin).noise
        for effect in effects(lin, noise):
            k = lin.names.index(effect.parameter)
            moved = 0.01 * abs(values[k]) * slopes[:, k]
            assert effect.rms["vt"] == pytest.approx(np.sqrt(np.mean(moved[:20] ** 2)))
            assert effect.rms["efd"] == pytest.approx(np.sqrt(np.mean(moved[20:] ** 2)))
            stds = [channel.std / weight for channel, weight in zip(noise, weights, strict=True)]
            assert effect.of_noise == pytest.approx(
                np.sqrt(np.mean((moved / np.repeat(stds, (20, 40))) ** 2))
            )


@pytest.mark.parametrize("seed", range(5))
def test_neither_bounds_nor_the_scale_of_a_parameter_matter_to_its_effect(seed):
    rng = np.random.default_rng(seed)
    slopes, errors = rng.standard_normal((60, 3)), 1e-3 * rng.standard_normal(60)
    values = np.array([0.011, -3.0, 200.0])
    ranked = [
        effects(lin, confidence(lin).noise)
        for width in (np.abs(values), 1e3 * np.ones(3))
        for logarithmic in (False, True)
        for lin in [linearised(values, errors, slopes, width=width, logarithmic=[logarithmic] * 3)]
    ]
    assert {effect.label for effect in ranked[0]} == {"a", "b", "c"}
    for each in ranked:
        assert [effect.label for effect in each] == [effect.label for effect in ranked[0]]
        for effect, first in zip(each, ranked[0], strict=True):
            assert effect.rms == pytest.approx(first.rms)
            assert effect.of_noise == pytest.approx(first.of_noise)


def test_one_percent_of_nothing_is_one_of_the_interval_and_every_table_says_so():
    width, slopes = np.array([2.0, 5.0]), np.eye(2)
    lin = linearised([0.0, 1.0], [1e-3, 1e-3], slopes, width=width)
    ranked = {effect.parameter: effect for effect in effects(lin, confidence(lin).noise)}
    assert ranked["a"].rms["vt"] / ranked["b"].rms["vt"] == pytest.approx(2.0)
    assert [ranked[name].percent_of for name in "ab"] == ["interval", "value"]
    (sentence,) = ranking(list(ranked.values()))
    assert "a (is 0: 1 % of its interval)" in sentence
    table = [*csv.DictReader(io.StringIO(effects_table([*ranked.values()])))]
    assert [row["percent_of"] for row in table] == ["interval", "value"]


def test_where_no_noise_is_seen_the_strongest_still_comes_first():
    lin = linearised([1.0, 1.0], np.zeros(3), [[1.0, 3.0], [0.0, 2.0], [1.0, 1.0]])
    ranked = effects(lin, confidence(lin).noise)
    assert [effect.parameter for effect in ranked] == ["b", "a"]
    assert all(np.isnan(effect.of_noise) for effect in ranked)


def test_a_compressed_record_shows_the_effects_of_all_its_samples(tmp_path):
    """What is left of many samples is equivalent to them."""
    time = np.arange(0.0, 10.0, 5e-4)
    record = np.loadtxt(SAMPLES / "ac1a_up.csv", delimiter=",", skiprows=1)
    rows = np.column_stack([time, np.interp(time, record[:, 0], record[:, 1])])
    np.savetxt(tmp_path / "long.csv", rows, delimiter=",", header="t,vt", comments="")
    content = config("ac1a_typical")
    del content["validate"]
    content["record"]["file"] = "long.csv"
    content["simulation"] = {"step": 0.01}
    _, problem = fitted(case_of(content, tmp_path))
    assert problem.compressed is not problem.residuals
    theta = problem.residuals.start
    ranked = []
    for form in (problem, type(problem)(problem.residuals, problem.residuals)):
        lin = linearisation(form, theta, ())
        ranked.append(effects(lin, confidence(lin).noise))
    for compressed, whole in zip(*ranked, strict=True):
        assert compressed.parameter == whole.parameter
        assert compressed.rms["vt"] == pytest.approx(whole.rms["vt"], rel=1e-6)


def test_a_fit_stores_them_in_its_result_and_as_a_table():
    result = fit(CONFIGS / "ac1a_good.yaml", search="local")
    stored = json.loads(result_text(result))["knowledge"]["sensitivities"]
    table = [*csv.DictReader(io.StringIO(effects_table(result.knowledge.effects)))]
    assert [row["parameter"] for row in table] == [entry["parameter"] for entry in stored]
    for row, entry in zip(table, stored, strict=True):
        assert float(row["vt_rms"]) == pytest.approx(entry["rms"]["vt"])
        assert float(row["of_noise"]) == pytest.approx(entry["of_noise"])


def test_what_belongs_to_a_record_is_no_parameter():
    lin = linearised([1.0, 1.0], [0.1, 0.1], np.eye(2), nuisances=(False, True))
    assert [effect.parameter for effect in effects(lin, confidence(lin).noise)] == ["a"]
