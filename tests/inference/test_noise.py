"""Laws of errors that are described as an autoregression."""

import numpy as np
import pytest
from linearised import autoregressive
from scipy.linalg import toeplitz
from scipy.signal import lfilter
from tiers import few_of

from exfit.inference.noise import Autoregression, autocorrelations, described

TIME = np.linspace(0.0, 1.0, 600)
SLOW = np.column_stack([np.ones_like(TIME), TIME, TIME**2, np.exp(-5.0 * TIME)])


def left_over(errors):
    """Return what a fit of slow responses leaves of errors."""
    return errors - SLOW @ np.linalg.lstsq(SLOW, errors, rcond=None)[0]


@pytest.mark.parametrize("phi", few_of([0.5, 0.9], 1))
def test_the_coefficient_is_found_though_the_fit_took_slow_errors(phi):
    rng = np.random.default_rng(1)
    found, plain, variances = [], [], []
    for errors in autoregressive(rng, phi, (40, len(TIME))):
        residuals = left_over(errors)
        first = next(described(residuals, SLOW))
        found.append(first.series.coefficients[0])
        variances.append(first.variance)
        plain.append(autocorrelations(residuals)[1])
    # three standard errors of the mean of 40; (1 - phi^2) / M is the variance of each
    allowed = 3.0 * np.sqrt((1.0 - phi**2) / len(TIME) / 40)
    assert np.mean(found) == pytest.approx(phi, abs=allowed)
    assert np.mean(plain) < np.mean(found)
    assert np.mean(variances) == pytest.approx(1.0, abs=0.15)


def test_a_second_order_is_recovered():
    series = Autoregression((0.8, -0.4))
    a, b = series.coefficients
    errors = lfilter([1.0], [1.0, -a, -b], np.random.default_rng(2).standard_normal(20_000))[500:]
    second = list(described(errors, np.ones((len(errors), 1))))[1]
    assert second.series.coefficients == pytest.approx([a, b], abs=0.03)
    assert second.variance * second.series.share == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("partial", [(0.7,), (0.6, -0.3), (0.5, 0.2, -0.4)])
def test_correlated_rows_have_the_correlations_of_the_series(partial):
    series = Autoregression(partial)
    impulse = np.zeros(500)
    impulse[0] = 1.0
    response = lfilter([1.0], np.r_[1.0, -series.coefficients], impulse)
    covariance = [response[: 500 - lag] @ response[lag:] for lag in range(60)]
    correlations = toeplitz(np.array(covariance) / covariance[0])
    rows = np.random.default_rng(3).standard_normal((3, 60))
    root = series.correlated(rows)
    assert root @ root.T == pytest.approx(rows @ correlations @ rows.T, rel=1e-6)
    assert series.inflation == pytest.approx(1.0 + 2.0 * sum(covariance[1:]) / covariance[0], 1e-2)
