"""Faults of a record that are known before a fit: each is put in, and reported with its figures."""

import numpy as np
import pytest
from columns import Columns
from step_records import step_record
from tiers import few_of

from exfit.dsp.lines import ripple_at_rest
from exfit.records.inspection import inspect

RECORD = step_record(1, with_reference=True, length=6.0)
CHANNELS = dict(RECORD.table.content)
TIME = CHANNELS["t"]


def findings(units=None, **channels):
    return inspect(Columns({"t": TIME, **channels}, units=units or {})).findings


def with_fault(**channels):
    return findings(**{**{k: v for k, v in CHANNELS.items() if k != "t"}, **channels})


@pytest.mark.parametrize("seed", few_of(range(8), 4))
def test_a_sound_record_has_no_finding(seed):
    assert inspect(step_record(seed, with_reference=True, length=6.0).table).findings == ()


def test_an_inverted_channel_is_named_with_its_level():
    (finding,) = findings({"If": "A"}, vt=CHANNELS["vt"], If=-500.0 * CHANNELS["ifd"])
    assert finding.startswith("If: rests at -56")
    assert "A, but ifd is positive at rest" in finding
    assert "scale: -1" in finding


def test_a_channel_that_moves_against_the_voltage_is_inverted_about_an_offset():
    (finding,) = with_fault(ifd=2.0 * CHANNELS["ifd"][0] - CHANNELS["ifd"])
    assert finding.startswith("ifd: falls by")
    assert "where vt rises" in finding


def test_field_voltage_and_current_rest_together_in_per_unit():
    (finding,) = with_fault(efd=1.3 * CHANNELS["efd"])
    assert "efd rests at 1.45" in finding
    assert "ifd at 1.12" in finding
    units = {"ifd": "A"}
    assert findings(units, **{**CHANNELS, "ifd": 500.0 * CHANNELS["ifd"]}) == ()


def test_a_field_voltage_that_rests_where_no_machine_does_needs_a_base_or_has_its_scale_found():
    (finding,) = with_fault(efd=CHANNELS["efd"] / 3.0)
    assert finding.startswith("efd: rests at 0.37")
    assert "0.95 to 1.6 pu" in finding
    assert "air-gap line" in finding
    (finding,) = with_fault(efd=CHANNELS["efd"] / CHANNELS["efd"][0])
    assert "is 1 pu of efd that at no load?" in finding


@pytest.mark.parametrize("signal", ["vref", "vt"])
def test_a_step_that_no_regulator_is_tested_with_is_named_in_per_cent(signal):
    (finding,) = with_fault(**{signal: 1.0 + 100.0 * (CHANNELS[signal] - 1.0)})
    assert finding.startswith(f"{signal}: changes at {RECORD.at:.4g} s")
    percent = float(finding.partition("pu is ")[2].partition(" %")[0])
    assert percent == pytest.approx(1e4 * RECORD.size, rel=0.1)
    assert "5 % is 0.05 pu" in finding


def test_a_start_that_is_not_at_rest_is_reported_with_how_far_it_moves():
    (finding,) = with_fault(vt=CHANNELS["vt"] + 0.02 * np.exp(-TIME / 0.4))
    assert finding.startswith("vt: moves by 0.00")
    assert "does not start at rest" in finding


# ---- ripple


def noisy_line(frequency, rate, seed, amplitude=2e-4, length=4.0):
    time = np.arange(0.0, length, 1.0 / rate)
    line = amplitude * np.sin(2.0 * np.pi * frequency * time + seed)
    return time, 1.0 + line + np.random.default_rng(seed).normal(0.0, 1e-4, time.size)


def ripple_of(time, samples):
    return ripple_at_rest(time, samples, [(time[0], time[-1])])


@pytest.mark.parametrize(
    ("frequency", "rate", "shown", "folded_from"),
    [(50.0, 1000.0, 50.0, None), (60.0, 100.0, 40.0, 60.0), (50.0, 80.0, 30.0, 50.0),
     (50.0, 200.0, 50.0, None), (12.3, 100.0, 12.3, None), (300.0, 250.0, 50.0, None),
     (3.0, 100.0, 3.0, None)],
)  # fmt: skip
def test_a_ripple_is_named_by_its_frequency_and_where_sampling_may_have_folded_it(
    frequency, rate, shown, folded_from
):
    for seed in range(3):
        ripple = ripple_of(*noisy_line(frequency, rate, seed))
        assert ripple.frequency == pytest.approx(shown, abs=0.05)
        assert ripple.amplitude == pytest.approx(2e-4, rel=0.2)
        assert ripple.folded_from == folded_from
        assert ("anti-alias" in ripple.remedy) == (folded_from is not None)
        assert ("oscillation" in ripple.in_words) == (shown < 5.0)


def test_white_noise_and_a_drift_have_no_ripple():
    for seed in range(40):
        time, samples = noisy_line(10.0, 100.0, seed, amplitude=0.0)
        assert ripple_of(time, samples) is None
        assert ripple_of(time, samples + 1e-3 * np.exp(-time)) is None


def test_the_ripple_of_a_record_is_looked_for_where_it_rests():
    (finding,) = with_fault(efd=CHANNELS["efd"] + 0.02 * np.sin(2.0 * np.pi * 11.0 * TIME))
    assert finding.startswith("efd: a ripple of 11 Hz, amplitude 0.02")
    assert "lowpass: 4.4" in finding
