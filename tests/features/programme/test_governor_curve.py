"""Tests of a governor in a programme: gate over power, droop and dead band of slow records."""

import sys

import numpy as np
import pytest
import yaml
from governor_programme import PROGRAMME
from places import ROOT

from exfit import run
from exfit.errors import CaseError, RecordError
from exfit.features.programme.governor_curve import gate_curve, gates_at_rest, lagged
from exfit.features.programme.programme import load_programme
from exfit.features.programme.result import GovernorCurve
from exfit.fitting.parameters import FreeParameter
from exfit.models import GOVERNORS
from exfit.models.sheet import typical

sys.path.append(str(ROOT / "tests" / "studies"))

import droop


@pytest.fixture
def programme(tmp_path):
    """Return the file of a programme with both tests, and the truth."""
    truth, columns = droop.drawn(np.random.default_rng(3), "hydro")
    rows = [columns["time"], 60.0 * columns["speed"], 100.0 * columns["gate"]]
    save(tmp_path / "slow.csv", rows, "t,f (Hz),Y (%)")
    power = np.linspace(0.1, 0.9, 12)
    noise = np.random.default_rng(4).normal(0.0, 1e-3, 12)
    save(tmp_path / "gate.csv", [power, power / 1.17 + 0.062 + noise], "P,Y")
    (tmp_path / "unit.yaml").write_text(PROGRAMME)
    return tmp_path / "unit.yaml", truth | {"At": 1.17, "qNL": 0.062}


def save(path, columns, header):
    np.savetxt(path, np.transpose(columns), "%.6f", ",", header=header, comments="")


@pytest.mark.parametrize("governor", ["HYGOV", "HYG3", "H6E", "TGOV1", "GGOV1", "PIDGOV"])
def test_the_gate_at_rest_holds_the_power(governor):
    """The power of a still governor at that gate is the one that was asked for."""
    model = GOVERNORS[governor]
    data, power = typical(model.sheet), np.array([0.3, 0.5, 0.7])
    gates = gates_at_rest(model, data, power)
    assert (np.diff(gates) > 0.0).all()
    if governor == "HYGOV":
        assert gates == pytest.approx(power / data["At"] + data["qNL"], abs=1e-12)
    found = gate_curve(model, data, power, gates, ())
    assert found.verdict.verdict == "good"
    assert found.reading.rms < 1e-12


@pytest.mark.parametrize("share", [0.05, 1.0, 20.0])
def test_a_lag_between_samples_follows_a_ramp_behind_its_time(share):
    time = np.arange(400.0)
    behind = lagged(time, share)
    assert behind == pytest.approx(time - share * (1.0 - np.exp(-time / share)), abs=1e-9)


def test_a_programme_finds_the_droop_the_band_and_the_gate_curve_and_passes_them_on(
    programme, tmp_path
):
    path, truth = programme
    result = run(path, tmp_path / "out")
    assert result.holds
    for test in result.tests:
        assert isinstance(test.result, GovernorCurve)
    values = {value.name.removeprefix("governor."): value for value in result.values}
    assert values.keys() == truth.keys()
    for name, value in values.items():
        low, high = value.interval
        assert low < truth[name] < high, name
        assert high - low < 0.2 * abs(truth[name])
        assert (value.source, value.entered) == ("measured", True)
    again = run(path, tmp_path / "out")
    assert all(test.kept for test in again.tests)
    assert again.values == result.values


def test_a_reference_that_moves_in_a_slow_record_is_no_match(monkeypatch):
    """By ten times the noise of the gate, of which 2 % are more than is left."""
    monkeypatch.setattr(droop, "LENGTH", 900.0)
    generator = np.random.default_rng(5)
    _, columns = droop.drawn(generator)
    still = droop.fitted(columns, generator)
    assert still.verdict.verdict != "no match"
    assert still.reading.limit == pytest.approx(3.0 * droop.NOISE["gate"], rel=0.15)
    columns["gate"] += 1e-2 * (np.abs(columns["time"] - 450.0) < 150.0)
    moved = droop.fitted(columns, generator)
    assert moved.reading.rms < 0.02 * 0.6
    assert moved.verdict.verdict == "no match"


def test_intervals_hold_the_truth_of_some_records(monkeypatch):
    """The study has 200 hours of each; these are quarters of an hour."""
    monkeypatch.setattr(droop, "LENGTH", 900.0)
    inside = [
        holds
        for seed in range(1)
        for _, truth, curve in droop.curves(seed)
        for holds, _ in droop.held(curve, truth).values()
    ]
    assert len(inside) == 11
    assert sum(inside) >= 9  # of 95 % each, with a chance of 0.98


def test_a_lag_of_a_record_has_no_interval_and_is_not_passed_on():
    _, columns = droop.drawn(np.random.default_rng(1))
    curve = droop.fitted(columns, np.random.default_rng(1))
    assert curve.parameters["lag"].interval is None
    assert curve.parameters["lag"].of_record
    assert not any("lag" in text for text in curve.undetermined)
    assert curve.verdict.verdict == "good"


@pytest.mark.parametrize(
    ("place", "value", "says"),
    [
        (("columns",), {"p": "P"}, r"columns.gate: is missing: the column of the file"),
        (("columns",), {"time": "t", "speed": "n"}, "give either gate or p beside speed"),
        (("free",), {"Rx": {"start": 1.0}}, "free.Rx"),
        (("columns", "gate"), {"column": "Y", "noise": 0.1}, "noise: only allowed for ifd or efd"),
    ],
)
def test_what_a_test_of_a_governor_cannot_be_is_refused(programme, place, value, says):
    path, _ = programme
    content = yaml.safe_load(path.read_text())
    section = content["tests"][1]
    for key in place[:-1]:
        section = section[key]
    section[place[-1]] = value
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(CaseError, match=says):
        load_programme(path)


def test_a_test_of_a_governor_needs_one(programme):
    path, _ = programme
    content = yaml.safe_load(path.read_text())
    del content["governor"]
    path.write_text(yaml.safe_dump(content))
    with pytest.raises(CaseError, match="not allowed without a governor"):
        load_programme(path)


def test_a_record_with_a_gap_or_whose_time_stands_still_is_refused():
    _, columns = droop.drawn(np.random.default_rng(1))
    for time in (columns["time"] + 5.0 * (columns["time"] > 100.0), 0.0 * columns["time"]):
        with pytest.raises(RecordError, match="at even intervals"):
            droop.fitted({**columns, "time": time}, np.random.default_rng(1))


def test_a_gate_that_never_moves_is_refused():
    _, columns = droop.drawn(np.random.default_rng(1))
    columns["gate"][:] = 0.55
    with pytest.raises(RecordError, match=r"gate: 0\.55 pu throughout"):
        droop.fitted(columns, np.random.default_rng(1))


def test_a_gate_that_lies_elsewhere_is_no_match():
    model, power = GOVERNORS["TGOV1"], np.linspace(0.2, 0.9, 8)
    free = [FreeParameter("R", 0.05, 0.01, 0.3, logarithmic=True)]
    found = gate_curve(model, typical(model.sheet), power, 1.2 * power, free)
    assert found.verdict.verdict == "no match"
