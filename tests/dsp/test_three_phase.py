"""The voltage of three phases: the positive sequence alone, without delay, and what is refused."""

from math import pi, sqrt

import numpy as np
import pytest
from oracle import lively_values, system_of

from exfit.dsp.filtering import Filtering, MovingAverage
from exfit.dsp.three_phase import LINE_VOLTAGE, mean_rms, positive_sequence
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

RATES = [1000.0, 1234.5, 4800.0, pytest.param(20_000.0, marks=pytest.mark.long)]  # Hz
FREQUENCIES = [49.2, 50.0, 60.3]  # Hz
BEHIND = 2.0 * pi / 3.0 * np.arange(3)  # of each phase, rad
ROUNDING = 1e-12
# what a plant has, and more: RMS values relative to the positive sequence
HARMONICS = {3: 0.03, 5: 0.05, 7: 0.04}
OFFSETS = [0.02, -0.01, 0.03]

every_rate = pytest.mark.parametrize("rate", RATES)
every_frequency = pytest.mark.parametrize("frequency", FREQUENCIES)


def clock(rate, end=1.0):
    return np.arange(0.0, end, 1.0 / rate)


def waves(time, frequency=50.0, voltage=1.0, negative=0.0, zero=0.0, harmonics=None):
    """Return waveforms (M, 3) of given RMS values; ``frequency`` may be a course (M,)."""
    turned = 2.0 * pi * np.broadcast_to(frequency, time.shape) * time
    if np.ndim(frequency):
        steps = np.diff(time, prepend=time[0])
        turned = 2.0 * pi * np.cumsum(frequency * steps)
    angle = turned[:, None] + 0.7
    sum_of = np.broadcast_to(voltage, time.shape)[:, None] * np.cos(angle - BEHIND)
    sum_of = sum_of + negative * np.cos(angle + BEHIND + 0.3) + zero * np.cos(angle + 1.0)
    for order, share in (harmonics or {}).items():
        sum_of = sum_of + share * np.cos(order * (angle - BEHIND) + order)
    return sqrt(2.0) * sum_of


def moving_average_of_a_lag(time, window, at, step, lag):
    """Return the mean over a window about each instant of 1 + step (1 - exp(-(t - at) / lag))."""

    def area(t):
        since = np.maximum(t - at, 0.0)
        return t + step * (since + lag * np.expm1(-since / lag))

    return (area(time + window / 2) - area(time - window / 2)) / window


# --- the positive sequence ------------------------------------------------------------------------


@every_rate
@every_frequency
@pytest.mark.parametrize("cycles", [1, 2])
def test_all_but_the_positive_sequence_cancels(rate, frequency, cycles):
    time = clock(rate)
    phases = waves(time, frequency, 0.97, negative=0.03, zero=0.02, harmonics=HARMONICS) + OFFSETS
    course = positive_sequence(time, phases, cycles)
    np.testing.assert_allclose(
        course.voltage, np.full(len(course.time), 0.97), rtol=0.0, atol=ROUNDING
    )
    assert course.frequency == pytest.approx(frequency, rel=1e-9)
    assert course.window == pytest.approx(cycles / frequency, rel=1e-9)


@every_rate
@pytest.mark.parametrize("unbalance", [[1.0, 0.9, 1.05], [1.0, 1.2, 1.0]])
def test_phases_of_unequal_size_show_the_mean_of_their_sizes(rate, unbalance):
    """In phase, three magnitudes have their mean as positive sequence (Fortescue)."""
    time = clock(rate)
    course = positive_sequence(time, waves(time, 49.2) * unbalance)
    np.testing.assert_allclose(
        course.voltage, np.full(len(course.time), np.mean(unbalance)), rtol=0.0, atol=ROUNDING
    )


@every_rate
@every_frequency
def test_a_voltage_that_moves_appears_as_its_moving_average(rate, frequency):
    time, at, step, lag = clock(rate), 0.4037, 0.05, 0.2
    moving = 1.0 - step * np.expm1(-np.maximum(time - at, 0.0) / lag)
    course = positive_sequence(time, waves(time, frequency, moving, harmonics={3: 0.05}))
    expected = moving_average_of_a_lag(course.time, course.window, at, step, lag)
    # the window is summed, not integrated: at a kink it errs by its jump x step^2 / (8 window)
    summed = step / lag / rate**2 / (8.0 * course.window)
    np.testing.assert_allclose(course.voltage, expected, rtol=0.0, atol=2.0 * summed)


@every_rate
def test_the_window_is_centred(rate):
    """A ramp averaged about its instant is the ramp."""
    time = clock(rate)
    ramp = 1.0 + 0.1 * time
    course = positive_sequence(time, waves(time, 49.2, ramp))
    np.testing.assert_allclose(course.voltage, ramp[course.rows], rtol=0.0, atol=ROUNDING)


@every_rate
@pytest.mark.parametrize("cycles", [1, 3])
def test_what_lies_within_half_a_window_of_the_ends_is_left_out(rate, cycles):
    time = clock(rate)
    course = positive_sequence(time, waves(time), cycles)
    assert np.array_equal(course.time, time[course.rows])
    assert len(course.voltage) == len(course.time)
    # a window ends on a sample, or less than one before it
    for gone in (course.time[0] - time[0], time[-1] - course.time[-1]):
        assert -1e-9 < gone - course.window / 2 < 1.0 / rate + 1e-9


@pytest.mark.parametrize("samples", [8, 9.3, 12, 20.32, 101.6])
def test_the_window_hardly_adds_to_the_noise(samples):
    """White noise is averaged over the samples of a cycle; correlated phases would not be."""
    rng = np.random.default_rng(0)
    time = np.arange(20_000) / (50.0 * samples)
    noise = 0.01
    phases = waves(time) + rng.normal(0.0, noise, (len(time), 3))
    # of three phases' noise in one direction, over the RMS value, of the samples of a window
    expected = noise / sqrt(3.0) / sqrt(samples)
    assert np.std(positive_sequence(time, phases).voltage) == pytest.approx(expected, rel=0.05)


def test_a_frequency_that_drifts_is_accounted_for():
    time = clock(5000.0, 4.0)
    drifting = 50.0 + 0.5 * np.sin(2.0 * pi * 0.5 * time)
    course = positive_sequence(time, waves(time, drifting, negative=0.01))
    # without the correction 1.6e-4; of the negative sequence 0.5 / 100 is left
    np.testing.assert_allclose(course.voltage, np.ones(len(course.time)), rtol=0.0, atol=6e-5)
    steady = positive_sequence(time, waves(time, drifting))
    np.testing.assert_allclose(steady.voltage, np.ones(len(course.time)), rtol=0.0, atol=2e-6)


def test_rounded_stamps_are_even():
    time = clock(4800.0)
    exact = positive_sequence(time, waves(time, 49.2))
    rounded = positive_sequence(np.round(time, 6), waves(time, 49.2))
    np.testing.assert_allclose(rounded.voltage, exact.voltage, rtol=0.0, atol=1e-9)


# --- beside a simulation --------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["FIRST_ORDER", "AC1A", "ST1A"])
def test_a_simulation_averaged_alike_is_what_the_waveforms_show(name):
    values = lively_values(name)
    time = clock(5000.0, 3.0)
    change = InputStep(0.5037, 0.5 if name == "FIRST_ORDER" else 0.05)
    simulator = Simulator(system_of(name), Inputs(0.0, 3.0, (change,)), time, 1e-3)
    vt = simulator.samples(values, ("vt",))[0][:, 0] + (1.0 if name == "FIRST_ORDER" else 0.0)
    phases = waves(time, 49.2, vt, negative=0.01, harmonics=HARMONICS)
    course = positive_sequence(time, phases)
    everything = np.ones(len(course.time), dtype=bool)
    alike = Filtering(course.time, everything, averaged=MovingAverage(course.window))
    # a moving voltage spreads the ripples' lines, and the window has zeros: some 1e-7 are left
    inner = slice(100, -100)  # half a window: beyond it the simulation goes on, here it ends
    simulated = alike.as_recorded(vt[course.rows])
    np.testing.assert_allclose(simulated[inner], course.voltage[inner], rtol=0.0, atol=1e-6)


def test_a_simulation_that_is_not_averaged_errs_at_the_kink_as_the_mean_of_a_kink_says():
    time, at, step, lag = clock(5000.0), 0.5, 0.05, 0.2
    vt = 1.0 - step * np.expm1(-np.maximum(time - at, 0.0) / lag)
    course = positive_sequence(time, waves(time, 50.0, vt))
    worst = np.max(np.abs(vt[course.rows] - course.voltage))
    half = 0.5 * course.window
    # half a window of 1 - exp(-t / lag) lies beyond the kink; nearly (slope) x window / 8
    expected = step * (half + lag * np.expm1(-half / lag)) / course.window
    assert worst == pytest.approx(expected, rel=1e-3)
    assert worst == pytest.approx(step / lag * course.window / 8.0, rel=0.02)


# --- per unit -------------------------------------------------------------------------------------

CONNECTIONS = [("phase-to-ground", 15.75 / sqrt(3.0)), ("phase-to-phase", 15.75)]


@pytest.mark.parametrize(("connection", "rated"), CONNECTIONS)
def test_the_rated_voltage_is_one_per_unit(connection, rated):
    time = clock(2000.0)
    per_unit = LINE_VOLTAGE[connection] / 15.75
    course = positive_sequence(time, waves(time, voltage=rated))
    np.testing.assert_allclose(
        course.voltage * per_unit, np.ones(len(course.time)), rtol=0.0, atol=ROUNDING
    )
    rms = mean_rms(np.full((5, 3), rated)) * per_unit
    np.testing.assert_allclose(rms, np.ones(5), rtol=0.0, atol=1e-14)


def test_voltages_to_ground_and_between_the_phases_tell_the_same():
    """Whatever the unbalance: the star point's voltage, the zero sequence, is in neither."""
    time = clock(2000.0)
    ground = waves(time, 49.2, 9.0, negative=0.4, zero=0.6)
    between = ground - np.roll(ground, -1, axis=1)
    from_ground = positive_sequence(time, ground).voltage * LINE_VOLTAGE["phase-to-ground"]
    from_lines = positive_sequence(time, between).voltage * LINE_VOLTAGE["phase-to-phase"]
    np.testing.assert_allclose(from_ground, from_lines, rtol=0.0, atol=ROUNDING)


# --- RMS values -----------------------------------------------------------------------------------


def test_of_three_rms_values_the_mean_is_the_voltage():
    rng = np.random.default_rng(0)
    phases = 9.0 + rng.normal(0.0, 0.05, (100, 3))
    assert np.array_equal(mean_rms(phases), phases.mean(axis=1))


@pytest.mark.parametrize("angle", np.linspace(0.0, 2.0 * pi, 7))
def test_the_mean_of_rms_values_is_nearly_the_positive_sequence(angle):
    negative, zero = 0.02, 0.015
    others = negative * np.exp(1j * (2.0 * BEHIND + angle)) + zero * np.exp(1j * (BEHIND + 1.0))
    excess = mean_rms(np.abs(1.0 + others)[None, :])[0] - 1.0
    assert 0.0 <= excess < (negative + zero) ** 2


def test_a_missing_rms_value_leaves_a_gap():
    phases = np.full((10, 3), 9.0)
    phases[3, 1] = np.nan
    assert np.flatnonzero(np.isnan(mean_rms(phases))).tolist() == [3]


def test_a_spike_in_one_phase_is_no_wrong_column():
    phases = np.full((1000, 3), 9.0)
    phases[500, 1] = 18.0
    assert mean_rms(phases)[500] == 12.0


@pytest.mark.parametrize("wrong", [0.0, 9.0 * sqrt(3.0), 5.0, np.linspace(9.0, 6.0, 50)])
def test_a_phase_that_differs_is_refused(wrong):
    phases = np.full((50, 3), 9.0)
    phases[:, 2] = wrong
    with pytest.raises(ValueError, match=r"9, 9, .* more than 5 % off their mean"):
        mean_rms(phases)


@pytest.mark.parametrize("level", [0.0, -9.0])
def test_rms_values_that_are_not_positive_are_refused(level):
    with pytest.raises(ValueError, match="another signal"):
        mean_rms(np.full((50, 3), level))


def test_rms_values_of_which_one_is_always_missing_are_refused():
    phases = np.full((50, 3), 9.0)
    phases[:, 1] = np.nan
    with pytest.raises(ValueError, match="no sample has a number in all three"):
        mean_rms(phases)


# --- what is refused ------------------------------------------------------------------------------

TIME = clock(2000.0)


def lost_phase(from_on=0.0):
    phases = waves(TIME)
    phases[from_on <= TIME, 2] = 0.0
    return phases


def with_gap():
    phases = waves(TIME)
    phases[700, 1] = np.nan
    return phases


def uneven():
    time = TIME.copy()
    time[500] += 1e-5
    return time


REFUSED = {
    "swapped phases": (TIME, waves(TIME)[:, [0, 2, 1]], "two phases are swapped"),
    "wrong sign": (TIME, waves(TIME) * [1.0, -1.0, 1.0], "or one has the wrong sign"),
    "a phase missing": (TIME, lost_phase(), "a phase is missing"),
    "a phase lost later": (TIME, lost_phase(0.5), r"at 0\.[45]\d* s the negative"),
    "nan": (TIME, with_gap(), r"no finite number at 0\.35 s"),
    "two columns": (TIME, waves(TIME)[:, :2], "3 columns"),
    "uneven": (uneven(), waves(TIME), r"a step differs by 2 %.* allowed is 1 %"),
    "too slow": (clock(300.0), waves(clock(300.0)), "300 Hz: a waveform needs at least 8 samples"),
    "few a cycle": (clock(350.0), waves(clock(350.0)), "7 samples a cycle of 50 Hz"),
    "25 Hz": (TIME, waves(TIME, 25.0), r"25\.000 Hz; it must be within 40 \.\.\. 70 Hz"),
    "RMS values": (TIME, np.tile([9.0, 9.1, 9.3], (len(TIME), 1)), r"0\.000 Hz; it must be within"),
    "short": (TIME[:150], waves(TIME[:150]), "needs 4 cycles"),
    "one sample": (TIME[:1], waves(TIME[:1]), "needs at least 8 samples"),
    "dead": (TIME, waves(TIME, voltage=np.where(TIME < 0.5, 1.0, 0.01)), "phase is lost"),
    "drift": (clock(2000.0, 4.0), None, "the frequency moves by"),
}


@pytest.mark.parametrize("what", REFUSED)
def test_waveforms_that_show_no_voltage_are_refused(what):
    time, phases, message = REFUSED[what]
    if phases is None:
        phases = waves(time, 50.0 + 1.5 * np.sin(2.0 * pi * 0.5 * time))
    with pytest.raises(ValueError, match=message):
        positive_sequence(time, phases)


@pytest.mark.parametrize("cycles", [0, -1, 1.5])
def test_a_window_of_other_than_whole_cycles_is_refused(cycles):
    with pytest.raises(ValueError, match="whole number"):
        positive_sequence(TIME, waves(TIME), cycles)
