"""The alternator exciters of IEEE Std 421.5-2016 against their block diagrams, typed a second time.

Transfer functions are algebra in s, ceilings and gates the roots of what holds where a limit acts.
"""

import cmath

import numpy as np
import pytest
from diagrams import alone, frequency_response, rectified, slope
from rotating import (
    EFD,
    FREQUENCIES,
    IFD,
    INPUTS,
    START,
    VT,
    around,
    behind_rectifier,
    holding_current,
    pid,
    solved,
)
from scipy.optimize import brentq
from tiers import examples_of

from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.plants import SATURATION
from exfit.plants.parts import exciter_parameters

P, Q = 0.8, 0.3  # on load
# every block of the diagram takes part, and nothing is near a limit or a knee
LIVELY = {
    "AC1C": {"TR": 0.02, "TB": 0.5, "TC": 0.3},
    "AC2C": {"TR": 0.02, "TB": 1.5, "TC": 0.4, "KA": 80.0, "VFEMAX": 9.0},
    "AC3C": {"TR": 0.02, "TB": 0.5, "TC": 0.2, "KIR": 0.8, "KDR": 0.05, "EFDN": 2.5},
    "AC4C": {"TR": 0.02, "KC": 0.3},
    "AC5C": {"TR": 0.02, "TF3": 0.3, "KA": 100.0},
    "AC6C": {"TR": 0.02, "VFELIM": 2.5, "KH": 3.0},
    "AC7C": {"TR": 0.02, "KDR": 0.2, "TDR": 0.05, "KF2": 0.05, "KF3": 0.02},
    "AC8C": {"TR": 0.02, "TA": 0.03, "VFEMAX": 9.0},
    "AC9C": {"TR": 0.02, "VFEMAX": 9.0},
    "AC11C": {"TR": 0.02},
}
SOURCE = {"KI": 0.4, "XL": 0.1, "THETAP": 20.0, "VBMAX": 99.0, "KC1": 0.2}
INDEPENDENT = SOURCE | {"SW1": 2.0}
SOURCES = {"KI1": 0.4, "XL": 0.1, "THETAP": 20.0, "VBMAX1": 99.0, "KC1": 0.1}
SOURCES |= {"KI2": 0.3, "KC2": 0.03}
CHOPPER = SOURCES | {"SCT": 0.0}
BOOST = SOURCE | {"KI2": 0.3, "KC2": 0.03, "VBMAX1": 99.0, "VBOOST": 2.0, "VBMAX2": 9.0}


def parameters(name, **changes):
    values = typical(MODELS[name].sheet) | LIVELY.get(name, {}) | changes
    return exciter_parameters(values, MODELS[name], SATURATION["quadratic"])


# --- linear behaviour -----------------------------------------------------------------------------


def lead_lag(s, TC, TB):
    return (1.0 + s * TC) / (1.0 + s * TB)


def ac1c(s, p):
    forward = lead_lag(s, p.TC, p.TB) * p.KA / (1.0 + s * p.TA)
    return solved(s, p, forward, forward * s * p.KF / (1.0 + s * p.TF))


def ac2c(s, p):
    regulator = p.KB * lead_lag(s, p.TC, p.TB) * p.KA / (1.0 + s * p.TA)
    return solved(s, p, regulator, regulator * s * p.KF / (1.0 + s * p.TF) + p.KB * p.KH)


def ac3c(s, p):
    feedback = s / (1.0 + s * p.TF) * (p.KF if EFD < p.EFDN else p.KN)
    # VR = KR efd VA: around the start, KR efd0 dVA + (VFE0 / efd0) defd
    regulator = p.KR * EFD * p.KA / (1.0 + s * p.TA)
    forward = regulator * pid(s, p.KPR, p.KIR, p.KDR, p.TDR) * lead_lag(s, p.TC, p.TB)
    return solved(s, p, forward, 0.0, regulator * feedback - around(p).vfe / EFD)


def ac4c(s, p):
    forward = lead_lag(s, p.TC, p.TB) * p.KA / (1.0 + s * p.TA)
    return np.array([forward, forward, 0.0, -forward / (1.0 + s * p.TR), 0.0])


def ac5c(s, p):
    regulator = p.KA / (1.0 + s * p.TA)
    path = s * p.KF / (1.0 + s * p.TF1) * lead_lag(s, p.TF3, p.TF2)
    return solved(s, p, regulator / (1.0 + regulator * path))


def ac6c(s, p):
    acts = around(p).vfe > p.VFELIM
    limiter = p.KH * lead_lag(s, p.TJ, p.TH) if acts else 0.0
    forward = p.KA * lead_lag(s, p.TK, p.TA) * lead_lag(s, p.TC, p.TB)
    return solved(s, p, forward, limiter)


def first_source(vt, p, KI):
    """Return VE1 of a machine with constant powers, by phasors."""
    current = (P - 1j * Q) / vt
    gain = cmath.rect(p.KP, np.radians(p.THETAP))
    return abs(gain * vt + 1j * (KI + gain * p.XL) * current) if p.SW1 == 1.0 else p.KP


def source(vt, vfe, p):
    """Return VB."""
    return min(rectified(first_source(vt, p, p.KI), p.KC1 * vfe), p.VBMAX)


class Supplied:
    """VFD = VS VA around the start: VS, and what its changes add to VFD."""

    def __init__(self, p):
        vfe = around(p).vfe
        if vars(p).get("SW2") == 2.0:
            self.vs, self.of_vt, self.of_vfe, self.of_efd = p.KR * EFD, 0.0, 0.0, p.KR
        else:
            self.vs, self.of_efd = source(VT, vfe, p), 0.0
            self.of_vt = slope(lambda vt: source(vt, vfe, p), VT)
            self.of_vfe = slope(lambda vfe: source(VT, vfe, p), vfe)
        self.va = vfe / self.vs


def ac7c(s, p):
    at = Supplied(p)
    amplifier = at.vs * pid(s, p.KPA, p.KIA, 0.0, 0.0)
    regulator = amplifier * pid(s, p.KPR, p.KIR, p.KDR, p.TDR)
    back = regulator * s * p.KF3 / (1.0 + s * p.TF) + amplifier * p.KF2 - at.va * at.of_vfe
    of_efd = amplifier * p.KF1 - at.va * at.of_efd
    return solved(s, p, regulator, back, of_efd, at.va * at.of_vt)


def ac8c(s, p):
    at = Supplied(p)
    regulator = pid(s, p.KPR, p.KIR, p.KDR, p.TDR) * p.KA / (1.0 + s * p.TA)
    return solved(s, p, at.vs * regulator, -at.va * at.of_vfe, 0.0, at.va * at.of_vt)


def ac9c(s, p):
    """VFD = VR VB1 + what the power stage adds."""
    vfe = around(p).vfe

    def vb1(vt, vfe):
        return min(rectified(first_source(vt, p, p.KI1), p.KC1 * vfe), p.VBMAX1)

    def added(vt, vfe):
        if p.SCT == 1.0 or p.VLIM1 < 0.1:
            return min(rectified(p.KI2 * abs(P - 1j * Q) / vt, p.KC2 * vfe), p.VBMAX2)
        return 0.0 if p.VLIM2 < 0.1 else -p.KFW * vfe

    vr = (vfe - added(VT, vfe)) / vb1(VT, vfe)
    by_vt = slope(lambda vt: vr * vb1(vt, vfe) + added(vt, vfe), VT)
    by_vfe = slope(lambda x: vr * vb1(VT, x) + added(VT, x), vfe)
    inner = vb1(VT, vfe) * pid(s, p.KPA, p.KIA, 0.0, 0.0) * p.KA / (1.0 + s * p.TA)
    regulator = pid(s, p.KPR, p.KIR, p.KDR, p.TDR)
    return solved(s, p, inner * regulator, inner * p.KF / (1.0 + s * p.TF) - by_vfe, 0.0, by_vt)


def ac11c(s, p):
    """VFD = VA VB1 + what boosts it at a low voltage."""
    vfe = around(p).vfe

    def vb1(vt, vfe):
        return min(rectified(first_source(vt, p, p.KI), p.KC1 * vfe), p.VBMAX1)

    def boost(vt, vfe):
        source = p.KI2 * abs(P - 1j * Q) / vt + p.KBOOST
        return min(rectified(source, p.KC2 * vfe), p.VBMAX2) if vt <= p.VBOOST else 0.0

    va = (vfe - boost(VT, vfe)) / vb1(VT, vfe)
    by_vt = slope(lambda vt: va * vb1(vt, vfe) + boost(vt, vfe), VT)
    by_vfe = slope(lambda x: va * vb1(VT, x) + boost(VT, x), vfe)
    regulator = p.KPA * (1.0 + 1.0 / (s * p.TIA)) * (1.0 + s * p.TB / (1.0 + s * p.TB / p.KB))
    return solved(s, p, vb1(VT, vfe) * regulator, -by_vfe, 0.0, by_vt)


FUNCTIONS = {
    "AC1C": ac1c,
    "AC2C": ac2c,
    "AC3C": ac3c,
    "AC4C": ac4c,
    "AC5C": ac5c,
    "AC6C": ac6c,
    "AC7C": ac7c,
    "AC8C": ac8c,
    "AC9C": ac9c,
    "AC11C": ac11c,
}
CASES = [
    *((name, {}) for name in FUNCTIONS),
    ("AC3C", {"EFDN": 1.2}),  # beyond the bend of its feedback
    ("AC6C", {"VFELIM": 99.0}),  # its field current limiter does not act
    *((name, changes) for name in ("AC7C", "AC8C") for changes in (SOURCE, INDEPENDENT)),
    ("AC7C", {"SW2": 2.0}),
    ("AC9C", SOURCES),
    ("AC9C", SOURCES | {"SW1": 2.0}),
    ("AC9C", CHOPPER),  # it conducts,
    ("AC9C", CHOPPER | {"VLIM1": 2.0}),  # is blocked,
    ("AC9C", CHOPPER | {"VLIM1": 2.0, "VLIM2": 1.0}),  # and reversed
    ("AC11C", {"VOS": 2.0}),
    ("AC11C", {"VOS": 3.0}),
    ("AC11C", BOOST),
    ("AC11C", BOOST | {"SW1": 2.0, "VBMAX2": 0.1}),
]


@pytest.mark.parametrize(("name", "changes"), CASES)
def test_the_linear_exciter_is_its_block_diagram(name, changes):
    p = parameters(name, **changes)
    got = frequency_response(name, p, INPUTS, FREQUENCIES, START | {"p": P, "q": Q})
    expected = np.array([FUNCTIONS[name](2j * np.pi * f, p) for f in FREQUENCIES])
    size = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    # differences over 1e-5: rounding over it, and a third derivative times its square
    assert (np.abs(got - expected) / size).max() < 1e-7


OF_2005 = ("AC3A", "AC4A", "AC5A", "AC6A", "AC7B", "AC8B")  # with a limiter at their summing point


@pytest.mark.parametrize("name", [*FUNCTIONS, *OF_2005])
def test_what_limiters_add_acts_as_the_reference_does(name):
    p = vars(parameters(name))
    expected = alone(name, p, vref=1e-3, time=0.2, **START)[1]
    got = alone(name, p, held={"vsum": 1e-3}, time=0.2, **START)[1]
    assert np.abs(expected - EFD).max() > 1e-4
    np.testing.assert_array_equal(got, expected)


# --- ceilings, floors and gates -------------------------------------------------------------------


def after(name, p, vref, held=None, seconds=15.0):
    """Return efd over a large step, with limiters that act from its instant on."""
    return alone(name, vars(p), vref=vref, held=held, time=seconds, step=5e-3, **START)[1]


def held_by(output):
    """Return the efd of an exciter that gets VFD = output(efd, VFE)."""

    def ceiling(p):
        def missing(ve):
            vfe = holding_current(ve, IFD, p)
            return output(behind_rectifier(ve, IFD, p), vfe, p) - vfe

        return behind_rectifier(brentq(missing, 1.0, 50.0, xtol=1e-13), IFD, p)

    return ceiling


def field_voltage(limit):
    return held_by(lambda efd, vfe, p: limit(p))


def supplied(efd, vfe, p):
    return min(rectified(p.KP * VT, p.KC1 * vfe), p.VBMAX)


BY_VFE = field_voltage(lambda p: p.VFEMAX)
BY_EFE = field_voltage(lambda p: p.EFEMAX)
BY_VT = field_voltage(lambda p: VT * p.EFEMAX)
LIMITS = [
    ("AC1C", {}, BY_EFE),
    ("AC1C", {"VFEMAX": 3.0}, BY_VFE),
    ("AC2C", {"VFEMAX": 4.4}, BY_VFE),
    ("AC2C", {"EFEMAX": 5.0}, BY_EFE),
    ("AC3C", {}, BY_VFE),  # it supplies itself up to there
    (
        "AC3C",
        {"KR": 1.5, "VAMAX": 1.5, "KIR": 0.0},
        held_by(lambda efd, vfe, p: p.KR * efd * p.VAMAX),
    ),
    ("AC4C", {}, lambda p: p.VRMAX - p.KC * IFD),
    ("AC5C", {}, field_voltage(lambda p: p.VAMAX)),
    ("AC5C", {"VFEMAX": 5.0}, BY_VFE),
    ("AC6C", {"VFELIM": 99.0, "EFEMAX": 9.0}, BY_VT),
    ("AC6C", {"VFELIM": 99.0, "VFEMAX": 12.0}, BY_VFE),
    ("AC7C", {"KC1": 0.1}, held_by(lambda efd, vfe, p: p.VAMAX * supplied(efd, vfe, p))),
    ("AC7C", {"VBMAX": 3.0}, held_by(lambda efd, vfe, p: p.VAMAX * p.VBMAX)),
    ("AC7C", {"VFEMAX": 3.0}, BY_VFE),
    ("AC7C", {"SW2": 2.0}, BY_VFE),  # it supplies itself up to there
    (
        "AC8C",
        {"VRMAX": 6.0, "VFEMAX": 99.0},
        held_by(lambda efd, vfe, p: p.VRMAX * supplied(efd, vfe, p)),
    ),
    ("AC8C", {"VFEMAX": 6.0}, BY_VFE),
    ("AC9C", {"VRMAX": 6.0}, held_by(lambda efd, vfe, p: p.VRMAX * rectified(VT, p.KC1 * vfe))),
    ("AC9C", {"VBMAX1": 0.6}, held_by(lambda efd, vfe, p: p.VRMAX * p.VBMAX1)),
    ("AC9C", {"VFEMAX": 5.0}, BY_VFE),
    ("AC11C", {"VRMAX": 6.0}, held_by(lambda efd, vfe, p: p.VRMAX * rectified(VT, p.KC1 * vfe))),
    ("AC11C", {"VAMAX": 6.0}, held_by(lambda efd, vfe, p: p.VAMAX * rectified(VT, p.KC1 * vfe))),
    (
        "AC11C",
        {"VBMAX1": 0.5, "VBOOST": 2.0, "VBMAX2": 0.2},
        held_by(lambda efd, vfe, p: p.VRMAX * p.VBMAX1 + p.VBMAX2),
    ),
    ("AC11C", {"VFEMAX": 5.0}, BY_VFE),
]


@pytest.mark.parametrize(("name", "changes", "ceiling"), examples_of(LIMITS, 4))
def test_a_large_step_drives_efd_to_its_ceiling_and_never_beyond(name, changes, ceiling):
    p = parameters(name, **changes)
    expected = ceiling(p)
    efd = after(name, p, 0.5)
    assert expected > 1.02 * EFD
    assert efd[-1] == pytest.approx(expected, rel=1e-6)
    assert efd.max() <= expected * (1.0 + 1e-6)


@pytest.mark.parametrize("name", examples_of(FUNCTIONS, 3))
def test_a_large_step_down_drives_the_exciter_to_its_floor(name):
    p = parameters(name, **({} if name == "AC4C" else {"VEMIN": 0.9}))
    floor = p.VRMIN if name == "AC4C" else behind_rectifier(p.VEMIN, IFD, p)
    efd = after(name, p, -0.5)
    assert efd[-1] == pytest.approx(floor, rel=1e-9)
    assert (efd >= floor - 1e-9).all()


TAKEN_OVER = {
    **dict.fromkeys(("AC1A", "AC1C", "AC2C", "AC5C", "AC6C"), ("vuel", "voel")),
    **dict.fromkeys(("AC8C", "AC9C", "AC11C"), ("vuel_out", "voel_out")),
}


@pytest.mark.long
@pytest.mark.parametrize("name", TAKEN_OVER)
def test_a_gate_takes_the_exciter_over(name):
    """Whatever the error drives: an upper gate below what would be, a lower one above it."""
    p = parameters(name, **({"VFELIM": 99.0} if name == "AC6C" else {}))
    under, over = TAKEN_OVER[name]
    for share, gate, vref in ((1.1, over, 0.5), (0.9, under, -0.5)):
        vfe = share * around(p).vfe
        source = rectified(p.KP * VT, p.KC1 * vfe) if gate.endswith("_out") else 1.0
        supply = source * vars(p).get("KA", 1.0) if gate.endswith("_out") else 1.0
        efd = after(name, p, vref, {gate: vfe / supply})
        assert efd[-1] == pytest.approx(field_voltage(lambda _, vfe=vfe: vfe)(p), rel=1e-6)


@pytest.mark.parametrize("name", ["AC7C", "AC8C"])
def test_a_gate_before_the_pid_takes_the_error_over(name):
    """A step of the error that a gate holds is no step; and the gate gives a step of its own."""
    p = parameters(name, **({"KF3": 0.0} if name == "AC7C" else {}))
    assert after(name, p, 0.01, {"voel": 0.0}, 0.5)[-1] == pytest.approx(EFD, abs=1e-9)
    expected = after(name, p, 0.01, None, 0.5)
    # over half a second the error does not change: the terminal voltage stays
    np.testing.assert_allclose(after(name, p, 0.0, {"vuel": 0.01}, 0.5), expected, rtol=1e-12)


@pytest.mark.long
def test_the_second_gates_of_ac7c_take_the_reference_of_the_inner_loop_over():
    """At rest KF1 efd is what the gate gives: the inner loop has an integral."""
    p = parameters("AC7C", KF2=0.0)
    for x, gate, vref in ((0.45, "voel_out", 0.5), (0.5, "vuel_out", -0.5)):
        assert after("AC7C", p, vref, {gate: x})[-1] == pytest.approx(x / p.KF1, rel=1e-6)


def test_the_inner_loop_of_ac9c_holds_the_field_current_at_the_limit_of_the_pid():
    p = parameters("AC9C", VPIDMAX=4.5)
    expected = field_voltage(lambda p: p.VPIDMAX / p.KF)(p)
    assert after("AC9C", p, 0.5)[-1] == pytest.approx(expected, rel=1e-6)


def test_the_first_gates_of_ac9c_hold_the_error_of_its_inner_loop():
    p = parameters("AC9C")
    assert after("AC9C", p, 0.01, {"voel": 0.0}, 0.5)[-1] == pytest.approx(EFD, abs=1e-9)
    assert after("AC9C", p, -0.01, {"vuel": 0.0}, 0.5)[-1] == pytest.approx(EFD, abs=1e-9)


@pytest.mark.long
def test_the_gates_of_ac3c_and_ac4c_take_the_input_of_the_regulator_over():
    for share, gate, vref in ((1.1, "voel", 0.5), (0.9, "vuel", -0.5)):
        p = parameters("AC4C")
        efd = after("AC4C", p, vref, {gate: share * EFD / p.KA})
        assert efd[-1] == pytest.approx(share * EFD, rel=1e-9)
        # without its feedback VA follows at once; the self-excited alternator then runs away
        p = parameters("AC3C", KF=0.0, KN=0.0, VFEMAX=9.0)
        efd = after("AC3C", p, vref, {gate: share * around(p).vfe / (p.KR * EFD) / p.KA})
        assert (efd[-1] - EFD) * vref > 0.1


# no derivative, as OEL's regulator has it
ALONE = {"TB": 1e-7}


@pytest.mark.parametrize(("gate", "of", "changes"), [("vuel", "U", {}), ("voel", "O", ALONE)])
def test_a_limiter_at_the_first_gates_of_ac11c_has_a_regulator_of_its_own(gate, of, changes):
    """It does as the first one would with its gain and time, and without OEL's derivative."""
    p = parameters("AC11C", TR=0.0)
    same = parameters(
        "AC11C",
        TR=0.0,
        KPA=vars(p)[f"KP{of}"],
        TIA=vars(p)[f"TI{of}"],
        **changes,
    )
    error = 0.01 if gate == "vuel" else -0.01
    expected = after("AC11C", same, error, None, 1.0)
    assert after("AC11C", p, 0.0, {gate: error}, 1.0) == pytest.approx(expected, abs=1e-12)
    assert abs(expected[-1] - EFD) > 0.01


@pytest.mark.parametrize("limited", [False, True])
def test_the_stabiliser_of_ac11c_acts_where_vos_says(limited):
    """By a regulator of its own it does the same, between limits; a limiter sends it there."""
    for VOS in (1.0, 2.0, 3.0):
        p = parameters("AC11C", VOS=VOS)
        expected = after("AC11C", p, 0.01, None, 1.0)
        held = {"vs": 0.01, **({"vuel": 0.0} if limited else {})}
        got = after("AC11C", p, -0.05 if limited else 0.0, held, 1.0)
        if VOS == 1.0 and limited:
            expected = np.full_like(got, EFD)  # it is part of what the gate replaces
        assert got == pytest.approx(expected, abs=1e-9)
    p = parameters("AC11C", VOS=3.0, VRSMAX=0.2)
    most = held_by(lambda efd, vfe, p: (start_of(p) + 0.2) * rectified(VT, p.KC1 * vfe))(p)
    assert after("AC11C", p, 0.0, {"vs": 0.5})[-1] == pytest.approx(most, rel=1e-6)


def start_of(p):
    """Return the VA of AC11C at the start."""
    vfe = around(p).vfe
    return vfe / rectified(p.KP * VT, p.KC1 * vfe)
