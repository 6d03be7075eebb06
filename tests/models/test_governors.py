"""What every governor of the catalogue keeps to, and each against its transfer function."""

from itertools import pairwise

import numpy as np
import pytest
import thermal_governors
import transfer_functions
from oracle import fastest_rate, float_run, leads_of, tangent_run, vector
from scipy.integrate import solve_ivp

from exfit.engine.kernel import Kernel, Span
from exfit.engine.system import Rest, System
from exfit.engine.tangents import TangentKernel
from exfit.models import GOVERNORS
from exfit.models.blocks import SHORTEST, Limited
from exfit.models.governor_parts import AT_LIMIT, delayed
from exfit.models.sheet import crossed_limits, typical
from exfit.plants.parts import Names, motion, values_named
from exfit.simulation.inputs import Inputs, RecordedInput
from exfit.simulation.simulator import LARGEST_STEP, Simulator

FREQUENCIES = np.geomspace(0.001, 10.0, 41)  # Hz
SIDES = ("dw", "p", "pref")
POWER = 0.7  # pu at the start, within all limits
SELECTORS = ("Rselect", "Flag", "M", "Feedback", "Cflag", "Fd")
VARIANTS = {
    "PIDGOV": ({}, {"Feedback": 0.0}),
    "HYG3": ({}, {"Cflag": 0.0}),
    "H6E": ({}, {"Fd": 0.0}),
}
BAND = {"DBH": 0.004, "DBL": -0.003}
DROOPS = (1.0, 0.0, -1.0, -2.0)  # of GGOV1, by Rselect


@pytest.fixture(params=list(GOVERNORS))
def governor(request):
    return GOVERNORS[request.param]


def seen(**changes):
    return Names(**{"dw": 0.0, "p": POWER, "pref": 0.0, **changes})


NO_CORNER = {"WPIDHY": {"P2": 0.75}, "H6E": {"BGV7": 0.925, "PGV7": 0.690937702}}


def usual(model):
    """Return typical data, of a curve of the power those that have no corner at POWER."""
    return typical(model.sheet) | NO_CORNER.get(model.name, {})


def lively(model):
    """Return typical data with no block bypassed and no band dead."""
    values = usual(model)
    values |= {row.symbol: values[row.symbol] or 0.04 for row in model.sheet if row.is_time}
    if model.name == "IEEEG1":
        values |= {"K7": 0.2, "T2": 0.5, "T1": 1.0}
    if model.name == "PIDGOV":
        values |= {"Ta": 0.1}
    if model.name == "GGOV1":
        values |= {"Kdgov": 0.5, "Tdgov": 0.2, "Kimw": 0.002, "Dm": 0.05, "Flag": 1.0, "Ldref": 2.0}
        values |= {"Tc": 0.03, "Teng": 0.2, "Trate_Mbase": 0.9, "Aset": 9.0}
    return values | thermal_governors.LIVELY.get(model.name, {})


def resting(model, p, power=POWER):
    """Return the states at rest, with the setpoints among them, and the reference."""
    x = Names()
    pref = model.rest(power, seen(p=power), p, x)
    assert vars(x).keys() == {*model.states, *model.setpoints}
    return x, pref


def motion_of(model, p, x, u):
    """Return the slopes of states (n), with their limits, and the output."""
    d = Names()
    pm = model.equations(x, u, p, d)
    assert vars(d).keys() == set(model.states)
    slopes = [getattr(d, name) for name in model.states]
    return np.array([s.slope if isinstance(s, Limited) else s for s in slopes]), pm


def frequency_response(model, values, power=POWER):
    """Return Pm per unit of dw, p and pref (frequencies, 3), from central differences at rest."""
    p, h = Names(**values), 1e-6
    x, pref = resting(model, p, power)
    columns = []
    for name in (*model.states, *SIDES):
        ends = []
        for side in (h, -h):
            s, u = Names(**vars(x)), seen(p=power, pref=pref)
            held = u if name in SIDES else s
            setattr(held, name, getattr(held, name) + side)
            slopes, pm = motion_of(model, p, s, u)
            ends.append(np.append(slopes, pm))
        columns.append((ends[0] - ends[1]) / (2.0 * h))
    whole = np.array(columns).T
    n = len(model.states)
    A, B, C, D = whole[:n, :n], whole[:n, n:], whole[n, :n], whole[n, n:]
    return np.array(
        [C @ np.linalg.solve(2j * np.pi * f * np.eye(n) - A, B) + D for f in FREQUENCIES]
    )


# --- the transfer functions, as the block diagrams print them -------------------------------------


def lag(s, T):
    return 1.0 / (1.0 + s * T)


def lead(s, T1, T2):
    return (1.0 + s * T1) / (1.0 + s * T2) if T2 > 0.0 else 1.0


def tgov1(s, p):
    forward = lag(s, p["T1"]) * lead(s, p["T2"], p["T3"]) / p["R"]
    return [-forward - p["Dt"], 0.0, forward]


def ieeeg1(s, p):
    passes, turbine = 1.0, 0.0
    for K, T in (("K1", "T4"), ("K3", "T5"), ("K5", "T6"), ("K7", "T7")):
        passes *= lag(s, p[T])
        turbine += p[K] * passes
    forward = lag(s, p["T3"]) * turbine
    return [-p["K"] * lead(s, p["T2"], p["T1"]) * forward, 0.0, forward]


def hygov(s, p):
    gate0 = POWER / p["At"] + p["qNL"]
    dashpot = (1.0 + s * p["Tr"]) / (p["r"] * s * p["Tr"]) * lag(s, p["Tf"])
    gate = dashpot / (1.0 + p["R"] * dashpot) * lag(s, p["Tg"])
    flow = 1.0 / (1.0 + s * p["TW"] * gate0 / 2.0)
    head = 2.0 / gate0 * (flow - 1.0)
    forward = gate * p["At"] * (flow + head * (gate0 - p["qNL"]))
    return [-forward - p["Dturb"] * gate0, 0.0, forward]


def gast(s, p):
    forward = lag(s, p["T1"]) * lag(s, p["T2"])
    return [-forward / p["R"] - p["Dturb"], 0.0, forward]


def ieesgo(s, p):
    reheated = p["K2"] * lag(s, p["T5"])
    crossed = p["K3"] * lag(s, p["T6"])
    turbine = lag(s, p["T4"]) * (1.0 - p["K2"] + reheated * (1.0 - p["K3"] + crossed))
    return [-p["K1"] * lag(s, p["T1"]) * lead(s, p["T2"], p["T3"]) * turbine, 0.0, turbine]


def ggov1(s, p):
    ratio, R, select = p["Trate_Mbase"], p["R"], p["Rselect"]
    pid = p["Kpgov"] + p["Kigov"] / s + p["Kdgov"] * s * lag(s, p["Tdgov"])
    actuator, turbine = lag(s, p["Tact"]), ratio * p["Kturb"] * lead(s, p["Tc"], p["Tb"])
    turbine *= thermal_governors.pade(s, p["Teng"])
    fed_back = {1.0: 0.0, 0.0: 0.0, -1.0: actuator, -2.0: 1.0}[select]
    valve = pid / (1.0 + R * fed_back * pid) * actuator
    measured = lag(s, p["Tpelec"]) / ratio
    of_power = -(p["Kimw"] / s + (R if select == 1.0 else 0.0)) * measured
    valve0 = (POWER / ratio + max(p["Dm"], 0.0)) / p["Kturb"] + p["Wfnl"]
    of_speed = p["Flag"] * valve0 * turbine - ratio * max(p["Dm"], 0.0)
    return [-valve * turbine + of_speed, of_power * valve * turbine, valve * turbine]


def slope(p, power):
    """Return the slope of the power over the gate, through G0 to P3."""
    points = [(p["G0"], 0.0), (p["G1"], p["P1"]), (p["G2"], p["P2"]), (1.0, p["P3"])]
    (g0, p0), (g1, p1) = next((a, b) for a, b in pairwise(points) if power <= b[1])
    return (p1 - p0) / (g1 - g0)


def water(s, T):
    return (1.0 - s * T) / (1.0 + s * T / 2.0)


def penstock(s, p, gate0):
    """Return the power per unit of the gate, of a flow whose head follows it."""
    flow = 1.0 / (1.0 + s * p["Tw"] * gate0 / 2.0)
    return p["At"] * (flow + 2.0 / gate0 * (flow - 1.0) * (gate0 - p["qNL"]))


def ieeeg2(s, p):
    forward = water(s, p["T4"])
    speed = p["K"] * lead(s, p["T2"], p["T1"]) * lag(s, p["T3"])
    return [-speed * forward, 0.0, forward]


def ieeeg3(s, p):
    servo = lag(s, p["TP"]) / (p["TG"] * s)
    droop = p["Rperm"] + p["Rtemp"] * s * p["TR"] * lag(s, p["TR"])
    flow = lag(s, p["A11"] * p["TW"])
    coupled = p["A11"] * p["A23"] - p["A13"] * p["A21"]
    turbine = (p["A23"] + coupled * s * p["TW"]) * flow
    forward = servo / (1.0 + servo * droop) * turbine
    return [-forward, 0.0, forward]


def hygov2(s, p):
    regulator = p["KA"] * (1.0 + s * p["T1"]) / (s * p["T3"]) * lead(s, p["T2"], p["T4"]) / s
    droop = p["R"] + p["Rtemp"] * s * p["TR"] * lag(s, p["TR"])
    forward = regulator / (1.0 + regulator * droop)
    forward *= p["PMAX"] * (1.0 - s * p["T5"]) * lag(s, p["T6"])
    return [-(p["KP"] + p["KI"] / s) * forward, 0.0, forward]


def pidgov(s, p):
    controller = (p["Kp"] + p["Ki"] / s + s * p["Kd"]) * lag(s, p["Ta"]) ** 2
    gate, droop = controller * lag(s, p["Tb"]), p["Rperm"] * lag(s, p["Treg"])
    gate /= 1.0 + gate * droop * p["Feedback"]
    gate *= slope(p, POWER) * water(s, p["Atw"] * p["Tw"])
    return [-gate - p["Dturb"], -droop * gate * (1.0 - p["Feedback"]), droop * gate]


def wpidhy(s, p):
    controller = (p["Kp"] + p["Ki"] / s + s * p["Kd"]) * lag(s, p["Ta"]) ** 2
    gate = controller * lag(s, p["Tb"]) * slope(p, POWER) * water(s, p["Tw"])
    droop = p["Reg"] * lag(s, p["Treg"])
    return [-gate - p["D"], droop * gate, -droop * gate]


def hygovr(s, p):
    gate0 = POWER / p["At"] + p["qNL"]
    leads = lag(s, p["Td"])
    for T in ("T1", "T3", "T5", "T7"):
        leads *= lead(s, p[T], p[f"T{int(T[1]) + 1}"])
    servo = p["Kg"] * lag(s, p["Tp"]) / s
    gate = p["Kp"] / s * servo / (1.0 + servo) * penstock(s, p, gate0)
    damping = p["Dturb"] * gate0
    return [-leads * gate - damping, -p["R"] * lag(s, p["Tt"]) * gate, gate]


def hyg3(s, p):
    gate0 = POWER / p["At"] + p["qNL"]
    servo = p["Kg"] * lag(s, p["Tp"]) / s
    turbine = servo / (1.0 + servo) * penstock(s, p, gate0)
    slow, steep = lag(s, p["Td"]), s * lag(s, p["Tf"])
    if p["Cflag"] > 0.5:
        controller = (p["Ki"] / s + p["K2"] + p["K1"] * steep) * slow
        of_speed = 1.0
    else:
        controller = p["Ki"] / s
        of_speed = slow * (1.0 + p["K1"] * steep + p["K2"] * steep**2)
    forward = controller / (1.0 + p["Rgate"] * controller) * turbine
    droop = p["Relec"] * lag(s, p["Tt"])
    return [-of_speed * forward - p["Dturb"] * gate0, -droop * forward, forward]


def h6e(s, p):
    gates, powers, blades, flows = kaplan(p)
    head, k = p["Hdam"], next(k for k in range(10) if powers[k] * p["Hdam"] > POWER)
    gain = (powers[k] - powers[k - 1]) / (flows[k] - flows[k - 1])
    steep = (blades[k] - blades[k - 1]) / (gates[k] - gates[k - 1])
    flow0 = flows[k] - (powers[k] - POWER / head) / gain
    off, own = blades[k] - steep * gates[k], 1.0 - p["Bgvmin"]  # the blade is off + steep gate
    area0 = flow0 / head**0.5
    gate0 = max(np.roots([own * steep, p["Bgvmin"] + own * off, -area0]).real)
    servo = p["Kg"] * lag(s, p["Tg"]) / s
    blade = steep * lag(s, p["Tbd"]) * lag(s, p["Tbs"])
    area = area0 / gate0 * servo / (1.0 + servo) + gate0 * own * blade
    flow = 2.0 * head / area0 / (s * p["Tw"] + 2.0 * head / flow0) * area
    turbine = (head * gain - POWER / head * s * p["Tw"]) * flow
    controller, of_gate = p["Kp"] + p["Ki"] / s, 1.0 - p["Fd"]
    turbine /= 1.0 + of_gate * p["Rg"] * controller
    of_speed = (controller + p["Kd"] * s * lag(s, p["Td"])) * lag(s, p["Tsp"])
    droop = p["Fd"] * p["Re"] * lag(s, p["Tpe"]) * p["Ki"] / s
    return [-of_speed * turbine - p["Dturb"] * gate0, -droop * turbine, controller * turbine]


def kaplan(p):
    """Return gates, powers, blades and flows (10,) of the points of H6E."""
    gates, powers, blades = (
        np.array([p[f"{name}{k}"] for k in range(1, 11)]) for name in ("GV", "PGV", "BGV")
    )
    return gates, powers, blades, gates * (p["Bgvmin"] + (1.0 - p["Bgvmin"]) * blades)


FUNCTIONS = {
    "H6E": h6e,
    "HYG3": hyg3,
    "HYGOV2": hygov2,
    "HYGOVR": hygovr,
    "IEEEG2": ieeeg2,
    "IEEEG3": ieeeg3,
    "PIDGOV": pidgov,
    "WPIDHY": wpidhy,
    "TGOV1": tgov1,
    "IEEEG1": ieeeg1,
    "HYGOV": hygov,
    "GAST": gast,
    "IEESGO": ieesgo,
    "GGOV1": ggov1,
    **thermal_governors.FUNCTIONS,
}


def assert_is_its_function(model, values):
    response = frequency_response(model, values)
    # differences of 1e-6 err by 1e-10 of rounding, over rates of up to 100 per second
    transfer_functions.assert_is_its_function(
        FUNCTIONS[model.name], response, values, FREQUENCIES, 1e-7
    )


def test_every_governor_has_a_transfer_function_here():
    assert FUNCTIONS.keys() == GOVERNORS.keys()


def test_the_response_is_the_product_of_the_blocks(governor):
    for variant in VARIANTS.get(governor.name, ({},)):
        assert_is_its_function(governor, usual(governor) | variant)
        assert_is_its_function(governor, lively(governor) | variant)


def test_the_response_is_the_product_of_the_blocks_for_drawn_values(governor):
    rng = np.random.default_rng(4)
    for _ in range(20):
        values = lively(governor)
        moved = {row.symbol for row in governor.sheet if row.unit in ("s", "1/s")}
        moved |= {"R", "r", "K", "K1", "K2", "KT", "Kpgov"}
        values |= {name: values[name] * 1.5 ** rng.uniform(-1.0, 1.0) for name in moved & {*values}}
        assert_is_its_function(governor, values)


@pytest.mark.parametrize("select", DROOPS)
@pytest.mark.parametrize("flag", [0.0, 1.0])
def test_the_droop_of_GGOV1_is_of_the_signal_that_Rselect_names(select, flag):
    model = GOVERNORS["GGOV1"]
    assert_is_its_function(model, lively(model) | {"Rselect": select, "Flag": flag})


def test_a_time_constant_of_zero_is_the_limit_of_a_small_one(governor):
    rows = {row.symbol: row for row in governor.sheet}
    for row in governor.sheet:
        if not row.is_time or row.low > 0.0:
            continue
        values = lively(governor) | dict.fromkeys(leads_of(row.symbol, rows), 0.0)
        none, small, twice = (
            frequency_response(governor, values | {row.symbol: T})
            for T in (0.0, SHORTEST, 2.0 * SHORTEST)
        )
        # a T + b T^2 + ...: the small ones tell a; 2 (2 pi 10 Hz SHORTEST)^2 = 8e-5 remains
        assert np.abs(2.0 * small - twice - none).max() < 1e-3 * np.abs(none).max(), row.symbol


def test_a_turbine_of_another_rating_is_that_of_its_own_base(governor):
    """Per unit of the turbine the same unit: power and limits are on its base."""
    ratio, values = 0.8, lively(governor)
    one = frequency_response(governor, values | {"Trate_Mbase": 1.0}, POWER)
    other = frequency_response(governor, values | {"Trate_Mbase": ratio}, ratio * POWER)
    np.testing.assert_allclose(other, one * [ratio, 1.0, ratio], rtol=1e-6, atol=1e-9)


def test_a_delay_errs_by_what_the_sheets_say():
    """In degrees at 1/T and 2/T rad/s, from the block's own slopes; its gain is 1."""
    for turn, degrees in ((1.0, 0.0749), (2.0, 1.972)):
        poles = np.array([[0.0, 1.0], [-12.0, -6.0]])
        x, v = np.linalg.solve(1j * turn * np.eye(2) - poles, [0.0, 12.0])
        y, *slopes = delayed(1.0, x, v, 1.0)
        np.testing.assert_allclose(slopes, [1j * turn * x, 1j * turn * v], atol=1e-12)
        assert abs(y) == pytest.approx(1.0, abs=1e-12)
        assert np.degrees(np.angle(y * np.exp(1j * turn))) == pytest.approx(degrees, abs=1e-3)


# --- rest -----------------------------------------------------------------------------------------


def test_rest_is_rest_at_any_power(governor):
    for values in (typical(governor.sheet), lively(governor)):
        for power in (0.3, 0.6, 0.85):
            p = Names(**values)
            x, pref = resting(governor, p, power)
            slopes, pm = motion_of(governor, p, x, seen(p=power, pref=pref))
            assert pm == pytest.approx(power, abs=1e-14)
            assert np.abs(slopes).max() < 1e-13


def test_the_measured_power_reaches_the_output_through_states_alone(governor):
    """A governor driven by a record measures the power that it gives."""
    for values in (typical(governor.sheet), lively(governor)):
        p = Names(**values)
        x, pref = resting(governor, p)
        _, others = motion_of(governor, p, x, seen(p=0.9 * POWER, pref=pref))
        assert others == motion_of(governor, p, x, seen(pref=pref))[1]


@pytest.mark.parametrize("change", [{"Kpload": 0.0}, {"Ka": 0.0}, {"R": 0.0, "Rselect": 0.0}])
def test_GGOV1_rests_without_one_of_its_parts(change):
    model = GOVERNORS["GGOV1"]
    p = Names(**typical(model.sheet) | change)
    x, pref = resting(model, p)
    slopes, pm = motion_of(model, p, x, seen(pref=pref))
    assert pm == pytest.approx(POWER, abs=1e-14)
    assert np.abs(slopes).max() < 1e-13


def limits_of(model):
    """Return the limits that a unit may start beyond, and on which side of it."""
    names = [name.removesuffix("0") for name in model.setpoints if name != "PE0"]
    return {name: -1.0 if "MIN" in name else 1.0 for name in names}


OF_LIMIT = {"HYGOV": "C", "IEEEG1": "VALVE", "IEESGO": "V4", "IEEEG2": "WATER"}
OF_GATE = ("H6E", "HYG3", "HYGOV2", "HYGOVR", "IEEEG3", "PIDGOV", "WPIDHY")
OF_LIMIT |= dict.fromkeys(OF_GATE, "GATE")
BEHIND_WATER = {("WPIDHY", "PMAX"), ("WPIDHY", "PMIN")}  # they stop no state


def stopped_by(model, name):
    """Return the state that a limit stops, or that has its value at rest."""
    if (model.name, name) in BEHIND_WATER:
        return "WATER"
    of = {"Ldref": "TURB", "VMAX": "VALVE", "VMIN": "VALVE"} if model.name == "GGOV1" else {}
    of |= thermal_governors.STATES.get(model.name, {})
    return of.get(name, OF_LIMIT.get(model.name, "V1"))


def started_beyond(model, name, excess):
    """Return typical data with one limit so far on the wrong side of the start at rest."""
    values = typical(model.sheet)
    x, _ = resting(model, Names(**values))
    return values | {name: getattr(x, stopped_by(model, name)) - limits_of(model)[name] * excess}


def test_a_unit_that_starts_slightly_beyond_a_limit_rests_on_it(governor):
    """It is kept there where the speed pushes it on, and leaves it where that turns round."""
    assert limits_of(governor) or governor.name == "WESGOV"
    for name, side in limits_of(governor).items():
        values = started_beyond(governor, name, 0.9 * AT_LIMIT)
        x, pref = resting(governor, Names(**values))
        slopes, pm = motion_of(governor, Names(**values), x, seen(pref=pref))
        assert np.abs(slopes).max() < 1e-13, name
        assert pm == pytest.approx(POWER, abs=1e-14)
        if (governor.name, name) in BEHIND_WATER:
            continue
        undamped = dict.fromkeys({"Dt", "Dturb", "D"} & {*values}, 0.0)
        for push in (1.0, -1.0):
            u = np.zeros((2001, len(SIDES)))
            u[:, 0] = -side * push * 1e-3 * np.minimum(np.arange(2001) / 100.0, 1.0)
            column = 1 + governor.states.index(stopped_by(governor, name))
            moved = run(governor, values | undamped | {"Pm": POWER}, u, 5e-3)[:, column]
            moved = moved - moved[0]
            assert np.abs(moved).max() < 1e-12 if push > 0.0 else side * moved[-1] < -1e-3, name


def test_a_unit_that_starts_farther_beyond_a_limit_is_not_at_rest(governor):
    for name in limits_of(governor):
        values = started_beyond(governor, name, 1.1 * AT_LIMIT)
        x, pref = resting(governor, Names(**values))
        slopes, pm = motion_of(governor, Names(**values), x, seen(pref=pref))
        assert max(np.abs(slopes).max(), abs(pm - POWER)) > 1e-4, name


def test_a_unit_above_its_load_limit_is_not_at_rest():
    for name, change in (("GAST", {"AT": 0.6}), ("GGOV1", {"Ldref": 0.6})):
        model = GOVERNORS[name]
        p = Names(**typical(model.sheet) | change)
        x, pref = resting(model, p)
        slopes, _ = motion_of(model, p, x, seen(pref=pref))
        assert np.abs(slopes).max() > 0.01, name


# --- the compiled code ----------------------------------------------------------------------------


def as_system(model):
    """Return a governor alone; the inputs are changes of the speed, the power and the reference."""

    def rest(p):
        x, pref = resting(model, sheet_of(p), p["Pm"])
        states = {name: getattr(x, name) for name in model.states}
        return Rest(states, {"pref0": pref, **{n: getattr(x, n) for n in model.setpoints}})

    def sheet_of(p):
        return Names(**{row.symbol: p[row.symbol] for row in model.sheet})

    def course(p, r, x, u):
        d = Names()
        at = Names(dw=u["dw"], p=p["Pm"] + u["p"], pref=r["pref0"] + u["pref"])
        s = Names(**vars(values_named(x, model.states)), **{n: r[n] for n in model.setpoints})
        pm = model.equations(s, at, sheet_of(p), d)
        return motion(d, model.states, {"pm": pm, **x})

    return System(
        parameters=(*(row.symbol for row in model.sheet), "Pm"),
        setpoints=("pref0", *model.setpoints),
        states=model.states,
        inputs=SIDES,
        outputs=("pm", *model.states),
        time_constants=tuple(row.symbol for row in model.sheet if row.is_time),
        rest=rest,
        motion=course,
    )


def run(model, values, u, step, parts=1):
    """Return the outputs (n + 1, outputs) of the compiled governor."""
    system = as_system(model)
    code, p = Kernel(system, system.outputs), vector(system, values)[:, None]
    (out,) = code.run(p, code.start(p), [Span(u, step, parts)])
    return out[:, :, 0]


def swing(size, count=2001, step=5e-3):
    """Return a decaying swing of the speed, with the power and the reference at their start."""
    time = step * np.arange(count)
    u = np.zeros((count, len(SIDES)))
    u[:, 0] = size * np.sin(1.5 * time) * np.exp(-0.1 * time)
    return u


def test_compiled_code_gives_what_the_plain_equations_give(governor):
    values = lively(governor) | {"Pm": POWER}
    values |= BAND if "DBH" in values else {}
    if "db" in values:
        values |= {"db": 0.001, "Aset": 0.01, "Ldref": 0.75}
    u, system = swing(0.05, 601), as_system(governor)
    u[:, 1] = -0.2 * u[:, 0] / 0.05
    (expected,) = float_run(system, values, system.outputs, [Span(u, 5e-3, 1)])
    got = run(governor, values, u, 5e-3)
    assert np.ptp(got[:, 0]) > 0.05
    assert np.abs(got - expected).max() < 1e-11 * np.abs(expected).max()


def test_a_flat_run_stays_flat_for_a_minute(governor):
    for values in (typical(governor.sheet), lively(governor)):
        got = run(governor, values | {"Pm": POWER}, np.zeros((12_001, len(SIDES))), 5e-3)
        assert np.abs(got[:, 0] - POWER).max() < 1e-12


def test_halving_the_step_cuts_the_error_sixteenfold(governor):
    """In a swing of the speed that meets no limit; the inputs are lines between 51 points."""
    values = lively(governor) | {"Pm": POWER}
    u = swing(1e-2 if governor.name == "GASTWD" else 2e-3, 51, 0.04)
    parts = int(np.ceil(0.04 * fastest_rate(as_system(governor), values) / 0.5))
    ends = {k: run(governor, values, u, 0.04, k * parts)[:, 0] for k in (1, 2, 4, 32)}
    errors = [np.abs(ends[k] - ends[32]).max() for k in (1, 2, 4)]
    for coarse, fine in pairwise(errors):
        # the next term of the error is smaller by step * rate
        assert 14.0 < coarse / fine < 21.0


def test_derivatives_are_those_of_the_response(governor):
    """In a swing that meets limits and dead band, whose instants move with a parameter."""
    values = lively(governor) | {"Pm": POWER}
    values |= BAND if "DBH" in values else {}
    system, u = as_system(governor), swing(0.02, 801)
    free = [name for name in system.parameters if values[name] != 0.0 and name not in SELECTORS]
    code = TangentKernel(system, ("pm",), free)
    p, names = vector(system, values), list(system.parameters)
    dp = np.zeros((len(p), len(free)))
    for k, symbol in enumerate(free):
        dp[names.index(symbol), k] = values[symbol]
    _, (slopes,) = tangent_run(code, p, dp, [Span(u, 5e-3, 1)])
    for k, symbol in enumerate(free):
        sides = [values | {symbol: values[symbol] * (1.0 + side)} for side in (1e-4, -1e-4)]
        up, down = (run(governor, side, u, 5e-3)[:, 0] for side in sides)
        difference, size = (up - down) / 2e-4, np.abs(up - POWER).max()
        # where a limit is met at another step, the difference is that of two courses
        assert np.abs(slopes[:, 0, k] - difference).max() < 2e-3 * size, symbol


# --- a second typing, integrated by another method ------------------------------------------------


def stopped(rate, x, low, high):
    """Return the rate of something that stands still where it would leave its range."""
    return 0.0 if (x >= high and rate > 0.0) or (x <= low and rate < 0.0) else rate


def felt(w, p):
    """Return what is left of the speed outside the dead band."""
    return max(w - p["DBH"], 0.0) if w > 0.0 else min(w - p["DBL"], 0.0)


def typed_tgov1(x, w, pe, ref, p):
    valve, reheat = np.clip(x[0], p["VMIN"], p["VMAX"]), x[1]
    opening = ((ref - felt(w, p)) / p["R"] - valve) / p["T1"]
    share = p["T2"] / p["T3"]
    return [stopped(opening, x[0], p["VMIN"], p["VMAX"]), (valve - reheat) / p["T3"]], (
        share * valve + (1.0 - share) * reheat - p["Dt"] * w
    )


def typed_ieeeg1(x, w, pe, ref, p):
    slow, valve = x[0], np.clip(x[1], p["PMIN"], p["PMAX"])
    w, share = felt(w, p), p["T2"] / p["T1"]
    speed = p["K"] * (share * w + (1.0 - share) * slow)
    opening = max(p["UC"], min(p["UO"], (ref - speed - valve) / p["T3"]))
    pressures = [valve, *x[2:]]
    flows = [
        (before - after) / p[T]
        for before, after, T in zip(pressures, x[2:], ("T4", "T5", "T6", "T7"), strict=False)
    ]
    power = sum(p[K] * level for K, level in zip(("K1", "K3", "K5", "K7"), x[2:], strict=True))
    return [(w - slow) / p["T1"], stopped(opening, x[1], p["PMIN"], p["PMAX"]), *flows], power


def typed_hygov(x, w, pe, ref, p):
    filtered, wanted, gate, flow = x
    wanted = np.clip(wanted, p["GMIN"], p["GMAX"])
    d_filtered = (ref - felt(w, p) - p["R"] * wanted - filtered) / p["Tf"]
    d_wanted = d_filtered / p["r"] + filtered / (p["r"] * p["Tr"])
    d_wanted = max(-p["VELM"], min(p["VELM"], d_wanted))
    head = flow**2 / gate**2
    power = p["At"] * head * (flow - p["qNL"]) - p["Dturb"] * w * gate
    return [
        d_filtered,
        stopped(d_wanted, x[1], p["GMIN"], p["GMAX"]),
        (wanted - gate) / p["Tg"],
        (1.0 - head) / p["TW"],
    ], power


def typed_gast(x, w, pe, ref, p):
    valve, fuel, exhaust = np.clip(x[0], p["VMIN"], p["VMAX"]), x[1], x[2]
    demand = min(ref - felt(w, p) / p["R"], (1.0 + p["KT"]) * p["AT"] - p["KT"] * exhaust)
    return [
        stopped((demand - valve) / p["T1"], x[0], p["VMIN"], p["VMAX"]),
        (valve - fuel) / p["T2"],
        (fuel - exhaust) / p["T3"],
    ], fuel - p["Dturb"] * w


def typed_ieesgo(x, w, pe, ref, p):
    slow, slower, inlet, reheat, crossed = x
    share = p["T2"] / p["T3"]
    demand = min(p["PMAX"], max(p["PMIN"], ref - share * slow - (1.0 - share) * slower))
    return [
        (p["K1"] * felt(w, p) - slow) / p["T1"],
        (slow - slower) / p["T3"],
        (demand - inlet) / p["T4"],
        (inlet - reheat / p["K2"]) * p["K2"] / p["T5"],
        (reheat - crossed / p["K3"]) * p["K3"] / p["T6"],
    ], inlet * (1.0 - p["K2"]) + reheat * (1.0 - p["K3"]) + crossed


def typed_ggov1(x, w, pe, ref, p):
    (
        measured,
        mw,
        slow_error,
        integral,
        valve,
        turbine,
        warm,
        hot,
        load,
        slow_w,
        allowed,
        *engine,
    ) = x
    base, stiff = p["Trate_Mbase"], p["Kdgov"] / p["Tdgov"]
    pe0 = POWER / base
    error = ref + mw - felt(w, p) - p["R"] * measured  # Rselect = 1
    error = np.sign(error) * max(abs(error) - p["db"], 0.0)
    error = min(p["maxerr"], max(p["minerr"], error))
    asked = p["Kpgov"] * error + stiff * (error - slow_error) + integral
    room = p["Ldref"] / p["Kturb"] + p["Wfnl"] - hot
    may = p["Kpload"] * room + load
    fuel = min(p["VMAX"], max(p["VMIN"], min(asked, may, 1.0, allowed)))
    burnt = valve * (1.0 + w)  # Flag = 1
    into, *engine = thermal_governors.late(p["Kturb"] * (burnt - p["Wfnl"]), *engine, p["Teng"])
    share, shape = p["Tc"] / p["Tb"], p["Tsa"] / p["Tsb"]
    opening = min(p["Ropen"], max(p["Rclose"], (fuel - valve) / p["Tact"]))
    return [
        (pe / base - measured) / p["Tpelec"],
        stopped(p["Kimw"] * (pe0 - measured), mw, -1.1 * p["R"], 1.1 * p["R"]),
        (error - slow_error) / p["Tdgov"],
        p["Kigov"] / p["Kpgov"] * (fuel - stiff * (error - slow_error) - integral),
        stopped(opening, valve, p["VMIN"], p["VMAX"]),
        (into - turbine) / p["Tb"],
        (burnt - warm) / p["Tsb"],
        (shape * burnt + (1.0 - shape) * warm - hot) / p["Tfload"],
        p["Kiload"] / p["Kpload"] * (fuel - load),
        (w - slow_w) / p["Ta"],
        (fuel - allowed) / 0.01 + p["Ka"] * (p["Aset"] - (w - slow_w) / p["Ta"]),
        *engine,
    ], base * (share * into + (1.0 - share) * turbine - p["Dm"] * (1.0 + w))


def typed_ieeeg2(x, w, pe, ref, p):
    slow, slower, column = x
    share = p["T2"] / p["T1"]
    demand = min(p["PMAX"], max(p["PMIN"], ref - slower))
    return [
        (p["K"] * w - slow) / p["T1"],
        (share * p["K"] * w + (1.0 - share) * slow - slower) / p["T3"],
        (demand - column) / (0.5 * p["T4"]),
    ], 3.0 * column - 2.0 * demand


def typed_ieeeg3(x, w, pe, ref, p):
    servo, gate, washed, flow = x
    gate = np.clip(gate, p["PMIN"], p["PMAX"])
    error = ref - felt(w, p) - p["Rperm"] * gate - p["Rtemp"] * (gate - washed)
    opening = max(p["UC"], min(p["UO"], servo))
    inertia, coupling = p["A11"] * p["TW"], p["A13"] * p["A21"] / p["A11"]
    return [
        (error / p["TG"] - servo) / p["TP"],
        stopped(opening, x[1], p["PMIN"], p["PMAX"]),
        (gate - washed) / p["TR"],
        (gate - flow) / inertia,
    ], (p["A23"] - coupling) * gate + coupling * flow


def typed_hygov2(x, w, pe, ref, p):
    integral, governed, servo, gate, washed, flow = x
    w, gate = felt(w, p), np.clip(gate, p["GMIN"], p["GMAX"])
    error = ref - p["KP"] * w - integral - p["R"] * gate - p["Rtemp"] * (gate - washed)
    governed += p["KA"] * p["T1"] / p["T3"] * error
    share, away = p["T2"] / p["T4"], p["T5"] / p["T6"]
    velocity = share * governed + (1.0 - share) * servo
    velocity = max(-p["VGMAX"], min(p["VGMAX"], velocity))
    return [
        p["KI"] * w,
        p["KA"] / p["T3"] * error,
        (governed - servo) / p["T4"],
        stopped(velocity, x[3], p["GMIN"], p["GMAX"]),
        (gate - washed) / p["TR"],
        (gate - flow) / p["T6"],
    ], p["PMAX"] * (flow - away * (gate - flow))


def powered(gate, p):
    """Return the power of a gate, on the lines through G0 to P3 and beyond."""
    if gate > p["G2"]:
        return p["P2"] + (gate - p["G2"]) * (p["P3"] - p["P2"]) / (1.0 - p["G2"])
    if gate > p["G1"]:
        return p["P1"] + (gate - p["G1"]) * (p["P2"] - p["P1"]) / (p["G2"] - p["G1"])
    return p["P1"] * (gate - p["G0"]) / (p["G1"] - p["G0"])


def typed_pidgov(x, w, pe, ref, p):
    drooped, integral, first, slow_error, second, gate, flow = x
    gate = np.clip(gate, p["GMIN"], p["GMAX"])
    error = drooped - felt(w, p)
    steep = p["Kd"] * (error - slow_error) / p["Ta"]
    back = gate if p["Feedback"] else pe
    opening = max(p["VELMIN"], min(p["VELMAX"], (second - gate) / p["Tb"]))
    power = powered(gate, p)
    return [
        (p["Rperm"] * (ref - back) - drooped) / p["Treg"],
        p["Ki"] * error,
        (p["Kp"] * error + integral - first) / p["Ta"],
        (error - slow_error) / p["Ta"],
        (first + steep - second) / p["Ta"],
        stopped(opening, x[5], p["GMIN"], p["GMAX"]),
        2.0 * (power - flow) / (p["Atw"] * p["Tw"]),
    ], 3.0 * flow - 2.0 * power - p["Dturb"] * w


def typed_wpidhy(x, w, pe, ref, p):
    drooped, slow, slower, servo, gate, flow = x
    gate = np.clip(gate, p["GMIN"], p["GMAX"])
    error = drooped - felt(w, p)
    rates = (error - slow) / p["Ta"], (slow - slower) / p["Ta"]
    bent = (rates[0] - rates[1]) / p["Ta"]
    asked = p["Ki"] * slower + p["Kp"] * rates[1] + p["Kd"] * bent
    opening, power = max(p["VELMIN"], min(p["VELMAX"], servo)), powered(gate, p)
    return [
        (p["Reg"] * (pe - ref) - drooped) / p["Treg"],
        *rates,
        (asked - servo) / p["Tb"],
        stopped(opening, x[4], p["GMIN"], p["GMAX"]),
        2.0 * (power - flow) / p["Tw"],
    ], min(p["PMAX"], max(p["PMIN"], 3.0 * flow - 2.0 * power)) - p["D"] * w


def servo_of(demand, valve, gate, behind, p):
    """Return the rates of pilot valve, gate, and what is behind the backlash, by events alone."""
    gate = np.clip(gate, p["PMIN"], p["PMAX"])
    pilot = stopped(
        (p["Kg"] * (demand - behind) - valve) / p["Tp"], valve, p["VELCLOSE"], p["VELOPEN"]
    )
    opening = np.clip(valve, p["VELCLOSE"], p["VELOPEN"])
    opening = stopped(opening, gate, p["PMIN"], p["PMAX"])
    return pilot, opening, taken_along(gate, behind, opening, p)


def taken_along(gate, behind, opening, p):
    """Return the rate of what is behind a gate's backlash."""
    pushed = (gate - behind >= p["BLG"] - 1e-10 and opening > 0.0) or (
        gate - behind <= 1e-10 - p["BLG"] and opening < 0.0
    )
    return opening if pushed else 0.0


def typed_hygovr(x, w, pe, ref, p):
    speed, *slow, drooped, demand, valve, gate, behind, flow = x
    rates, signal = [(felt(w, p) - speed) / p["Td"]], speed
    for k, state in zip((1, 3, 5, 7), slow, strict=True):
        rates.append((signal - state) / p[f"T{k + 1}"])
        signal = state + p[f"T{k}"] * rates[-1]
    head = (flow / behind) ** 2
    return [
        *rates,
        (p["R"] * pe - drooped) / p["Tt"],
        p["Kp"] * (ref - signal - drooped),
        *servo_of(demand, valve, gate, behind, p),
        (1.0 - head) / p["Tw"],
    ], p["At"] * head * (flow - p["qNL"]) - p["Dturb"] * behind * w


def typed_hyg3(x, w, pe, ref, p):
    seen_error, slow, slow1, slow2, drooped, integral, valve, gate, behind, flow = x
    w_felt, washed = felt(w, p), (seen_error - slow) / p["Tf"]
    twice = ((seen_error - slow1) / p["Tf"] - slow2) / p["Tf"]
    integral = np.clip(integral, p["PMIN"], p["PMAX"])
    if p["Cflag"]:
        demand = integral + p["K2"] * seen_error + p["K1"] * washed
        demand = np.clip(demand, p["PMIN"], p["PMAX"])
        wanted, error = ref - w_felt - p["Rgate"] * demand - drooped, seen_error
    else:
        demand, wanted = integral, w_felt
        error = ref - p["Rgate"] * demand - drooped
        error -= seen_error + p["K1"] * washed + p["K2"] * twice
    head = flow / np.interp(behind, *[[p[f"{n}{k}"] for k in range(1, 7)] for n in ("GV", "PGV")])
    head = head**2
    return [
        (wanted - seen_error) / p["Td"],
        washed,
        (seen_error - slow1) / p["Tf"],
        twice,
        (p["Relec"] * pe - drooped) / p["Tt"],
        stopped(p["Ki"] * error, x[5], p["PMIN"], p["PMAX"]),
        *servo_of(demand, valve, gate, behind, p),
        (p["H0"] - head) / p["Tw"],
    ], p["At"] * head * (flow - p["qNL"]) - p["Dturb"] * behind * w


def typed_h6e(x, w, pe, ref, p):
    drooped, speed, integral, slow, valve, gate, behind, asked, blade, flow = x
    gate, steep = np.clip(gate, p["GMIN"], p["GMAX"]), (speed - slow) / p["Td"]
    error = ref - felt(speed, p)
    wanted = p["Kp"] * error + integral - p["Kd"] * steep
    wanted /= 1.0 if p["Fd"] else 1.0 + p["Kp"] * p["Rg"]
    demand = np.clip(wanted, p["GMIN"], p["GMAX"])
    left = error - (drooped if p["Fd"] else p["Rg"] * demand)
    opening = max(valve, -p["Buv"]) if gate < p["Buf"] else valve
    opening = stopped(opening, gate, p["GMIN"], p["GMAX"])
    gates, powers, blades, flows = kaplan(p)
    head = (flow / behind / (p["Bgvmin"] + (1.0 - p["Bgvmin"]) * blade)) ** 2
    power = np.interp(flow, flows, powers) - p["Deff"] * (asked - blade) ** 2
    return [
        (p["Re"] * pe - drooped) / p["Tpe"],
        (w - speed) / p["Tsp"],
        stopped(p["Ki"] * left, wanted, p["GMIN"], p["GMAX"]),
        steep,
        stopped((p["Kg"] * (demand - gate) - valve) / p["Tg"], valve, -p["Velm"], p["Velm"]),
        opening,
        taken_along(gate, behind, opening, p),
        (np.interp(demand, gates, blades) - asked) / p["Tbd"],
        np.clip((asked - blade) / p["Tbs"], -p["Blv"], p["Blv"]),
        (p["Hdam"] - head) / p["Tw"],
    ], head * power - p["Dturb"] * behind * w


TYPED = {
    "H6E": (
        typed_h6e,
        0.06,
        {"GMAX": 0.73, "GMIN": 0.62, "Buf": 0.66, "BLG": 0.005, "Blv": 0.02, "Deff": 5.0}
        | {"Dturb": 0.3, "Hdam": 1.02, "PGV7": 0.685},
    ),
    "IEEEG2": (typed_ieeeg2, 0.02, {"T1": 1.0, "T2": 0.5}),
    "IEEEG3": (typed_ieeeg3, 0.06, {"PMAX": 0.73, "PMIN": 0.67}),
    "HYGOV2": (typed_hygov2, 0.05, {"GMAX": 0.66, "GMIN": 0.5, "KP": 2.0, "KI": 0.02, "R": 0.5}),
    "PIDGOV": (typed_pidgov, 0.06, {"GMAX": 0.57, "GMIN": 0.5}),
    "WPIDHY": (typed_wpidhy, 0.06, {"GMAX": 0.72, "GMIN": 0.6, "PMAX": 0.75}),
    "HYGOVR": (typed_hygovr, 0.04, {"PMAX": 0.7, "PMIN": 0.6, "BLG": 0.005}),
    "HYG3": (
        typed_hyg3,
        0.15,
        {"PMAX": 0.695, "PMIN": 0.6, "BLG": 0.005, "Relec": 0.02, "PGV5": 0.9},
    ),
    "TGOV1": (typed_tgov1, 0.06, {}),
    "IEEEG1": (typed_ieeeg1, 0.06, {"UC": -0.5, "UO": 0.3, "PMAX": 0.75}),
    "HYGOV": (typed_hygov, 0.03, {"GMIN": 0.6, "GMAX": 0.72}),
    "GAST": (typed_gast, 0.06, {"AT": 0.8}),
    "IEESGO": (typed_ieesgo, 0.1, {}),
    "GGOV1": (typed_ggov1, 0.05, {"db": 0.002, "Aset": 0.01, "Ldref": 0.84, "VMIN": 0.62}),
    **thermal_governors.TYPED,
}
# the states that both limits stop, with these
STOPPED = {
    **dict.fromkeys(("HYGOV2", "PIDGOV", "WPIDHY"), ("GATE", "GMIN", "GMAX")),
    **dict.fromkeys(("IEEEG3", "HYGOVR", "HYG3"), ("GATE", "PMIN", "PMAX")),
    "TGOV1": ("V1", "VMIN", "VMAX"),
    "IEEEG1": ("VALVE", "PMIN", "PMAX"),
    "HYGOV": ("C", "GMIN", "GMAX"),
    "TGOV3": ("VALVE", "PMIN", "PMAX"),
    "DEGOV1": ("INTEG", "TMIN", "TMAX"),
}


def test_every_governor_is_typed_a_second_time():
    assert TYPED.keys() == GOVERNORS.keys()


@pytest.mark.parametrize("variant", [0, 1])
def test_another_typing_and_method_reach_and_leave_the_limits_together(governor, variant):
    """The speed swings by so much that limits and dead band act; the power falls and comes back."""
    variants = VARIANTS.get(governor.name, ({},))
    if variant == len(variants):
        pytest.skip("has one controller")
    typed, size, change = TYPED[governor.name]
    values = lively(governor) | {"Pm": POWER} | change | variants[variant]
    values |= BAND if "DBH" in values else {}
    time = 0.01 * np.arange(1001)
    x0, ref = resting(governor, Names(**values))

    def at(t):
        w = size * np.sin(1.5 * t) * np.exp(-0.1 * t)
        return w, POWER - 0.5 * w

    fine = 5e-4 * np.arange(20_001)
    w, pe = at(fine)
    moves = {"dw": RecordedInput(fine, w), "p": RecordedInput(fine, pe - POWER)}
    inputs, shown = Inputs(0.0, time[-1], (), moves), ("pm", *governor.states)
    simulator = Simulator(
        as_system(governor), inputs, time, LARGEST_STEP, located=True, accuracy=1e-6
    ).with_enough_substeps(values, shown)
    got = simulator.samples(values, shown)[0]
    start = [getattr(x0, name) for name in governor.states]
    x = solve_ivp(
        lambda t, x: typed(x, *at(t), ref, values)[0],
        (0.0, time[-1]),
        start,
        "DOP853",
        time,
        rtol=1e-8,
        atol=1e-10,
        max_step=0.02,
    ).y
    expected = np.array([typed(x[:, k], *at(t), ref, values)[1] for k, t in enumerate(time)])
    assert np.ptp(expected) > 0.1
    if governor.name in STOPPED:
        name, low, high = STOPPED[governor.name]
        state = got[:, 1 + governor.states.index(name)]
        assert (state.min(), state.max()) == (values[low], values[high])
    assert np.abs(got[:, 0] - expected).max() < 1e-5


EITHER_WAY = {"SERVO", "SPEED", "V3", "VALVE"}  # of a servo, which may close


def test_no_parameter_is_inert(governor):
    rng = np.random.default_rng(2)
    values = lively(governor)
    rows = {row.symbol: row for row in governor.sheet}
    changes = {"Rselect": -2.0, "db": 0.01, "Dt": 1.0, "Ldref": 0.0}
    changes |= {"PRMAX": 0.01, "MIN": 0.5, "T5": 100.0, "Fd": 0.0}
    changes |= {f"GV{k}": values.get(f"GV{k}", 0.0) + 0.05 for k in range(1, 11)}
    changes |= {"DBL": -0.01, "DBH": 0.01, "Trate_Mbase": 0.5}

    def felt(changed):
        motions = []
        for size in (1e-3, 0.1, 1.0, 10.0):
            for _ in range(60):
                # none beyond zero: a gate or a speed that is negative has no head
                s = {name: size * abs(rng.normal()) for name in governor.states}
                s |= {name: rng.choice((1.0, -1.0)) * s[name] for name in EITHER_WAY & s.keys()}
                s = Names(**s)
                s = Names(**vars(s), **dict.fromkeys(governor.setpoints, POWER))
                u = Names(dw=size * rng.uniform(-0.09, 0.09), p=size, pref=0.1 * size)
                slopes, pm = motion_of(governor, Names(**changed), s, u)
                motions.append([*slopes, pm])
        return np.array(motions)

    for symbol in rows:
        rng = np.random.default_rng(2)
        own = values | ({"Fd": 0.0} if symbol == "Rg" else {})
        before = felt(own)
        rng = np.random.default_rng(2)
        after = felt(own | {symbol: changes.get(symbol, 0.5 * values[symbol] or 1.0)})
        assert np.abs(after - before).max() > 1e-6, symbol


# --- sheets and records ---------------------------------------------------------------------------


def test_a_sheet_names_each_parameter_once_within_its_range(governor):
    for column in ("symbol", "meaning"):
        entries = [getattr(row, column) for row in governor.sheet]
        assert len(set(entries)) == len(entries)
    for row in governor.sheet:
        assert row.symbol.isidentifier()
        assert row.unit
        assert row.low <= row.typical <= row.high, row.symbol
    assert list(crossed_limits(typical(governor.sheet))) == []


def test_a_drawing_is_narrow_and_shows_every_parameter(governor):
    text = governor.title + governor.drawing
    assert governor.title
    assert max(map(len, governor.drawing.splitlines())) <= 80
    for row in governor.sheet:
        assert row.symbol in text, row.symbol


def test_a_record_lists_every_parameter_once(governor):
    for record in governor.records:
        symbols = [row.symbol for row in governor.sheet]
        integers = [name for name, _ in record.icons if name in (*symbols, *record.ignored)]
        listed = [*record.cons, *integers, *dict(record.held)]
        assert sorted(listed) == sorted([*symbols, *dict(record.absent), *record.ignored])
