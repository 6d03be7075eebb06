"""Averages of a recorder whose window holds few samples: a simulation is read in between, too."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from exfit.dsp.filtering import Filtering

Array = NDArray[np.float64]

NODES = 8  # of a window, by Gauss and Legendre: exact for polynomials of order 15


@dataclass(frozen=True, eq=False)
class Averages:
    """Where a simulation is read about each sample, and what of that each signal shows.

    ``offsets`` (n,) are s from the sample, ``weights`` (signals, n).
    """

    offsets: Array
    weights: Array

    def times(self, samples: Array) -> Array:
        """Return the instants (M n,) at which a simulation is read for samples at (M,) s."""
        return np.ravel(samples[:, None] + self.offsets)

    def of(self, read: Array, axis: int = 0) -> Array:
        """Return averages (..., M, signals, ...) of what was read, (..., M n, signals, ...)."""
        shape = (*read.shape[:axis], -1, len(self.offsets), *read.shape[axis + 1 :])
        parts = np.moveaxis(read.reshape(shape), [axis, axis + 1, axis + 2], [0, 1, 2])
        means = np.einsum("mns...,sn->ms...", parts, self.weights)
        return np.moveaxis(means, [0, 1], [axis, axis + 1])


def averages_of(filterings: "Sequence[Filtering | None]") -> Averages | None:
    """Return the averages of signals whose windows hold few samples, None where none has such."""
    windows = [0.0 if each is None else each.window_between for each in filterings]
    if not any(windows):
        return None
    distinct = sorted({*windows} - {0.0})
    nodes, shares = np.polynomial.legendre.leggauss(NODES)
    offsets = np.concatenate([[0.0], *(0.5 * window * nodes for window in distinct)])
    weights = np.zeros((len(windows), len(offsets)))
    for own, window in zip(weights, windows, strict=True):
        if window:
            own[1 + NODES * distinct.index(window) :][:NODES] = 0.5 * shares
        else:
            own[0] = 1.0
    return Averages(offsets, weights)
