"""The clock of a record: how evenly it runs, where it jumps, where it stands or goes back."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

GAP = 3.0  # median steps: a longer one is a gap
EVEN = 0.01  # of the median step: what differs by more makes the sampling uneven
FEWEST = 2  # samples that have a step between them


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
        """Tell whether the steps are alike, gaps aside."""
        return max(self.largest - self.step, self.step - self.smallest) <= EVEN * self.step


def increasing(time: Array) -> Mask:
    """Return which stamps (M,) exceed all before them."""
    before = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]])
    return np.asarray(time > before)


def sampling_of(time: Array) -> Sampling:
    """Return how a clock (M,) in s runs; raises ValueError for fewer than two samples."""
    if len(time) < FEWEST:
        raise ValueError(f"{len(time)} samples; at least {FEWEST} are needed")
    forward = increasing(time)
    kept = time[forward]
    steps = np.diff(kept)
    step = float(np.median(steps)) if len(steps) else 0.0
    jumps = np.flatnonzero(steps > GAP * step)
    gaps = tuple(
        Gap(float(kept[k]), float(kept[k + 1]), max(round(float(steps[k]) / step) - 1, 1))
        for k in jumps
    )
    usual = np.delete(steps, jumps)
    smallest, largest = (float(np.min(usual)), float(np.max(usual))) if len(usual) else (0.0, 0.0)
    backward = tuple(int(k) for k in np.flatnonzero(~forward))
    return Sampling(float(kept[0]), float(kept[-1]), step, smallest, largest, gaps, backward)
