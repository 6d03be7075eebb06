"""The noise of a record, estimated from the signal itself."""

from math import comb, sqrt
from statistics import NormalDist

import numpy as np

from exfit.util.arrays import Array, distinct, median

NEIGHBOURS = 3  # samples whose median is free of a lone spike
SECOND_DIFFERENCE = sqrt(6.0)  # spread of x[k-1] - 2 x[k] + x[k+1] over that of white x
MEDIAN_DEVIATION = NormalDist().inv_cdf(0.75)  # median of |x|, over the spread of a normal x
UNIFORM_SPREAD = 1.0 / sqrt(12.0)  # over the width: of what rounding leaves, over its step
FEWEST_IN_HALF = 4  # samples at rest, of each half
UNSTEADY = 6.0  # standard errors between both halves of what is at rest


def noise(samples: Array, order: int = 2) -> float:
    """Return the standard deviation of the white noise on a slow signal (M,), in its unit.

    It is the median absolute deviation of the second differences, which neither the slow changes
    of the signal nor rare spikes affect, and no less than what rounding to the recorder's steps
    leaves. Uneven sampling passes where the signal is slow against its longest step. Differences
    of a higher ``order`` bear a signal that moves faster, such as a swing at 60 samples a second,
    for an estimate that is a little less certain.

    Source: Rousseeuw and Croux 1993 (median absolute deviation). The variance of the differences of
    white noise is binomial(2 order, order) times its own.

    Raises:
        ValueError: no more samples than the order.
    """
    if len(samples) <= order:
        raise ValueError(
            f"{len(samples)} samples: the noise is estimated from at least {order + 1}"
        )
    scatter = spread(np.diff(samples, order)) / sqrt(comb(2 * order, order))
    sides = samples[:-2], samples[2:]  # medians of three are longer than a spike
    lasting = np.clip(samples[1:-1], np.minimum(*sides), np.maximum(*sides))
    steps = np.diff(distinct(lasting))
    return max(float(scatter), UNIFORM_SPREAD * float(np.min(steps)) if len(steps) else 0.0)


def spread(values: Array, axis: int = -1) -> Array:
    """Return the median absolute deviation along an axis, scaled to the normal law's spread."""
    away = np.abs(values - median(values, axis=axis, keepdims=values.ndim > 1))
    return np.asarray(median(away, axis=axis) / MEDIAN_DEVIATION)


def drift_at_rest(samples: Array) -> float:
    """Difference between the second and the first half of samples at rest (M,); 0 by chance."""
    half = len(samples) // 2
    if half < FEWEST_IN_HALF:
        return 0.0
    # noise from neighbours: a drift does not pass for it
    scatter = float(np.std(np.diff(samples))) / sqrt(2.0)
    drift = float(samples[half:].mean() - samples[:half].mean())
    return drift if abs(drift) > UNSTEADY * scatter * sqrt(2.0 / half) else 0.0
