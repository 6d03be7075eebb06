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
ROUNDING = 1e-13  # of the largest response: less is none

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
        return np.asarray(self.own + np.einsum("ij,ij->i", self.carried, self.carried))


class WhitenedRows(NamedTuple):
    """White errors at ``rows``: ``matrix`` times the errors at ``window``."""

    rows: Rows
    window: Rows
    matrix: Array


class Whitening(NamedTuple):
    """Matrix that makes errors (M,) white: W (M, M), W'W the inverse of their covariance / scale^2.

    An error becomes what those before it in time do not predict, over the standard deviation of
    that. The white errors have the standard deviation ``scale``; ``deviations`` (M,) are those that
    the errors had. ``shift`` (M,) is taken from the white errors, of which ``bias`` (M,) is what
    noise of the driving signals would add along the derivatives.

    Source: Seber & Wild 1989, section 2.1.4 (generalised least squares by a Cholesky factor);
    Vecchia 1988 (given only those that came just before).
    """

    parts: tuple[WhitenedRows, ...]
    scale: float
    deviations: Array
    shift: Array
    bias: Array

    def errors(self, errors: Array) -> Array:
        """Return errors (K, M) as white ones."""
        return self.slopes(errors.T).T - self.shift

    def slopes(self, slopes: Array) -> Array:
        """Return the derivatives (M, N) of the white errors by those of the errors."""
        white = np.empty_like(slopes)
        for part in self.parts:
            white[part.rows] = part.matrix @ slopes[part.window]
        return white


def whitening(
    noise: PropagatedNoise, order: Rows, scale: float, before: int = ROWS_BEFORE
) -> Whitening:
    """Make a whitening of errors that follow one another in time by ``order`` (M,).

    Each becomes what so many rows ``before`` it do not predict.
    """
    return Whitening(
        tuple(_parts(noise, order, scale, before)),
        scale,
        np.sqrt(noise.variance),
        np.zeros(len(order)),
        np.zeros(len(order)),
    )


def _parts(
    noise: PropagatedNoise, order: Rows, scale: float, rows_before: int
) -> Iterator[WhitenedRows]:
    from scipy.linalg.blas import dtrsm
    from scipy.linalg.lapack import dpotrf, dtrtri

    own, (carried, begun) = noise.own[order], _in_time(noise.carried, order)
    covariance, first, done = np.empty((0, 0), order="F"), 0, 0
    while done < len(order):
        before, first = first, max(done - rows_before, 0)
        kept, end = done - first, min(first + rows_before + ROWS_TOGETHER, len(order))
        known = covariance[first - before :, first - before :]
        covariance = np.zeros((end - first, end - first), order="F")  # its lower triangle
        covariance[:kept, :kept] = known
        sources = np.searchsorted(begun, end)
        covariance[kept:] = carried[done:end, :sources] @ carried[first:end, :sources].T
        new = np.arange(kept, end - first)
        covariance[new, new] += own[done:end]
        factor, _ = dpotrf(covariance, lower=1, clean=1)
        # of its inverse the rows of the new errors
        inverse, _ = dtrtri(factor[kept:, kept:], lower=1)
        matrix = np.empty((end - done, end - first), order="F")
        matrix[:, kept:] = inverse
        matrix[:, :kept] = -inverse @ factor[kept:, :kept]
        if kept:
            matrix[:, :kept] = dtrsm(1.0, factor[:kept, :kept], matrix[:, :kept], side=1, lower=1)
        for row in range(done, end, ROWS_OF_A_PART):
            behind = min(row + ROWS_OF_A_PART, end)
            part = scale * matrix[row - done : behind - done, : behind - first]
            yield WhitenedRows(order[row:behind], order[first:behind], np.ascontiguousarray(part))
        done = end


def _in_time(carried: Array, order: Rows) -> tuple[Array, Rows]:
    """Return what sources carry, errors by ``order`` and sources as they begin, and at which row.

    So products leave out sources that have not begun.
    """
    carried = carried[order]
    nothing = ROUNDING * max(np.max(carried, initial=0.0), -np.min(carried, initial=0.0))
    begun = np.argmax((carried > nothing) | (carried < -nothing), axis=0)
    in_turn = np.argsort(begun, kind="stable")
    return np.take(carried, in_turn, axis=1), begun[in_turn]
