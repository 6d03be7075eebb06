"""A unit on load with a governor: what it holds at rest, and how the power follows the speed."""

import numpy as np
import pytest
from on_load import QUADRATIC, system, values_on_load
from oracle import vector

from exfit.engine.kernel import LinearKernel
from exfit.engine.system import parameters_used
from exfit.models import GOVERNORS, MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import BREAKER, GOVERNOR, NETWORK
from exfit.plants.controls import why_no_rest
from exfit.plants.infinite_bus import infinite_bus
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

POWER = 0.69  # pu
# dPm/dpref and dPm/dw where all is settled, of typical data
DROOP = {"TGOV1": 0.05, "GAST": 0.04, "IEEEG1": 1 / 25.0, "IEESGO": 1 / 14.3}


@pytest.fixture(params=list(GOVERNORS))
def governor(request):
    return GOVERNORS[request.param]


def governed(governor, inputs=("vref", "pref", "angle", "X")):
    """Return a unit with a governor, and its values: typical ones, all within the limits."""
    machine = MACHINES["GENROU"]
    made = infinite_bus(MODELS["AC8B"], machine, QUADRATIC, inputs, "Q", governor=governor)
    values = values_on_load(machine, network_P=POWER, machine_D=2.0)
    values |= {GOVERNOR + name: value for name, value in typical(governor.sheet).items()}
    return made, values


def response(made, values, *steps, seconds=20.0):
    inputs = Inputs(0.0, seconds, steps)
    simulator = Simulator(made, inputs, np.linspace(0.0, seconds, 401), 1e-3)
    return simulator.response(values).signals


def test_a_unit_with_a_governor_waits_at_rest(governor):
    made, values = governed(governor)
    signals = response(made, values, seconds=60.0)
    assert np.abs(signals["p"] - POWER).max() < 1e-9
    assert np.abs(signals["speed"] - 1.0).max() < 1e-12


def test_all_parameters_of_a_governor_reach_the_system(governor):
    made, values = governed(governor)
    own = {name for name in values if name.startswith(GOVERNOR)}
    assert own <= parameters_used(made)
    assert {GOVERNOR + name for name in governor.states} <= {*made.states}


def test_without_a_governor_the_system_is_that_of_before():
    made, _ = governed(GOVERNORS["TGOV1"])
    plain = system(MACHINES["GENROU"], inputs=("vref", "pref", "angle", "X"))
    assert not any(name.startswith(GOVERNOR) for name in (*plain.parameters, *plain.states))
    assert "Pm" in plain.setpoints
    assert set(plain.states) < set(made.states)


@pytest.mark.parametrize("name", DROOP)
def test_the_power_settles_at_what_the_reference_asks_for(name):
    """The source holds the speed at 1: dPm is that of the reference, over the droop of TGOV1."""
    governor = GOVERNORS[name]
    made, values = governed(governor)
    step = 0.05 * (DROOP[name] if name == "TGOV1" else 1.0)
    signals = response(made, values, InputStep(1.0, step, "pref"), seconds=120.0)
    assert signals["p"][-1] == pytest.approx(POWER + 0.05, abs=1e-4)


@pytest.mark.parametrize("name", DROOP)
def test_the_power_falls_with_the_frequency_by_the_droop(name):
    governor, rise = GOVERNORS[name], 1e-3
    made, values = governed(governor)
    values |= {GOVERNOR + row.symbol: 0.0 for row in governor.sheet if row.symbol in DAMPING}
    turning = 2.0 * np.pi * values[NETWORK + "f0"] * rise  # rad/s
    ramp = InputStep(1.0, turning * 119.0, "angle", ramp=119.0)
    signals = response(made, values, ramp, seconds=120.0)
    assert signals["speed"][-1] == pytest.approx(1.0 + rise, abs=1e-7)
    expected = (POWER - rise / DROOP[name] - values["machine.D"] * rise) / (1.0 + rise)
    assert signals["p"][-1] == pytest.approx(expected, abs=1e-4)


DAMPING = ("Dt", "Dturb")
SELECTORS = ("Rselect", "Feedback", "Cflag", "Fd")


def test_exact_derivatives_with_a_governor_equal_central_differences(governor):
    """To every parameter of it, over a step of the reference and a line trip, off its limits."""
    inputs = Inputs(0.0, 4.0, (InputStep(0.2, 1e-3, "pref"), InputStep(1.0, 0.05, "X")))
    made, values = governed(governor)
    values |= {GOVERNOR + name: 9.0 for name in ("Aset", "Ldref") if GOVERNOR + name in values}
    simulator = Simulator(made, inputs, np.linspace(0.0, 4.0, 41), 1e-3)
    free = tuple(
        GOVERNOR + row.symbol
        for row in governor.sheet
        if values[GOVERNOR + row.symbol] != 0.0 and row.symbol not in SELECTORS
    )
    _, slopes = simulator.tangents(values, ("p", "speed"), each(free))
    for column, name in enumerate(free):
        misses = []
        for h in (1e-5 * abs(values[name]), 1e-4 * abs(values[name])):  # one rounds, one bends
            sets = [values | {name: values[name] + side * h} for side in (1, -1)]
            up, down = simulator.samples_of_many(sets, ("p", "speed"))[0]
            difference = (up - down) / (2.0 * h)
            size = max(np.abs(difference).max(), 1e-3)
            misses.append(np.abs(slopes[:, :, column] - difference).max() / size)
        assert min(misses) < 1e-5, name


def test_after_a_load_rejection_the_governor_takes_the_power_away(governor):
    made, values = governed(governor, ("vref", BREAKER))
    signals = response(made, values, InputStep(1.0, 1.0, BREAKER), seconds=30.0)
    assert signals["p"][-1] == 0.0
    highest = signals["speed"].max()
    assert 1.03 < highest < 2.0
    assert signals["speed"][-1] < highest - 0.01


def test_a_governor_s_modes_are_stable_in_its_unit(governor):
    made, values = governed(governor)
    p = vector(made, values)
    rest = LinearKernel(made).rest(p)
    _, jacobian = LinearKernel(made).motion(p, rest.r, rest.x, np.zeros(len(made.inputs)))
    moving = np.abs(jacobian).max(axis=1) > 0.0
    assert np.linalg.eigvals(jacobian[np.ix_(moving, moving)]).real.max() < 1e-9


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("TGOV1", {"VMAX": 0.6}),
        ("IEEEG1", {"PMIN": 0.8}),
        ("IEEEG1", {"K1": 0.0, "K3": 0.0, "K5": 0.0}),
        ("HYGOV", {"GMAX": 0.5}),
        ("GAST", {"AT": 0.6}),
        ("IEESGO", {"PMAX": 0.6}),
        ("GGOV1", {"Ldref": 0.6}),
        ("GGOV1", {"VMAX": 0.6}),
    ],
)
def test_a_governor_at_a_limit_is_said_not_to_rest(name, change):
    governor = GOVERNORS[name]
    values = typical(governor.sheet)
    assert why_no_rest(governor, values, POWER) is None
    why = why_no_rest(governor, values | change, POWER)
    assert next(iter(change)) in why or why == "PMAX = 1 where it needs inf"
