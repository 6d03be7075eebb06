"""Quality of a channel: rounding, stuck recorders and spikes are found where they are."""

import numpy as np
import pytest

from exfit.dsp.quality import noise_of, quantum, spikes, stuck

LIMIT = 6.0  # times the noise


@pytest.mark.parametrize("step", [1e-5, 5.5e-5, 0.1, 2.0])
def test_the_step_of_rounded_numbers_is_found(step):
    rng = np.random.default_rng(7)
    rounded = step * np.round(rng.normal(100.0, 8.0, 5000))
    assert quantum(rounded) == pytest.approx(step, rel=1e-6)
    assert quantum(rng.normal(0.0, 1.0, 5000)) is None
    assert quantum(np.ones(50)) is None


@pytest.mark.parametrize("coarse", [0.3, 1.0, 3.0])
def test_rounding_alone_is_no_stuck_recorder(coarse):
    for seed in range(20):
        noisy = np.random.default_rng(seed).normal(0.0, 1.0, 3000)
        rounded = coarse * np.round(noisy / coarse)
        assert stuck(rounded) == ()
        rounded[1000:1200] = rounded[1000]
        ((first, last),) = stuck(rounded)
        assert first <= 1000
        assert last >= 1199


def test_a_switch_is_no_stuck_recorder():
    """Its levels have no noise that could repeat a number by chance."""
    assert stuck(np.repeat([0.0, 1.0], [200, 300])) == ()


def test_numbers_of_all_sizes_have_no_grid():
    with np.errstate(all="raise"):
        assert quantum(np.array([0.0, 1e-300, 1.0, 1e100])) is None


def test_white_noise_has_no_spikes_and_each_spike_is_found_at_its_place():
    rng = np.random.default_rng(7)
    time = 0.01 * np.arange(20_000)
    noisy = rng.normal(0.0, 1.0, time.size)
    assert len(spikes(time, noisy, 1.0, LIMIT)) <= 1
    places = np.arange(100, 20_000, 400)
    noisy[places] += 25.0  # six times what seven samples of noise may scatter by
    assert set(places) <= set(spikes(time, noisy, 1.0, LIMIT))


def bridge(time, seed):
    """Return what a recorder shows of the field voltage of a six-pulse bridge, of mean 1."""
    rng = np.random.default_rng(seed)
    angle = (2.0 * np.pi * 50.0 * time + rng.uniform(0.0, 2.0 * np.pi)) % (np.pi / 3.0)
    notches = np.where(angle < 0.03, -0.8, 0.0)  # while two valves conduct
    return np.cos(angle + 0.7) + notches + rng.normal(0.0, 1e-3, time.size)


@pytest.mark.parametrize("step", [0.0013, 0.004, 0.01003])
def test_what_a_bridge_does_is_no_spike(step):
    for seed in range(10):
        time = step * np.arange(4000)
        field = bridge(time, seed)
        assert len(spikes(time, field, noise_of(field), LIMIT)) == 0


def test_noise_with_heavy_tails_has_no_spikes():
    time = 0.003 * np.arange(3752)
    none = 0
    for seed in range(20):
        noisy = np.random.default_rng(seed).standard_t(3.0, time.size)
        none += len(spikes(time, noisy, noise_of(noisy), LIMIT)) == 0
    assert none == 20


def test_a_jump_with_its_first_samples_is_no_spike():
    rng = np.random.default_rng(3)
    time = 0.01 * np.arange(1000)
    field = np.where(time < 2.0, 1.0, 1.5 + 4.0 * np.exp(-np.maximum(time - 2.0, 0.0) / 0.015))
    assert len(spikes(time, field + rng.normal(0.0, 1e-3, time.size), 1e-3, LIMIT)) == 0


def test_many_spikes_are_the_signal_and_few_are_found_beside_a_step():
    rng = np.random.default_rng(4)
    time = 0.01 * np.arange(1000)
    noisy = np.where(time < 2.0, 1.0, 1.05) + rng.normal(0.0, 1e-4, time.size)
    few, many = noisy.copy(), noisy.copy()
    few[[50, 333, 700]] += 0.01
    many[20:-20:40] += 0.01
    assert [*spikes(time, few, 1e-4, LIMIT)] == [50, 333, 700]
    assert len(spikes(time, many, 1e-4, LIMIT)) == 0
