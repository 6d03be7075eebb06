"""Commutator exciters against another simulator, transfer functions and the standard's formulas."""

import numpy as np
import pytest
from diagrams import Transfer, lag, lead_lag, pid, washout
from oracle import rates_at_rest, system_of, typical_values, vector
from references import reference
from scipy.optimize import brentq

from exfit.engine.kernel import LinearKernel
from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.plants import MACHINE, SATURATION, VT0
from exfit.plants.parts import Names, exciter_inputs, exciter_parameters
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

CONTINUOUS = ("DC1A", "DC2A", "DC1C", "DC2C", "IEEET1", "IEEEX1", "EXDC2")
BY_VR = ("IEEET2", "EXDC2A")  # whose rate feedback is taken from VR
COMPUTING = (*CONTINUOUS, *BY_VR, "DC4B")  # where KE = 0 and VRMAX = 0 are computed
GIVEN = ("DC3A", "DC4C")  # where they are as they are given
ALL = (*COMPUTING, *GIVEN)
BUS_FED = ("DC2A", "DC2C", "EXDC2", "EXDC2A", "DC4B", "DC4C")  # limits proportional to VT
NOT_NEGATIVE = ("DC1A", "DC2A")  # EFD >= 0
TD0 = 6.0
PLAIN = {"Tpd0": TD0, "S10": 0.0, "S12": 0.0}  # a machine that is a lag: vt = efd / (1 + s Td0)


def values_of(name, vt0=1.0, **changes):
    """Return values on a machine that is a lag; no lag is bypassed, EFD stands above its knee."""
    values = typical_values(name, "ONE_AXIS") | {VT0: vt0}
    lively = {"TR": 0.02, "TA": 0.05, "TB": 0.3, "TC": 0.1, "KF": 0.06, "TF": 0.8, "TF1": 0.8}
    knee = {"E1": 1.2, "SE1": 0.1, "E2": 2.0, "SE2": 0.3}
    values |= {symbol: value for symbol, value in (lively | knee).items() if symbol in values}
    values |= {MACHINE + symbol: value for symbol, value in PLAIN.items()}
    return values | {symbol.replace("machine_", MACHINE): v for symbol, v in changes.items()}


def vx(e):
    """Return VX through 1.2 pu: .12 and 2.0 pu: .6, typed again."""
    ratio = np.sqrt(0.12 / 0.6)
    knee = (1.2 - ratio * 2.0) / (1.0 - ratio)
    return 0.6 * (max(e - knee, 0.0) / (2.0 - knee)) ** 2


def respond(name, values, *changes, end=3.0, outputs=("vt", "efd")):
    """Return the outputs (M, ny) every 10 ms."""
    inputs = Inputs(0.0, end, tuple(InputStep(*change) for change in changes))
    times = np.linspace(0.0, end, round(100 * end) + 1)
    system = system_of(name, "ONE_AXIS")
    return Simulator(system, inputs, times, 1e-3).samples(values, outputs)[0]


# --- another simulator ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["ieeet1", "esdc2a"])
def test_a_bump_up_is_that_of_another_simulator(name):
    """Nothing is rounded there: what differs is its trapezoidal rule at 1 ms."""
    model, values, inputs, columns, described = reference(f"reference_{name}")
    system = system_of(model)
    assert values.keys() == set(system.parameters)
    got = Simulator(system, inputs, columns["t"], 1e-3).response(values).signals
    assert got["vref"][0] == pytest.approx(described["vref_initial"], abs=1e-9)
    assert np.abs(got["vt"] - columns["vt"]).max() < 5e-7
    assert np.abs(got["efd"] - columns["efd"]).max() < 5e-5
    assert np.abs(got["ifd"] - columns["ifd"]).max() < 5e-6


# --- small steps: transfer functions --------------------------------------------------------------


def effective_KE(p, efd):
    return p["KE"] if p["KE"] != 0.0 else p["VRMAX"] / (10.0 * efd) - vx(efd) / efd


def field_of(p, KE, efd):
    """Return 1 / (sTE + KE + dVX/dE)."""
    slope = (vx(efd + 1e-5) - vx(efd - 1e-5)) / 2e-5
    return Transfer(1.0, [p["TE"], KE + slope])


def continuous_loop(p, vt0):
    """Return vt / vref of a lead-lag regulator with rate feedback from EFD."""
    regulator = lead_lag(p.get("TC", 0.0), p.get("TB", 0.0)) * lag(p["KA"], p["TA"])
    forward = regulator * field_of(p, effective_KE(p, vt0), vt0)
    rated = forward.fed_back(washout(p["KF"], p.get("TF", p.get("TF1"))))
    return (rated * lag(1.0, TD0)).fed_back(lag(1.0, p["TR"]))


def brushless_loop(p, vt0):
    """Return vt / vref with a rate feedback that is taken from VR through two lags."""
    feedback = washout(p["KF"], p["TF1"]) * lag(1.0, p["TF2"])
    chain = lead_lag(p.get("TC", 0.0), p.get("TB", 0.0)) * lag(p["KA"], p["TA"])
    regulator = chain.fed_back(feedback)
    forward = regulator * field_of(p, effective_KE(p, vt0), vt0)
    return (forward * lag(1.0, TD0)).fed_back(lag(1.0, p["TR"]))


def pid_loop(p, vt0):
    """Return vt / vref of DC4B, whose regulator is fed from the terminals."""
    KE, machine = effective_KE(p, vt0), lag(1.0, TD0)
    at_rest = (KE * vt0 + vx(vt0)) / (p["KA"] * vt0)  # the PID's output
    regulator = vt0 * pid(p["KP"], p["KI"], p["KD"], p["TD"])
    fed = lag(p["KA"], p["TA"]) * field_of(p, KE, vt0)
    rated = fed.fed_back(regulator * washout(p["KF"], p["TF"]) + -at_rest * machine)
    return (regulator * rated * machine).fed_back(lag(1.0, p["TR"]))


def fed_pid_loop(p, vt0):
    """Return vt / vref of DC4C, whose exciter is fed through a rectifier from the terminals.

    Loaded a little, that gives vt - KC1 VFE / sqrt(3).
    """
    machine, slope = lag(1.0, TD0), (vx(vt0 + 1e-5) - vx(vt0 - 1e-5)) / 2e-5
    vfe = p["KE"] * vt0 + vx(vt0)
    loading = p["KC1"] / np.sqrt(3.0) if vfe > 0.0 else 0.0
    supply = vt0 - loading * vfe
    at_rest = vfe / supply  # VR
    field = Transfer(1.0, [p["TE"], (p["KE"] + slope) * (1.0 + at_rest * loading)])
    regulator = pid(p["KPR"], p["KIR"], p["KDR"], p["TDR"]) * lag(p["KA"], p["TA"])
    feedback = supply * regulator * washout(p["KF"], p["TF"]) + -at_rest * machine
    forward = supply * regulator * field.fed_back(feedback)
    return (forward * machine).fed_back(lag(1.0, p["TR"]))


def rheostat_loop(p, vt0):
    """Return vt / vref of DC3A between its contacts."""
    rheostat = Transfer((p["VRMAX"] - p["VRMIN"]) / (p["KV"] * p["TRH"]), [1.0, 0.0])
    forward = rheostat * field_of(p, p["KE"], vt0) * lag(1.0, TD0)
    return forward.fed_back(lag(1.0, p["TR"]))


LOOPS = {
    **dict.fromkeys(BY_VR, brushless_loop),
    "DC4B": pid_loop,
    "DC4C": fed_pid_loop,
    "DC3A": rheostat_loop,
}


@pytest.mark.parametrize("vt0", [0.9, 1.1])
@pytest.mark.parametrize("KE", [1.0, 0.0, -0.05])
@pytest.mark.parametrize("name", ALL)
def test_a_small_step_is_that_of_the_transfer_function(name, KE, vt0):
    """The step is small enough for VX to be straight; its rounding is 1e-10 of the step."""
    if name in GIVEN and KE == 0.0:
        pytest.skip(f"{name} computes no KE")
    size = 1e-6
    gain = {"KA": 25.0} if name in (*CONTINUOUS, *BY_VR) else {}
    loaded = {"KC1": 0.2, "VBMAX": 9.0} if name == "DC4C" else {}
    limits = {"VRMAX": 9.0, "VRMIN": -9.0} if name != "DC3A" else {}  # far away
    values = values_of(name, vt0, KE=KE, **gain, **loaded, **limits)
    got = respond(name, values, (0.0, size))[:, 0]
    loop = LOOPS.get(name, continuous_loop)
    times = np.linspace(0.0, 3.0, 301)
    expected = loop(values, vt0).step(times)
    # VX curves by some 1e-5 of the step, and the method errs by (step / shortest lag)^4 / 120
    assert np.abs((got - vt0) / size - expected).max() < 1e-5 * np.abs(expected).max()
    assert np.abs(expected).max() > 1e-2  # it moves


# --- large steps: ceilings and floors -------------------------------------------------------------


def steady(p, vr):
    """Return the EFD that a VR holds."""
    return brentq(lambda e: p["KE"] * e + vx(e) - vr, -100.0, 100.0)


@pytest.mark.parametrize("name", ALL)
def test_a_large_step_drives_efd_to_the_ceiling_and_back_to_the_floor(name):
    """A quick exciter on a slow machine: EFD follows the limits of VR, which may follow VT."""
    values = values_of(name, KE=0.9, TE=0.05, VRMAX=3.0, VRMIN=-2.0, machine_Tpd0=50.0)
    values |= {"VEMIN": 0.3} if "VEMIN" in values else {}
    values |= {symbol: 0.0 for symbol in ("KD", "KF", "KC1") if symbol in values}
    vt, efd = respond(name, values, (0.0, 2.0), (4.0, -4.0), end=8.0).T
    fed = vt if name in BUS_FED else np.ones_like(vt)
    up, down = 399, 799
    # EFD lags its limit by TE / KE: 0.06 s, in which vt moves by 0.06 pu/s at most
    assert efd[up] == pytest.approx(steady(values, 3.0 * fed[up]), rel=5e-3)
    lowest = -2.0 * fed[down] / 0.9
    if name in NOT_NEGATIVE or "VEMIN" in values:
        assert efd[down] == values.get("VEMIN", 0.0)
    else:
        assert efd[down] == pytest.approx(lowest, rel=5e-3)
    if name in BUS_FED:
        assert abs(fed[up] - 1.0) > 0.05  # far enough from 1 to tell the two kinds apart


@pytest.mark.parametrize("name", COMPUTING)
def test_a_regulator_at_its_limit_turns_back_at_once(name):
    """Non-windup: VR leaves its ceiling within TA of the moment that its input turns."""
    values = values_of(name, KE=0.9, TA=0.02, machine_Tpd0=50.0)
    values |= {symbol: 0.0 for symbol in ("KI", "KD", "KF", "TB", "TC") if symbol in values}
    vr = respond(name, values, (0.0, 2.0), (2.0, -4.0), end=2.5, outputs=("VR",))[:, 0]
    assert vr[199] > 0.9 * values["VRMAX"]
    # five lags after the turn it has gone all the way
    assert vr[212] < 0.0 if values["VRMIN"] < 0.0 else vr[212] < 0.02 * vr[199]


# --- KE = 0 and VRMAX = 0 -------------------------------------------------------------------------


def setpoints(name, values):
    system = system_of(name, "ONE_AXIS")
    rest = LinearKernel(system).rest(vector(system, values))
    found = dict(zip(system.setpoints, rest.r, strict=True))
    return found | dict(zip(system.states, rest.x, strict=True))


@pytest.mark.parametrize("vt0", [0.5, 1.0, 1.2])
@pytest.mark.parametrize("name", COMPUTING)
def test_a_self_excited_exciter_starts_at_a_tenth_of_its_ceiling(name, vt0):
    values = values_of(name, vt0, KE=0.0)
    found = setpoints(name, values)
    assert found["VR"] == pytest.approx(values["VRMAX"] / 10.0, rel=1e-12)
    assert found["KE0"] * vt0 + vx(vt0) == pytest.approx(values["VRMAX"] / 10.0, rel=1e-12)


@pytest.mark.parametrize("name", COMPUTING)
def test_a_self_excited_exciter_is_the_one_with_the_computed_constant(name):
    given = values_of(name, KE=values_of(name)["VRMAX"] / 10.0 - vx(1.0))
    got, expected = (respond(name, values, (0.1, 0.02)) for values in (given | {"KE": 0.0}, given))
    assert np.abs(got - expected).max() < 1e-10


@pytest.mark.parametrize(("KE", "ceiling"), [(1.0, 2.6), (0.5, 1.6), (0.0, 0.6), (-0.05, 0.6)])
@pytest.mark.parametrize("name", COMPUTING)
def test_a_ceiling_of_zero_is_what_the_upper_point_of_saturation_needs(name, KE, ceiling):
    values = values_of(name, 0.55, KE=KE, VRMAX=0.0)
    found = setpoints(name, values)
    assert found["VRMAX0"] == pytest.approx(ceiling, rel=1e-12)
    assert found["VRMIN0"] == pytest.approx(-ceiling, rel=1e-12)
    swapped = values | {"E1": 2.0, "SE1": 0.3, "E2": 1.2, "SE2": 0.1}
    assert setpoints(name, swapped)["VRMAX0"] == pytest.approx(ceiling, rel=1e-12)
    explicit = values | {"VRMAX": found["VRMAX0"], "VRMIN": found["VRMIN0"]}
    got, expected = (respond(name, one, (0.1, 0.3)) for one in (values, explicit))
    assert np.abs(got - expected).max() < 1e-10


@pytest.mark.parametrize("name", COMPUTING)
def test_values_that_are_given_are_kept(name):
    values = values_of(name, KE=-0.05, VRMAX=2.0, VRMIN=-1.5)
    found = setpoints(name, values)
    assert (found["KE0"], found["VRMAX0"], found["VRMIN0"]) == (-0.05, 2.0, -1.5)


@pytest.mark.parametrize("name", ALL)
def test_a_start_beyond_the_ceiling_is_named(name):
    with pytest.raises(SimulationError, match=r"above VRMAX = 0\.5"):
        respond(name, values_of(name, KE=1.0, VRMAX=0.5), (0.1, 0.01))


# --- what the models share ------------------------------------------------------------------------


def shared(values, name):
    """Return the values under the names of another model of the family."""
    rows = [row.symbol for row in MODELS[name].sheet]
    own = {symbol: values[symbol] for symbol in rows if symbol in values}
    other = {new: values[old] for new, old in (("TF", "TF1"), ("TF1", "TF")) if old in values}
    rest = {key: value for key, value in values.items() if MACHINE in key or key == VT0}
    without = {"TB": 0.0, "TC": 0.0, "VEMAX": 99.0, "VEMIN": -99.0}
    return {symbol: (without | other | own)[symbol] for symbol in rows} | rest


@pytest.mark.parametrize("name", CONTINUOUS)
def test_off_the_limits_the_continuous_regulators_are_one_model(name):
    values = values_of("IEEET1")
    expected = respond("IEEET1", values, (0.1, 0.01))
    assert np.abs(respond(name, shared(values, name), (0.1, 0.01)) - expected).max() < 1e-12


@pytest.mark.parametrize("name", ALL)
def test_the_typical_data_are_stable_on_open_circuit(name):
    for machine in ("GENROU", "ONE_AXIS"):
        assert growth(name, typical_values(name, machine), machine) < -0.01


def growth(name, values, machine):
    """Return the largest real part (1/s) of the eigenvalues at rest."""
    return rates_at_rest(system_of(name, machine), values).real.max()


def test_the_rheostat_of_the_standard_s_sample_hunts_on_open_circuit():
    sample = {"KV": 0.05, "TRH": 20.0, "TE": 0.5, "KE": 0.05, "VRMAX": 1.0, "VRMIN": 0.0}
    assert growth("DC3A", typical_values("DC3A", **sample), "GENROU") > 0.1


# --- gates and contacts ---------------------------------------------------------------------------


def slopes(name, values, vref=None, **inputs):
    """Return the slopes at rest, with inputs or the reference moved away from it."""
    found = MODELS[name]
    p = exciter_parameters(values, found, SATURATION["quadratic"])
    x, d = Names(), Names()
    u = exciter_inputs(vt=1.1, ifd=1.1)
    u.vref = found.rest(1.1, u, p, x)
    changed = exciter_inputs(vt=1.1, ifd=1.1, vref=u.vref + (vref or 0.0), **inputs)
    found.equations(x, changed, p, d)
    return {state: getattr(s, "slope", s) for state, s in vars(d).items()}, x


@pytest.mark.parametrize("name", ["DC1A", "DC2A", "DC1C", "DC2C"])
def test_an_underexcitation_limiter_takes_over_above_the_regulator_s_input(name):
    values = values_of(name, KE=1.0, VRMAX=9.0)
    gain, T = values["KA"], values["TA"]
    still, x = slopes(name, values, vuel=-1.0)
    assert still["VR"] == pytest.approx(0.0, abs=1e-9)
    taken, _ = slopes(name, values, vuel=x.VR / gain + 0.01)
    assert taken["VR"] == pytest.approx(gain * 0.01 / T)


@pytest.mark.parametrize("name", ["DC4B", "DC4C", "DC1C", "DC2C"])
def test_limiters_take_over_at_the_gates(name):
    """Of the PID, or behind the lead and lag; DC4B multiplies with the voltage before its lag."""
    values = values_of(name, KE=1.0, VRMAX=9.0, VRMIN=-9.0)
    gain = values["KA"] * (1.1 if name == "DC4B" else 1.0)
    rate = gain / values["TA"]
    _, x = slopes(name, values)
    at = x.VR / gain
    for inputs, change in (
        ({"vuel": at + 0.01}, 0.01),
        ({"vuel": at - 0.01}, 0.0),
        ({"voel": at - 0.02}, -0.02),
        ({"voel": at + 0.02}, 0.0),
        ({"vuel": at + 0.01, "voel": at - 0.02}, -0.02),  # the low value gate is the last
    ):
        got, _ = slopes(name, values, **inputs)
        assert got["VR"] == pytest.approx(rate * change, abs=1e-9)


@pytest.mark.parametrize("name", ["DC1C", "DC2C", "DC4C"])
def test_what_limiters_add_is_a_step_of_the_reference(name):
    values = values_of(name, KE=1.0, VRMAX=9.0, VRMIN=-9.0)
    assert slopes(name, values, vsum=0.01)[0] == slopes(name, values, vref=0.01)[0]


@pytest.mark.parametrize("name", ["DC1C", "DC2C"])
def test_the_ceiling_of_the_field_voltage_is_reached_left_and_never_passed(name):
    values = values_of(name, KE=0.9, TE=0.05, VRMAX=3.0, machine_Tpd0=50.0, VEMAX=1.8, VEMIN=-9.0)
    efd = respond(name, values, (0.0, 2.0), (1.0, -4.0), end=1.5)[:, 1]
    assert efd.max() == efd[99] == 1.8
    assert efd[110] < 1.7


def test_a_supply_of_its_own_is_free_of_the_terminals():
    """SW1 = 2 feeds DC4C with KP, whatever VT is; what the rectifier loses is as without it."""
    values = values_of("DC4C", KE=1.0, VRMAX=9.0, KP=1.3, KC1=0.0)
    p = exciter_parameters(values, MODELS["DC4C"], SATURATION["quadratic"])
    vfe = 1.2 + vx(1.2)
    for p.SW1, p.VBMAX, expected in ((1.0, 9.0, 1.3 * 0.9), (2.0, 9.0, 1.3), (2.0, 0.8, 0.8)):
        x = Names()
        MODELS["DC4C"].rest(1.2, exciter_inputs(vt=0.9, ifd=1.1), p, x)
        assert vfe / x.VR == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("share", "vr"), [(0.999, "VRH"), (1.001, "VRMAX"), (-0.999, "VRH"), (-1.001, "VRMIN")]
)
def test_the_contacts_close_where_the_error_passes_their_setting(share, vr):
    values = values_of("DC3A")
    error = share * values["KV"]
    got, x = slopes("DC3A", values, vref=error)
    held = values.get(vr, x.VRH)
    assert got["EFD"] == pytest.approx((held - x.VRH) / values["TE"], abs=1e-9)
    # at an error of KV the rheostat travels its whole way in TRH, contacts or not
    travel = (values["VRMAX"] - values["VRMIN"]) / values["TRH"]
    assert got["VRH"] == pytest.approx(share * travel)


def test_the_rheostat_stops_at_its_ends():
    values = values_of("DC3A", TRH=1.0, machine_Tpd0=50.0)
    vrh = respond("DC3A", values, (0.0, 2.0), (2.0, -4.0), end=4.0, outputs=("VRH",))[:, 0]
    assert vrh[199] == values["VRMAX"]
    assert vrh[-1] == values["VRMIN"]
