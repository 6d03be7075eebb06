"""Errors that follow from those before them: an autoregression, beside what a fit took away."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from exfit.inference.linear import Array

HIGHEST_ORDER = 4
SAMPLES_PER_COEFFICIENT = 20
LEAST_SEEN = 1e-6  # of the largest singular value: rounding, no direction of the slopes
LARGEST_PARTIAL = 0.9999  # a partial autocorrelation of 1 is no stationary series


class Autoregression(NamedTuple):
    """A stationary series e[k] = sum of a[j] e[k-1-j] + v[k], v white.

    ``partial``: its partial autocorrelations, each between -1 and 1; as many as its order.
    """

    partial: tuple[float, ...]

    @property
    def coefficients(self) -> Array:
        """The coefficients a."""
        return _coefficients(np.array(self.partial))

    @property
    def share(self) -> float:
        """The variance of v over that of e."""
        return float(np.prod(1.0 - np.square(self.partial)))

    @property
    def inflation(self) -> float:
        """The variance of a long mean over that of white errors: the sum of autocorrelations."""
        return self.share / float(1.0 - np.sum(self.coefficients)) ** 2

    def correlated(self, rows: Array) -> Array:
        """Return rows (r, M) times a root of the correlations of M errors (M, M): (r, 2 M).

        The root is the response of the errors to what v was within them and as long before.
        """
        from scipy.signal import lfilter

        backwards = np.concatenate([rows[:, ::-1], np.zeros_like(rows)], axis=1)
        denominator = np.concatenate([[1.0], -self.coefficients])
        return np.asarray(np.sqrt(self.share) * lfilter([1.0], denominator, backwards, axis=1))


class Described(NamedTuple):
    """Errors (M,) as an autoregression, their variance, and what it leaves (M - order,)."""

    series: Autoregression
    variance: float
    innovations: Array


def described(errors: Array, slopes: Array) -> Iterator[Described]:
    """Yield errors (M,) of a fit as autoregressions of rising order.

    ``slopes`` (M, r): what the fit could take away from them. The estimate is that of restricted
    maximum likelihood (Patterson & Thompson 1971), given the first errors; it allows for what the
    fit took of slow errors, which makes those that are left look faster than they were.
    """
    from scipy.optimize import minimize

    highest = min(HIGHEST_ORDER, len(errors) // SAMPLES_PER_COEFFICIENT)
    basis, singular, _ = np.linalg.svd(slopes, full_matrices=False)
    basis = basis[:, singular > LEAST_SEEN * np.max(singular, initial=0.0)]
    both = np.column_stack([basis, errors / np.linalg.norm(errors)])
    lagged = np.array([both[highest - lag : len(both) - lag] for lag in range(highest + 1)])
    products = np.einsum("imk,jml->ijkl", lagged, lagged, optimize=True)
    dof = lagged.shape[1] - basis.shape[1]
    angles = np.empty(0)
    for order in range(1, highest + 1):
        arguments = (products[: order + 1, : order + 1], dof)
        try:
            angles = minimize(_likelihood, np.append(angles, 0.0), arguments, method="BFGS").x
        except np.linalg.LinAlgError:  # the fit took all but rounding: nothing is left to describe
            return
        series = Autoregression(tuple((LARGEST_PARTIAL * np.tanh(angles)).tolist()))
        white = np.tensordot(_whitener(angles), lagged[: order + 1], 1)
        amounts = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
        innovations = (white[:, -1] - white[:, :-1] @ amounts) * np.linalg.norm(errors)
        variance = float(innovations @ innovations) / dof / series.share
        yield Described(series, variance, innovations)


def _likelihood(angles: Array, products: Array, dof: int) -> float:
    """Return minus the logarithm of the restricted likelihood, but for a constant."""
    whitener = _whitener(angles)
    root = np.linalg.cholesky(np.einsum("i,j,ijkl->kl", whitener, whitener, products))
    logarithms = np.log(np.diag(root))
    return float(dof * logarithms[-1] + np.sum(logarithms[:-1]))


def _whitener(angles: Array) -> Array:
    """Matrix that makes correlated errors white, from the last one back."""
    return np.concatenate([[1.0], -_coefficients(LARGEST_PARTIAL * np.tanh(angles))])


def _coefficients(partial: Array) -> Array:
    """Return the coefficients of the series with these partial autocorrelations.

    Source: the recursion of Levinson and Durbin (Box, Jenkins & Reinsel 1994, appendix A3.2).
    """
    coefficients = np.empty(0)
    for value in partial:
        coefficients = np.append(coefficients - value * coefficients[::-1], value)
    return coefficients
