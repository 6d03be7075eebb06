"""Errors of several channels whose noise is correlated, made white: weighted by its covariance."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.util.arrays import Array

Rows = NDArray[np.intp]

ROWS_TOGETHER = 400  # that are whitened by one factor
ROWS_BEFORE = 1200  # that tell what noise comes next: more add nothing, and cost their square
ROWS_OF_A_PART = 200  # of a factor: its other half is zero

BIAS_KNOWN_TO = 0.12  # of itself, as the variance of noise by fourth differences of 720 samples


class PropagatedNoise(NamedTuple):
    """The covariance of the noise of M errors: diag(own) + carried carried'.

    ``own`` (M,) is the variance of noise that is independent in each, ``carried`` (M, D) what D
    independent sources of one standard deviation do to all.
    """

    own: Array
    carried: Array

    def covariance(self, rows: Rows) -> Array:
        """Return the covariance of some of the errors."""
        some = self.carried[rows]
        covariance = np.asarray(some @ some.T)
        covariance[np.diag_indices_from(covariance)] += self.own[rows]
        return covariance

    @property
    def variance(self) -> Array:
        """The variance of each error (M,)."""
        return np.asarray(self.own + np.sum(self.carried**2, axis=1))


class WhitenedRows(NamedTuple):
    """White errors at ``rows``: ``matrix`` times the errors at ``window``."""

    rows: Rows
    window: Rows
    matrix: Array


class Whitening(NamedTuple):
    """Matrix that makes errors (M,) white: W (M, M), W'W the inverse of their covariance / scale^2.

    An error becomes what those before it in time do not predict, over the standard deviation of
    that. The white errors have the standard deviation ``scale``; ``deviations`` (M,) are those that
    the errors had. ``shift`` (M,) is taken from the white errors.

    Source: Seber & Wild 1989, section 2.1.4 (generalised least squares by a Cholesky factor);
    Vecchia 1988 (given only those that came just before).
    """

    parts: tuple[WhitenedRows, ...]
    scale: float
    deviations: Array
    shift: Array

    def errors(self, errors: Array) -> Array:
        """Return errors (K, M) as white ones."""
        return self.slopes(errors.T).T - self.shift

    def slopes(self, slopes: Array) -> Array:
        """Return the derivatives (M, N) of the white errors by those of the errors."""
        white = np.empty_like(slopes)
        for part in self.parts:
            white[part.rows] = part.matrix @ slopes[part.window]
        return white


def whitening(noise: PropagatedNoise, order: Rows, scale: float) -> Whitening:
    """Make a whitening of errors that follow one another in time by ``order`` (M,)."""
    return Whitening(
        tuple(_parts(noise, order, scale)),
        scale,
        np.sqrt(noise.variance),
        np.zeros(len(order)),
    )


def _parts(noise: PropagatedNoise, order: Rows, scale: float) -> Iterator[WhitenedRows]:
    done = 0
    while done < len(order):
        first = max(done - ROWS_BEFORE, 0)
        window = order[first : first + ROWS_BEFORE + ROWS_TOGETHER]
        from scipy.linalg.lapack import dpotrf, dtrtri

        factor, _ = dpotrf(noise.covariance(window), lower=1, clean=1)
        inverse, _ = dtrtri(factor, lower=1)
        matrix = scale * np.asarray(inverse)
        for row in range(done - first, len(window), ROWS_OF_A_PART):
            rows = slice(row, min(row + ROWS_OF_A_PART, len(window)))
            yield WhitenedRows(
                window[rows], window[: rows.stop], np.ascontiguousarray(matrix[rows, : rows.stop])
            )
        done = first + len(window)
