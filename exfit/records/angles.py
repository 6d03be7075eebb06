"""Angles of phasors: from degrees or radians, wrapped or not, to one that is smooth; its faults."""

from collections.abc import Iterator
from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURNS = {"deg": 360.0, "rad": 2.0 * pi}  # of a turn in a unit
MOST_BETWEEN_SAMPLES = 0.25  # turns: an angle that moves farther may have been wrapped or not
LEAST_MOVE = 2e-3  # Hz, rms: with less neither shows the other
SMOOTHED_OVER = 0.2  # s
LIKE_FREQUENCY = (0.5, 2.0)  # times what the frequency moves by
ALIKE = 0.5  # correlation


class AngleError(ValueError):
    """A fault of the angles between a sample, counted from 0, and the one before."""

    def __init__(self, row: int, text: str) -> None:
        super().__init__(text)
        self.row = row


def in_radians(angle: Array, unit: str) -> Array:
    """Return angles (M,) in rad, given in deg or rad."""
    return np.asarray(angle * (2.0 * pi / TURNS[unit]))


def unwrapped(angle: Array) -> Array:
    """Return angles (M,) in rad without jumps by whole turns; nan stays where it is.

    Raises AngleError where an angle moves by more than a quarter of a turn from one sample to the
    next: it is not known then by how many turns.
    """
    present = np.flatnonzero(np.isfinite(angle))
    smooth = np.array(angle, np.float64)
    turns = np.diff(smooth[present]) / (2.0 * pi)
    moves = turns - np.round(turns)
    far = np.flatnonzero(np.abs(moves) > MOST_BETWEEN_SAMPLES)
    if far.size:
        row = int(present[far[0] + 1])
        raise AngleError(
            row,
            f"the angle moves by {abs(360.0 * moves[far[0]]):.0f} degrees (to whole turns) from "
            f"one sample to the next ({far.size} times in the record); beyond "
            f"{360.0 * MOST_BETWEEN_SAMPLES:.0f} its turns cannot be counted",
        )
    if present.size:
        steps = 2.0 * pi * moves
        smooth[present] = smooth[present[0]] + np.concatenate([[0.0], np.cumsum(steps)])
    return smooth


def wraps(angle: Array, unit: str) -> int:
    """Count the jumps of angles (M,) by most of a turn of their unit."""
    jumps = np.abs(np.diff(angle[np.isfinite(angle)]))
    return int(np.count_nonzero(jumps > 0.75 * TURNS[unit]))


def unit_by_range(angle: Array) -> str | None:
    """Return the unit in which wrapped angles (M,) are: deg or rad, by the size of their jumps.

    None without jumps by a turn: an angle that is not wrapped may have any range in either.
    """
    if wraps(angle, "deg"):
        return "deg"
    largest = float(np.max(np.abs(angle), initial=0.0, where=np.isfinite(angle)))
    return "rad" if largest <= TURNS["rad"] and wraps(angle, "rad") else None


def angle_findings(time: Array, name: str, angle: Array, frequency: Array | None) -> Iterator[str]:
    """Find what is wrong with an angle (M,) in rad beside the recorded frequency (M,) in Hz."""
    try:
        smooth = unwrapped(angle)
    except AngleError as fault:
        yield f"{name}: at {time[fault.row]:.6g} s {fault}"
        return
    if frequency is None:
        return
    present = np.isfinite(smooth) & np.isfinite(frequency)
    t, f = time[present], _smoothed(time[present], frequency[present])
    rate = _smoothed(t, np.gradient(smooth[present], t) / (2.0 * pi))
    f, rate = f - np.mean(f), rate - np.mean(rate)
    sizes = [float(np.sqrt(np.mean(y * y))) for y in (rate, f)]
    if max(sizes) < LEAST_MOVE:
        return
    ratio = sizes[0] / max(sizes[1], 1e-12)
    alike = float(rate @ f) / max(len(f) * sizes[0] * sizes[1], 1e-300)
    low, high = LIKE_FREQUENCY
    if not low <= ratio <= high:
        yield (
            f"{name}: turns {ratio:.3g} times as fast as the recorded frequency moves, not {low:g} "
            f"... {high:g}: degrees taken for radians are 57.3 times as fast, mHz for Hz 1000 times"
        )
    elif alike < -ALIKE:
        yield (
            f"{name}: turns against the recorded frequency (correlation {alike:.2f}): scale: -1 on "
            "the channel angle turns it"
        )
    elif alike < ALIKE:
        yield (
            f"{name}: does not turn as the recorded frequency moves (correlation {alike:.2f}, not "
            f"above {ALIKE:g}): is it the angle of the same voltage, and not relative to another?"
        )


def _smoothed(time: Array, samples: Array) -> Array:
    """Return a signal (M,) averaged over a short time about each instant."""
    width = max(round(SMOOTHED_OVER / float(np.median(np.diff(time)))), 1)
    padded = np.pad(samples, (width // 2, width - 1 - width // 2), mode="edge")
    return np.convolve(padded, np.ones(width) / width, "valid")
