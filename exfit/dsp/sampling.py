"""The samples of a record: how evenly its clock runs, where it jumps; few points that show many."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exfit.util.arrays import Array, Mask, Places, distinct, median

GAP_STEPS = 3.0  # median steps: a longer one is a gap
MOST_UNEVEN = 0.01  # of a sampling step: steps that differ by more are uneven
FEWEST_STAMPS = 2  # that have a step between them
PIXELS = 2000  # a figure has no more dots across


@dataclass(frozen=True)
class Gap:
    """A jump of the clock, s, and about how many samples it left out."""

    start: float
    end: float
    lost: int


@dataclass(frozen=True)
class Sampling:
    """How a record is sampled: its steps in s, without gaps and stamps that do not increase.

    ``backward`` are the places of samples, counted from 0, whose time does not exceed all before.
    """

    start: float
    end: float
    step: float
    smallest: float
    largest: float
    gaps: tuple[Gap, ...]
    backward: tuple[int, ...]

    @property
    def span(self) -> float:
        """Length of the record, s."""
        return self.end - self.start

    @property
    def rate(self) -> float:
        """Samples per second, by the median step; 0 where no stamp exceeds another."""
        return 1.0 / self.step if self.step > 0.0 else 0.0

    @property
    def even(self) -> bool:
        """Whether the steps are alike, gaps aside."""
        return max(self.largest - self.step, self.step - self.smallest) <= MOST_UNEVEN * self.step


def present_samples(time: Array, samples: Array) -> tuple[Array, Array]:
    """Select the instants and samples (M,) of a signal that are not missing (nan)."""
    present = np.isfinite(samples)
    return (time, samples) if present.all() else (time[present], samples[present])


def even_step(time: Array, purpose: str) -> float:
    """Return the mean sampling step (s) of an even clock (M,), 2 <= M.

    Raises ValueError where a step differs from it by more than 1 %; ``purpose`` is what needs it.
    """
    steps = np.diff(time)
    step = float(np.mean(steps))
    uneven = float(np.max(np.abs(steps - step))) / step
    if uneven > MOST_UNEVEN:
        raise ValueError(
            f"{purpose} needs even sampling: a step differs by {100 * uneven:.3g} % from the mean "
            f"of {step:g} s, allowed is {100 * MOST_UNEVEN:g} %"
        )
    return step


def increasing(time: Array) -> Mask:
    """Mask of the stamps (M,) that exceed all before them."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    return np.asarray(time > before)


def sampling_of(time: Array) -> Sampling:
    """Examine the clock (M,) of a record, in s; raises ValueError for fewer than two samples."""
    if len(time) < FEWEST_STAMPS:
        raise ValueError(f"{len(time)} samples; at least {FEWEST_STAMPS} are needed")
    forward = increasing(time)
    valid = time[forward]
    steps = np.diff(valid)
    step = float(median(steps)) if len(steps) else 0.0
    jumps = np.flatnonzero(steps > GAP_STEPS * step)
    gaps = tuple(
        Gap(float(valid[k]), float(valid[k + 1]), max(round(float(steps[k]) / step) - 1, 1))
        for k in jumps
    )
    usual = np.delete(steps, jumps)
    smallest, largest = (float(np.min(usual)), float(np.max(usual))) if len(usual) else (0.0, 0.0)
    backward = tuple(int(k) for k in np.flatnonzero(~forward))
    return Sampling(float(valid[0]), float(valid[-1]), step, smallest, largest, gaps, backward)


def envelope(x: Array, y: Array, bins: int = PIXELS) -> tuple[Array, Array]:
    """Return a line (M,) thinned to the least and greatest value of each of the bins.

    A line with no more points than that stays as it is; a gap (nan) as long as a bin stays one.
    """
    rows = kept_rows([y], bins)
    return x[rows], y[rows]


def kept_rows(signals: Sequence[Array], bins: int) -> Places:
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
