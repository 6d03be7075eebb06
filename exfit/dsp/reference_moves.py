"""What a recorded reference shows: until when it is at rest, and where it jumps."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import SECOND_DIFFERENCE, spread
from exfit.util.sorting import distinct, median

Array = NDArray[np.float64]

FEWEST_SAMPLES = 10  # at rest, from which the level is taken and before which nothing jumps
DEPARTURE = (0.1, 6.0)  # of the whole range and times the noise: farther from its level, it moves
NEAR_LEVEL = (0.005, 2.0)  # of the same: within it, it has not begun to move
JUMP = (0.1, 10.0)  # of the whole range and times the noise: a smaller change is no jump
NEIGHBOUR = (0.2, 4.0)  # of the jump and times the noise: by less it changes before and after
WINDOW = 10  # samples, before and after a place, whose means show whether the reference moves there
MOVING = 4.0  # times the standard error of their difference
FEWEST_RESTING = 30  # samples at rest: of fewer a slope may pass for noise
DRIFT = 4.0  # times its standard error: a slope beyond is no rest
LONGEST_JUMP = 0.1  # s between two samples: what takes longer may be a ramp
UNEVEN = 1.5  # times the usual spacing: a longer one is a gap


def scatter(samples: Array) -> float:
    """Return the standard deviation of the noise on a reference (M,), which is mostly at rest.

    It is 0 for a reference between whose moves nothing changes.
    """
    return float(spread(np.diff(samples, 2)) / SECOND_DIFFERENCE) if len(samples) > 2 else 0.0


def jumps(time: Array, samples: Array) -> NDArray[np.intp]:
    """Return after which samples a reference (M,) jumps, each time before the next sample.

    A jump is complete between two samples: just before and just after it the reference changes by
    less than a fifth as much. What takes two samples or more is a ramp, and so is what happens
    between two samples that are farther apart than others, or than 0.1 s: rows of a sparse table.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.
    """
    if len(samples) < FEWEST_SAMPLES + 2:
        return np.zeros(0, np.intp)
    noise, span = scatter(samples), float(np.ptp(samples))
    changes, spacing = np.abs(np.diff(samples)), np.diff(time)
    large = np.maximum(JUMP[0] * span, JUMP[1] * noise)
    at_ends = np.pad(changes, 1)
    beside = np.maximum(at_ends[:-2], at_ends[2:])
    alone = beside <= NEIGHBOUR[0] * changes + NEIGHBOUR[1] * noise
    close = spacing <= min(UNEVEN * float(median(spacing)), LONGEST_JUMP)
    after = np.flatnonzero((changes > large) & alone & close)
    return after[(after >= FEWEST_SAMPLES - 1) & (after < len(changes) - 1)]


def rest_end(samples: Array) -> int:
    """Return the first sample of a reference (M,) that is not at rest any more.

    Raises ValueError where it never moves out of its noise, or moves from its first samples on.
    """
    noise, span = scatter(samples), float(np.ptp(samples))
    away = np.abs(samples - median(samples[:FEWEST_SAMPLES]))
    far = np.flatnonzero(away > max(DEPARTURE[0] * span, DEPARTURE[1] * noise))
    if span == 0.0 or not len(far):
        raise ValueError("never moves out of its noise: there is no test")
    near = np.flatnonzero(away[: far[0]] <= max(NEAR_LEVEL[0] * span, NEAR_LEVEL[1] * noise))
    end = int(near[-1]) + 1 if len(near) else 0
    if end < FEWEST_SAMPLES:
        raise ValueError(f"moves within its first {FEWEST_SAMPLES} samples: its level is unknown")
    return end


def settled(samples: Array, first: int, after: NDArray[np.intp]) -> Array:
    """Return a reference (M,) with its mean in place of its noise wherever it rests.

    It rests before its ``first`` move, and wherever the means of ten samples before and after a
    place differ by no more than noise does, if a line through all these samples is level. What
    moves is left as it is; ``after`` which samples it jumps separates one rest from the next.
    """
    noise, result = scatter(samples), samples.copy()
    result[:first] = np.mean(samples[:first])
    if noise == 0.0:
        return result
    ends = distinct(np.array([first, *(after[after >= first] + 1), len(samples)]))
    for begin, end in pairwise(ends):
        for start, stop in _rests(samples[begin:end], noise):
            result[begin + start : begin + stop] = np.mean(samples[begin + start : begin + stop])
    return result


def _rests(samples: Array, noise: float) -> Iterator[tuple[int, int]]:
    """Yield first sample and end of each stretch that is level but for its noise."""
    if len(samples) < 2 * WINDOW:
        return
    means = np.convolve(samples, np.full(WINDOW, 1.0 / WINDOW), "valid")
    moved = np.abs(means[WINDOW:] - means[:-WINDOW]) > MOVING * noise * np.sqrt(2.0 / WINDOW)
    # a difference belongs to the place between its means; the ends are those of the nearest place
    places = np.pad(moved, (WINDOW - 1, WINDOW), mode="edge")
    bounds = np.flatnonzero(np.diff(places, prepend=True, append=True))
    for start, stop in zip(bounds[::2], bounds[1::2], strict=True):
        if stop - start >= FEWEST_RESTING and _level(samples[start:stop], noise):
            yield int(start), int(stop)


def _level(samples: Array, noise: float) -> bool:
    """Return whether the slope of a line through samples is none but for their noise."""
    way = np.arange(len(samples)) - 0.5 * (len(samples) - 1)
    slope = way @ samples / (way @ way)
    return bool(abs(slope) <= DRIFT * noise / np.sqrt(way @ way))
