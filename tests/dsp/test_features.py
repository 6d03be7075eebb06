"""Features of a step response against closed forms."""

from math import exp, log, pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exfit.dsp.features import BAND, features

STEP_AT = 1.0  # s
SAMPLING = 0.001  # s


def clock(length):
    return np.arange(0.0, STEP_AT + length, SAMPLING)


def stepped(time, response):
    """Return a response (a function of the time since the step) that rests at 0 before it."""
    return np.where(time < STEP_AT, 0.0, response(np.maximum(time - STEP_AT, 0.0)))


def first_order(a):
    return lambda t: 1.0 - np.exp(-a * t)


def second_order(w0, zeta):
    wd, damping = w0 * sqrt(1.0 - zeta**2), zeta * w0
    return lambda t: 1.0 - np.exp(-damping * t) * (np.cos(wd * t) + damping / wd * np.sin(wd * t))


def read(time, signal):
    return features(time, signal, STEP_AT, float(time[-1]))


@given(a=st.floats(0.5, 20.0))
def test_a_first_order_response_rises_in_ln9_over_a_without_overshoot(a):
    time = clock(20.0 / a)
    response = read(time, stepped(time, first_order(a)))
    assert response.rise_time == pytest.approx(log(9.0) / a, abs=SAMPLING)
    # the final value is a mean over the last twentieth: e^-19 short of 1
    assert response.settling_time == pytest.approx(-log(BAND) / a, abs=2.0 * SAMPLING)
    assert response.overshoot_percent == 0.0
    assert response.peak_time is None
    assert response.initial_value == 0.0
    assert response.final_value == pytest.approx(1.0, abs=1e-7)


def test_a_response_that_still_rises_when_the_record_ends_does_not_overshoot():
    time = clock(1.0)
    response = read(time, stepped(time, first_order(1.0)))
    assert response.overshoot_percent == 0.0
    assert response.peak_time is None


def test_a_response_outside_the_band_when_the_record_ends_has_not_settled():
    time = clock(pi)  # half a period beyond the last full one: at the bottom of the swing
    response = read(time, stepped(time, lambda t: 1.0 - np.cos(10.0 * t) * np.exp(-0.1 * t)))
    assert response.settling_time is None
    assert response.peak_time is not None


@given(zeta=st.floats(0.1, 0.8), w0=st.floats(2.0, 20.0))
def test_overshoot_and_peak_time_are_those_of_an_underdamped_second_order(zeta, w0):
    time = clock(25.0 / (zeta * w0))
    response = read(time, stepped(time, second_order(w0, zeta)))
    wd = w0 * sqrt(1.0 - zeta**2)
    overshoot = 100.0 * exp(-pi * zeta / sqrt(1.0 - zeta**2))
    # a peak is flat: a sample beside it misses (w0 dt)^2 / 2 of the way at most
    assert response.overshoot_percent == pytest.approx(overshoot, abs=100.0 * (w0 * SAMPLING) ** 2)
    assert response.peak_time == pytest.approx(pi / wd, abs=2.0 * SAMPLING)


@given(zeta=st.floats(0.1, 0.8), w0=st.floats(2.0, 20.0))
def test_after_the_settling_time_the_response_stays_in_the_band(zeta, w0):
    time = clock(25.0 / (zeta * w0))
    signal = stepped(time, second_order(w0, zeta))
    response = read(time, signal)
    distance = np.abs(signal - response.final_value) / response.final_value
    settled = STEP_AT + response.settling_time
    assert np.all(distance[time > settled] <= BAND)
    assert distance[np.searchsorted(time, settled - SAMPLING / 2.0) - 1] > BAND
    # the envelope bounds it from above
    envelope = log(1.0 / (BAND * sqrt(1.0 - zeta**2))) / (zeta * w0)
    assert response.settling_time <= envelope + 2.0 * SAMPLING


@given(
    offset=st.floats(-2.0, 2.0),
    size=st.floats(0.01, 1.0),
    zeta=st.floats(0.1, 0.8),
)
def test_a_down_step_has_the_features_of_its_mirror_image(offset, size, zeta):
    time = clock(5.0)
    way = stepped(time, second_order(6.0, zeta))
    up, down = read(time, offset + size * way), read(time, offset - size * way)
    for name in ("rise_time", "overshoot_percent", "peak_time", "settling_time"):
        # the offset costs digits, and a tie between two samples may fall either way
        assert getattr(up, name) == pytest.approx(getattr(down, name), abs=2.0 * SAMPLING), name
    assert up.initial_value == pytest.approx(down.initial_value)
    assert up.final_value - offset == pytest.approx(offset - down.final_value)


def test_noise_moves_the_features_by_its_own_size():
    time = clock(5.0)
    clean = 1.0 + 0.05 * stepped(time, second_order(6.0, 0.4))
    noise = 1e-4 * np.random.default_rng(1).standard_normal(len(time))
    still, shaken = read(time, clean), read(time, clean + noise)
    assert shaken.initial_value == pytest.approx(still.initial_value, abs=1e-5)
    assert shaken.final_value == pytest.approx(still.final_value, abs=5e-5)
    assert shaken.rise_time == pytest.approx(still.rise_time, abs=0.02)
    # the largest of many noisy samples lies up to four deviations high: 0.2 % of the step each
    assert shaken.overshoot_percent == pytest.approx(still.overshoot_percent, abs=1.0)
    assert shaken.peak_time == pytest.approx(still.peak_time, abs=0.1)


def test_a_flat_signal_has_no_features():
    time = clock(2.0)
    assert read(time, np.ones(len(time))) is None


def test_a_record_that_ends_with_the_step_has_no_features():
    time = np.array([0.0, 0.5, 1.0])
    assert features(time, np.array([0.0, 0.0, 1.0]), 1.0, 1.0) is None


def test_only_the_response_until_the_next_step_counts():
    time = clock(6.0)
    alone = stepped(time, second_order(8.0, 0.5))
    back = alone - np.where(time < 4.0, 0.0, second_order(8.0, 0.5)(np.maximum(time - 4.0, 0.0)))
    until = 4.0 - SAMPLING / 2.0
    assert features(time, back, STEP_AT, until) == features(time, alone, STEP_AT, until)


def test_a_record_that_begins_with_the_step_starts_from_its_first_sample():
    time = np.arange(0.0, 10.0, SAMPLING)
    response = features(time, 2.0 + first_order(2.0)(time), 0.0, 10.0)
    assert response.initial_value == 2.0
    assert response.rise_time == pytest.approx(log(9.0) / 2.0, abs=SAMPLING)


# ---- to 1e-6, on responses whose figures are known in closed form

FINE = 2e-4  # s: what is read between samples is exact to its square
FINE_TIME = np.arange(0.0, 13.0, FINE)


@pytest.mark.parametrize(("zeta", "w0"), [(0.2, 8.0), (0.4, 6.0), (0.55, 5.0)])
def test_a_second_order_response_gives_its_overshoot_peak_time_and_damping(zeta, w0):
    found = read(FINE_TIME, stepped(FINE_TIME, second_order(w0, zeta)))
    root = sqrt(1.0 - zeta**2)
    assert found.overshoot_percent / 100.0 == pytest.approx(exp(-pi * zeta / root), abs=1e-6)
    assert found.peak_time == pytest.approx(pi / (w0 * root), abs=1e-6)
    assert found.damping_ratio == pytest.approx(zeta, abs=1e-6)
    assert found.final_value == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(("a", "late"), [(2.0, 0.0), (2.0, 0.05), (5.0, 0.1234)])
def test_a_delayed_first_order_response_gives_its_times(a, late):
    response = first_order(a)
    found = read(FINE_TIME, stepped(FINE_TIME, lambda t: response(np.maximum(t - late, 0.0))))
    assert found.delay == pytest.approx(late - log(0.9) / a, abs=1e-6)
    assert found.rise_time == pytest.approx(log(9.0) / a, abs=1e-6)
    assert found.settling_time == pytest.approx(late - log(BAND) / a, abs=1e-6)
    assert found.peak_time is found.damping_ratio is None


def test_the_damping_ratio_does_not_depend_on_the_side_of_the_swing():
    up, down = (
        read(FINE_TIME, sign * stepped(FINE_TIME, second_order(6.0, 0.3))) for sign in (1, -2)
    )
    assert up.damping_ratio == pytest.approx(down.damping_ratio, rel=1e-12)


def test_a_swing_that_returns_to_its_level_has_a_damping_ratio():
    """As the power of a unit behind a fault: exp(-s t) sin(w t), whose extrema decay evenly."""
    s, w = 1.5, 9.0
    t = np.maximum(FINE_TIME - STEP_AT, 0.0)
    found = read(FINE_TIME, np.exp(-s * t) * np.sin(w * t) + 1e-4 * (t > 0.0))
    assert found.damping_ratio == pytest.approx(s / np.hypot(s, w), abs=1e-6)


@pytest.mark.parametrize("times", [1e-300 * np.arange(9.0), [0, 1, 1 + 1e-16, 2, 3, 4, 5, 6, 7]])
def test_times_that_nearly_agree_give_features_without_a_warning(times):
    response = np.array([0.0, 0.0, 1e-200, 1.3, 0.7, 1.1, 1.0, 1.0, 1.0])
    assert features(np.asarray(times, dtype=float), response, 0.0, 10.0) is not None


@pytest.mark.parametrize("factor", [1e-300, 1e300])
def test_samples_of_any_size_give_features_without_a_warning(factor):
    swing = np.array([0.0, 0.0, 1.3, 1.0 - factor, 1.0 + 1e-300, 1.0, 1.0, 1.0, 1.0, 1.0])
    features(np.arange(10.0), swing, 1.0, 10.0)
