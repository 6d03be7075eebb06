"""A slower clock: what it can hold stays, nothing else appears, and nothing moves in time."""

from math import pi

import numpy as np
import pytest
from tiers import few_of

from exfit.dsp.noise import noise
from exfit.dsp.resampling import resampled

# a whole ratio, a broken one, nearly equal rates, a clock off its nominal rate, no simple ratio
CLOCKS = [
    (20_000.0, 1000.0),
    (1000.0, 200.0),
    (208.0, 200.0),
    (208.0, 50.0),
    (4999.87, 1000.0),
    (1000.0, 333.39),
    (1000.0, 100.0 * pi),
    (1000.0, 990.0),
]
RIPPLE = 3e-4  # of the pass band
LEFT = 3.2e-4  # of the stop band: 70 dB
REACH = 25  # new samples from an end on which a wave that is turned about it differs from itself
ROUNDING = 1e-13

every_clock = pytest.mark.parametrize(("own", "rate"), CLOCKS)


def clock(rate, end=4.0):
    return np.arange(0.0, end, 1.0 / rate)


def one(time, signal, rate):
    """Return a single signal resampled."""
    slower, signals = resampled(time, {"vt": signal}, rate)
    return slower, signals["vt"]


def jittery(seed=0, end=4.0):
    """Return a field recorder's clock: 208 Hz, steps of 4.6 to 5.0 ms."""
    return np.cumsum(np.random.default_rng(seed).uniform(0.0046, 0.0050, round(208 * end)))


# --- the clock ------------------------------------------------------------------------------------


@every_clock
def test_the_clock_is_even_of_the_rate_requested_and_spans_the_record(own, rate):
    time = clock(own)
    slower, _ = one(time, time, rate)
    steps = np.diff(slower)
    assert steps == pytest.approx(np.full(len(steps), 1.0 / rate), rel=1.01e-4)
    assert np.ptp(steps) < 1e-12
    assert slower[0] == time[0]
    # less than a step is missing, which the clock off its rate may have gathered
    assert -1e-9 < time[-1] - slower[-1] < 1.3 / rate


def test_all_signals_are_on_one_clock_and_the_record_is_left_as_it_was():
    time = clock(1000.0)
    signals = {"vt": np.sin(time), "efd": np.cos(time)}
    for samples in (time, *signals.values()):
        samples.flags.writeable = False
    slower, found = resampled(time, signals, 200.0)
    assert list(found) == ["vt", "efd"]
    for name, samples in signals.items():
        assert np.array_equal(found[name], one(time, samples, 200.0)[1])
        assert len(found[name]) == len(slower)


# --- what stays, and what goes --------------------------------------------------------------------


@every_clock
@pytest.mark.parametrize("share", few_of([0.02, 0.2, 0.4], 1))
def test_a_tone_that_the_new_clock_can_hold_stays_as_it_is(own, rate, share):
    """Its amplitude and its phase: there is no delay."""
    time = clock(own)
    slower, found = one(time, np.cos(2.0 * pi * share * rate * time + 0.3), rate)
    expected = np.cos(2.0 * pi * share * rate * slower + 0.3)
    inner = slice(REACH, -REACH)
    assert found[inner] == pytest.approx(expected[inner], abs=RIPPLE)


@pytest.mark.parametrize(
    ("own", "rate", "share"),
    [
        (*both, x)
        for both in CLOCKS
        for x in (0.501, 0.6, 0.77, 1.0, 1.3)
        if x * both[1] < both[0] / 2
    ],
)
def test_a_tone_that_it_cannot_hold_is_gone(own, rate, share):
    """Sampled as it is, it would appear at another frequency with all its amplitude."""
    time = clock(own)
    _, found = one(time, np.cos(2.0 * pi * share * rate * time + 0.3), rate)
    assert np.abs(found[REACH:-REACH]).max() < LEFT


@every_clock
def test_a_constant_stays_constant_and_a_line_a_line_to_their_ends(own, rate):
    time = clock(own)
    slower, constant = one(time, np.full(len(time), 1.05), rate)
    assert constant == pytest.approx(np.full(len(slower), 1.05), abs=ROUNDING)
    _, line = one(time, 1.0 + 0.3 * time, rate)
    assert line == pytest.approx(1.0 + 0.3 * slower, abs=ROUNDING)


@every_clock
def test_a_slow_signal_is_itself_to_its_ends(own, rate):
    """Of its curvature, which turns at the ends, a step of the new clock sees little."""
    time = clock(own)
    slower, found = one(time, np.sin(2.0 * time + 0.5), rate)
    # the curvature is 4 / s^2; an image of the whole wave beyond the old rate is far down
    assert found == pytest.approx(np.sin(2.0 * slower + 0.5), abs=4.0 / rate**2 + 1e-4)


# --- steps ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("own", "rate"), [(20_000.0, 1000.0), (10_000.0, 200.0)])
def test_a_step_keeps_its_instant_and_its_levels(own, rate):
    time, at = clock(own), 2.0
    rises = 1.0 + 0.05 * ((time > at) + 0.5 * (np.abs(time - at) < 1e-9))
    slower, found = one(time, rises, rate)
    middle = int(np.flatnonzero(np.abs(slower - at) < 1e-9)[0])
    around = np.arange(1, 100)
    assert found[middle] == pytest.approx(1.025, abs=1e-6)
    # zero phase: what is missing behind the instant is there before it
    mirrored = found[middle + around] + found[middle - around]
    assert mirrored == pytest.approx(np.full(len(around), 2.05), abs=1e-6)
    far = np.abs(slower - at) > REACH / rate
    level = np.where(slower < at, 1.0, 1.05)
    assert found[far] == pytest.approx(level[far], abs=0.05 * LEFT)


@pytest.mark.parametrize("rate", [200.0, 1000.0])
@pytest.mark.parametrize("lag", [0.02, 0.1])
def test_a_lag_is_missing_what_an_ideal_filter_takes_of_its_kink(rate, lag):
    """That is 1 / (2 pi^2 cutoff lag), of a cutoff amid the transition, 0.45 rate."""
    time, worst = clock(20_000.0, 2.0), 0.0
    for at in 1.0 + np.linspace(0.0, 1.0 / rate, 6):
        slower, found = one(time, -np.expm1(-np.maximum(time - at, 0.0) / lag), rate)
        expected = -np.expm1(-np.maximum(slower - at, 0.0) / lag)
        worst = max(worst, np.abs(found - expected).max())
    assert worst == pytest.approx(1.0 / (2.0 * pi**2 * 0.45 * rate * lag), rel=0.02)
    if lag == 0.02:
        assert worst == pytest.approx({200.0: 0.028, 1000.0: 0.0056}[rate], rel=0.02)


@pytest.mark.long
def test_white_noise_stays_nearly_white():
    """The figures that the docstring states; an ideal filter at 0.9 would leave 0.9 and 0.11."""
    time = clock(5000.0, 400.0)
    _, found = one(time, np.random.default_rng(0).standard_normal(len(time)), 200.0)
    spread = 1.0 / np.sqrt(len(found))
    assert np.var(found) * 5000.0 / 200.0 == pytest.approx(0.88, abs=3.0 * spread)
    neighbours = [np.corrcoef(found[:-k], found[k:])[0, 1] for k in (1, 2)]
    assert neighbours == pytest.approx([0.13, -0.12], abs=4.0 * spread)
    assert noise(found) / np.std(found) == pytest.approx(0.88, abs=3.0 * spread)


# --- uneven records -------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_a_constant_and_a_line_stay_so_on_uneven_time(seed):
    time = jittery(seed)
    slower, line = one(time, 1.0 + 0.3 * time, 100.0)
    assert line == pytest.approx(1.0 + 0.3 * slower, abs=1e-12)
    assert slower[0] == time[0]
    assert np.ptp(np.diff(slower)) < 1e-12


@pytest.mark.parametrize("share", [0.05, 0.1, 0.2])
def test_uneven_samples_lose_what_a_spline_takes(share):
    """Waves of frequency f lose (f / (mean rate - f))^4; jitter changes that by half at most."""
    time = jittery()
    own = (len(time) - 1) / (time[-1] - time[0])
    slower, found = one(time, np.cos(2.0 * pi * share * own * time), 110.0)
    expected = np.cos(2.0 * pi * share * own * slower)
    inner = slice(REACH, -REACH)
    lost = (share / (1.0 - share)) ** 4
    assert found[inner] == pytest.approx(expected[inner], abs=1.5 * lost + RIPPLE)


def test_a_bump_on_a_field_recorders_clock_is_hardly_altered():
    """Less than the recorder resolves, 5.5e-5 pu, of a step of 0.05 pu with a lag of 0.5 s."""
    time, at = jittery(), 1.0

    def bump(t):
        since = np.maximum(t - at, 0.0) / 0.5
        return 1.0 + 0.05 * (1.0 - (1.0 + since) * np.exp(-since))

    slower, found = one(time, bump(time), 100.0)
    assert found == pytest.approx(bump(slower), abs=5.5e-5)


def test_rounded_stamps_are_even():
    """No spline is laid through them: it would follow the rounding, here 2e-3."""
    time = clock(1200.0)
    rounded = np.round(time, 5)
    assert np.ptp(np.diff(rounded)) > 0.9e-5
    wave = np.cos(2.0 * pi * 75.0 * time)
    # the last stamp's rounding is in the mean rate, and so in the filter's cutoff
    assert one(rounded, wave, 200.0)[1] == pytest.approx(one(time, wave, 200.0)[1], abs=1e-5)


# --- what is refused ------------------------------------------------------------------------------

TIME = clock(1000.0)


@pytest.mark.parametrize("rate", [1000.0, 1001.0, 0.2, 0.0, -5.0, np.nan, np.inf])
def test_a_rate_that_is_not_lower_or_has_no_two_samples_is_refused(rate):
    with pytest.raises(ValueError, match=f"{rate:g} Hz: it must lie between .* 1000 Hz"):
        one(TIME, TIME, rate)


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_a_sample_that_is_no_number_is_refused(lost):
    signal = TIME.copy()
    signal[300] = lost
    with pytest.raises(ValueError, match=r"vt: no finite number at 0\.3 s"):
        one(TIME, signal, 200.0)


def test_a_gap_is_refused():
    kept = (TIME < 1.0) | (TIME > 1.0035)
    with pytest.raises(ValueError, match=r"a gap of 0\.005 s after 0\.999 s.* 3 sampling steps"):
        one(TIME[kept], TIME[kept], 200.0)


def test_a_single_sample_is_refused():
    with pytest.raises(ValueError, match="1 samples"):
        one(TIME[:1], TIME[:1], 200.0)
