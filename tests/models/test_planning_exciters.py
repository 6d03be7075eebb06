"""Exciters of planning files that IEEE Std 421.5 does not have, against their block diagrams.

The linear behaviour is put together here a second time, as block diagram algebra in s that knows
nothing of states; ceilings are those that the limits of the diagram give.
"""

import numpy as np
import pytest
from diagrams import (
    Rotating,
    alone,
    field_current,
    frequency_response,
    rectified,
    saturation,
    slope,
)
from oracle import rates_at_rest, system_of, typical_values
from scipy.optimize import brentq
from tiers import examples_of

from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.plants import SATURATION
from exfit.plants.parts import exciter_parameters
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

FREQUENCIES = np.geomspace(0.01, 50.0, 31)  # Hz
EFD, IFD, VT = 1.9, 1.8, 1.02  # a start of a machine on load, and off every limit
START = {"efd": EFD, "ifd": IFD, "vt": VT}
INPUTS = ("vref", "vs", "vsum", "vt", "vc1", "ifd")
ERROR = np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])  # what of each input is added to the error
DIRECT = {name: np.eye(len(INPUTS))[INPUTS.index(name)] for name in ("vt", "vc1", "ifd")}


def parameters(name, changes):
    values = typical(MODELS[name].sheet) | dict(changes)
    return exciter_parameters(values, MODELS[name], SATURATION["quadratic"])


def lag(s, T):
    return 1.0 / (1.0 + s * T)


def lead_lag(s, TC, TB):
    return (1.0 + s * TC) / (1.0 + s * TB)


def error(s, p):
    """Return the voltage error per unit of each input, without any feedback."""
    return ERROR - DIRECT["vc1"] * lag(s, p.TR)


def source(vt, ifd, p):
    return rectified(p.KP * vt, p.KC * ifd)


def source_slopes(p):
    """Return VB per unit of each input."""
    return DIRECT["vt"] * slope(lambda vt: source(vt, IFD, p), VT) + DIRECT["ifd"] * slope(
        lambda ifd: source(VT, ifd, p), IFD
    )


# --- linear behaviour -----------------------------------------------------------------------------


def rexs(s, p):
    at = Rotating(vars(p), EFD, IFD)
    regulator = (p.KVP + p.KVI / s) * lead_lag(s, p.TC1, p.TB1) * lead_lag(s, p.TC2, p.TB2)
    regulator = regulator * lag(s, p.TA)
    inner = (p.KIP + p.KII / s) * lag(s, p.TP)
    stabiliser = s * p.KF * lag(s, p.TF) * lead_lag(s, p.TF1, p.TF2)
    # per unit of VR, of VFE and of efd, what is fed back
    of_vr, of_vfe, of_efd = (stabiliser * (choice == p.FBF) for choice in (0, 1, 2))
    # VR = open (e - of_vfe VFE - of_efd efd), with efd = a VE - b IFD and VFE = c VE + KD IFD
    opened = regulator / (1.0 + regulator * of_vr)
    by_ve = of_vfe * at.c + of_efd * at.a
    by_ifd = of_vfe * p.KD - of_efd * at.b
    forward = inner * opened
    loop = s * p.TE + at.c * (1.0 + inner * p.KH) + forward * by_ve
    load = p.KD * (1.0 + inner * p.KH) + forward * by_ifd
    ve = (forward * error(s, p) - load * DIRECT["ifd"]) / loop
    return at.a * ve - at.b * DIRECT["ifd"]


def expic1(s, p):
    regulator = p.KA * (1.0 + s * p.TA1) / s * (1.0 + s * p.TA3) * lag(s, p.TA2) * lag(s, p.TA4)
    stabiliser = s * p.KF * lag(s, p.TF1) * lag(s, p.TF2)
    vr = regulator / (1.0 + regulator * stabiliser) * error(s, p)
    vx, vx_slope = saturation(EFD, vars(p))
    if p.TE == 0.0:
        return source(VT, IFD, p) * vr + EFD / source(VT, IFD, p) * source_slopes(p)
    e0 = p.KE * EFD + vx
    driven = source(VT, IFD, p) * vr + e0 / source(VT, IFD, p) * source_slopes(p)
    return driven / (s * p.TE + p.KE + vx_slope)


def exst2(s, p):
    regulator, stabiliser = p.KA * lag(s, p.TA), s * p.KF * lag(s, p.TF)
    driven = regulator * error(s, p) + source_slopes(p)
    return driven / (s * p.TE + p.KE + regulator * stabiliser)


def exst3(s, p):
    vb = source(VT, IFD, p)
    inner = p.KA * lag(s, p.TA)
    driven = vb * inner * p.KJ * lead_lag(s, p.TC, p.TB) * error(s, p)
    KG = p.KG if p.KG * EFD < p.VGMAX else 0.0
    return (driven + EFD / vb * source_slopes(p)) / (1.0 + vb * inner * KG)


def alternator(s, p, driven, fed_back):
    """Return efd where VR = driven e + fed_back efd, and sTE VE = VR - VFE."""
    at = Rotating(vars(p), EFD, IFD)
    load = (p.KD + fed_back * at.b) * DIRECT["ifd"]
    ve = (driven * error(s, p) - load) / (s * p.TE + at.c - fed_back * at.a)
    return at.a * ve - at.b * DIRECT["ifd"]


def exac1a(s, p):
    regulator = lead_lag(s, p.TC, p.TB) * p.KA * lag(s, p.TA)
    return alternator(s, p, regulator, -regulator * s * p.KF * lag(s, p.TF))


def exac3(s, p):
    regulator = lead_lag(s, p.TC, p.TB) * p.KA * lag(s, p.TA)
    stabiliser = s * (p.KF if EFD < p.EFDN else p.KN) * lag(s, p.TF)
    # VR = KR efd VA around its rest, where VA = VFE / (KR efd)
    driven, va = p.KR * EFD * regulator, Rotating(vars(p), EFD, IFD).vfe / (p.KR * EFD)
    return alternator(s, p, driven, p.KR * va - driven * stabiliser)


def bbsex1(s, p):
    return p.K * lead_lag(s, p.T3, p.T4) * lead_lag(s, p.T2, p.T1) * error(s, p)


def esurry(s, p):
    regulator = p.K10 * lead_lag(s, p.TA, p.TB) * lead_lag(s, p.TC, p.TD)
    back = 1.0 + (p.K16 + s * p.KF * lag(s, p.TF)) * lag(s, p.T1)
    at = Rotating(vars(p), EFD, IFD)
    ve = (regulator * error(s, p) - p.KD * back * DIRECT["ifd"]) / (s * p.TE + at.c * back)
    return at.a * ve - at.b * DIRECT["ifd"]


def urst5t(s, p):
    regulator = p.KR * lead_lag(s, p.TC1, p.TB1) * lead_lag(s, p.TC2, p.TB2)
    return regulator * lag(s, p.T1) * error(s, p) - p.KC * DIRECT["ifd"]


# no gain and no time constant of the first is zero; then each variant of the diagram
REXS = {
    **{"TR": 0.02, "KVP": 300.0, "KVI": 40.0, "TB1": 0.5, "TC1": 0.3, "TB2": 0.05, "TC2": 0.2},
    **{"TF": 1.5, "TF1": 0.3, "TF2": 0.1, "KIP": 2.0, "KII": 5.0, "TP": 0.03, "KH": 0.4},
    **{"KC": 0.2, "SE1": 0.1, "E1": 2.0, "E2": 3.0, "SE2": 0.3, "VIMAX": 9.0},
}
EXPIC1 = {
    **{"TR": 0.02, "TA2": 0.05, "TA3": 0.2, "TA4": 0.02, "KF": 0.1, "TF2": 0.1, "TE": 0.3},
    **{"E1": 1.0, "SE1": 0.05, "E2": 3.0, "SE2": 0.3},
}
LINEAR = [
    ("REXS", rexs, REXS),
    ("REXS", rexs, REXS | {"FBF": 0.0}),
    ("REXS", rexs, REXS | {"FBF": 0.0, "TA": 0.0}),  # VR waits for its own feedback
    ("REXS", rexs, REXS | {"FBF": 0.0, "TA": 0.0, "TF1": 0.0, "TF2": 0.0, "KVP": 0.0}),
    ("REXS", rexs, REXS | {"FBF": 2.0, "TA": 0.0, "TP": 0.0}),
    ("REXS", rexs, {"KVI": 30.0}),
    ("EXPIC1", expic1, EXPIC1),
    ("EXPIC1", expic1, EXPIC1 | {"TE": 0.0, "TA2": 0.0}),
    ("EXPIC1", expic1, EXPIC1 | {"TF1": 0.0}),
    # the feedback waits for itself
    ("EXPIC1", expic1, EXPIC1 | {"TA2": 0.0, "TA3": 0.0, "TA4": 0.0, "TF2": 0.0, "TE": 0.0}),
    ("EXPIC1", expic1, EXPIC1 | {"TA2": 0.0, "TF2": 0.0}),
    ("EXPIC1", expic1, {}),
    ("EXST2", exst2, {"TR": 0.02, "KE": 0.8, "KC": 0.3}),
    ("EXST2", exst2, {"TA": 0.0, "KF": 0.1}),
    ("EXST3", exst3, {"TR": 0.02}),
    ("EXST3", exst3, {"VGMAX": 1.0, "KC": 0.5}),
    ("EXAC1A", exac1a, {"TR": 0.02, "TB": 0.5, "TC": 0.3}),
    ("EXAC3", exac3, {"TR": 0.02, "TB": 0.5, "TC": 0.3}),
    ("EXAC3", exac3, {"EFDN": 2.5}),  # up to the bend of its feedback
    ("BBSEX1", bbsex1, {}),
    ("ESURRY", esurry, {"KC": 0.2, "KD": 0.4}),
    ("ESURRY", esurry, {"T1": 0.0, "TB": 0.0, "TA": 0.0}),
    ("URST5T", urst5t, {"KC": 0.1}),
    ("BBSEX1", bbsex1, {"TR": 0.0, "T2": 0.0, "T3": 0.0}),
]


@pytest.mark.parametrize(("name", "diagram", "changes"), LINEAR)
def test_the_linear_exciter_is_its_block_diagram(name, diagram, changes):
    p = parameters(name, changes)
    got = frequency_response(name, p, INPUTS, FREQUENCIES, START)
    expected = np.array([diagram(2j * np.pi * f, p) for f in FREQUENCIES])
    size = np.maximum(np.abs(expected).max(axis=0), 1e-3)
    # differences over 1e-5: rounding over it, and a third derivative times its square
    assert (np.abs(got - expected) / size).max() < 1e-8


# --- ceilings -------------------------------------------------------------------------------------


def of_field_current(vfe, p):
    """Return the efd of an alternator whose field current stands at VFE."""
    ve = brentq(lambda ve: field_current(ve, IFD, vars(p)) - vfe, 0.0, 99.0, xtol=1e-13)
    return rectified(ve, p.KC * IFD)


def of_regulator(p):
    """Return the efd of REXS at VR = VRMAX, with KII = 0."""
    vr = (1.0 + p.FLIMF * (VT - 1.0)) * p.VRMAX
    return of_field_current(vr / (p.KH + 1.0 / p.KIP), p)


def self_supplied(va, p):
    """Return the efd of EXAC3 at which a constant VA holds it."""

    def missing(ve):
        return field_current(ve, IFD, vars(p)) - p.KR * va * rectified(ve, p.KC * IFD)

    ve = brentq(missing, p.E1, 99.0, xtol=1e-13)
    return rectified(ve, p.KC * IFD)


CEILINGS = [
    ("REXS", {"VRMAX": 5.0, "KII": 0.0, "KIP": 2.0}, of_regulator),
    ("REXS", {"VRMAX": 5.0, "KII": 0.0, "FLIMF": 1.0}, of_regulator),
    ("REXS", {"VFMAX": 4.0}, lambda p: of_field_current(4.0, p)),
    ("REXS", {"VFMAX": 4.0, "TP": 0.1, "FLIMF": 1.0}, lambda p: of_field_current(4.0 * VT, p)),
    ("EXPIC1", {}, lambda p: source(VT, IFD, p)),  # VR = 1
    ("EXPIC1", {"VR1": 0.6}, lambda p: 0.6 * source(VT, IFD, p)),
    ("EXPIC1", {"VRMAX": 0.7, "TA4": 0.1, "TA3": 0.3}, lambda p: 0.7 * source(VT, IFD, p)),
    ("EXPIC1", {"EFDMAX": 4.0}, lambda p: 4.0),
    ("EXPIC1", {"KP": 0.0, "VR1": 5.0, "VRMAX": 3.0}, lambda p: 3.0),  # without a source VB = 1
    (
        "EXPIC1",
        {"EFDMAX": 4.0, "TE": 0.2},
        lambda p: brentq(lambda e: field_current(e, 0.0, vars(p)) - 4.0, 0.0, 9.0, xtol=1e-13),
    ),
    ("EXST2", {}, lambda p: p.EFDMAX),
    ("EXST2", {"EFDMAX": 9.0, "KE": 0.9}, lambda p: (p.VRMAX + source(VT, IFD, p)) / p.KE),
    ("EXST2", {"KP": 0.0, "KI": 0.0, "EFDMAX": 9.0}, lambda p: p.VRMAX + 1.0),
    ("EXST3", {}, lambda p: source(VT, IFD, p)),  # VRMAX = 1
    ("EXST3", {"EFDMAX": 4.0}, lambda p: 4.0),
    ("EXAC1A", {}, lambda p: of_field_current(p.VRMAX, p)),
    ("EXAC3", {"VAMAX": 0.4, "TE": 0.5}, lambda p: self_supplied(p.VAMAX, p)),
    ("ESURRY", {"KD": 0.4, "TE": 0.9, "TD": 2.0}, lambda p: of_field_current(p.VRMAX, p)),
    ("URST5T", {"KC": 0.1}, lambda p: p.VRMAX - p.KC * IFD),  # VT is above 1
    ("BBSEX1", {"VRMAX": 3.0}, lambda p: 3.0),
    ("BBSEX1", {"EFDMAX": 3.0}, lambda p: 3.0 * VT),
]


@pytest.mark.parametrize(("name", "changes", "ceiling"), examples_of(CEILINGS, 4))
def test_a_large_step_drives_efd_to_its_ceiling_never_beyond_and_back(name, changes, ceiling):
    """Up for twenty seconds, sixteen time constants of the slowest here, then down for ten."""
    p = parameters(name, changes)
    expected = ceiling(p)
    times, efd = alone(
        name, vars(p), vref=lambda t: 0.5 if t < 20.0 else -0.5, time=30.0, step=5e-3, **START
    )
    assert efd[times < 20.0][-1] == pytest.approx(expected, rel=1e-6)
    # Runge-Kutta leaves a limit by rounding
    assert efd.max() < expected * (1.0 + 1e-9)
    assert efd[-1] < 0.5 * EFD


@pytest.mark.parametrize("name", ["EXAC3"])
def test_a_low_voltage_limiter_holds_efd_above_nothing(name):
    p = parameters(name, {"TE": 0.5, "VAMAX": 9.0, "VLV": 0.9})
    _, efd = alone(name, vars(p), vref=-0.5, time=30.0, step=5e-3, **START)

    def missing(efd):
        ve = efd + p.KC * IFD / np.sqrt(3.0) if 0.4 * efd > p.KC * IFD else np.nan
        return field_current(ve, IFD, vars(p)) - p.KR * efd * p.KA * p.KLV * (p.VLV - efd)

    held = brentq(missing, 0.7, p.VLV, xtol=1e-13)
    assert efd[-1] == pytest.approx(held, rel=1e-6)
    assert efd.min() > 0.5 * held


# --- typical data ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted({row[0] for row in LINEAR}))
def test_typical_data_give_a_stable_step_of_five_percent(name):
    system, values = system_of(name), typical_values(name)
    times = np.linspace(0.0, 30.0, 601)
    simulator = Simulator(system, Inputs(0.0, 30.0, (InputStep(0.5, 0.05),)), times, 1e-3)
    vt = simulator.with_enough_substeps(values).samples(values, ("vt",))[0][:, 0]
    assert rates_at_rest(system, values).real.max() < 0.0
    assert vt.max() < 1.0 + 1.3 * 0.05  # an overshoot of at most 30 %
    assert vt[-1] == pytest.approx(1.05, abs=1e-3)  # proportional regulators leave some
