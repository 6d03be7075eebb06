"""Whole systems against outside results: another simulator, closed forms, another integrator."""

import numpy as np
import pytest
from oracle import SURROUNDED, drawn_values, system_of, typical_values
from references import reference
from typed_units import AC1A, AC8B, integrated

from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import MACHINE, SATURATION, SPEED, VT0
from exfit.plants.open_circuit import open_circuit
from exfit.simulation.inputs import Inputs, InputStep, each
from exfit.simulation.simulator import Simulator

PAIRS = [*dict.fromkeys((exciter, machine) for exciter, machine, _ in SURROUNDED)]


@pytest.mark.parametrize("name", ["ac1a", "ac8b_unit1", "ac8b_unit2"])
def test_a_bump_up_and_down_is_that_of_another_simulator(name):
    """The other one rounds the rectifier's constants, which moves vt by 4e-6."""
    model, values, inputs, columns, described = reference(f"reference_{name}")
    system = system_of(model)
    assert values.keys() == set(system.parameters)
    simulator = Simulator(system, inputs, columns["t"], 1e-3)
    got = simulator.response(values).signals
    assert got["vref"][0] == pytest.approx(described["vref_initial"], abs=2e-6)
    assert np.abs(got["vt"] - columns["vt"]).max() < 1e-5
    assert np.abs(got["efd"] - columns["efd"]).max() < 2e-3
    assert np.abs(got["ifd"] - columns["ifd"]).max() < 2e-3
    assert np.abs(got["vref"] - columns["vref"]).max() < 2e-6  # old still at the instants


def test_at_another_speed_the_unit_is_a_rated_one_with_a_larger_gain():
    """vt is speed times flux: w of the speed, KA w times and KF, vt0, the step a w-th as large."""
    machine, speed, times = MACHINES["GENROU"], 1.04, np.linspace(0.0, 6.0, 601)
    turning = open_circuit(MODELS["AC1A"], machine, SATURATION["quadratic"], ("vref", SPEED))
    values = typical_values("AC1A", KA=200.0, KF=0.03)
    faster = {**values, VT0: 1.02, f"{SPEED}0": speed}
    rated = {**values, VT0: 1.02 / speed, "KA": speed * 200.0, "KF": 0.03 / speed}

    def response(system, own, step):
        inputs = Inputs(0.0, times[-1], (InputStep(1.0, step),))
        return Simulator(system, inputs, times, 1e-3).response(own).signals

    got = response(turning, faster, 0.05)
    expected = response(system_of("AC1A"), rated, 0.05 / speed)
    # two runs of the same equations: rounding
    assert np.abs(got["vt"] - speed * expected["vt"]).max() < 1e-9
    for signal in ("efd", "ifd"):
        assert np.abs(got[signal] - expected[signal]).max() < 1e-8


def test_a_falling_speed_takes_vt_along_where_the_flux_holds():
    """With a regulator so slow that it does nothing, vt falls as the speed does."""
    machine, times = MACHINES["GENROU"], np.linspace(0.0, 2.0, 201)
    turning = open_circuit(MODELS["AC1A"], machine, SATURATION["quadratic"], ("vref", SPEED))
    values = {**typical_values("AC1A", TA=1e4, TF=1e4), VT0: 1.0, f"{SPEED}0": 1.0}
    inputs = Inputs(0.0, 2.0, (InputStep(0.0, -0.02, SPEED, ramp=2.0),))
    vt = Simulator(turning, inputs, times, 1e-3).response(values).signals["vt"]
    assert np.abs(vt - (1.0 - 0.01 * times)).max() < 1e-4


# --- the check system in closed form --------------------------------------------------------------

K, A = 4.0, 2.0
PRINTED_DK = """0 .0906 .1648 .2256 .2753 .3161 .3494 .3767
    .3991 .4174 .4323 .4446 .4546 .4629 .4696 .4751"""
PRINTED_DA = """0 -.0175 -.0616 -.1219 -.1912 -.2642 -.3374 -.4082
    -.4751 -.5372 -.5940 -.6454 -.6916 -.7326 -.7689 -.8009"""
TIMES = np.arange(16) / 10.0


def check_system(k=K, a=A, vt0=0.0):
    inputs = Inputs(0.0, TIMES[-1], (InputStep(0.0, 1.0),))
    simulator = Simulator(system_of("FIRST_ORDER"), inputs, TIMES, 1e-3)
    return simulator, {"k": k, "a": a, VT0: vt0}


def closed_form(k, a, t=TIMES):
    return k / a * (1.0 - np.exp(-a * t))


def closed_slopes(k, a, t=TIMES):
    e = np.exp(-a * t)
    return (1.0 - e) / a, k * (t * e / a - (1.0 - e) / a**2)


@pytest.mark.parametrize(("k", "a"), [(K, A), (1.0, 0.1), (30.0, 12.0)])
def test_the_check_system_has_its_closed_form(k, a):
    simulator, values = check_system(k, a)
    (samples, _), expected = simulator.samples(values, ("vt",)), closed_form(k, a)
    # Runge-Kutta errs by (a step)^4 / 120 relative
    assert np.abs(samples[:, 0] - expected).max() < 1e-7 * expected.max()
    for column, slope in enumerate(closed_slopes(k, a)):
        _, exact = simulator.tangents(values, ("vt",), each(("k", "a")))
        assert np.abs(exact[:, 0, column] - slope).max() < 1e-7 * np.abs(slope).max()


@pytest.mark.parametrize(("name", "column"), [("k", 0), ("a", 1)])
def test_central_differences_of_the_check_system_reach_its_closed_form(name, column):
    simulator, values = check_system()
    h = 1e-5 * values[name]
    sets = [values | {name: values[name] + side * h} for side in (1, -1)]
    (above, below), _ = simulator.samples_of_many(sets, ("vt",))
    got = (above - below)[:, 0] / (2 * h)
    assert np.abs(got - closed_slopes(K, A)[column]).max() < 1e-7


@pytest.mark.parametrize(("printed", "column"), [(PRINTED_DK, 0), (PRINTED_DA, 1)])
def test_the_derivatives_of_the_check_system_are_those_printed(printed, column):
    """Lai, NC State University, 3.3: k = 4, a = 2, to four decimals."""
    simulator, values = check_system()
    _, slopes = simulator.tangents(values, ("vt",), each(("k", "a")))
    expected = np.array(printed.split(), dtype=float)
    assert np.abs(slopes[:, 0, column] - expected).max() <= 0.5e-4 + 1e-9


def test_the_check_system_starts_at_rest_anywhere():
    simulator, values = check_system(vt0=3.0)
    (samples, _), (_, slopes) = (
        simulator.samples(values, ("vt",)),
        simulator.tangents(values, ("vt",), each((VT0,))),
    )
    assert samples[:, 0] == pytest.approx(3.0 + closed_form(K, A), abs=1e-12)
    assert slopes[:, 0, 0] == pytest.approx(np.ones(16), abs=1e-12)


# --- another integrator, equations typed again ----------------------------------------------------


@pytest.mark.parametrize("method", ["DOP853", "LSODA"])
@pytest.mark.parametrize(
    ("machine", "changes_of_machine"),
    [("ONE_AXIS", {}), ("GENROU", {}), ("GENROU", {"machine.Xppd": 0.22})],
)
@pytest.mark.parametrize("unit", [AC1A, AC8B])
def test_another_integrator_of_other_words_agrees(unit, machine, changes_of_machine, method):
    """Steps on and off the grid, a ramp, samples at uneven times; the limits stand far away.

    The typical Xppd lies halfway between Xl and Xpd, where both fluxes have equal shares.
    """
    name = unit.__name__
    values = drawn_values(name, 2, machine)
    for symbol, value in changes_of_machine.items():
        values[symbol] *= value / typical_values(name, machine)[symbol]
    limits = {"MAX": 9999.0, "MIN": -9999.0}
    values |= {symbol: limits[symbol[-3:]] for symbol in values if symbol[-3:] in limits}
    changes = (InputStep(0.2, 0.02), InputStep(1.00037, -0.03), InputStep(1.5, 0.025, ramp=0.4))
    times = np.sort(np.random.default_rng(3).uniform(0.0, 2.5, 120))
    times = np.unique([0.0, 1.00037, 2.5, *times])
    vt, efd = integrated(unit(values, machine), 1.0, changes, times, method)
    simulator = Simulator(system_of(name, machine), Inputs(0.0, 2.5, changes), times, 2.5e-4)
    samples, parts = simulator.samples(values, ("vt", "efd"))
    assert parts == 1
    # what is asked of the other integrator is 1e-10 per step; ours errs by (step/T)^4
    assert np.abs(samples[:, 0] - vt).max() < 2e-8
    assert np.abs(samples[:, 1] - efd).max() < 1e-6


# --- machines -------------------------------------------------------------------------------------


def response(name, machine, values, size=0.05):
    inputs = Inputs(0.0, 3.0, (InputStep(0.1, size),))
    simulator = Simulator(system_of(name, machine), inputs, np.linspace(0.0, 3.0, 301), 1e-3)
    return simulator.samples(values, ("vt", "efd", "ifd"))[0]


def test_a_round_rotor_without_damper_is_the_one_axis_machine(exciter):
    round_rotor = typical_values(exciter, "GENROU", machine_Tppd0=0.0)
    one_axis = typical_values(exciter, "ONE_AXIS")
    shared = {name: round_rotor[name] for name in one_axis}
    got = response(exciter, "GENROU", round_rotor)
    assert got == pytest.approx(response(exciter, "ONE_AXIS", shared), abs=1e-12)


@pytest.mark.each_model
@pytest.mark.parametrize(("exciter", "machine"), PAIRS)
def test_a_machine_without_saturation_needs_as_much_field_as_voltage(exciter, machine):
    values = typical_values(exciter, machine, machine_S10=0.0, machine_S12=0.0)
    got = response(exciter, machine, values)
    assert got[0] == pytest.approx([1.0, 1.0, 1.0], abs=1e-12)
    slow = values | {VT0: 1.1}
    assert response(exciter, machine, slow)[0] == pytest.approx([1.1] * 3, abs=1e-12)


@pytest.mark.each_model
@pytest.mark.parametrize(("exciter", "machine"), PAIRS)
def test_saturation_of_the_machine_has_its_two_points(exciter, machine):
    values = typical_values(exciter, machine)
    for voltage, added in ((1.0, 0.12), (1.2, 1.2 * 0.4)):
        got = response(exciter, machine, values | {VT0: voltage}, size=0.0)
        assert got[0] == pytest.approx([voltage, *[voltage + added] * 2], abs=1e-9)


@pytest.mark.parametrize(
    ("machine", "wrong", "symbol"),
    [
        ("GENROU", {"Xpd": 1.8}, "Xd"),
        ("GENROU", {"Xl": 0.4}, "Xpd"),
        ("GENSAL", {"Tppd0": 7.0}, "Tpd0"),
        ("GENROU", {"Tppd0": 7.0}, "Tpd0"),
        ("GENROU", {"S10": 0.3, "S12": 0.2}, "S12"),
        ("ONE_AXIS", {"S10": 0.3, "S12": 0.3}, "S12"),
    ],
)
def test_machine_data_that_contradict_each_other_are_named(machine, wrong, symbol):
    found = MACHINES[machine]
    (fault,) = found.faults(typical(found.sheet) | wrong)
    assert fault[0] == symbol
    assert f"{next(iter(wrong.values())):g}" in fault[1] or symbol == "S12"


def test_a_damper_that_is_not_seen_may_have_any_time_constant():
    """X'd = X''d, as planning files write it: the response knows nothing of T''d0."""
    machine = MACHINES["GENROU"]
    unseen = {"Xppd": typical(machine.sheet)["Xpd"]}
    assert list(machine.faults(typical(machine.sheet) | unseen | {"Tppd0": 999.0})) == []
    inputs = Inputs(0.0, 3.0, (InputStep(0.5, 0.01),))
    simulator = Simulator(system_of("AC1A"), inputs, np.linspace(0.0, 3.0, 61), 1e-3)
    values = typical_values("AC1A", machine_Xppd=unseen["Xppd"])
    one, other = (
        simulator.samples(values | {MACHINE + "Tppd0": T}, ("vt",))[0] for T in (0.05, 999.0)
    )
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12)
