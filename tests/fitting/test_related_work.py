"""Methods of related work, with which docs/methods.md compares the search of exfit."""

from functools import cache

import block_models
import discrete_models
import numpy as np
import pytest
from discrete_models import Data, Model, arx, instrumental, regressors, transferred
from frequency_weights import Weighted, Whitened, equal, least_spread, weighted
from related_work import descended, each, figures, lowest_cost, matched, subject
from stochastic_approximation import recursive_gauss_newton, robbins_monro, spsa

INTERVAL = 0.01  # s
THIRD_ORDER = Model(np.poly([0.9, 0.8 + 0.1j, 0.8 - 0.1j]).real, np.array([0.0, 0.2, -0.1, 0.05]))
SHORT = {
    "SPSA": spsa(90, gain=0.1, perturbation=0.03, decay=1.0),
    "Robbins-Monro": robbins_monro(30, gain=0.03),
    "recursive Gauss-Newton": recursive_gauss_newton(30, first=0.3),
}


@cache
def coloured():
    """Return the record with coloured noise."""
    return subject("coloured")


def driven(noise: float) -> Data:
    """Return what the model of third order makes of white noise, with white noise of so much."""
    rng = np.random.default_rng(5)
    u = rng.standard_normal(4000)
    y = THIRD_ORDER.response(u)
    return Data(
        INTERVAL * np.arange(len(u)), u, y + noise * np.std(y) * rng.standard_normal(len(u))
    )


def error_of(model: Model) -> float:
    """Return by how much the coefficients of a model are wrong, at most."""
    return float(np.max(np.abs(np.concatenate([model.a, model.b]) - np.concatenate(THIRD_ORDER))))


def test_the_rows_of_arx_predict_the_next_sample_exactly():
    data = driven(0.0)
    coefficients = np.concatenate([THIRD_ORDER.a[1:], THIRD_ORDER.b[1:]])
    predicted = regressors(data.y, data.u, 3) @ coefficients
    np.testing.assert_allclose(predicted, data.y[3:], atol=1e-10)


@pytest.mark.parametrize("fit", [arx, instrumental, discrete_models.output_error])
def test_a_record_without_noise_shows_its_model(fit):
    data = driven(0.0)
    assert error_of(fit(data, 3, data)) < 1e-6


def test_noise_biases_arx_but_neither_instruments_nor_output_error():
    data = driven(0.1)
    biased = error_of(arx(data, 3, data))
    assert biased > 0.3
    assert error_of(instrumental(data, 3, data)) < 0.1 * biased
    assert error_of(discrete_models.output_error(data, 3, data)) < 0.1 * biased


@pytest.mark.parametrize("fit", [block_models.equation_error, block_models.output_error])
@pytest.mark.parametrize(("sign", "gain", "time"), [(1.0, 364.0, 0.05), (-1.0, 0.04, 1.5)])
def test_a_block_shows_its_gain_and_its_time_constant(fit, sign, gain, time):
    doubled = 2.0 * time + INTERVAL
    b = gain * (INTERVAL if sign > 0.0 else 2.0) / doubled
    block = block_models.FirstOrder((2.0 * time - INTERVAL) / doubled, b, sign)
    u = np.cumsum(np.random.default_rng(3).standard_normal(400))
    fitted = fit(u, block.response(u, 0.0), np.ones(len(u), bool), sign)
    assert fitted.gain_and_time(INTERVAL) == pytest.approx((gain, time), rel=1e-6)


def test_blocks_of_a_unit_without_noise_have_its_parameters():
    of = coloured()
    times = of.residuals.experiments[0].simulator.times
    p = of.residuals.values(of.truth)
    fit = block_models.equation_error
    values = block_models.parameters(fit, times, block_models.signals(of), p)
    # of the bilinear rule, at 10 ms beside a time constant of 54 ms
    assert values == pytest.approx({name: p[name] for name in values}, rel=5e-3)


def test_equal_weights_in_the_frequency_domain_are_least_squares_in_time():
    residuals = coloured().residuals
    own = residuals
    in_time, slopes = own.residuals([residuals.start])[0], own.jacobians([residuals.start])[0]
    by_frequency = Weighted(own, equal(in_time))
    errors, tilted = (
        by_frequency.residuals([residuals.start])[0],
        by_frequency.jacobians([residuals.start])[0],
    )
    assert errors @ errors == pytest.approx(in_time @ in_time, rel=1e-12)
    np.testing.assert_allclose(tilted.T @ errors, slopes.T @ in_time, rtol=1e-9)


def test_errors_whitened_in_time_are_weighted_by_their_covariance():
    share, errors = 0.9, np.random.default_rng(2).standard_normal(50)
    white = Whitened(None, share).whitened(errors)
    covariance = share ** np.abs(np.subtract.outer(np.arange(50), np.arange(50)))
    expected = errors @ np.linalg.solve(covariance, errors) * (1.0 - share**2)
    assert white @ white == pytest.approx(expected, rel=1e-9)


def test_no_weights_have_less_spread_than_those_of_the_true_spectrum():
    of = coloured()
    slopes = of.residuals.exact(of.truth)
    for share in (0.0, 0.6, 0.95):
        of_equal, least = least_spread(slopes, share)
        assert np.all(least <= of_equal * (1.0 + 1e-9))
        if share == 0.0:
            np.testing.assert_allclose(of_equal, 1.0, rtol=1e-6)


@pytest.mark.parametrize("name", SHORT)
def test_stochastic_approximation_lowers_the_cost_within_the_bounds(name):
    of = coloured()
    records, starts = [of.residuals] * 2, np.tile(of.residuals.start, (2, 1))
    low, high = of.residuals.bounds
    for end in SHORT[name](records, starts):
        assert np.all((low <= end.point) & (end.point <= high))
        assert of.residuals.costs([end.point])[0] < 0.5 * of.residuals.costs([starts[0]])[0]


@pytest.mark.long
def test_each_method_comes_to_what_the_documentation_says():
    """The study with three records: least squares reach the least cost, what is transferred not."""
    of = coloured()
    starts, records = np.tile(of.residuals.start, (3, 1)), of.drawn(3)
    lowest = lowest_cost(of)
    methods = {
        "linear phase": each(matched),
        "ARX": transferred(arx),
        "equal weights": each(weighted(equal)),
        **SHORT,
    }
    for name, method in methods.items():
        ends = method([of.residuals] * 3, starts)
        own = figures(of, ends, method(records, starts))
        assert np.all(own.costs * lowest >= lowest * (1.0 - 1e-9))
        assert (own.reached == 3) == (name == "equal weights")
        better = figures(of, descended([of.residuals] * 3, ends), descended(records, ends))
        assert better.reached == 3
