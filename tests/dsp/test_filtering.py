"""Filtering: lost samples are bridged, filters have no delay, tangents are exact."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.ndimage import median_filter

from exfit.dsp.filtering import Filtering, LowPass, Median, MovingAverage, outliers

RATE = 100.0
TIME = np.arange(0.0, 10.0, 1.0 / RATE)
ALL = np.ones(TIME.size, bool)
RESPONSE = np.where(TIME < 1.0, 1.0, 1.05 - 0.05 * np.exp(-3.0 * np.maximum(TIME - 1.0, 0.0)))
FILTERS = [None, LowPass(10.0), Median(5)]

every_filter = pytest.mark.parametrize("filter", FILTERS, ids=str)


def some_lost(seed=0, share=0.05):
    """Return which samples are kept: gaps, longer gaps, and both ends lost."""
    kept = np.random.default_rng(seed).random(TIME.size) > share
    kept[:3], kept[-4:], kept[500:520] = False, False, False
    return kept


def white(size, seed=0, count=TIME.size):
    return np.random.default_rng(seed).normal(0.0, size, count)


def test_without_a_filter_and_with_all_kept_the_samples_are_the_answer():
    filtering = Filtering(TIME, ALL)
    samples, slopes = RESPONSE, np.ones((TIME.size, 2))
    assert filtering.apply(samples) is samples
    assert filtering.tangents(samples, slopes) is slopes


def test_without_a_filter_the_kept_samples_are_the_answer():
    kept = some_lost()
    samples = np.where(kept, RESPONSE, np.nan)
    assert np.array_equal(Filtering(TIME, kept).apply(samples), RESPONSE[kept])


@every_filter
def test_the_value_of_a_lost_sample_does_not_matter(filter):
    kept = some_lost()
    filtering = Filtering(TIME, kept, filter)
    signal = RESPONSE + white(1e-3)
    expected = filtering.apply(signal)
    assert expected.shape == (kept.sum(),)
    for lost in (np.nan, np.inf, 1e9):
        assert np.array_equal(filtering.apply(np.where(kept, signal, lost)), expected)


@every_filter
def test_a_line_passes_whatever_is_lost_of_it(filter):
    kept = some_lost()
    kept[[0, -1]] = True  # beyond the ends a lost sample is the nearest one, not on the line
    line = 1.0 + 0.1 * TIME
    filtered = Filtering(TIME, kept, filter).apply(np.where(kept, line, np.nan))
    inner = slice(200, -200) if filter else slice(None)  # far from where a filter starts
    assert filtered[inner] == pytest.approx(line[kept][inner], rel=1e-12)


def test_lost_samples_are_bridged_in_time_not_in_number():
    time = np.array([0.0, 1.0, 5.0, 6.0, 8.0])
    kept = np.array([False, True, False, True, False])
    filtering = Filtering(time, kept, Median(1))
    assert filtering._bridged(np.array([9.0, 1.0, 9.0, 2.0, 9.0])).tolist() == [
        1.0,
        1.0,
        1.8,
        2.0,
        2.0,
    ]


@every_filter
def test_a_constant_passes_to_its_ends(filter):
    kept = some_lost()
    filtered = Filtering(TIME, kept, filter).apply(np.where(kept, 1.05, np.nan))
    assert filtered == pytest.approx(np.full(kept.sum(), 1.05), rel=1e-12)


@pytest.mark.parametrize("frequency", [1.0, 2.0, 5.0, 10.0, 20.0])
def test_the_low_pass_is_a_butterworth_filter_twice_without_delay(frequency):
    cutoff = 5.0
    wave = np.exp(2j * np.pi * frequency * TIME)
    low = Filtering(TIME, ALL, LowPass(cutoff))
    filtered = low.apply(wave.real) + 1j * low.apply(wave.imag)
    # the analogue law at the frequencies that the bilinear transform puts in place of these
    warped = np.tan(np.pi * frequency / RATE) / np.tan(np.pi * cutoff / RATE)
    inner = slice(200, -200)  # far from the ends, where the filter starts
    assert filtered[inner] / wave[inner] == pytest.approx(1.0 / (1.0 + warped**4), abs=1e-9)


def test_the_median_is_that_of_scipy():
    signal = RESPONSE + white(1e-3)
    signal[::50] += 0.05
    for samples in (1, 3, 7, 31):
        expected = median_filter(signal, samples, mode="nearest")
        assert np.array_equal(Filtering(TIME, ALL, Median(samples)).apply(signal), expected)


def test_a_median_wider_than_the_record_is_held_at_the_ends():
    few = np.array([1.0, 5.0, 2.0])
    filtered = Filtering(np.arange(3.0), np.ones(3, bool), Median(9)).apply(few)
    assert np.array_equal(filtered, median_filter(few, 9, mode="nearest"))


@every_filter
@pytest.mark.parametrize("kept", [ALL, some_lost()], ids=["all", "some"])
def test_tangents_are_the_derivatives_of_apply(filter, kept):
    filtering = Filtering(TIME, kept, filter)
    slopes = np.stack([np.sin(TIME), np.cos(7 * TIME), TIME**2], axis=1)
    signal = RESPONSE + white(1e-3)
    filtered = filtering.tangents(signal, slopes)
    assert filtered.shape == (kept.sum(), 3)
    # so small that no median picks another sample; all is linear then, and only rounding is left
    step = 1e-9
    for k in range(3):
        above = filtering.apply(signal + step * slopes[:, k])
        below = filtering.apply(signal - step * slopes[:, k])
        assert filtered[:, k] == pytest.approx((above - below) / (2 * step), abs=1e-5)


@every_filter
def test_tangents_do_not_see_lost_samples(filter):
    kept = some_lost()
    filtering = Filtering(TIME, kept, filter)
    slopes = np.stack([TIME, np.sin(TIME)], axis=1)
    lost = np.where(kept, RESPONSE, np.nan)
    expected = filtering.tangents(RESPONSE, slopes)
    assert np.array_equal(filtering.tangents(lost, slopes), expected)


def test_a_spike_that_is_not_kept_leaves_no_trace():
    kept = ALL.copy()
    kept[[300, 301, 700]] = False
    spiky = RESPONSE + np.where(kept, 0.0, 0.05)
    for filter in FILTERS:
        filtered = Filtering(TIME, kept, filter).apply(spiky)
        clean = Filtering(TIME, ALL, filter).apply(RESPONSE)[kept]
        # a bridge of three steps of 0.01 s across a curvature of 0.05 * 3^2 pu/s^2
        assert filtered == pytest.approx(clean, abs=1e-4)


def test_uneven_sampling_is_refused_to_a_low_pass_only():
    time = TIME.copy()
    time[500] += 0.0004
    for filter in (None, Median(3)):
        Filtering(time, ALL, filter)
    with pytest.raises(ValueError, match=r"differs by 4 %.* 0\.01 s, allowed is 1 %"):
        Filtering(time, ALL, LowPass(5.0))
    Filtering(np.round(TIME + 5e-6, 5), ALL, LowPass(5.0))  # rounded stamps are even


UNEVEN = np.cumsum(np.random.default_rng(0).uniform(0.001, 0.02, 500))
WINDOWS = [0.0005, 0.02, 0.1, 3.0]  # s: shorter than a step, and longer than many

every_window = pytest.mark.parametrize("window", WINDOWS)


def averaging(window, time=UNEVEN, kept=None, filter=None):
    kept = np.ones(len(time), dtype=bool) if kept is None else kept
    return Filtering(time, kept, filter, MovingAverage(window))


def test_without_an_average_a_simulation_stays_as_it_is():
    assert Filtering(TIME, some_lost(), LowPass(5.0)).as_recorded(RESPONSE) is RESPONSE


@every_window
def test_an_average_is_the_integral_of_the_line_through_the_samples(window):
    signal = np.random.default_rng(1).normal(1.0, 0.1, UNEVEN.size)
    line, half = make_interp_spline(UNEVEN, signal, k=1), window / 2
    filtered = averaging(window).as_recorded(signal)
    inside = (UNEVEN - half >= UNEVEN[0]) & (UNEVEN + half <= UNEVEN[-1])
    expected = [line.integrate(t - half, t + half) / window for t in UNEVEN[inside]]
    assert filtered[inside] == pytest.approx(np.array(expected, dtype=float), abs=1e-11)


@every_window
def test_an_average_leaves_a_constant_and_a_line_as_they_are_to_their_ends(window):
    average = averaging(window)
    assert np.array_equal(
        average.as_recorded(np.full(UNEVEN.size, 1.05)), np.full(UNEVEN.size, 1.05)
    )
    line = 1.0 + 0.3 * UNEVEN
    assert average.as_recorded(line) == pytest.approx(line, abs=1e-11)


@every_window
def test_derivatives_are_averaged_as_values_are(window):
    columns = np.random.default_rng(2).normal(0.0, 1.0, (UNEVEN.size, 3))
    average = averaging(window)
    expected = np.stack([average.as_recorded(column) for column in columns.T], axis=1)
    assert average.as_recorded(columns) == pytest.approx(expected, abs=1e-11)


@every_filter
def test_a_record_is_not_averaged_once_more(filter):
    kept = some_lost()
    measured = np.where(kept, RESPONSE, np.nan)
    plain, average = Filtering(TIME, kept, filter), averaging(0.1, TIME, kept, filter)
    assert np.array_equal(average.apply(measured), plain.apply(measured))


def test_a_kink_between_two_samples_errs_by_what_the_line_cuts_off():
    step, window, at = 0.005, 0.02, 1.0025
    time = np.arange(0.0, 2.0, step)
    filtered = averaging(window, time).as_recorded(np.maximum(time - at, 0.0))
    expected = np.clip(time - at + window / 2, 0.0, window) ** 2 / (2.0 * window)
    expected += np.maximum(time - at - window / 2, 0.0)
    assert np.abs(filtered - expected).max() == pytest.approx(step**2 / (8.0 * window), rel=1e-6)


@pytest.mark.parametrize("window", [0.0, -0.02, np.nan, np.inf])
def test_an_average_over_no_time_is_refused(window):
    with pytest.raises(ValueError, match="longer than 0"):
        MovingAverage(window)


def test_an_average_over_more_than_the_record_is_refused():
    with pytest.raises(ValueError, match=r"over 10 s: the record is 9\.99 s long"):
        averaging(10.0, TIME)
    with pytest.raises(ValueError, match="1 samples"):
        averaging(0.02, TIME[:1])


@pytest.mark.parametrize("cutoff", [-1.0, 0.0, 1e-300, 9e-5, 50.0, 60.0, np.nan])
def test_a_cutoff_outside_half_the_sampling_rate_is_refused(cutoff):
    with pytest.raises(ValueError, match=f"cutoff of {cutoff:g} Hz.* 50 Hz"):
        Filtering(TIME, ALL, LowPass(cutoff))


def test_the_shortest_record_is_filtered_and_a_shorter_one_refused():
    low = LowPass(5.0)
    assert Filtering(TIME[:10], ALL[:10], low).apply(RESPONSE[:10]).shape == (10,)
    with pytest.raises(ValueError, match="9 samples"):
        Filtering(TIME[:9], ALL[:9], low)


@pytest.mark.parametrize("samples", [-1, 0, 2, 10])
def test_a_median_over_an_even_number_is_refused(samples):
    with pytest.raises(ValueError, match=f"{samples} samples"):
        Median(samples)


def test_nothing_kept_is_refused():
    with pytest.raises(ValueError, match="no sample is kept"):
        Filtering(TIME, ~ALL)


# courses without noise that have no spikes, over time in s
COURSES = {
    "steep rise": np.interp(TIME, [1.0, 1.1], [1.0, 1.05]),
    "jump": np.where(TIME < 1.0, 1.0, 1.05),
    "response": RESPONSE,
    "swing": 1.0 + np.where(TIME < 1, 0, 0.05 * np.exp(-TIME) * np.sin(9 * (TIME - 1))),
    "wave": 1.0 + 0.05 * np.sin(12.0 * TIME),
    "constant": np.full(TIME.size, 0.1),
    "line and curve": np.where(TIME < 5.0, 1.0 + TIME / 30, RESPONSE + 4.0 / 30),
    "rounded": 5.5e-5 * np.round(RESPONSE / 5.5e-5),
}
LIMITS = [3.5, 5.0, 8.0]


@pytest.mark.parametrize("limit", LIMITS)
@pytest.mark.parametrize("course", COURSES)
def test_a_course_without_noise_holds_no_spike(course, limit):
    assert not outliers(TIME, COURSES[course], limit).any()


@pytest.mark.parametrize("course", COURSES)
def test_every_spike_is_found_and_hardly_anything_else(course):
    false = 0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        spiky = rng.random(TIME.size) < 0.01
        spikes = np.where(spiky, 0.05 * rng.choice([-1.0, 1.0], TIME.size), 0.0)
        outlying = outliers(TIME, COURSES[course] + white(1e-4, seed) + spikes, 5.0)
        assert outlying[spiky].all()
        false += (outlying & ~spiky).sum()
    assert false <= 0.001 * 10 * TIME.size


@pytest.mark.parametrize("at", [0, 1, 3, 50, 996, 999])
def test_a_lone_spike_on_a_constant_is_found_wherever_it_is(at):
    samples = np.ones(TIME.size)
    samples[at] += 0.05
    assert np.flatnonzero(outliers(TIME, samples, 5.0)).tolist() == [at]


def test_spikes_are_found_on_uneven_time_and_steep_slopes():
    rng = np.random.default_rng(4)
    time = np.sort(rng.uniform(0.0, 1.0, 200))
    samples = 2.0 * time + rng.normal(0.0, 1e-4, 200)
    samples[[20, 21, 100]] += 0.05
    assert np.flatnonzero(outliers(time, samples, 6.0)).tolist() == [20, 21, 100]


def test_spikes_need_seven_samples_to_show():
    with pytest.raises(ValueError, match="6 samples"):
        outliers(TIME[:6], RESPONSE[:6], 5.0)
