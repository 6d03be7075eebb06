"""Errors whose noise is correlated, made white."""

import numpy as np
import pytest

from exfit.inference import whitening as module
from exfit.inference.whitening import PropagatedNoise, whitening

COUNT = 60  # of samples of each of two channels
ORDER = np.arange(2 * COUNT).reshape(2, COUNT).T.ravel()


@pytest.fixture
def noise():
    """Noise of two channels that a decaying response carries into both."""
    decay = 0.7 ** np.arange(COUNT)
    response = np.tril(np.array([np.roll(decay, k) for k in range(COUNT)]).T)
    own = np.repeat([0.5, 2.0], COUNT)
    return PropagatedNoise(own, np.vstack([3.0 * response, -response]))


def test_white_errors_are_independent_and_of_one_size(noise):
    white = whitening(noise, ORDER, 1.7)
    covariance = noise.covariance(np.arange(2 * COUNT))
    assert np.diag(covariance) == pytest.approx(white.deviations**2)
    matrix = white.slopes(np.eye(2 * COUNT))
    assert matrix @ covariance @ matrix.T == pytest.approx(1.7**2 * np.eye(2 * COUNT), abs=1e-10)


def test_the_sum_of_squares_is_that_by_the_inverse_covariance(noise):
    errors = np.random.default_rng(1).standard_normal((3, 2 * COUNT))
    covariance = noise.covariance(np.arange(2 * COUNT))
    weighted = np.einsum("ki,ij,kj->k", errors, np.linalg.inv(covariance), errors)
    white = whitening(noise, ORDER, 1.0).errors(errors)
    assert np.sum(white**2, axis=1) == pytest.approx(weighted, rel=1e-9)


def test_only_errors_before_it_tell_what_one_should_be(noise):
    matrix = whitening(noise, ORDER, 1.0).slopes(np.eye(2 * COUNT))
    assert np.array_equal(np.triu(matrix[np.ix_(ORDER, ORDER)], 1), np.zeros((2 * COUNT,) * 2))


def test_errors_long_before_tell_next_to_nothing(noise, monkeypatch):
    """The response to a sample has decayed to 0.7^20 = 8e-4 of itself after 40 errors."""
    exact = whitening(noise, ORDER, 1.0).slopes(np.eye(2 * COUNT))
    monkeypatch.setattr(module, "ROWS_TOGETHER", 20)
    near = whitening(noise, ORDER, 1.0, before=40)
    assert len(near.parts) > 1
    assert near.slopes(np.eye(2 * COUNT)) == pytest.approx(exact, abs=1e-3)


def test_a_shift_is_taken_from_the_errors_and_not_from_their_derivatives(noise):
    white = whitening(noise, ORDER, 1.0)
    shift = np.arange(2.0 * COUNT)
    errors = np.ones((1, 2 * COUNT))
    shifted = white._replace(shift=shift)
    assert white.errors(errors) - shifted.errors(errors) == pytest.approx(shift[None])
    assert np.array_equal(shifted.slopes(errors.T), white.slopes(errors.T))
