"""Filters that a recorded signal and its simulation both pass before they are compared."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from exfit.dsp.noise import noise, spread
from exfit.dsp.sampling import even_step
from exfit.util.arrays import Array, Mask, Places, median, median_step

LOWEST_CUTOFF = 1e-6  # of the sampling rate: the coefficients for a lower one are rounded away
BUTTERWORTH_ORDER = 2  # of the Butterworth filter, which runs twice
FEWEST_FILTERED = 10  # samples: the filter starts on a mirror of three times its length
FEWEST_AVERAGED = 2  # samples of a line
FEWEST_IN_WINDOW = 16  # samples: lines through fewer err by 1 % of what an average does, or more
NODES = 8  # of a window, by Gauss and Legendre: exact for polynomials of order 15
OUTLIER_WINDOW = 7  # samples, of which the middle one is compared with the rest; 3 may be spikes


class LowPass(NamedTuple):
    """A Butterworth filter of second order, run forwards and backwards: no delay, and half the
    amplitude at ``cutoff`` (Hz)."""

    cutoff: float


@dataclass(frozen=True)
class Median:
    """A running median over an odd number of ``samples``; the first and last are held beyond the
    ends."""

    samples: int

    def __post_init__(self) -> None:
        if self.samples < 1 or self.samples % 2 == 0:
            raise ValueError(f"a median over {self.samples} samples: the number must be odd")


@dataclass(frozen=True)
class MovingAverage:
    """The mean over a ``window`` (s) about each instant, of the line through the samples.

    A kink between two of them, ``step`` s apart, where the slope jumps by ``jump`` per second, is
    cut by the line: the mean there errs by up to ``jump * step**2 / (8 * window)``.
    """

    window: float

    def __post_init__(self) -> None:
        if not 0.0 < self.window < np.inf:
            raise ValueError(f"an average over {self.window:g} s: it must be longer than 0")


@dataclass(frozen=True, eq=False)
class Filtering:
    """How a signal (M,) on the clock ``time`` (s) is filtered, and which samples are ``kept``.

    Samples that are not kept, which may be nan, are bridged in a line between their kept
    neighbours before the filter, so that they do not smear, and dropped after it. Where the record
    holds averages already, the simulation is ``averaged`` alike before all that.

    Raises:
        ValueError: no sample is kept, the low-pass filter finds uneven sampling, a cutoff that is
            not between a millionth and half of the sampling rate, or fewer than ten samples, or an
            average finds fewer than two samples or a window longer than the record.
    """

    time: Array
    kept: Mask
    filter: LowPass | Median | None = None
    averaged: MovingAverage | None = None

    def __post_init__(self) -> None:
        if not self.kept.any():
            raise ValueError("no sample is kept")
        count = len(self.time)
        if isinstance(self.filter, LowPass):
            if count < FEWEST_FILTERED:
                raise ValueError(
                    f"{count} samples: the low-pass filter needs at least {FEWEST_FILTERED}"
                )
            step = even_step(self.time, "the low-pass filter")
            cutoff, lowest = self.filter.cutoff, LOWEST_CUTOFF / step
            if not lowest <= cutoff < 0.5 / step:
                raise ValueError(
                    f"cutoff of {cutoff:g} Hz: it must lie between {lowest:g} Hz and half the "
                    f"sampling rate, {0.5 / step:g} Hz"
                )
        if self.averaged is not None:
            if count < FEWEST_AVERAGED:
                raise ValueError(f"{count} samples: an average needs at least {FEWEST_AVERAGED}")
            window, length = self.averaged.window, self.time[-1] - self.time[0]
            if window > length:
                raise ValueError(f"an average over {window:g} s: the record is {length:g} s long")

    def as_recorded(self, simulated: Array) -> Array:
        """Return simulated values (M, ...) as the record shows them: averaged, where it is so.

        Beyond the ends they go on in a line. It is linear: derivatives are averaged as values.
        """
        if self.averaged is None:
            return simulated
        column = (-1, *[1] * (simulated.ndim - 1))
        steps = np.diff(self.time).reshape(column)
        # from the first value on: a mean is a difference of areas, and these are rounded
        values = simulated - simulated[0]
        areas, slopes = np.zeros_like(values), np.diff(values, axis=0) / steps
        np.cumsum(0.5 * steps * (values[1:] + values[:-1]), axis=0, out=areas[1:])

        def area(place: Places, beyond: Array) -> Array:
            way = beyond.reshape(column)
            return np.asarray(areas[place] + way * (values[place] + 0.5 * way * slopes[place]))

        before, behind = self._windows
        rise = area(*behind) - area(*before)
        return np.asarray(simulated[0] + rise / self.averaged.window)

    def apply(self, samples: Array) -> Array:
        """Filter a signal (M,) as it is compared, one number for each kept sample."""
        return self.tangents(samples, samples)

    def tangents(self, samples: Array, slopes: Array) -> Array:
        """Return the derivatives (kept, N) of ``apply`` at a signal of derivatives (M, N).

        Where the median may pick one of several equal samples, it is that of one of them.
        """
        if self.filter is None and bool(self.kept.all()):
            return slopes
        whole = self._bridged(slopes)
        if isinstance(self.filter, LowPass):
            from scipy.signal import sosfiltfilt

            whole = np.asarray(sosfiltfilt(self._sections, whole, axis=0))
        elif isinstance(self.filter, Median):
            width, picked = self.filter.samples, self._bridged(samples)
            around = np.arange(len(picked))[:, None] + np.arange(width) - width // 2
            around = np.clip(around, 0, len(picked) - 1)
            middle = np.argpartition(picked[around], width // 2, axis=1)[:, [width // 2]]
            whole = whole[np.take_along_axis(around, middle, axis=1)[:, 0]]
        return np.asarray(whole[self.kept])

    @cached_property
    def smooth_over(self) -> int:
        """How many samples a window of the record's averages holds, 1 where it has none."""
        if self.averaged is None:
            return 1
        return max(1, round(self.averaged.window / median_step(self.time)))

    @property
    def window_between(self) -> float:
        """The window (s) of averages, of which the samples hold too few for lines; else 0."""
        few = self.averaged is not None and self.smooth_over < FEWEST_IN_WINDOW
        return self.averaged.window if few and self.averaged is not None else 0.0

    @cached_property
    def _windows(self) -> tuple[tuple[Places, Array], tuple[Places, Array]]:
        """Return the lines on which each window begins and ends, and how far (s) along them."""
        assert self.averaged is not None
        half = 0.5 * self.averaged.window
        begin, end = (
            np.clip(np.searchsorted(self.time, at) - 1, 0, len(self.time) - 2)
            for at in (self.time - half, self.time + half)
        )
        return (
            (begin, self.time - half - self.time[begin]),
            (end, self.time + half - self.time[end]),
        )

    @cached_property
    def _bridges(self) -> tuple[Places, Places, Places, Array]:
        """Places of the lost samples, of their kept neighbours, and their way between these."""
        lost, kept = np.flatnonzero(~self.kept), np.flatnonzero(self.kept)
        right = np.searchsorted(kept, lost)
        before = kept[np.maximum(right - 1, 0)]
        after = kept[np.minimum(right, len(kept) - 1)]
        gap = np.where(before == after, 1.0, self.time[after] - self.time[before])
        return lost, before, after, (self.time[lost] - self.time[before]) / gap

    def _bridged(self, values: Array) -> Array:
        """Return values (M, ...) with lines in the place of the lost samples."""
        lost, before, after, way = self._bridges
        if not len(lost):
            return values
        whole = values.copy()
        rise = values[after] - values[before]
        whole[lost] = values[before] + way.reshape(-1, *[1] * (values.ndim - 1)) * rise
        return whole

    @cached_property
    def _sections(self) -> Array:
        from scipy.signal import butter

        assert isinstance(self.filter, LowPass)
        rate = 1.0 / float(np.mean(np.diff(self.time)))
        return np.asarray(butter(BUTTERWORTH_ORDER, self.filter.cutoff, fs=rate, output="sos"))


def outliers(time: Array, samples: Array, limit: float, scatter: float | None = None) -> Mask:
    """Find the samples (M,) that lie off the line through the medians of their neighbours.

    The line is the repeated median over seven samples, which three spikes do not move and along
    which a steep rise is no spike. Off is farther than ``limit`` robust standard deviations: the
    noise of the record, or of these seven where they scatter more.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.
        limit: in standard deviations.
        scatter: the noise of the record where it is known, else it is estimated from the samples.

    Source: Hampel 1974 (the rule); Siegel 1982 (the line).

    Raises:
        ValueError: fewer than seven samples.
    """
    if len(samples) < OUTLIER_WINDOW:
        raise ValueError(
            f"{len(samples)} samples: spikes are found among at least {OUTLIER_WINDOW}"
        )
    t, y = (sliding_window_view(values, OUTLIER_WINDOW) for values in (time, samples))
    slopes = []  # of the repeated median: of the slopes to the others from each sample
    for k in range(OUTLIER_WINDOW):
        rest = np.flatnonzero(np.arange(OUTLIER_WINDOW) != k)
        slopes.append(median((y[:, rest] - y[:, [k]]) / (t[:, rest] - t[:, [k]]), axis=1))
    slope = median(slopes, axis=0)
    level = y - slope[:, None] * (t - t[:, [OUTLIER_WINDOW // 2]])
    from_line = np.asarray(level - median(level, axis=1, keepdims=True))
    place = np.arange(len(samples))
    window = np.clip(place - OUTLIER_WINDOW // 2, 0, len(samples) - OUTLIER_WINDOW)
    away = np.abs(from_line[window, place - window])
    scale = np.maximum(spread(from_line), noise(samples) if scatter is None else scatter)
    return np.asarray(away > limit * scale[window])


class Averages(NamedTuple):
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


def averages_of(filterings: Sequence[Filtering | None]) -> Averages | None:
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
