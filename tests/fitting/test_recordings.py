"""The level before the step, where its instant or the delay of the recorder is found."""

import numpy as np
import pytest
from records import TEST, TIME, case_of, found_in, one, synthetic, write
from tables import read_columns

from exfit.fitting.build import build_experiments
from exfit.plants import VT0


def test_an_early_recorder_leaves_less_to_find_the_level(tmp_path):
    """At a delay of -0.4 s the record of a step at 1 s moves from 0.6 s on."""
    synthetic(tmp_path, TEST, TIME, noise=0.0)
    level = {"vref": TEST["vref"]}
    shown = read_columns(tmp_path / "record.csv", ["t", "vt"])
    write(tmp_path / "record.csv", t=TIME, vt=np.interp(TIME + 0.4, shown["t"], shown["vt"]))
    for delay in (-0.4, found_in(0.0, -0.4, 0.1)):
        setup = build_experiments(case_of(one(level, delay=delay), tmp_path))[0]
        assert setup.experiment.own[VT0] == pytest.approx(1.0, abs=1e-9)


def test_the_level_before_an_instant_that_is_found_is_that_before_its_lower_bound(tmp_path):
    vt = np.where(TIME < 0.7, 1.0, 1.0 + 0.01 * (TIME - 0.7))
    write(tmp_path / "record.csv", t=TIME, vt=vt)
    test = {"vref": [{"at": found_in(1.0, 0.7, 1.2), "step": 0.05}]}
    setup = build_experiments(case_of(one(test), tmp_path))[0]
    assert setup.experiment.own[VT0] == 1.0
    assert setup.test.steady == 0.7
