"""Quality of a channel: rounding, stuck recorders and spikes are found where they are."""

import numpy as np
import pytest

from exfit.dsp.quality import quantum, spikes, stuck

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


def test_white_noise_has_no_spikes_and_each_spike_is_found_at_its_place():
    rng = np.random.default_rng(7)
    time = 0.01 * np.arange(20_000)
    noisy = rng.normal(0.0, 1.0, time.size)
    assert len(spikes(time, noisy, 1.0, LIMIT)) <= 1
    places = np.arange(100, 20_000, 400)
    noisy[places] += 25.0  # six times what seven samples of noise may scatter by
    assert set(places) <= set(spikes(time, noisy, 1.0, LIMIT))
