"""The alternator exciters against transfer functions, ceilings of the standard and a simulator.

The transfer functions are assembled from the block diagrams of IEEE Std 421.5-2005, clause 6, by
algebra of polynomials: no state and no equation of the models is used.
"""

import numpy as np
import pytest
from diagrams import Transfer, alone, field_current, lag, lead_lag, rectified, saturation, washout
from oracle import system_of, typical_values
from references import reference

from exfit.models import MODELS, find
from exfit.models.blocks import limited_lead_lag
from exfit.models.sheet import typical
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

ALTERNATORS = ("AC2A", "AC3A", "AC4A", "AC5A", "AC6A", "EXAC4")


# --- small signals: transfer functions ------------------------------------------------------------


def at_rest(p, efd, ifd):
    """Return VE and the slopes of efd and VFE to it, from the standard's formulas."""
    load = p["KC"] * ifd
    ve = efd + load / np.sqrt(3.0)  # the first arc: IN is small
    assert load / ve < np.sqrt(3.0) / 4.0
    return ve, 1.0, p["KE"] + saturation(ve, p)[1]


def ac2a(p, efd, ifd):
    _, gain, slope = at_rest(p, efd, ifd)
    alternator = lag(1.0 / slope, p["TE"] / slope)
    inner = (p["KB"] * alternator).fed_back(p["KH"] * slope)
    forward = lead_lag(p["TC"], p["TB"]) * lag(p["KA"], p["TA"]) * inner
    return gain * forward.fed_back(slope * washout(p["KF"], p["TF"]))


def ac3a(p, efd, ifd):
    ve, gain, slope = at_rest(p, efd, ifd)
    assert saturation(ve, p)[1] == 0.0  # below the knee: VFE is a straight line
    vfe = p["KE"] * ve + p["KD"] * ifd
    # VR = KR efd VA: around a rest, KR efd0 dVA + (VFE0 / efd0) defd
    alternator = Transfer([1.0], [p["TE"], slope - vfe / efd * gain])
    feedback = p["KF"] if efd < p["EFDN"] else p["KN"]
    forward = lag(p["KA"], p["TA"]) * (p["KR"] * efd) * alternator * gain
    return lead_lag(p["TC"], p["TB"]) * forward.fed_back(washout(feedback, p["TF"]))


def ac4a(p, efd, ifd):
    return lead_lag(p["TC"], p["TB"]) * lag(p["KA"], p["TA"])


def ac5a(p, efd, ifd):
    slope = p["KE"] + saturation(efd, p)[1]
    path = washout(p["KF"], p["TF1"]) * lead_lag(p["TF3"], p["TF2"])
    regulator = lag(p["KA"], p["TA"]).fed_back(path)
    return regulator * lag(1.0 / slope, p["TE"] / slope)


def ac6a(p, efd, ifd):
    ve, gain, slope = at_rest(p, efd, ifd)
    alternator = lag(1.0 / slope, p["TE"] / slope)
    limiter = p["KH"] * slope * lead_lag(p["TJ"], p["TH"])
    acts = p["KE"] * ve + p["KD"] * ifd > p["VFELIM"]
    regulator = p["KA"] * lead_lag(p["TK"], p["TA"]) * lead_lag(p["TC"], p["TB"])
    return gain * regulator * (alternator.fed_back(limiter) if acts else alternator)


LINEAR = {"AC2A": ac2a, "AC3A": ac3a, "AC4A": ac4a, "AC5A": ac5a, "AC6A": ac6a, "EXAC4": ac4a}
EFD, IFD = 1.3, 1.1
# every block of the diagram takes part, and nothing is near a limit or a knee
LIVELY = {
    "AC2A": {"TB": 1.5, "TC": 0.4, "KB": 10.0, "KA": 80.0},
    "AC3A": {"TB": 1.5, "TC": 0.4},
    "AC4A": {"KC": 0.3},
    "AC5A": {"TF3": 0.3, "KA": 100.0},
    "AC6A": {"KA": 100.0},
    "EXAC4": {"KC": 0.3},
}
CASES = [
    *((name, {}) for name in ALTERNATORS),
    ("AC3A", {"EFDN": 0.9}),  # beyond the bend of its feedback
    ("AC5A", {"TF2": 0.0, "TF3": 0.3}),  # both bypassed
    ("AC5A", {"TF3": 0.0}),
    ("AC6A", {"VFELIM": 2.5, "KH": 3.0}),  # its field current limiter acts
]


@pytest.mark.parametrize(("name", "changes"), CASES)
def test_a_small_step_gives_the_response_of_the_block_diagram(name, changes):
    values = typical(MODELS[name].sheet) | {"TR": 0.02} | LIVELY[name] | changes
    bypassed = {"TF2": 1.0, "TF3": 1.0} if values.get("TF2") == 0.0 else {}
    expected = LINEAR[name](values | bypassed, EFD, IFD)
    size = 1e-6
    times, efd = alone(name, values, vref=size)
    got = efd - EFD
    linear = size * expected.step(times)
    # what remains, 1e-6 at most, is curvature over a change of 1e-4 pu and the error of the step
    assert np.abs(linear).max() > 1e-6
    assert np.abs(got - linear).max() < 1e-5 * np.abs(linear).max()


# --- large signals: the ceilings of the standard --------------------------------------------------


def where_field_current_is(wanted, p):
    """Return VE, by bisection."""
    low, high = 0.0, 100.0
    for _ in range(100):
        ve = (low + high) / 2.0
        low, high = (ve, high) if field_current(ve, IFD, p) < wanted else (low, ve)
    return low


def ceiling(name, p):
    """Return the efd that a large step up reaches, from the limits of the diagram."""
    if name in ("AC4A", "EXAC4"):
        return p["VRMAX"] - p["KC"] * IFD
    if name == "AC5A":
        return where_field_current_is(p["VRMAX"], p)
    if name == "AC6A":  # VR = VT VRMAX in equilibrium with VFE, VT = 1
        ve = where_field_current_is(p["VRMAX"], p)
    else:
        ve = where_field_current_is(p["VFEMAX"], p)
    return rectified(ve, p["KC"] * IFD)


def floor(name, p):
    """Return the efd that a large step down reaches."""
    if name == "AC3A":
        return rectified(p["VEMIN"], p["KC"] * IFD)
    return {"AC4A": p["VRMIN"], "EXAC4": p["VRMIN"] - p.get("KC", 0.0) * IFD}.get(name, 0.0)


# the limiter of AC6A would act before its regulator is at its ceiling
AT_LIMITS = {"AC6A": {"VFELIM": 999.0}, "AC4A": {"KC": 0.3}, "EXAC4": {"KC": 0.3}}


@pytest.mark.parametrize("name", ALTERNATORS)
def test_a_large_step_drives_efd_to_the_ceiling_and_to_the_floor_of_the_standard(name):
    values = typical(MODELS[name].sheet) | AT_LIMITS.get(name, {})
    up, down = alone(name, values, vref=[0.5, -0.5], time=6.0, step=4e-3)[1][-1]
    assert up == pytest.approx(ceiling(name, values), rel=1e-3)
    assert down == pytest.approx(floor(name, values), abs=1e-6)


@pytest.mark.long
def test_the_field_current_limiter_of_ac6a_holds_the_field_current_near_its_reference():
    """With VA at VAMAX, VFE = VAMAX - KH (VFE - VFELIM) holds at rest."""
    p = typical(MODELS["AC6A"].sheet) | {"VFELIM": 5.0}
    up = alone("AC6A", p, vref=0.5, time=6.0, step=4e-3)[1][-1]
    vfe = (p["VAMAX"] + p["KH"] * p["VFELIM"]) / (1.0 + p["KH"])
    ve = where_field_current_is(vfe, p)
    assert up == pytest.approx(rectified(ve, p["KC"] * IFD), rel=1e-4)


def test_the_clamp_of_exac4_winds_up_and_the_limit_of_ac4a_does_not():
    """The lag of EXAC4 has to come back to the ceiling first, from as far as the error drove it."""
    up_and_down = {}
    for name in ("AC4A", "EXAC4"):
        values = typical_values(name)
        inputs = Inputs(0.0, 1.0, (InputStep(0.1, 0.5), InputStep(0.6, -0.5)))
        simulator = Simulator(system_of(name), inputs, np.linspace(0.0, 1.0, 1001), 1e-3)
        up_and_down[name] = simulator.response(values, ("efd",)).signals["efd"]
    held = {name: efd[600:] >= 5.64 - 1e-9 for name, efd in up_and_down.items()}
    assert not held["AC4A"][2:].any()
    assert held["EXAC4"][:5].all()
    assert not held["EXAC4"][-1]


# --- the lead-lag with a limit --------------------------------------------------------------------


def annex_e(u, TC, TB, low, high, h):
    """Return the block diagram of annex E: the limited output is fed back through 1/(1 + sTC)."""
    w, found = 0.0, []
    for value in u:
        y = np.clip(TC / TB * (value + (TB / TC - 1.0) * w), low, high)
        found.append(y)
        w += h * (y - w) / TC
    return np.array(found)


@pytest.mark.parametrize(("TC", "TB"), [(3.0, 9.0), (0.2, 1.0), (0.6, 0.3), (0.4, 0.4)])
def test_a_limited_lead_lag_is_the_diagram_of_annex_e(TC, TB):
    h, x = 1e-3, 0.0
    u = np.where(np.arange(3000) * h < 2.0, 5.0, -1.0)
    got = []
    for value in u:
        y, slope = limited_lead_lag(value, x, TC, TB, -0.7, 1.5)
        got.append(y)
        x += h * slope.slope
    expected = annex_e(u, TC, TB, -0.7, 1.5, h)
    assert expected.max() == 1.5
    # two Euler runs of equations that are the same
    assert np.abs(np.array(got) - expected).max() < 2e-3


def test_a_limited_lead_lag_without_lead_is_a_limited_lag():
    for u, x, slope in ((5.0, 1.5, 0.0), (1.0, 1.5, -1.0), (5.0, 0.5, 9.0), (-5.0, -0.7, 0.0)):
        y, held = limited_lead_lag(u, x, 0.0, 0.5, -0.7, 1.5)
        assert (y, held.slope) == (x, slope)
        assert (held.low, held.high) == (-0.7, 1.5)
    y, bypassed = limited_lead_lag(5.0, 0.3, 0.2, 0.0, -0.7, 1.5)
    assert (y, bypassed.slope) == (1.5, 0.0)


# --- another simulator ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "ours", "vt", "efd"),
    [
        ("exac4", "EXAC4", 1e-6, 2e-4),
        ("exac4", "AC4A", 1e-6, 2e-4),  # KC = 0, and no limit is met: the same model here
        ("esac5a", "AC5A", 5e-6, 2e-4),
    ],
)
def test_a_step_is_that_of_another_simulator(name, ours, vt, efd):
    """What is left is the other one's step of 1 ms (trapezoidal rule), squared.

    vt differs by 2.6e-7 (EXAC4) and 1.1e-6 pu (AC5A, which is at VRMAX from 1.008 to 1.135 s),
    efd by 1.2e-4 and 7e-5. A fourth of our step leaves EXAC4 as it is; AC5A then differs by
    3.2e-6 and 1.4e-4: the instants at which the limit is met and left are known to a step of each
    program. Rounded constants have no part in it: neither model has a rectifier; saturation is
    quadratic in both.
    """
    _, values, inputs, columns, described = reference(f"andes_{name}_up5")
    simulator = Simulator(system_of(ours), inputs, columns["t"], 1e-3)
    assert values.keys() == set(simulator.system.parameters)
    got = simulator.response(values).signals
    assert got["vref"][0] == pytest.approx(described["vref_initial"], abs=1e-9)
    assert np.abs(got["vt"] - columns["vt"]).max() < vt
    assert np.abs(got["efd"] - columns["efd"]).max() < efd
    assert np.abs(got["ifd"] - columns["ifd"]).max() < efd


# --- names ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ESAC2A", "ESAC3A", "ESAC4A", "ESAC5A", "ESAC6A", "EXAC4"])
def test_a_psse_name_finds_its_model_and_its_record(name, tmp_path):
    found = find(name, tmp_path)
    (record,) = found.records
    assert record.name == name
    assert set(record.cons) == {row.symbol for row in found.sheet}
