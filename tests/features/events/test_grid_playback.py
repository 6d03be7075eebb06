"""A unit that recorded voltage and angle drive: another simulator, and what must hold anyway."""

import csv
from dataclasses import replace
from math import pi

import numpy as np
import pytest
from on_load import QUADRATIC, system, values_on_load
from places import REFERENCE
from scipy.interpolate import CubicSpline

from exfit.engine.trace import larger, sqrt, where
from exfit.features.events.grid_playback import grid_playback
from exfit.models import GOVERNORS, MODELS
from exfit.models.blocks import field_demand, pi_rest
from exfit.models.exciters.ac8 import ac8b
from exfit.models.governor_parts import PLAIN
from exfit.models.machines import MACHINES
from exfit.plants import GOVERNOR, MACHINE, NETWORK, VT0
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput, SplinedInput
from exfit.simulation.simulator import Simulator

GENROU = MACHINES["GENROU"]
OF_MACHINE = {
    "Tpd0": 6.27, "Tppd0": 0.059, "Tpq0": 0.7, "Tppq0": 0.096, "H": 4.471, "D": 0.0,
    "Xd": 2.014, "Xq": 1.96, "Xpd": 0.331, "Xpq": 0.466, "Xppd": 0.2059, "Xl": 0.129,
    "S10": 0.14, "S12": 0.56,
}  # fmt: skip
OF_EXCITER = {
    "TR": 0.0, "KPR": 80.0, "KIR": 5.0, "KDR": 10.0, "TDR": 0.1, "KA": 1.0, "TA": 0.01,
    "VPIDMAX": 999.0, "VPIDMIN": -999.0, "VRMAX": 35.0, "VRMIN": 0.0, "TE": 1.2,
    "VFEMAX": 999.0, "VEMIN": 0.0, "KC": 0.55, "KD": 1.1, "KE": 1.0,
    "E1": 6.5, "SE1": 0.3, "E2": 9.0, "SE2": 3.0,
}  # fmt: skip
OF_TRANSFORMER = {"f0": 60.0, "R": 0.0, "X": 0.0, "Ra": 0.0, "Rc": 0.0, "Xc": 0.0}
OF_GOVERNOR = {"R": 0.05, "VMAX": 1.2, "VMIN": 0.0, "T1": 0.4, "T2": 2.1, "T3": 7.0, "Dt": 0.0}
STEP = 1e-3


def recorded(name):
    """Return the columns of a reference trajectory."""
    with (REFERENCE / f"{name}.csv").open() as file:
        header, *rows = csv.reader(file)
    return dict(zip(header, np.array(rows, dtype=float).T, strict=True))


def values_of(columns, **transformer):
    """Return the values of the unit of the reference trajectories, from the record's first row."""
    values = {**OF_EXCITER, VT0: columns["vt"][0], "speed0": 1.0}
    values |= {"p0": columns["p"][0], "q0": columns["q"][0]}
    values |= {MACHINE + symbol: value for symbol, value in OF_MACHINE.items()}
    network = {**OF_TRANSFORMER, **transformer}
    return values | {NETWORK + symbol: value for symbol, value in network.items()}


def played(time, vt, angle, frequency=None):
    """Return inputs of a record that is at rest at its start."""
    turning = SplinedInput(time, angle - angle[0])
    if frequency is not None:
        turning = SplinedInput(time, 2.0 * pi * (frequency - frequency[0]), integrated=True)
    return Inputs(time[0], time[-1], (), {"vt": SplinedInput(time, vt - vt[0]), "angle": turning})


def response(made, inputs, time, values, step=STEP):
    return Simulator(made, inputs, time, step).response(values).signals


# --- another simulator ----------------------------------------------------------------------------


def rounded_rectifier(ve, load):
    """Return the voltage behind a rectifier, with the constants that the other program rounds."""
    steepest = larger(1.732 * (ve - load), 0.0)
    sloping = where(load < 0.75 * ve, sqrt(0.75 * ve * ve - load * load), steepest)
    return where(load <= 0.433 * ve, ve - 0.577 * load, sloping)


def rounded_equations(s, u, p, d):
    ac8b(s, u, p, d)
    return rounded_rectifier(s.VE, p.KC * u.ifd)


def rounded_rest(efd, u, p, x):
    """Write AC8B's rest where the rectifier is on its first arc, as before this event it is."""
    ve = efd + 0.577 * p.KC * u.ifd
    vfe = field_demand(ve, u.ifd, p)
    error, x.VI = pi_rest(vfe / p.KA, p.KPR, p.KIR)
    x.VC, x.VD, x.VR, x.VE = u.vc1, error, vfe, ve
    return u.vc1 + error - u.vs


ROUNDED = replace(MODELS["AC8B"], equations=rounded_equations, rest=rounded_rest)


@pytest.mark.parametrize(
    ("exciter", "most"),
    [
        (MODELS["AC8B"], {"p": 2e-5, "q": 1.5e-4, "efd": 6e-4, "speed": 5e-7}),
        (ROUNDED, {"p": 1e-5, "q": 1e-5, "efd": 1e-5, "speed": 5e-7}),
    ],
    ids=["exact", "rounded"],
)
@pytest.mark.parametrize("governor", [None, "TGOV1"])
def test_an_event_is_that_of_another_simulator(exciter, most, governor):
    """It rounds the constants of the rectifier, and writes the swing equation with a torque.

    With these constants efd jumps where the arcs miss each other, which a sample just beside shows.
    """
    columns = recorded("playback_ac8b" if governor is None else "playback_ac8b_tgov1")
    time, turbine = columns["t"], None if governor is None else GOVERNORS[governor]
    unit = UnitOnLoad(exciter, GENROU, QUADRATIC, dialect="andes", governor=turbine)
    inputs = played(time, columns["vt"], columns["angle"])
    values = {GOVERNOR + symbol: value for symbol, value in (PLAIN | OF_GOVERNOR).items()}
    got = response(grid_playback(unit), inputs, time, values_of(columns) | values, 0.5 * STEP)
    arcs = np.abs(OF_EXCITER["KC"] * got["ifd"] / got["VE"] - 0.433) > 1e-3
    for signal, limit in most.items():
        difference = np.abs(got[signal] - columns[signal])
        assert difference[arcs if signal == "efd" else slice(None)].max() < limit, signal


# --- what must hold -------------------------------------------------------------------------------


def behind_a_line(exciter="AC8B", X=0.3, **network):
    """Return an infinite bus whose source sags, turns and comes back, and what its terminals show.

    That is time, values, signals and the angle of the terminal voltage, every 1/60 s.
    """
    line = {"network_R": 0.0, "network_X": X, "network_Rc": 0.0, "network_Xc": 0.0, **network}
    values = values_on_load(GENROU, exciter=exciter, **line)
    steps = (
        InputStep(1.0, -0.03, "E", ramp=0.4),
        InputStep(1.5, 0.2, "angle", ramp=0.5),
        InputStep(3.0, 0.05, "E", ramp=0.5),
    )
    time = np.arange(361) / 60.0
    bus = Simulator(system(GENROU, exciter=exciter), Inputs(0.0, 6.0, steps), time, STEP)
    got = bus.response(values).signals
    angle = np.interp(time, [0.0, 1.5, 2.0, 6.0], [0.0, 0.0, 0.2, 0.2])
    advance = np.arctan2(got["p"] * X, got["vt"] ** 2 - got["q"] * X)
    return time, values, got, angle + advance


def powers(values, got):
    """Return the values of a playback of terminals that rest with the powers at the start."""
    return {**values, "p0": got["p"][0], "q0": got["q"][0], "speed0": 1.0}


@pytest.mark.parametrize("exciter", ["AC8B", "SEXS", "ST1A", "DC1A"])
def test_a_playback_of_its_terminals_is_the_unit_behind_a_line(exciter):
    """At 60 samples a second splines between the corners of ramps leave a few 1e-5."""
    time, values, got, angle = behind_a_line(exciter)
    made = grid_playback(UnitOnLoad(MODELS[exciter], GENROU, QUADRATIC))
    own = powers(values, got) | {NETWORK + "X": 0.0}
    again = response(made, played(time, got["vt"], angle), time, own)
    assert np.ptp(got["p"]) > 0.05
    for signal, limit in (("p", 2e-4), ("q", 1e-4), ("speed", 5e-6), ("efd", 3e-3)):
        assert np.abs(again[signal] - got[signal]).max() < limit, signal


@pytest.mark.parametrize("power_at", ["recorded-voltage", "terminals"])
def test_a_transformer_is_a_line_to_the_recorded_voltage(power_at):
    """The source of an infinite bus is what is recorded: the powers are those at either end."""
    time, values, got, _ = behind_a_line(network_R=0.02)
    source = got["vt"][0] - (0.02 + 0.3j) * (got["p"][0] - 1j * got["q"][0]) / got["vt"][0]
    vt = np.interp(time, [0.0, 1.0, 1.4, 3.0, 3.5, 6.0], np.cumsum([0, 0, -0.03, 0, 0.05, 0]))
    angle = np.interp(time, [0.0, 1.5, 2.0, 6.0], [0.0, 0.0, 0.2, 0.2])
    made = grid_playback(
        UnitOnLoad(MODELS["AC8B"], GENROU, QUADRATIC),
        ("vref", "vt", "angle"),
        frozenset(),
        power_at,
    )
    lost = (got["p"] ** 2 + got["q"] ** 2) / got["vt"] ** 2
    far = {"p": got["p"] - 0.02 * lost, "q": got["q"] - 0.3 * lost}
    shown = got if power_at == "terminals" else far
    own = values | {"p0": shown["p"][0], "q0": shown["q"][0], "speed0": 1.0, VT0: abs(source)}
    in_lines = {"vt": RecordedInput(time, vt), "angle": RecordedInput(time, angle)}
    again = response(made, Inputs(0.0, 6.0, (), in_lines), time, own)
    for signal in ("p", "q"):
        assert np.abs(again[signal] - shown[signal]).max() < 1e-6, signal
    assert np.abs(again["efd"] - got["efd"]).max() < 1e-5


@pytest.mark.parametrize("dialect", ["standard", "powerworld", "andes"])
def test_a_unit_whose_record_rests_stays_at_rest_for_a_minute(dialect):
    made = grid_playback(UnitOnLoad(MODELS["AC8B"], GENROU, QUADRATIC, dialect=dialect))
    columns = {"vt": np.full(2, 1.01), "p": [0.8], "q": [0.1]}
    time = np.linspace(0.0, 60.0, 61)
    inputs = Inputs(0.0, 60.0, ())
    values = values_of(columns, R=0.005, X=0.1, Xc=0.05)
    got = response(made, inputs, time, values)
    for signal, samples in got.items():
        assert np.ptp(samples) < 1e-9, signal
    assert got["p"][0] == pytest.approx(0.8, abs=1e-12)
    assert got["q"][0] == pytest.approx(0.1, abs=1e-12)


def test_halving_the_step_cuts_the_error_of_a_playback_fourfold():
    """The recorded voltage runs in lines between the points of the grid."""
    columns = recorded("playback_ac8b")
    time = columns["t"]
    made = grid_playback(UnitOnLoad(MODELS["AC8B"], GENROU, QUADRATIC))
    inputs, values = played(time, columns["vt"], columns["angle"]), values_of(columns)
    step = 1.0 / 240.0
    runs = [response(made, inputs, time, values, step / 2**k)["p"] for k in range(4)]
    errors = [np.abs(run - runs[-1]).max() for run in runs[:2]]
    assert 3.5 < errors[0] / errors[1] < 5.5  # 4.2 against a run that is itself not exact


def test_a_resistance_of_the_stator_is_one_of_the_transformer_whose_drop_is_compensated():
    columns = recorded("playback_ac8b")
    made = grid_playback(UnitOnLoad(MODELS["AC8B"], GENROU, QUADRATIC))
    time, values = columns["t"], values_of(columns)
    inside, outside = (
        response(made, played(time, columns["vt"], columns["angle"]), time, values | of_network)
        for of_network in ({"network.Ra": 0.01, "network.Rc": 0.01}, {"network.R": 0.01})
    )
    for signal in ("efd", "p", "q", "speed"):
        assert np.abs(inside[signal] - outside[signal]).max() < 1e-9, signal


def test_the_frequency_drives_as_the_angle_whose_slope_it_is():
    columns = recorded("playback_ac8b")
    time, angle = columns["t"], columns["angle"]
    made = grid_playback(UnitOnLoad(MODELS["AC8B"], GENROU, QUADRATIC))
    values = values_of(columns)
    frequency = CubicSpline(time, angle).derivative()(time) / (2.0 * pi)
    by_angle, by_frequency = (
        response(made, played(time, columns["vt"], angle, course), time, values)["p"]
        for course in (None, frequency)
    )
    assert np.abs(by_angle - by_frequency).max() < 2e-4


def test_a_spline_goes_from_jump_to_jump():
    """Beside a jump it is as without one, and inside it a line."""
    time = np.arange(60) / 60.0
    smooth = np.sin(3.0 * time)
    jumping = smooth + 0.5 * (time > 0.5)
    spline = SplinedInput(time, jumping, ((30, 31),))
    fine = np.linspace(0.0, time[-1], 591)
    exact = np.sin(3.0 * fine) + 0.5 * (fine >= time[31])
    outside = (fine <= time[30]) | (fine >= time[31])
    assert np.abs(spline.at(fine) - exact)[outside].max() < 1e-6
    middle = spline.at(np.array([0.5 * (time[30] + time[31])]))
    assert middle[0] == pytest.approx(0.5 * (jumping[30] + jumping[31]), abs=1e-12)
    assert np.abs(SplinedInput(time, jumping).at(fine) - exact)[outside].max() > 1e-2
