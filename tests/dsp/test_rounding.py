"""The rounding of a recorder against what simulation shows of it."""

import numpy as np
import pytest
from tiers import few_of

from exfit.dsp.rounding import is_coarse, noise_before_rounding, rounding_waves

STEP = 5e-4
TIME = np.linspace(0.0, 5.0, 600)
BASIS = np.column_stack([np.ones_like(TIME), 1.0 - np.exp(-2.0 * TIME)])
LEVELS = BASIS @ [1.0, 0.05]


def rounded(rng, noise):
    """Return readings of the levels with noise, by a recorder whose zero lies anywhere."""
    zero = STEP * rng.uniform()
    samples = LEVELS + noise * rng.standard_normal(len(TIME))
    return zero + STEP * np.round((samples - zero) / STEP)


@pytest.mark.parametrize("share", few_of([0.1, 0.2, 0.35], 1))
def test_the_noise_is_found_behind_the_rounding_by_a_fit_that_took_some_of_it(share):
    rng, found = np.random.default_rng(1), []
    for _ in range(20):
        readings = rounded(rng, share * STEP)
        fitted = BASIS @ np.linalg.lstsq(BASIS, readings)[0]
        found.append(noise_before_rounding(readings, fitted, BASIS, STEP))
    # one record shows it to some 8 %
    assert np.mean(found) == pytest.approx(share * STEP, rel=0.1)


def test_the_waves_have_the_covariance_that_repetition_shows():
    rng, noise, records = np.random.default_rng(2), 0.2 * STEP, 4000
    errors = np.array([rounded(rng, noise) - LEVELS for _ in range(records)])
    waves = rounding_waves(LEVELS, STEP, noise)
    for first, second in ((400, 500), (100, 500), (20, 60)):
        expected = float(waves[first] @ waves[second])
        shown = float(np.mean(errors[:, first] * errors[:, second]))
        # four standard deviations of the mean of so many products
        assert shown == pytest.approx(expected, abs=4.0 * np.var(errors) / records**0.5)
    assert np.var(errors) == pytest.approx(noise**2 + STEP**2 / 12.0, rel=0.02)


def test_noise_much_larger_than_the_step_leaves_no_waves():
    assert rounding_waves(LEVELS, STEP, STEP).shape == (len(LEVELS), 0)
    assert not is_coarse(STEP, STEP)
    assert is_coarse(STEP, 0.35 * STEP)
