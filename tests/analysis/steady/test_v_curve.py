"""Points on load beside the machine's model: what a fit of them finds, and what they leave open."""

import numpy as np
import pytest

from exfit.analysis.steady.field_on_load import field_on_load
from exfit.analysis.steady.v_curve import FieldMeasurement, PointsOnLoad, v_curve
from exfit.fitting.parameters import FreeParameter
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical

BASE, NOISE = 640.0, 0.003  # A; pu
P = np.repeat([0.05, 0.4, 0.8], 5)
Q = np.tile([-0.3, -0.1, 0.1, 0.3, 0.5], 3)
VT = 1.0 + 0.05 * Q
SALIENT = MACHINES["GENSAL"]
TRUTH = typical(SALIENT.sheet) | {"S10": 0.1, "S12": 0.4}


def points(base=BASE, seed=1, noise=NOISE, rows=slice(None), **reading):
    p, q, vt = P[rows], Q[rows], VT[rows]
    ifd = field_on_load(SALIENT, TRUTH, p, q, vt)
    ifd = ifd + np.random.default_rng(seed).normal(0.0, noise, len(p))
    return PointsOnLoad(p, q, vt, {"ifd": FieldMeasurement(BASE * ifd, "A", base, **reading)})


def free(name, start, low, high):
    return FreeParameter(name, start, low, high, logarithmic=True)


def test_points_of_the_model_itself_are_matched():
    curve = v_curve(SALIENT, TRUTH, points())
    assert curve.verdict.verdict == "good"
    assert curve.readings["ifd"].rms == pytest.approx(NOISE, rel=0.5)
    assert curve.parameters == {}


def test_wrong_machine_data_are_no_match():
    curve = v_curve(SALIENT, TRUTH | {"Xd": 1.3}, points())
    assert curve.verdict.verdict == "no match"


def test_a_fit_finds_reactances_and_base_within_their_intervals():
    measured = points(base=700.0, free_base=free("ifd.base", 700.0, 200.0, 2000.0))
    start = TRUTH | {"Xd": 1.2, "Xq": 0.6}
    wanted = [free("Xd", 1.2, 0.4, 4.0), free("Xq", 0.6, 0.3, 1.2)]
    curve = v_curve(SALIENT, start, measured, wanted)
    assert curve.verdict.verdict == "good"
    for name, value in {"Xd": TRUTH["Xd"], "Xq": TRUTH["Xq"], "ifd.base": BASE}.items():
        low, high = curve.parameters[name].interval
        assert low < value < high
        assert high - low < 0.1 * value
    assert curve.determined == ("Xd", "Xq")
    assert curve.machine_data["Xd"] == curve.parameters["Xd"].value


def test_points_without_power_do_not_determine_the_q_axis():
    curve = v_curve(SALIENT, TRUTH, points(rows=slice(5)), [free("Xq", 0.7, 0.3, 1.2)])
    assert not curve.parameters["Xq"].determined
    assert curve.verdict.verdict == "matches, not all determined"
    assert any("Xq" in sentence for sentence in curve.undetermined)
