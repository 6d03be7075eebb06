"""Thin long lines for drawing: they look the same with few points."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from exfit.util.sorting import distinct

Array = NDArray[np.float64]

PIXELS = 2000  # a figure has no more dots across


def envelope(x: Array, y: Array, bins: int = PIXELS) -> tuple[Array, Array]:
    """Return a line (M,) thinned to the least and greatest value of each of the bins.

    A line with no more points than that stays as it is; a gap (nan) as long as a bin stays one.
    """
    rows = kept_rows([y], bins)
    return x[rows], y[rows]


def kept_rows(signals: Sequence[Array], bins: int) -> NDArray[np.intp]:
    """Return the rows that hold the least and greatest of each signal (M,) in each of the bins.

    The first and last row are always among them, and all where they are not many more than these.
    """
    count = len(signals[0])
    if count <= 2 * bins * len(signals):
        return np.arange(count)
    size = -(-count // bins)
    starts = np.arange(0, count, size)
    rows = [np.array([0, count - 1])]
    for signal in signals:
        for pick, beyond in ((np.argmin, np.inf), (np.argmax, -np.inf)):
            filled = np.full(len(starts) * size, beyond)
            filled[:count] = np.where(np.isnan(signal), beyond, signal)
            rows.append(starts + pick(filled.reshape(-1, size), axis=1))
    return distinct(np.concatenate(rows))
