"""The tests that tell noise from what a model leaves: their rates, and what they see."""

import numpy as np
import pytest

from exfit.dsp.noise import noise
from exfit.verdict.residual_tests import (
    excess,
    largest_deviation,
    rest_scatter,
    sample_scatter,
    step_pattern,
    with_carried,
)

RECORDS, SAMPLES, STEP = 400, 1000, 100
FALSE_ALARMS = 0.03  # at a level of 1 %: more by chance in one of 1,000 such studies


def whites(seed, count=RECORDS):
    return np.random.default_rng(seed).standard_normal((count, SAMPLES))


def after_step(size):
    """A deviation that dies out after a step, with a sum of squares of ``size``."""
    shape = np.zeros(SAMPLES)
    shape[STEP:] = np.exp(-np.arange(SAMPLES - STEP) / 40.0)
    return shape * np.sqrt(size / np.sum(shape**2))


def test_white_noise_is_rejected_as_rarely_as_the_level_says():
    patterns = np.array([step_pattern(own, [STEP]) for own in whites(0)])
    sizes = [excess(np.std(own), sample_scatter(noise(own), SAMPLES)) for own in whites(1)]
    at_rest = [excess(np.std(own), rest_scatter(own[:STEP], SAMPLES)) for own in whites(2)]
    for probabilities in (patterns, sizes, at_rest):
        assert np.mean(np.array(probabilities) < 0.01) <= FALSE_ALARMS


def test_a_deviation_after_the_step_is_seen_long_before_it_raises_the_error():
    """A sum of squares of 60 beside 1,000: the error grows by 3 %."""
    probabilities = [step_pattern(own + after_step(60.0), [STEP]) for own in whites(3, 100)]
    assert np.mean(np.array(probabilities) < 0.01) > 0.95


def test_a_drift_at_rest_is_no_scatter_but_a_slow_wander_counts_as_few_samples():
    white = whites(4, 1)[0]
    still, drifting = (rest_scatter(white + drift, SAMPLES) for drift in (0.0, np.arange(1000.0)))
    assert drifting.std == pytest.approx(still.std, rel=0.01)  # what the line takes of the noise
    wandering = np.convolve(white, np.ones(50), "same")
    assert rest_scatter(wandering, SAMPLES).log_variance > 10.0 * still.log_variance
    assert rest_scatter(white[:10], SAMPLES) is None
    assert rest_scatter(np.ones(100), SAMPLES) is None


def test_what_recorded_inputs_carry_adds_to_the_scatter_with_its_few_samples():
    own = sample_scatter(1.0, SAMPLES)
    wander = np.cumsum(whites(5, 4), axis=1) / 20.0
    total = with_carried(own, wander)
    assert total.std == pytest.approx(np.sqrt(1.0 + np.mean(wander**2)))
    assert total.log_variance > 10.0 * own.log_variance
    assert with_carried(own, np.zeros((4, SAMPLES))) == own


def test_a_deviation_counts_that_lasts_a_fiftieth_of_the_record():
    white = whites(6, 1)[0]
    lasting, brief, spiky = white.copy(), white.copy(), white.copy()
    lasting[500:530] += 10.0
    brief[500:505] += 10.0
    spiky[::15] += 100.0
    assert largest_deviation(lasting, 1.0) == pytest.approx(10.0, rel=0.1)
    assert largest_deviation(white, 1.0) < 0.5
    assert largest_deviation(brief, 1.0) < 1.0
    assert largest_deviation(spiky, 1.0) < 1.0


def test_errors_of_zero_are_no_pattern():
    assert step_pattern(np.zeros(100), [10]) is None
    assert excess(0.0, sample_scatter(1e-4, 100)) == 1.0
