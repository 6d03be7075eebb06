"""Arrays by what they hold; medians and distinct values without the masked arrays of NumPy."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
Places = NDArray[np.intp]


def median(values: ArrayLike, axis: int = -1, keepdims: bool = False) -> Any:
    """Return the median along an axis, nan where a sample is.

    The same numbers as `np.median`, which imports numpy.ma: an eighth of the time of a short fit.
    """
    samples = np.asarray(values, dtype=np.float64)
    if axis not in (-1, samples.ndim - 1):
        samples = np.moveaxis(samples, axis, -1)
    count = samples.shape[-1]
    low, high = (count - 1) // 2, count // 2
    parted = np.partition(samples, (low, high, count - 1), axis=-1)
    if samples.ndim == 1 and not keepdims:
        last = parted[-1]
        return np.float64(last if np.isnan(last) else 0.5 * (parted[low] + parted[high]))
    middle = 0.5 * (parted[..., low] + parted[..., high])
    middle = np.where(np.isnan(parted[..., -1]), np.nan, middle)
    return np.expand_dims(middle, axis) if keepdims else middle[()]


def median_step(times: NDArray[Any]) -> float:
    """Return the median time between samples at instants (M,)."""
    return float(median(np.diff(times)))


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """Return the distinct values of an array in ascending order, as `np.unique` does."""
    ordered = np.sort(values, axis=None)
    first = np.ones(len(ordered), dtype=np.bool_)
    first[1:] = ordered[1:] != ordered[:-1]
    return ordered[first]
