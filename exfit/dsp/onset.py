"""When a response sets out from its rest: the interval that holds the instant."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from exfit.util.sorting import median

Array = NDArray[np.float64]

LAGS_IN_CHAIN = (1, 2, 3, 4)  # whose step responses are the shapes that a rise may have
LAGS = np.geomspace(0.02, 8.0, 14)  # each, of the time that the rise takes
SHORTEST_LAG = 0.02  # of a sample: with it the rise is a jump
TRIED_INSTANTS = 120
SOUGHT_BEFORE = 1.5  # times the rise: how long before its first sample the response may set out
COMPARED_RISE, LESS_OF_IT = 0.5, 0.5  # of the first move, and of that, until a shape fits
LEAST_RISE = 6.0  # times the noise: less of a rise shows no shape
FEWEST_RISING = 3  # samples: fewer show no shape either
HARDLY_MOVED = 0.2  # of the compared rise: until there the response may rest
COMPARED_REST = 4.3  # times the rise; a whole number would end at a sample, or by rounding not
FEWEST_RESTING = 20  # samples of the rest that is compared
MOST_SAMPLES = 200  # of rest and rise; of more, neighbours are averaged
FITTED_VALUES = 4  # level, size, instant and lag
CHI_SQUARE = 3.84  # of one degree of freedom: exceeded by chance in 5 of 100
FIT_QUANTILE = 1.0  # standard deviations of chi-square: a misfit beyond is one of the shape
SHAPE_ERROR = 0.15  # of the rise: by so much no shape is that of the response
CLOCK_ERROR = 0.25  # of a sample
NOISELESS = 1e-9  # of the rise: the least noise, as numbers are rounded


@dataclass(frozen=True)
class Onset:
    """The interval (s) that holds the instant at which a response sets out, at 95 %."""

    earliest: float
    latest: float

    @property
    def at(self) -> float:
        """The middle of the interval, s."""
        return 0.5 * (self.earliest + self.latest)

    @property
    def error(self) -> float:
        """Half the interval, s."""
        return 0.5 * (self.latest - self.earliest)


def onset(time: Array, samples: Array, level: float, peak: int, scatter: float) -> Onset:
    """Return when a response (M,) sets out from its rest.

    The rise is compared with the step responses of chains of one to four equal lags, from a jump
    to a power of time, up to half of the ``peak`` of the first move, and up to less where no shape
    fits within the ``scatter`` of the noise. The interval holds the instants whose best shape
    exceeds the best of all by no more than chi-square does at 95 %, and what such a shape errs by.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite, without spikes.
        level: where they rest.
        peak: the sample at which the first move ends.
        scatter: the standard deviation of the noise.
    """
    for rest_end, end in _rises(np.abs(samples[: peak + 1] - level), scatter):
        rise = float(time[end] - time[rest_end])
        first = int(np.searchsorted(time, time[rest_end] - COMPARED_REST * rise))
        window = slice(max(min(first, rest_end - FEWEST_RESTING), 0), end + 1)
        block = -(-(window.stop - window.start) // MOST_SAMPLES)
        t, y = _block_means(time[window], block), _block_means(samples[window], block)
        earliest = time[rest_end] - SOUGHT_BEFORE * rise
        interval, fits = _compared(t, y, max(float(earliest), t[0]), scatter / sqrt(block))
        margin = SHAPE_ERROR * rise + CLOCK_ERROR * float(median(np.diff(t)))
        result = Onset(interval.earliest - margin, interval.latest + margin)
        if fits:
            break
    return result


def _rises(way: Array, scatter: float) -> Iterator[tuple[int, int]]:
    """Yield where less and less of a rise begins and ends, given the ``way`` (M,) from rest."""
    size = float(np.max(way))
    far = max(COMPARED_RISE * size, min(LEAST_RISE * scatter, size))
    while True:
        end = max(int(np.argmax(way >= far)), 1)
        near = np.flatnonzero(way[:end] <= max(HARDLY_MOVED * far, scatter))
        rest_end = int(near[-1]) if len(near) else 0
        yield rest_end, end
        far *= LESS_OF_IT
        if far < LEAST_RISE * scatter or end - rest_end < FEWEST_RISING:
            return


def _block_means(samples: Array, block: int) -> Array:
    """Return the means of whole blocks of samples, counted from the end."""
    if block == 1:
        return samples
    return np.asarray(np.mean(samples[len(samples) % block :].reshape(-1, block), axis=1))


def _compared(time: Array, samples: Array, low: float, scatter: float) -> tuple[Onset, bool]:
    """Return the interval without what shapes err by, and whether the best of them fits."""
    instants = np.linspace(low, time[-1], TRIED_INSTANTS, endpoint=False)
    costs = _costs(time, samples, instants)
    freedom = max(len(samples) - FITTED_VALUES, 1)
    known = max(scatter, NOISELESS * float(np.ptp(samples))) ** 2
    left = float(np.min(costs)) / freedom
    fits = left <= known * (1.0 + FIT_QUANTILE * sqrt(2.0 / freedom))
    return interval_below(
        instants, costs, float(np.min(costs)) + CHI_SQUARE * max(known, left)
    ), fits


def interval_below(instants: Array, costs: Array, limit: float) -> Onset:
    """Return the first and last instant at which costs (N,) cross a limit, in lines between them.

    Where they are below it at an end, that is the end.
    """
    inside = np.flatnonzero(costs <= limit)
    first, last = int(inside[0]), int(inside[-1])

    def crossing(within: int, beyond: int) -> float:
        if not 0 <= beyond < len(costs):
            return float(instants[within])
        share = (limit - costs[within]) / (costs[beyond] - costs[within])
        return float(instants[within] + share * (instants[beyond] - instants[within]))

    return Onset(crossing(first, first - 1), crossing(last, last + 1))


def _costs(time: Array, samples: Array, instants: Array) -> Array:
    """Return the least sum of squares (N,) that any shape from each instant on leaves.

    Level and size are eliminated (Golub and Pereyra 1973).
    """
    rise = float(time[-1] - instants[0])
    lags = np.maximum(LAGS * rise, SHORTEST_LAG * float(median(np.diff(time))))
    ago = np.maximum(time - instants[:, None], 0.0)[:, None, :] / lags[:, None]
    y = samples - np.mean(samples)
    costs = np.full(len(instants), y @ y)
    # of a chain of n equal lags: 1 - exp(-x) (1 + x + ... + x^(n-1) / (n-1)!)
    term = np.exp(-ago)
    shape = 1.0 - term
    for order in LAGS_IN_CHAIN:
        if order > 1:
            term = term * ago / (order - 1)
            shape = shape - term
        centred = shape - np.mean(shape, axis=-1, keepdims=True)
        along, size = centred @ y, np.sum(centred**2, axis=-1)
        gain = np.divide(along**2, size, out=np.zeros_like(size), where=size > 0.0)
        costs = np.minimum(costs, y @ y - np.max(gain, axis=1))
    return costs
