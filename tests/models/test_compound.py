"""Compound-source exciters and the simplified ones, against their block diagrams typed again."""

import cmath
import math
from itertools import product

import numpy as np
import pytest
from diagrams import Transfer, lag, lead_lag, pid, rectified, standing, washout
from oracle import lively_values, system_of, typical_values
from references import reference

from exfit.engine.trace import Graph, evaluate, in_order
from exfit.models import MODELS
from exfit.models.blocks import compound_source
from exfit.plants import MACHINE
from exfit.plants.parts import Names
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

J = 1j

# sample data of ST4B: (a), and (b) with room for a field voltage that KG = 1 feeds back whole
POTENTIAL_ST4B = {
    "KPR": 10.75,
    "KIR": 10.75,
    "TA": 0.02,
    "KPM": 1.0,
    "KIM": 0.0,
    "KG": 0.0,
    "KP": 9.3,
    "KI": 0.0,
    "VBMAX": 11.63,
    "KC": 0.113,
    "XL": 0.124,
    "VMMAX": 99.0,
    "VMMIN": -99.0,
}
COMPOUND_ST4B = {
    "KPR": 20.0,
    "KIR": 20.0,
    "VRMAX": 9.0,
    "KPM": 0.0,
    "KIM": 14.9,
    "KG": 1.0,
    "KP": 5.5,
    "KI": 8.8,
    "VBMAX": 8.54,
    "KC": 1.8,
    "XL": 0.0,
    "VMMAX": 1.0,
    "VMMIN": -0.87,
}


# --- the source -----------------------------------------------------------------------------------


def source_in_phasors(vt, p, q, KP, KI, XL, THETAP):
    """Return |KP VT + j (KI + KP XL) IT| as the standard writes it."""
    KP = KP * cmath.exp(J * math.radians(THETAP))
    return abs(KP * vt + J * (KI + KP * XL) * ((p - J * q) / vt))


def drawn_sources(count=200):
    """Return (vt, p, q, KP, KI, XL, THETAP) on load, leading and lagging."""
    low = [0.3, -1.0, -1.0, 0.0, 0.0, 0.0, -180.0]
    high = [1.3, 1.0, 1.0, 10.0, 10.0, 0.5, 180.0]
    return np.random.default_rng(7).uniform(low, high, (count, 7))


def test_a_compound_source_is_its_phasor_sum():
    for drawn in drawn_sources():
        assert compound_source(*drawn) == pytest.approx(source_in_phasors(*drawn), rel=1e-12)


def test_a_source_of_voltage_alone_takes_neither_reactance_nor_angle():
    for vt, p, q, KP, KI, _, _ in drawn_sources(20):
        expected = abs(KP * vt + J * KI * (p - J * q) / vt)
        assert compound_source(vt, p, q, KP, KI) == pytest.approx(expected, rel=1e-12)


def test_a_traced_source_is_the_one_of_floats():
    graph = Graph()
    nodes = [graph.symbol(name, varies=True) for name in "abcdefg"]
    traced = compound_source(*nodes)
    for drawn in drawn_sources(20):
        value = evaluate([traced], dict(zip(nodes, drawn, strict=True)))[traced]
        assert value == pytest.approx(compound_source(*drawn), rel=1e-12)


def test_on_open_circuit_a_source_is_its_voltage_and_current_and_angle_are_gone():
    graph = Graph()
    vt, KP, KI, XL, THETAP = (graph.symbol(name, varies=name == "vt") for name in "vPIXT")
    needed = list(in_order([compound_source(vt, 0.0, 0.0, KP, KI, XL, THETAP)]))
    assert [node.op for node in needed] == ["symbol", "symbol", "*"]
    assert compound_source(0.9, 0.0, 0.0, 6.0, 3.0, 0.1, 20.0) == pytest.approx(5.4, rel=1e-12)


# --- linear response: the block diagrams as transfer functions ------------------------------------


def bridge(p):
    """Return VB / VT on open circuit, where IFD = VT: the first arc of the rectifier."""
    share = p["KP"] - p["KC"] / math.sqrt(3.0)
    assert p["KC"] / p["KP"] < math.sqrt(3.0) / 4.0
    return min(share, p.get("VBMAX", math.inf)), share if share < p.get("VBMAX", math.inf) else 0.0


# each gives X and Y of efd = X error + Y vt, all as deviations from vt = ifd = efd = 1


def st2a(p):
    vb, slope = bridge(p)
    regulator = lag(p["KA"], p["TA"])
    feedback = washout(p["KF"], p["TF"])
    loop = Transfer([p["TE"], p["KE"]]) + Transfer(vb) * regulator * feedback
    return Transfer(vb) * regulator / loop, Transfer(p["KE"] / vb * slope) / loop


def ieeet3(p):
    """The source is proportional to VT, as IFD is on this machine: V4 = sqrt(KP^2 - 0.78^2) VT."""
    regulator, feedback = lag(p["KA"], p["TA"]), washout(p["KF"], p["TF"])
    loop = Transfer([p["TE"], p["KE"]]) + regulator * feedback
    return regulator / loop, Transfer(math.sqrt(p["KP"] ** 2 - 0.78**2)) / loop


def with_field_voltage_loop(p, regulator, inner, KG):
    vb, slope = bridge(p)
    loop = Transfer(1.0) + Transfer(vb * KG) * inner
    return Transfer(vb) * inner * regulator / loop, Transfer(1.0 / vb * slope) / loop


def st3a(p):
    regulator = lead_lag(p["TC"], p["TB"]) * lag(p["KA"], p["TA"])
    KG = p["KG"] if p["KG"] < p["VGMAX"] else 0.0
    return with_field_voltage_loop(p, regulator, lag(p["KM"], p["TM"]), KG)


def st4b(p):
    regulator = pid(p["KPR"], p["KIR"]) * lag(1.0, p["TA"])
    return with_field_voltage_loop(p, regulator, pid(p["KPM"], p["KIM"]), p["KG"])


def sexs(p):
    leading = lead_lag(p["TATB"] * p["TB"], p["TB"])
    return leading * lag(p["K"], p["TE"]), Transfer(0.0)


def scrx(p):
    return sexs(p)[0], Transfer(0.0 if p["CSWITCH"] == 1.0 else 1.0)


LINEAR = [
    ("ST2A", st2a, {}),
    ("ST2A", st2a, {"KC": 0.3, "KE": 0.8, "VRMIN": -1.0}),
    ("IEEET3", ieeet3, {}),
    ("IEEET3", ieeet3, {"KE": 0.7, "KP": 1.4, "KF": 0.1}),
    ("ST3A", st3a, {"VRMIN": -20.0, "VMMIN": -1.0}),
    ("ST3A", st3a, {"VBMAX": 5.0, "KG": 0.5}),
    ("ST3A", st3a, {"VGMAX": 0.5, "KA": 5.0}),
    ("ST4B", st4b, {}),
    ("ST4B", st4b, POTENTIAL_ST4B),
    ("ST4B", st4b, {"KIR": 0.0, "KIM": 0.0, "KG": 0.3}),
    ("ST4B", st4b, {"KPM": 0.7, "KIM": 3.0, "KG": 0.9, "VRMAX": 9.0}),
    ("ST4B", st4b, COMPOUND_ST4B),
    ("SEXS", sexs, {}),
    ("SCRX", scrx, {}),
    ("SCRX", scrx, {"CSWITCH": 1.0}),
]


@pytest.mark.parametrize(("name", "diagram", "changes"), LINEAR)
def test_a_small_step_on_a_machine_without_saturation_is_that_of_the_diagram(
    name, diagram, changes
):
    """The closed loop; what the product VM VB adds is of the second order, 2e-5 of it all."""
    values = lively_values(name, "ONE_AXIS", machine_S10=0.0, machine_S12=0.0) | changes
    times, size = np.linspace(0.0, 3.0, 301), 1e-5
    X, Y = diagram(values)
    machine = lag(1.0, values[MACHINE + "Tpd0"])
    transducer = lag(1.0, values.get("TR", 0.0))
    closed = machine.fed_back(-1.0 * Y + X * transducer) * X
    expected = size * closed.step(times)
    inputs = Inputs(0.0, 3.0, (InputStep(0.0, size),))
    simulator = Simulator(system_of(name, "ONE_AXIS"), inputs, times, 5e-4)
    got = simulator.response(values, ("vt",)).signals["vt"] - 1.0
    assert np.abs(expected).max() > 0.3 * size
    assert np.abs(got - expected).max() < 5e-5 * size


# --- large steps ----------------------------------------------------------------------------------


def behind(p, vt, ifd):
    return min(rectified(p["KP"] * vt, p["KC"] * ifd), p.get("VBMAX", math.inf))


CEILINGS = [
    ("ST2A", {"EFDMAX": 2.5}, lambda p, vt, ifd: 2.5),
    ("IEEET3", {"VBMAX": 1.6, "TE": 0.05}, lambda p, vt, ifd: 1.6),
    ("ST3A", {"VMMAX": 0.5}, lambda p, vt, ifd: 0.5 * behind(p, vt, ifd)),
    ("ST3A", {"VMMAX": 0.5, "VBMAX": 5.0}, lambda p, vt, ifd: 2.5),
    ("ST4B", {"VMMAX": 0.5}, lambda p, vt, ifd: 0.5 * behind(p, vt, ifd)),
    (
        "ST4B",
        POTENTIAL_ST4B | {"KP": 5.0},
        lambda p, vt, ifd: behind(p, vt, ifd),
    ),  # VRMAX = KPM = 1
    ("ST4B", COMPOUND_ST4B, lambda p, vt, ifd: behind(p, vt, ifd)),  # VMMAX = 1
    ("SEXS", {}, lambda p, vt, ifd: 4.0),
    ("SCRX", {}, lambda p, vt, ifd: 5.0 * vt),
    ("SCRX", {"CSWITCH": 1.0}, lambda p, vt, ifd: 5.0),
]


@pytest.mark.parametrize(("name", "changes", "ceiling"), CEILINGS)
def test_a_large_step_drives_the_field_to_its_ceiling_and_back(name, changes, ceiling):
    values = typical_values(name) | changes
    inputs = Inputs(0.0, 20.0, (InputStep(0.5, 0.4), InputStep(1.5, -0.4)))
    times = np.linspace(0.0, 20.0, 2001)
    got = Simulator(system_of(name), inputs, times, 1e-3).response(values).signals
    expected = np.array(
        [ceiling(values, vt, ifd) for vt, ifd in zip(got["vt"], got["ifd"], strict=True)]
    )
    # what the lag TA of ST4B leaves after eleven times its length
    reached = np.abs(got["efd"] - expected) < 1e-4
    assert reached.sum() > 30  # 0.3 s
    assert (got["efd"] < expected + 1e-9).all()
    assert not reached[times > 3.0].any()
    # what a slow integral of the regulator leaves after eighteen seconds
    assert np.abs(got["vt"][-1] - 1.0) < 2e-3


def test_without_any_source_st2a_is_fed_by_one_per_unit():
    values = typical_values("ST2A") | {"KP": 0.0, "KI": 0.0, "VRMAX": 3.0, "EFDMAX": 9.0}
    simulator = Simulator(system_of("ST2A"), Inputs(0.0, 5.0, ()), np.linspace(0, 5, 11), 1e-3)
    got = simulator.response(values).signals
    assert got["VR"] == pytest.approx(got["efd"], abs=1e-9)


# --- on load, and at the gates --------------------------------------------------------------------


def on_load(name, changes=()):
    """Return a model's inputs, parameters and states at the rest of efd = 2 on load."""
    values = typical_values(name) | dict(changes)
    return standing(name, values, efd=2.0, vt=0.97, ifd=2.1, p=0.8, q=0.35)


@pytest.mark.parametrize(
    ("name", "driver", "changes"),
    [
        ("ST2A", "VR", {}),
        ("ST3A", "VM", {"KI": 4.83, "THETAP": 20.0, "KP": 4.37, "VBMAX": 99.0}),
        ("ST4B", "VM", COMPOUND_ST4B | {"THETAP": 20.0, "XL": 0.09, "VBMAX": 99.0}),
    ],
)
def test_on_load_the_bridge_is_fed_by_the_compound_source(name, driver, changes):
    """At rest the driver is efd / VB (in ST2A KE = 1)."""
    u, p, x = on_load(name, changes)
    XL, THETAP = vars(p).get("XL", 0.0), vars(p).get("THETAP", 0.0)
    ve = source_in_phasors(u.vt, u.p, u.q, p.KP, p.KI, XL, THETAP)
    assert getattr(x, driver) == pytest.approx(2.0 / rectified(ve, p.KC * u.ifd), rel=1e-12)


PI_GAINS = [
    {"KPR": KPR, "KIR": KIR, "KPM": KPM, "KIM": KIM, "KG": KG}
    for KPR, KIR, KPM, KIM, KG in product((0.0, 3.0), (0.0, 2.0), (0.0, 4.0), (0.0, 5.0), (0.0, 1))
    if KPR + KIR > 0.0 < KPM + KIM
]


@pytest.mark.parametrize("gains", PI_GAINS)
def test_st4b_rests_whichever_of_its_gains_are_zero(gains):
    u, p, x = on_load("ST4B", gains | {"VRMAX": 9.0})
    d = Names()
    assert MODELS["ST4B"].equations(x, u, p, d) == pytest.approx(2.0, rel=1e-12)
    assert list(vars(d).values()) == pytest.approx([0.0] * 4, abs=1e-12)


def test_the_field_voltage_loop_of_st4b_closes_on_itself():
    """The PI sees the very field voltage that it gives: limited, gated or neither."""
    rng = np.random.default_rng(11)
    for _ in range(300):
        u, p, x = on_load("ST4B", {"VMMAX": 0.5, "VMMIN": -0.3, "KIM": 2.0})
        p.KPM, p.KG, x.VA, x.VM = rng.uniform([0.0, 0.0, -3.0, -0.5], [5.0, 2.0, 3.0, 0.5])
        u.voel = rng.choice([np.inf, 0.1])
        d = Names()
        efd = MODELS["ST4B"].equations(x, u, p, d)
        ve = source_in_phasors(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
        vb = min(rectified(ve, p.KC * u.ifd), p.VBMAX)
        inner = p.KPM * (x.VA - p.KG * efd) + x.VM
        expected = vb * min(np.clip(inner, p.VMMIN, p.VMMAX), u.voel)
        assert efd == pytest.approx(expected, abs=1e-12)
        slope = p.KIM * (x.VA - p.KG * efd)
        frozen = (inner > p.VMMAX and slope > 0.0) or (inner < p.VMMIN and slope < 0.0)
        assert abs(d.VM - (0.0 if frozen else slope)) < 1e-12


@pytest.mark.parametrize("name", ["ST2A", "ST3A"])
def test_an_underexcitation_limiter_takes_the_error_over_when_it_is_larger(name):
    u, p, x = on_load(name, {"TA": 0.1, "VMMAX": 9.0})
    state, gain = {"ST2A": ("VR", p.KA / p.TA), "ST3A": ("VL", 1.0 / 10.0)}[name]
    free, gated, below = Names(), Names(), Names()
    found = MODELS[name]
    found.equations(x, u, p, free)
    found.equations(x, Names(**{**vars(u), "vuel": 0.05}), p, gated)
    found.equations(x, Names(**{**vars(u), "vuel": -0.05}), p, below)
    slopes = [getattr(d, state) for d in (free, gated, below)]
    free, gated, below = (getattr(slope, "slope", slope) for slope in slopes)
    error = u.vref - u.vc1
    assert gated - free == pytest.approx(gain * (0.05 - error), rel=1e-9)
    assert below == free


# --- another simulator ----------------------------------------------------------------------------


def test_a_step_of_sexs_is_that_of_another_simulator():
    _, values, inputs, columns, described = reference("andes_sexs_up5")
    simulator = Simulator(system_of("SEXS"), inputs, columns["t"], 1e-3)
    got = simulator.response(values).signals
    assert got["vref"][0] == pytest.approx(described["vref_initial"], abs=1e-9)
    # what its trapezoidal rule errs by at 1 ms, several times over
    assert np.abs(got["vt"] - columns["vt"]).max() < 1e-6
    assert np.abs(got["ifd"] - columns["ifd"]).max() < 5e-6
    assert np.abs(got["efd"] - columns["efd"]).max() < 2e-5
