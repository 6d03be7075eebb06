"""Poles, frequency responses and margins: closed forms, transfer functions, simulated runs."""

from dataclasses import replace

import numpy as np
import pytest
from diagrams import Transfer, lag, lead_lag, pid, washout
from on_load import system as on_load
from on_load import values_on_load
from oracle import SURROUNDINGS, drawn_values, lively_values, system_of, typical_values
from scipy import signal
from scipy.linalg import eig

from exfit.errors import SimulationError
from exfit.models import MODELS
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import MACHINE, MEASURED, SATURATION
from exfit.plants.playback import playback
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput
from exfit.simulation.simulator import Simulator
from exfit.simulation.small_signal import StateSpace, linearised, margins, poles_of, small_signal

ALONE = "FIRST_ORDER"
DEAF = "IEEET4"  # answers nothing that stays in its dead band
WITH_LOOP = [name for name in MODELS if name not in (ALONE, DEAF)]
TALL = 1e-7  # pu: a disturbance that is linear


def at(of, frequency):
    """Return the frequency response of a hand-typed transfer function."""
    return signal.freqresp((of.over.c, of.under.c), 2.0 * np.pi * frequency)[1]


def every(poles):
    """Return all poles, both of each pair."""
    found = np.array([pole.value for pole in poles])
    return np.append(found, found[found.imag > 0.0].conj())


def in_order(values):
    return np.sort_complex(np.round(np.asarray(values, dtype=complex), 9))


def state_space(transfer):
    A, b, c, d = signal.tf2ss(transfer.over.c, transfer.under.c)
    return StateSpace(A, b[:, 0], c[0], float(d[0, 0]))


# --- transfer functions of the drawings -----------------------------------------------------------

LINEAR = {"KC": 0.0, "KD": 0.0, "SE1": 0.0, "SE2": 0.0}


def regulator(name, p):
    """Return the path from the voltage error to efd as the drawing has it, without limits."""
    if name == "SEXS":
        return lead_lag(p["TATB"] * p["TB"], p["TB"]) * lag(p["K"], p["TE"])
    if name == "ST1A":
        forward = lead_lag(p["TC"], p["TB"]) * lead_lag(p["TC1"], p["TB1"]) * lag(p["KA"], p["TA"])
        return forward.fed_back(washout(p["KF"], p["TF"]))
    exciter = Transfer([1.0], [p["TE"], p["KE"]])
    if name == "AC8B":
        return pid(p["KPR"], p["KIR"], p["KDR"], p["TDR"]) * lag(p["KA"], p["TA"]) * exciter
    forward = lead_lag(p["TC"], p["TB"]) * lag(p["KA"], p["TA"]) * exciter
    return forward.fed_back(p["KE"] * washout(p["KF"], p["TF"]))


def drawing(name, seed):
    """Return a linear model on a machine of one lag, its values and its loop gain."""
    system = system_of(name, "ONE_AXIS")
    values = drawn_values(name, seed, "ONE_AXIS")
    known = {k: v for k, v in LINEAR.items() if k in values}
    values |= known | {MACHINE + "S10": 0.0, MACHINE + "S12": 0.0}
    values |= {"ILR": 99.0} if "ILR" in values else {}
    values |= {"VFEMAX": 99.0} if "VFEMAX" in values else {}
    machine = lag(1.0, values[MACHINE + "Tpd0"])
    transducer = lag(1.0, values.get("TR", 0.0))
    return system, values, regulator(name, values) * machine, transducer


@pytest.mark.parametrize("name", ["SEXS", "ST1A", "AC8B", "AC1A"])
@pytest.mark.parametrize("seed", [1, 2])
def test_the_loop_is_that_of_the_drawing(name, seed):
    system, values, forward, transducer = drawing(name, seed)
    frequency = np.geomspace(1e-3, 50.0, 60)
    found = small_signal(system, values, frequency)
    loop = at(forward * transducer, frequency)
    # SciPy's polynomials of six and more roots lose some digits
    assert found.open.response == pytest.approx(loop, rel=1e-7)
    assert found.closed.response == pytest.approx(at(forward, frequency) / (1.0 + loop), rel=1e-7)
    typed = forward.fed_back(transducer)
    ours = every(found.poles)
    for pole in np.roots(typed.under.c):
        assert np.abs(ours - pole).min() < 1e-5 * abs(pole)


def test_a_first_order_model_has_its_pole_its_bandwidth_and_its_gain():
    found = small_signal(system_of(ALONE), typical_values(ALONE))
    (pole,) = found.poles
    assert pole == (-2.0, 1.0, 0.0, ("V",))
    assert found.closed.response == pytest.approx(
        4.0 / (2j * np.pi * found.closed.frequency + 2.0), rel=1e-12
    )
    assert found.bandwidth == pytest.approx(1.0 / np.pi, rel=1e-7)
    # a tenth of the pole's frequency is the lowest that is looked at
    assert found.peak == pytest.approx(20.0 * np.log10(2.0), abs=0.05)
    assert (found.open, found.margins, found.path) == (None, None, ("vref", "vt"))


# --- margins --------------------------------------------------------------------------------------

WIDE = np.geomspace(1e-3, 1e2, 300)


def test_three_equal_lags_have_the_margins_of_the_textbook():
    """K / (1 + s)^3 turns by 180 degrees at sqrt(3) rad/s, where its gain is K / 8."""
    K = 4.0
    found = margins(state_space(Transfer([K], np.poly([-1.0] * 3))), WIDE)
    assert found.gain == pytest.approx(20.0 * np.log10(8.0 / K), rel=1e-9)
    assert found.gain_at == pytest.approx(np.sqrt(3.0) / (2.0 * np.pi), rel=1e-9)
    crossover = np.sqrt(K ** (2.0 / 3.0) - 1.0)
    assert found.phase_at == pytest.approx(crossover / (2.0 * np.pi), rel=1e-9)
    assert found.phase == pytest.approx(180.0 - 3.0 * np.degrees(np.arctan(crossover)), rel=1e-8)


def test_an_unstable_loop_has_negative_margins():
    found = margins(state_space(Transfer([16.0], np.poly([-1.0] * 3))), WIDE)
    assert found.gain == pytest.approx(20.0 * np.log10(0.5), rel=1e-9)
    assert found.phase < 0.0


def test_one_or_two_lags_have_no_gain_margin_and_a_low_gain_no_phase_margin():
    assert margins(state_space(lag(5.0, 1.0) * lag(1.0, 1.0)), WIDE).gain is None
    low = margins(state_space(lag(0.5, 1.0)), WIDE)
    assert low == (None, None, None, None)


def test_of_several_crossovers_the_nearest_to_instability_is_reported():
    """A double integrator with a lead, then two lags: -180 degrees below and above the gain."""
    loop = Transfer([6.0 * 4.0, 6.0 * 4.0 * 0.4, 6.0 * 0.2], np.poly([0.0, 0.0, 0.0, -20.0, -30.0]))
    loop = Transfer(600.0 * loop.over.c, loop.under.c)
    w = np.geomspace(1e-2, 200.0, 200001)
    z = at(loop, w / (2.0 * np.pi))
    turned = np.flatnonzero((np.diff(np.sign(z.imag)) != 0) & (z.real[1:] < 0.0))
    assert len(turned) == 2
    gains = -20.0 * np.log10(np.abs(z[turned]))
    found = margins(state_space(loop), WIDE)
    assert found.gain == pytest.approx(gains[np.argmin(np.abs(gains))], rel=1e-3)


@pytest.mark.parametrize("name", WITH_LOOP)
def test_the_margins_bring_a_pole_to_the_edge(name):
    """Raised by the gain margin the loop swings; so it does turned by the phase margin."""
    system, values = system_of(name), drawn_values(name, 3)
    loop = linearised(system, values).path(MEASURED, MEASURED).broken()
    found = small_signal(system, values).margins
    if found.gain is not None:
        raised = loop.A - 10.0 ** (found.gain / 20.0) * np.outer(loop.b, loop.c)
        poles, edge = np.linalg.eigvals(raised), 2j * np.pi * found.gain_at
        assert np.abs(poles - edge).min() < 1e-5 * abs(edge)
    turned = loop.A - np.exp(-1j * np.radians(found.phase)) * np.outer(loop.b, loop.c)
    poles, edge = np.linalg.eigvals(turned), 2j * np.pi * found.phase_at
    assert np.abs(poles - edge).min() < 1e-5 * abs(edge)


# --- over the catalogue ---------------------------------------------------------------------------

OWN_LEAD = ("ST7B",)  # its voltage passes a lead-lag that its reference does not


@pytest.mark.parametrize("name", [name for name in WITH_LOOP if name not in OWN_LEAD])
@pytest.mark.parametrize("values_of", [typical_values, lively_values])
def test_closed_is_open_over_one_plus_open_behind_the_transducer(name, values_of):
    values = values_of(name)
    found = small_signal(system_of(name), values)
    s = 2j * np.pi * found.closed.frequency
    seen = found.closed.response / (1.0 + s * values.get("TR", values.get("TFV", 0.0)))
    loop = found.open.response / (1.0 + found.open.response)
    assert np.abs(seen - loop).max() < 1e-9 * np.abs(loop).max()


@pytest.mark.parametrize("name", WITH_LOOP)
def test_the_poles_are_the_roots_of_one_plus_the_loop_gain(name):
    """1 + L(s) is the product of (s - closed pole) over that of (s - open pole)."""
    system, values = system_of(name), drawn_values(name, 4)
    loop = linearised(system, values).path(MEASURED, MEASURED).broken()
    s = np.random.default_rng(5).uniform(0.5, 20.0, 20) * np.exp(0.3j)
    closed, opened = every(small_signal(system, values).poles), np.linalg.eigvals(loop.A)
    product = np.prod((s[:, None] - closed) / (s[:, None] - opened), axis=1)
    assert product == pytest.approx(1.0 + loop.response(s), rel=1e-6)


@pytest.mark.parametrize("name", WITH_LOOP)
def test_the_loop_gain_is_positive_at_low_frequency(name):
    found = small_signal(system_of(name), lively_values(name)).open.response[0]
    assert abs(found) > 1.0
    # an integrator turns it by 90 degrees; AC3C has two, as an alternator that feeds its own
    # regulator is nearly one as well
    once = found * 1j if name == "AC3C" else found
    assert once.real > 0.0 or once.imag < 0.0


def differences(system, values):
    """Return the poles of a Jacobian by central differences of the plain equations."""
    start = system.rest(values)
    still = dict.fromkeys(system.inputs, 0.0)

    def slopes(x):
        told = system.motion(values, start.setpoints, x, still).slopes
        return np.array([float(told[name]) for name in system.states])

    columns = []
    for name in system.states:
        h = 1e-6 * max(1.0, abs(float(start.states[name])))
        up, down = ({**start.states, name: start.states[name] + sign * h} for sign in (1.0, -1.0))
        columns.append((slopes(up) - slopes(down)) / (2.0 * h))
    jacobian = np.stack(columns, axis=1)
    moves = np.any(jacobian != 0.0, axis=1)
    return np.linalg.eigvals(jacobian[np.ix_(moves, moves)])


def assert_same_poles(found, expected):
    ours = every(found)
    assert len(ours) == len(expected)
    for pole in expected:
        # what a difference shows, of poles that may lie close together
        assert np.abs(ours - pole).min() < 1e-4 * max(1.0, abs(pole))


def test_poles_are_those_of_differences_of_the_equations(model):
    system, values = system_of(model), drawn_values(model, 6)
    assert_same_poles(small_signal(system, values).poles, differences(system, values))


@pytest.mark.parametrize(("machine", "saturation"), SURROUNDINGS)
def test_closed_is_that_of_the_equations_around_every_machine(machine, saturation):
    values = lively_values("AC1A", machine)
    system = system_of("AC1A", machine, saturation)
    assert_same_poles(small_signal(system, values).poles, differences(system, values))


def test_unstable_poles_are_those_of_a_run_that_grows(model):
    """Some seconds after a small bump it has grown, up to the limits, or died out."""
    gain = next(
        (
            symbol
            for symbol in ("KA", "K", "KPR", "KPA", "KV", "KVP", "K10", "KR", "VPU", "k")
            if symbol in typical_values(model)
        ),
        None,
    )
    bump = Inputs(0.0, 12.0, (InputStep(0.5, TALL), InputStep(0.6, -TALL)))
    times = np.linspace(0.0, 12.0, 2401)
    decided = 0
    for factor in (0.3, 1.0, 8.0, 60.0):
        values = lively_values(model)
        values[gain] *= factor
        fastest = max(pole.value.real for pole in small_signal(system_of(model), values).poles)
        if not 0.2 < abs(fastest) < 20.0:
            continue  # too slow to be seen, or soon beyond every limit
        vt = Simulator(system_of(model), bump, times, 1e-3).samples(values, ("vt",))[0][:, 0]
        moved = np.abs(vt - vt[0])
        early, late = moved[120:400].max(), moved[2000:].max()
        grown = late > min(early, 10.0 * TALL)
        assert grown == (fastest > 0.0), (factor, fastest)
        decided += 1
    assert decided or model in ("DC3A", "AC8B", "AC7B", "DC4B", "ESAC8B", "ST4C")


# --- simulated runs -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["AC1A", "ST1A", "SEXS", "DC2A", "AC8B", "FIRST_ORDER"])
def test_a_small_step_settles_to_the_response_at_rest(name):
    system, values = system_of(name), lively_values(name)
    inputs = Inputs(0.0, 200.0, (InputStep(1.0, TALL),))
    vt = Simulator(system, inputs, np.array([0.0, 200.0]), 1e-3).samples(values, ("vt",))[0][:, 0]
    slow = small_signal(system, values, np.array([1e-6])).closed.response[0]
    # the rounding of vt, over the step
    assert (vt[1] - vt[0]) / TALL == pytest.approx(slow.real, abs=1e-5)


@pytest.mark.parametrize("name", ["AC1A", "ST1A", "AC8B", "ST7B", "DC1A"])
@pytest.mark.parametrize("frequency", [0.2, 1.5])
def test_a_small_sine_comes_back_as_the_closed_response_says(name, frequency):
    system, values = system_of(name), lively_values(name)
    times = np.linspace(0.0, 60.0, 60001)
    size = 1e-5
    sine = {"vref": RecordedInput(times, size * np.sin(2.0 * np.pi * frequency * times))}
    simulator = Simulator(system, Inputs(0.0, 60.0, (), sine), times, 1e-3)
    vt = simulator.samples(values, ("vt",))[0][30000:, 0]
    angle = 2.0 * np.pi * frequency * times[30000:]
    columns = np.stack([np.sin(angle), np.cos(angle), np.ones_like(angle)], axis=1)
    along, across, _ = np.linalg.lstsq(columns, vt, rcond=None)[0] / size
    found = small_signal(system, values, np.array([frequency])).closed.response[0]
    # a slow mode has not died out within half a minute; the sine is straight between grid points
    assert complex(along, across) == pytest.approx(found, abs=5e-3)


# --- on load, and without a loop ------------------------------------------------------------------


@pytest.mark.parametrize("machine", list(MACHINES))
def test_on_load_there_is_the_swing_of_the_rotor(machine):
    values = values_on_load(MACHINES[machine])
    system = on_load(MACHINES[machine])
    found = small_signal(system, values)
    assert_same_poles(found.poles, differences(system, values))
    (swing,) = [pole for pole in found.poles if {"delta", "dw"} <= set(pole.states)]
    assert 0.5 < swing.frequency < 3.0
    assert -0.1 < swing.damping < 0.5


def test_damping_and_frequency_are_those_of_the_decay():
    """With a stiff mechanical damping the swing's decrement follows its pole."""
    machine = MACHINES["GENROU"]
    values = values_on_load(machine, machine_D=4.0)
    system = on_load(machine)
    poles = small_signal(system, values).poles
    (swing,) = [pole for pole in poles if {"delta", "dw"} <= set(pole.states)]
    times = np.linspace(0.0, 10.0, 10001)
    inputs = Inputs(0.0, 10.0, (InputStep(0.1, TALL, "E"), InputStep(0.2, -TALL, "E")))
    dw = Simulator(system, inputs, times, 1e-3).samples(values, ("speed",))[0][:, 0]
    dw = dw - dw[0]
    turns = times[1:][np.diff(np.sign(dw)) != 0]
    turns = turns[(turns > 2.0) & (turns < 4.5)]
    assert 0.5 / np.diff(turns).mean() == pytest.approx(swing.frequency, rel=0.05)


def test_the_loop_on_load_is_broken_where_the_exciter_measures():
    """With droop the measured voltage is not vt: vt answers by other than L / (1 + L)."""
    machine = MACHINES["GENROU"]
    values = values_on_load(machine, network_Xc=0.0, network_Rc=0.0)
    found = small_signal(on_load(machine), values)
    s = 2j * np.pi * found.closed.frequency
    loop = found.open.response / (1.0 + found.open.response)
    assert found.closed.response / (1.0 + s * values["TR"]) == pytest.approx(loop, abs=1e-8)
    drooping = small_signal(on_load(machine), values | {"network.Xc": 0.1})
    loop = drooping.open.response / (1.0 + drooping.open.response)
    assert np.abs(drooping.closed.response - loop).max() > 1e-3


def test_played_back_signals_leave_no_loop():
    system = playback(MODELS["AC1A"], SATURATION["quadratic"], ("vt", "ifd"))
    values = typical(MODELS["AC1A"].sheet) | {"vt0": 1.0, "ifd0": 1.1, "efd0": 1.1}
    found = small_signal(system, values)
    assert (found.open, found.margins, found.path) == (None, None, ("vref", "efd"))
    assert np.abs(found.closed.response[0]) > 1.0


# --- what is told ---------------------------------------------------------------------------------


def test_the_damping_of_an_oscillation_is_that_of_its_pair():
    found = small_signal(system_of("AC6A"), typical_values("AC6A")).poles
    pair = next(pole for pole in found if pole.frequency > 0.0)
    assert pair.damping == pytest.approx(-pair.value.real / abs(pair.value))
    assert pair.frequency == pytest.approx(pair.value.imag / (2.0 * np.pi))
    assert all(pole.damping == 1.0 for pole in found if pole.frequency == 0.0)


def test_a_state_that_nothing_feeds_back_has_a_pole_of_its_own():
    values = lively_values("AC1A", KF=0.0)
    found = small_signal(system_of("AC1A"), values).poles
    (washed,) = [pole for pole in found if pole.states[0] == "VF"]
    assert washed.value == pytest.approx(-1.0 / values["TF"], rel=1e-9)
    assert washed.states == ("VF",)


def test_a_bypassed_block_has_no_pole():
    values = typical_values("AC1A")
    assert (values["TR"], values["TB"]) == (0.0, 0.0)
    found = small_signal(system_of("AC1A"), values).poles
    states = system_of("AC1A").states
    assert len(every(found)) == len(states) - 2
    assert not {"VC", "VL"} & {state for pole in found for state in pole.states}


def test_frequencies_that_are_requested_are_reported_and_change_no_figure():
    system, values = system_of("AC8B"), lively_values("AC8B")
    asked = np.array([0.1, 1.0])
    few, all_of_them = small_signal(system, values, asked), small_signal(system, values)
    assert few.closed.frequency is asked
    assert (few.margins, few.bandwidth, few.peak) == (
        all_of_them.margins,
        all_of_them.bandwidth,
        all_of_them.peak,
    )


def test_a_dead_band_leaves_no_loop():
    found = small_signal(system_of(DEAF), lively_values(DEAF))
    assert not found.open.response.any()
    assert not found.closed.response.any()
    assert found.margins == (None, None, None, None)


def test_the_peak_and_the_bandwidth_are_those_of_a_denser_grid(model):
    if model == DEAF:
        pytest.skip("a response of zero has neither")
    system, values = system_of(model), drawn_values(model, 7)
    found = small_signal(system, values)
    frequency = found.closed.frequency
    dense = np.geomspace(frequency[0], frequency[-1], 20001)
    gains = np.abs(small_signal(system, values, dense).closed.response)
    assert found.peak == pytest.approx(20.0 * np.log10(gains.max()), abs=0.02)
    if found.bandwidth is not None:
        slow, there = np.abs(
            small_signal(system, values, np.array([1e-7, found.bandwidth])).closed.response
        )
        assert there / slow == pytest.approx(np.sqrt(0.5), rel=1e-6)
        assert np.all(gains[dense < 0.99 * found.bandwidth] / slow > np.sqrt(0.5))  # the first


def test_a_start_beyond_a_limit_is_no_rest():
    with pytest.raises(SimulationError, match=r"no state of rest: .*above VRMAX"):
        small_signal(system_of("AC1A"), typical_values("AC1A", VRMAX=0.5))


def test_the_input_that_breaks_the_loop_moves_what_the_exciter_measures():
    """A step of it is one of the reference the other way, where both meet at once."""
    system, values = system_of("SEXS"), typical_values("SEXS")
    several = replace(system, inputs=("vref", MEASURED))
    times = np.linspace(0.0, 2.0, 21)

    def moved(signal, step):
        inputs = Inputs(0.0, 2.0, (InputStep(0.5, step, signal),))
        return Simulator(several, inputs, times, 1e-3).samples(values, ("vt",))[0]

    np.testing.assert_allclose(moved(MEASURED, 0.01), moved("vref", -0.01), rtol=0.0, atol=1e-12)


def test_two_equal_lags_are_two_real_poles():
    """Rounding splits a double pole into a pair beside the real axis."""
    values = lively_values("AC1A")
    values["TC"] = values["TB"] = values["TR"]
    found = [pole for pole in small_signal(system_of("AC1A"), values).poles if pole.frequency == 0]
    same = [pole for pole in found if abs(pole.value + 1.0 / values["TR"]) < 1e-4]
    assert len(same) == 2
    assert all(pole.damping == 1.0 for pole in same)


@pytest.mark.parametrize("name", ["AC1A", "ST4B", "AC8B"])
def test_states_take_part_as_left_and_right_eigenvectors_say(name):
    linear = linearised(system_of(name), typical_values(name))
    values, left, right = eig(linear.A, left=True, right=True)
    shares = np.abs(left.conj() * right)
    strongest = {complex(v): linear.states[np.argmax(shares[:, k])] for k, v in enumerate(values)}
    for pole in poles_of(linear):
        nearest = min(strongest, key=lambda value: abs(value - pole.value))
        assert pole.states[0] == strongest[nearest]
