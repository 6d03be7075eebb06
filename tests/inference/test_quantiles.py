"""Tails and quantiles against SciPy's."""

import numpy as np
import pytest
from scipy import special

from exfit.inference.quantiles import chi_square_tail, student_quantile, wave_quantile

ROUNDING = 1e-12  # of either library; 2e-13 was the largest difference


@pytest.mark.parametrize("dof", range(1, 25))
def test_the_tail_of_chi_square_is_scipys(dof):
    statistics = np.geomspace(1e-6, 1200.0, 60)
    tails = [chi_square_tail(statistic, dof) for statistic in statistics]
    assert tails == pytest.approx(special.chdtrc(dof, statistics), rel=ROUNDING, abs=1e-300)


@pytest.mark.parametrize("dof", [1, 1.3, 2, 3.5, 10, 30.7, 99.9, 100, 101, 999.3, 1e6, 1e9, np.inf])
def test_the_quantile_of_students_t_is_scipys(dof):
    probabilities = (0.55, 0.9, 0.975, 0.995)
    quantiles = np.array([student_quantile(dof, probability) for probability in probabilities])
    # by SciPy's distribution: its inverse was exact to 4e-11 only, until 1.14
    tails = 1.0 - np.array(probabilities)
    assert special.stdtr(dof, -quantiles) == pytest.approx(tails, rel=100.0 * ROUNDING)


def test_the_quantile_of_a_wave_of_any_phase_is_that_of_its_law():
    """Of a sine alone the arcsine law; of none the normal one; beside noise what a sample shows."""
    sine = np.array([0.6, 0.8])
    assert wave_quantile(0.0, sine, 0.95) == pytest.approx(
        np.sqrt(2.0) * np.sin(0.95 * np.pi / 2.0), abs=5e-3
    )
    assert wave_quantile(1.0, 0.0 * sine, 0.95) == pytest.approx(1.959964, abs=2e-3)
    rng = np.random.default_rng(1)
    phase, normal = rng.uniform(0.0, 2.0 * np.pi, 200_000), rng.standard_normal(200_000)
    sizes = np.abs(0.6 * normal + 0.8 * np.sqrt(2.0) * np.sin(phase))
    # so many samples show the quantile to 0.003
    assert wave_quantile(0.6, 0.8 * sine, 0.95) == pytest.approx(
        np.quantile(sizes, 0.95), abs=0.012
    )
