"""A recorded reference: its rest, its jumps, and what is left of its noise."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exfit.dsp.jumps import jumps, rest_end, scatter, settled

TIME = np.arange(0.0, 10.0, 0.01)
NOISE = 1e-4


def moved(at=3.0, ramp=0.0, size=0.05, noise=0.0, seed=0):
    """Return a reference of 1 pu that steps right after ``at``, or ramps from there."""
    way = np.clip((TIME - at) / ramp, 0.0, 1.0) if ramp else np.where(at < TIME, 1.0, 0.0)
    return 1.0 + size * way + noise * np.random.default_rng(seed).standard_normal(len(TIME))


@given(st.floats(0.2, 9.7), st.sampled_from([-0.05, 0.02, 0.1]), st.sampled_from([0.0, NOISE]))
def test_a_step_between_two_samples_is_a_jump_there(at, size, noise):
    samples = moved(at, size=size, noise=noise)
    (place,) = jumps(TIME, samples)
    assert TIME[place] <= at < TIME[place + 1]
    # the last samples at rest may lie beyond two standard deviations of their noise
    assert place - 2 <= rest_end(samples) <= place + 1


# s; one that lasts a sample or less could as well be a jump
@pytest.mark.parametrize("ramp", [0.021, 0.05, 0.5, 5.0])
@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_what_lasts_two_samples_is_no_jump(ramp, noise):
    for at in (3.0, 3.0037, 3.005):
        samples = moved(at, ramp, noise=noise)
        assert len(jumps(TIME, samples)) == 0
        late = TIME[rest_end(samples)] - at
        # within noise it is at rest: six standard deviations of it, or a tenth of the way
        assert -0.02 <= late <= 0.01 + 0.1 * ramp


def test_several_jumps_are_found_beside_a_ramp():
    samples = moved(2.0) - 0.02 * (TIME > 4.0) + 0.03 * np.clip(TIME - 6.0, 0.0, 1.0)
    samples += 0.01 * (TIME > 8.0) - 0.01 * (TIME > 8.05)
    noisy = samples + NOISE * np.random.default_rng(1).standard_normal(len(TIME))
    for reference in (samples, noisy):
        assert TIME[jumps(TIME, reference)] == pytest.approx([2.0, 4.0, 8.0, 8.05], abs=0.011)


def test_no_jump_is_seen_in_a_gap_in_a_slow_clock_or_in_the_steps_of_a_converter():
    samples = moved(3.0)
    kept = (TIME < 2.995) | (TIME > 3.025)
    assert len(jumps(TIME[kept], samples[kept])) == 0
    assert len(jumps(50.0 * TIME, samples)) == 0
    rounded = 2.5e-3 * np.round(moved(3.0, 2.0) / 2.5e-3)  # twenty steps on the way
    assert len(jumps(TIME, rounded)) == 0


def test_a_reference_that_does_not_move_or_moves_at_once_is_refused():
    for samples in (np.ones(1000), moved(noise=NOISE)[:250]):
        with pytest.raises(ValueError, match="never leaves its noise"):
            rest_end(samples)
    with pytest.raises(ValueError, match="moves within its first 10 samples"):
        rest_end(moved(0.045))


def test_at_rest_its_mean_takes_the_place_of_noise():
    """What moves keeps its noise, and ten samples on each side of it."""
    clean, noisy = (moved(3.0, 0.5, noise=noise, seed=3) for noise in (0.0, NOISE))
    clean, noisy = (samples - 0.02 * (TIME > 6.0037) for samples in (clean, noisy))
    result = settled(noisy, rest_end(noisy), jumps(TIME, noisy))
    moving = (TIME > 2.85) & (TIME < 3.65)
    error = np.abs(result - clean)
    # three standard errors of a mean over 240 samples or more; and six of a sample's noise
    assert error[~moving].max() < 3.0 * NOISE / np.sqrt(240.0)
    assert error[moving].max() < 6.0 * NOISE
    assert np.count_nonzero(np.diff(result[~moving])) < 8


def test_a_slow_ramp_is_no_rest():
    """It rises by a tenth of its noise between samples: what rests seems short stays within it."""
    slow = 1.0 + np.where(TIME < 2.0, 0.0, 1e-3 * (TIME - 2.0))
    noisy = slow + NOISE * np.random.default_rng(5).standard_normal(len(TIME))
    result = settled(noisy, 200, np.zeros(0, np.intp))
    assert np.count_nonzero(result[200:] != noisy[200:]) < 0.1 * len(TIME)
    assert np.mean((result - slow)[200:] ** 2) < 1.1 * NOISE**2


def test_a_reference_without_noise_is_left_as_it_is():
    samples = moved(3.0, 0.5) - 0.02 * (TIME > 6.0)
    assert scatter(samples) == 0.0
    assert settled(samples, 300, jumps(TIME, samples)) == pytest.approx(samples, abs=1e-15)
