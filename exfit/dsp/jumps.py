"""Jumps of a sampled signal, and its rests: a reference, a breaker, a switching in the grid."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from exfit.dsp.noise import SECOND_DIFFERENCE, spread
from exfit.util.arrays import Array, Places, distinct, median, median_step

Jump = tuple[int, int]  # the samples before and after it

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
STANDS_OUT = 3.0  # times the next largest change between two samples: a jump that is alone
NEIGHBOUR_WHILE_MOVING = 0.25  # of a jump: by less a signal changes as long before and after it
NOISE_WHILE_MOVING = (10.0, 4.0)  # times the noise: the least jump, and what is added to the share
LONGEST_SPREAD = 0.04  # s: a jump between two samples that a filter of the recorder makes three


def scatter(samples: Array) -> float:
    """Standard deviation of the noise on a reference (M,), which is mostly at rest.

    It is 0 for a reference between whose moves nothing changes.
    """
    return float(spread(np.diff(samples, 2)) / SECOND_DIFFERENCE) if len(samples) > 2 else 0.0


def jumps(time: Array, samples: Array) -> Places:
    """Find the jumps of a reference (M,): the last sample before each of them.

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
    """Find the first sample of a reference (M,) that is not at rest any more.

    Raises ValueError where it never leaves its noise, or moves from its first samples on.
    """
    noise, span = scatter(samples), float(np.ptp(samples))
    away = np.abs(samples - median(samples[:FEWEST_SAMPLES]))
    far = np.flatnonzero(away > max(DEPARTURE[0] * span, DEPARTURE[1] * noise))
    if span == 0.0 or not len(far):
        raise ValueError("never leaves its noise: there is no step")
    near = np.flatnonzero(away[: far[0]] <= max(NEAR_LEVEL[0] * span, NEAR_LEVEL[1] * noise))
    end = int(near[-1]) + 1 if len(near) else 0
    if end < FEWEST_SAMPLES:
        raise ValueError(f"moves within its first {FEWEST_SAMPLES} samples: its level is unknown")
    return end


def settled(samples: Array, first: int, after: Places) -> Array:
    """Replace the noise of a reference (M,) by its mean wherever it rests.

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
        if stop - start >= FEWEST_RESTING:
            way = np.arange(stop - start) - 0.5 * (stop - start - 1)
            slope = way @ samples[start:stop] / (way @ way)
            if abs(slope) <= DRIFT * noise / np.sqrt(way @ way):  # it is level
                yield int(start), int(stop)


def largest_jump(samples: Array) -> int:
    """Find the last sample before the one jump of a signal (M,), which is finite.

    Raises ValueError where no change between two samples is larger than all others.
    """
    changes = np.abs(np.diff(samples))
    if len(changes) < 2:
        raise ValueError(f"{len(samples)} samples: they show no jump")
    before = int(np.argmax(changes))
    others = float(np.delete(changes, before).max())
    if changes[before] <= STANDS_OUT * others:
        raise ValueError(
            f"no jump stands out: the largest change between two samples is {changes[before]:.3g}, "
            f"another is {others:.3g}"
        )
    return before


def jumps_while_moving(time: Array, samples: Array, least: float) -> list[Jump]:
    """Find where a signal (M,) that moves all along jumps by at least so much, in order.

    A jump is complete between two samples or, where the recorder spreads it, three that are within
    0.04 s: as long before and after it the signal changes by less than a quarter as much.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.
        least: in the unit of the signal.
    """
    if len(samples) < 3:
        return []
    noise, spacing = scatter(samples), median_step(time)
    times_least, times_beside = NOISE_WHILE_MOVING
    found: list[Jump] = []
    for width in (1, 2) if 2.0 * spacing <= LONGEST_SPREAD else (1,):
        changes = np.abs(samples[width:] - samples[:-width])
        beside = np.full((2, len(changes)), np.inf)  # at the ends: what lies beyond is not known
        beside[0, width:] = changes[:-width]
        beside[1, :-width] = changes[width:]
        alone = beside.max(axis=0) <= NEIGHBOUR_WHILE_MOVING * changes + times_beside * noise
        large = changes > max(least, times_least * noise)
        for first in np.flatnonzero(large & alone).tolist():
            jump = (first, first + width)
            if not any(jump[0] <= after and before <= jump[1] for before, after in found):
                found.append(jump)
    return sorted(found)
