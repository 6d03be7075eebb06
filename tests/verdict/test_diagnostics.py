"""The notes of a fit: what its reader must know, and no false alarm."""

import numpy as np
import pytest
from records import TEST, TIME, case_of, found_in, one, synthetic, write

from exfit.workflows import fit


def test_a_voltage_that_is_found_is_not_held_against_its_start(tmp_path):
    """It starts 2 % off; on a bound it is that which is noted, not the number it started from."""
    synthetic(tmp_path, {**TEST, "vt0": 0.987}, TIME, noise=2e-5)
    found = fit(case_of(one({**TEST, "vt0": found_in(1.01, 0.9, 1.1)}), tmp_path))
    assert not [note for note in found.notes if note.startswith("vt0")]
    assert not [cause for cause in found.verdict.causes if cause.cause.startswith("vt0")]


@pytest.mark.long
@pytest.mark.parametrize(
    ("at", "step", "drift", "noted"),
    [
        (1.0, 0.05, 0.0, False),
        (0.93, 0.05, 0.0, True),
        (1.0, 0.04, 0.0, True),
        (1.0, 0.05, 1e-4, True),
    ],
)
def test_an_error_far_above_the_noise_has_causes(tmp_path, at, step, drift, noted):
    """Of a step that the case has 70 ms early or a fifth too small, and of a record that drifts."""
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    write(tmp_path / "record.csv", t=TIME, vt=shown + drift * TIME)
    test = {"vt0": 1.0, "vref": [{"at": at, "step": step}]}
    found = fit(case_of(one(test, free=["KA", "TE", "TA"]), tmp_path))
    assert bool(found.verdict.causes) == noted


@pytest.mark.long
def test_spikes_that_a_robust_loss_bears_are_no_misfit(tmp_path):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[::40] += 0.02
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    plain = one(TEST, free=["KA", "TE"])
    for content, noted in ((plain, True), ({**plain, "estimate": {"loss": "huber"}}, False)):
        found = fit(case_of(content, tmp_path))
        assert any("are spikes" in cause.cause for cause in found.verdict.causes) == noted


@pytest.mark.parametrize(("every", "words"), [(60, "10 of {}"), (600, "1 of {}")])
def test_how_many_samples_are_left_out_as_outliers_is_noted(tmp_path, every, words):
    shown = synthetic(tmp_path, TEST, TIME)["vt"]
    shown[::every] += 0.02
    shown[30:35] = np.nan
    write(tmp_path / "record.csv", t=TIME, vt=shown)
    channel = {"vt": {"column": "vt", "outliers": 8}}
    found = fit(case_of(one(TEST, channel, free=["KA"], gaps="skip"), tmp_path))
    verb = "is" if every == 600 else "are"
    count = words.format(len(TIME) - 5)
    note = f"{count} samples of vt of record.csv {verb} left out as outliers"
    assert note in found.notes
