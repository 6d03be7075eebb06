"""The static exciters against their block diagrams, as transfer functions and at their limits."""

from types import SimpleNamespace

import numpy as np
import pytest
from diagrams import Transfer, alone, assert_is_diagram, lag, lead_lag, pid, washout
from oracle import drawn_values, lively_values, system_of, typical_values

from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.plants import VT0
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

STATIC = ("ST1A", "ST5B", "ST6B", "ST7B", "EXST1")


# --- transfer functions ---------------------------------------------------------------------------


def st1a(p, vt):
    forward = lead_lag(p.TC, p.TB) * lead_lag(p.TC1, p.TB1) * lag(p.KA, p.TA)
    return forward.fed_back(washout(p.KF, p.TF)), lag(1.0, p.TR)


def exst1(p, vt):
    forward = lead_lag(p.TC, p.TB) * lag(p.KA, p.TA)
    return forward.fed_back(washout(p.KF, p.TF)), lag(1.0, p.TR)


def st5b(p, vt):
    chain = lead_lag(p.TC1, p.TB1) * lead_lag(p.TC2, p.TB2) * p.KR * lag(1.0, p.T1)
    return chain, lag(1.0, p.TR)


def st6b(p, vt):
    regulator = pid(p.KPA, p.KIA, p.KDA, p.TDA)
    # VR = (KFF + KM) VA - KM KG/(1+sTG) EFD, EFD = VT VR
    inner = Transfer(vt).fed_back(lag(p.KM * p.KG, p.TG))
    return regulator * (p.KFF + p.KM) * inner, lag(1.0, p.TR)


def st7b(p, vt):
    # KIA = 1: the positive feedback of a lag is a PI
    feedback = lag(-p.KIA, p.TIA)
    chain = p.KPA * lead_lag(p.TC, p.TB) * Transfer(1.0).fed_back(feedback)
    return chain, lag(1.0, p.TR) * lead_lag(p.TG, p.TF)


DIAGRAMS = {"ST1A": st1a, "EXST1": exst1, "ST5B": st5b, "ST6B": st6b, "ST7B": st7b}


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("name", STATIC)
def test_the_linear_exciter_is_its_block_diagram(name, seed):
    values = drawn_values(name, seed)
    forward, measured = DIAGRAMS[name](SimpleNamespace(**values), 0.9)
    ways = {"vref": forward, "vc1": -1.0 * measured * forward}
    assert_is_diagram(name, values, ways, vt=0.9)


@pytest.mark.parametrize("name", ["ST1A", "EXST1"])
def test_a_rate_feedback_around_a_regulator_without_a_lag_is_the_block_diagram_s(name):
    """TA = 0: output and feedback wait for each other, whatever lead is between them."""
    for TC in (0.0, 0.4, 3.0):
        values = lively_values(name) | {"TA": 0.0, "KF": 0.02, "TF": 0.7, "TC": TC, "TB": 1.3}
        forward, _ = DIAGRAMS[name](SimpleNamespace(**values), 0.9)
        assert_is_diagram(name, values, {"vref": forward}, vt=0.9)


def test_st7b_is_a_pi_regulator():
    """KPA (1 + 1/(sTIA)), the standard's words, without the lead-lag: a ramp behind a step."""
    values = typical_values("ST7B") | {"TC": 0.0, "TB": 0.0}
    times, efd = alone("ST7B", values, vref=1e-4)
    expected = 1.3 + 1e-4 * 40.0 * (1.0 + times / 3.0)
    assert efd == pytest.approx(expected, rel=1e-12)


# --- limits ---------------------------------------------------------------------------------------


def ceiling(name, values, vt, ifd):
    """Return what the standard's formula (PSS/E's for EXST1) makes of VRMAX."""
    drop = values["KC"] * ifd if name in ("ST1A", "EXST1", "ST5B") else 0.0
    if name == "ST5B":  # KC IFD is taken from VRMAX before, the supply limits behind
        return min(values["VRMAX"] - drop, vt * values["VRMAX"])
    return vt * values["VRMAX"] - drop


def floor(name, values, vt, ifd):
    """Return the same of VRMIN."""
    if name == "EXST1":
        return vt * values["VRMIN"] - values["KC"] * ifd
    if name == "ST5B":
        return max(values["VRMIN"] - values["KC"] * ifd, vt * values["VRMIN"])
    return vt * values["VRMIN"]


WIDE = {"VIMAX": 99.0, "VIMIN": -99.0, "VAMAX": 99.0, "VAMIN": -99.0}


def wide(name, **changes):
    """Return typical data with the other limits far away."""
    values = lively_values(name)
    return values | {k: v for k, v in WIDE.items() if k in values} | changes


@pytest.mark.long
@pytest.mark.parametrize("vt", [0.6, 1.1])
@pytest.mark.parametrize("name", STATIC)
def test_a_large_step_reaches_the_ceiling_or_the_floor_of_the_standard(name, vt):
    for size, limit in ((3.0, ceiling), (-3.0, floor)):
        values = wide(name, VMAX=9.0, VMIN=-9.0)
        _, efd = alone(name, values, vref=size, vt=vt, time=1.5, step=1e-3)
        expected = limit(name, values, vt, 1.1)
        assert efd[-1] == pytest.approx(expected, rel=1e-9), size


@pytest.mark.parametrize("name", STATIC)
def test_the_output_never_leaves_the_limits_in_a_large_bump(name):
    system, values = system_of(name), lively_values(name)
    inputs = Inputs(0.0, 20.0, (InputStep(0.1, 1.0), InputStep(2.0, -1.9), InputStep(4.0, 0.9)))
    simulator = Simulator(system, inputs, np.linspace(0.0, 20.0, 2001), 1e-3)
    found = simulator.response(values).signals
    pairs = zip(found["vt"], found["ifd"], strict=True)
    high, low = np.array([(ceiling(name, values, *a), floor(name, values, *a)) for a in pairs]).T
    if name == "ST5B":  # the lag behind the clamp may stand beyond a limit that has moved
        high, low = found["vt"] * values["VRMAX"], found["vt"] * values["VRMIN"]
    assert (found["efd"] <= high + 1e-9).all()
    assert (found["efd"] >= low - 1e-9).all()
    assert (found["efd"] >= high - 0.05).any()
    assert found["vt"][-1] == pytest.approx(1.0, abs=0.1)  # and back


def test_exst1_winds_up_behind_its_clamp_and_st1a_does_not():
    """Both at a ceiling of 4 for half a second; then the error turns round."""

    def time_at_the_ceiling(name, **changes):
        values = wide(name, KF=0.0, TC=0.0, TB=0.0, TA=0.5, KA=50.0, TR=0.0, KC=0.0, **changes)
        system = system_of(name)
        inputs = Inputs(0.0, 2.0, (InputStep(0.1, 0.5), InputStep(0.6, -0.6)))
        simulator = Simulator(system, inputs, np.linspace(0.0, 2.0, 2001), 1e-3)
        efd = simulator.response(values).signals["efd"]
        return np.flatnonzero(efd >= 4.0 - 1e-9)[-1] * 1e-3 - 0.6

    assert time_at_the_ceiling("EXST1", VRMAX=4.0) > 0.1
    limits = {"VAMAX": 4.0, "TC1": 0.0, "TB1": 0.0, "KLR": 0.0}
    assert time_at_the_ceiling("ST1A", **limits) < 0.01


@pytest.mark.long
@pytest.mark.parametrize(("name", "factor"), [("ST1A", 1.0), ("ST6B", 1.0577)])
def test_a_field_current_beyond_its_limit_takes_the_field_down(name, factor):
    values = typical_values(name)
    ifd = values["ILR"] * factor + 0.1
    _, efd = alone(name, values, vref=1.0, ifd=ifd, vt=1.0, efd=0.5, time=1.0, step=1e-3)
    if name == "ST1A":  # subtracted from VA at its ceiling of 14.5, behind which VRMAX clamps
        expected = min(14.5 - 4.54 * 0.1, 7.8 - 0.08 * ifd)
        values |= {"VAMAX": 7.0}
        _, efd = alone(name, values, vref=1.0, ifd=ifd, vt=1.0, efd=0.5, time=1.0, step=1e-3)
        expected = 7.0 - 4.54 * 0.1
    else:  # the lower of VR and 17.33 (KCI ILR - IFD)
        expected = max(17.33 * -0.1, -3.85)
    assert efd[-1] == pytest.approx(expected, rel=1e-9)


@pytest.mark.long
@pytest.mark.parametrize("name", ["ST1A", "ST5B", "ST6B", "ST7B"])
def test_a_limiter_at_its_gate_takes_over(name):
    values = wide(name, VMAX=9.0, VMIN=-9.0)
    _, free = alone(name, values, time=1.0, step=1e-3)
    if name in ("ST1A", "ST7B"):  # gates at the output: the signal itself
        _, gated = alone(name, values, held={"vuel": 2.5}, time=0.1, step=1e-3)
        assert gated == pytest.approx(2.5)
        _, gated = alone(name, values, held={"vuel": 2.5, "voel": 0.7}, time=0.1, step=1e-3)
        assert gated == pytest.approx(0.7)
    else:  # a gate at the error: it raises the field
        _, gated = alone(name, values, held={"vuel": 0.02}, time=1.0, step=1e-3)
        assert gated[-1] > free[-1] + 0.1
    assert free == pytest.approx(1.3, abs=1e-9)


def test_a_start_beyond_the_reference_s_limit_is_refused():
    values = typical_values("ST7B") | {"VMAX": 1.1, VT0: 1.2}
    inputs = Inputs(0.0, 1.0, (InputStep(0.1, 0.05),))
    simulator = Simulator(system_of("ST7B"), inputs, np.linspace(0.0, 1.0, 11), 1e-3)
    with pytest.raises(SimulationError, match=r"above VMAX = 1\.1"):
        simulator.response(values)


# --- records --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", STATIC)
def test_a_record_lists_every_parameter_once(name):
    for record in MODELS[name].records:
        strangers = {symbol for symbol, _ in record.absent} | set(record.ignored)
        assert len(set(record.cons)) == len(record.cons)
        assert set(record.cons) - strangers == {row.symbol for row in MODELS[name].sheet}
        assert strangers <= set(record.cons)


def test_real_records_of_st5b_st6b_and_st7b_decode_to_sane_data():
    """As printed in InterPSS's tests of its PSS/E reader: gains large, limits of either sign."""
    for name, printed in (
        ("ST5B", "0 1.2 2.667 .01 .017 200 10 -9 .004 .004 1.5 3.33 .1 .15 1.52 3.378 .1 .15"),
        ("ST6B", ".051 55 5 0 1 4.81 -3.85 1.4 .2 1.5 17.33 4.164 4.5 -7.5 .1 .5"),
        ("ST7B", ".017 3.21 3 1.05 .95 87.8 5.77 -4.64 0 1 1 1 1 3"),
    ):
        (record,) = MODELS[name].records
        values = dict(zip(record.cons, map(float, printed.split()), strict=True))
        for row in MODELS[name].sheet:
            assert row.low <= values[row.symbol] <= row.high, row.symbol
        assert values["VRMIN"] < 0.0 < values["VRMAX"] <= 10.0
        assert max(values, key=values.get) in ("KR", "KPA")
