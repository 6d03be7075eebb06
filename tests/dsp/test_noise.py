"""Noise: its standard deviation is found whatever the signal does."""

import numpy as np
import pytest
from places import SAMPLES
from tables import read_columns

from exfit.dsp.noise import noise, spread

TIME = np.arange(0.0, 10.0, 0.01)
RESPONSE = np.where(TIME < 1.0, 1.0, 1.05 - 0.05 * np.exp(-3.0 * (TIME - 1.0)))


def white(size, seed=0, count=TIME.size):
    return np.random.default_rng(seed).normal(0.0, size, count)


def spikes(seed=0, share=0.01, count=TIME.size):
    rng = np.random.default_rng(seed)
    return np.where(rng.random(count) < share, 0.05 * rng.choice([-1.0, 1.0], count), 0.0)


@pytest.mark.parametrize("size", [1e-6, 1e-4, 1e-2, 10.0])
def test_white_noise_is_found_without_bias(size):
    estimates = [noise(white(size, seed)) for seed in range(50)]
    # one value is good to 5 % at 1000 samples, the mean of 50 to 0.7 %
    assert np.mean(estimates) == pytest.approx(size, rel=0.02)
    assert np.std(estimates) < 0.06 * size


@pytest.mark.parametrize("size", [1e-4, 1e-3])
def test_the_course_of_the_signal_and_rare_spikes_do_not_matter(size):
    alone = np.mean([noise(white(size, seed)) for seed in range(20)])
    estimates = [noise(RESPONSE + white(size, seed) + spikes(seed)) for seed in range(20)]
    # 3 % of the second differences hold a spike and move their median by 3.5 %
    assert np.mean(estimates) == pytest.approx(alone, rel=0.06)


@pytest.mark.parametrize(
    ("record", "size"),
    [(f"{name}.csv", 1e-4) for name in ("ac1a_up", "ac1a_down", "ac8b_unit1_up", "ac8b_on_line")],
)
def test_the_noise_of_a_record_is_what_was_added_to_it(record, size):
    vt = read_columns(SAMPLES / record, ["vt"])["vt"]
    assert noise(vt) == pytest.approx(size, rel=0.15)  # three standard errors


@pytest.mark.parametrize("signal", [np.ones(50), RESPONSE, np.full(3, 0.1)], ids=len)
def test_what_has_no_noise_has_only_rounding(signal):
    # of the response, what its course leaves once it has settled
    assert noise(signal) <= 1e-10


def test_a_constant_and_a_spike_on_it_have_no_noise_at_all():
    assert noise(np.ones(100)) == 0.0
    assert noise(np.where(np.arange(100) % 20 == 7, 1.05, 1.0)) == 0.0


@pytest.mark.parametrize("size", [0.0, 5e-6, 1.5e-5, 3e-5])
def test_a_rounding_recorder_leaves_no_less_than_its_own_noise(size):
    quantum = 5.5e-5
    rounded = quantum * np.round((RESPONSE + white(size)) / quantum)
    assert noise(rounded) >= quantum / np.sqrt(12.0) * (1 - 1e-9)
    assert noise(rounded) < 2 * np.hypot(size, quantum / np.sqrt(12.0))


def test_noise_scales_with_the_signal_and_ignores_line_and_level():
    samples = white(1e-3)
    assert noise(7.0 * samples) == pytest.approx(7.0 * noise(samples), rel=1e-12)
    # the line rounds at 1e-15
    assert noise(samples + 3.0 - 0.2 * TIME) == pytest.approx(noise(samples), rel=1e-9)


def test_uneven_sampling_is_passed_over():
    time = np.sort(np.random.default_rng(2).uniform(0.0, 10.0, 1000))
    slow = 1.0 + 0.05 * (1.0 - np.exp(-time))
    assert noise(slow + white(1e-3)) == pytest.approx(1e-3, rel=0.15)


def test_the_spread_is_that_of_a_normal_law():
    values = np.random.default_rng(3).normal(5.0, 2.0, (4, 20_000))
    assert spread(values) == pytest.approx(np.full(4, 2.0), rel=0.04)
    assert spread(values.T, axis=0) == pytest.approx(spread(values), rel=1e-12)


def test_fewer_than_three_samples_show_no_noise():
    with pytest.raises(ValueError, match="2 samples"):
        noise(np.array([1.0, 2.0]))
