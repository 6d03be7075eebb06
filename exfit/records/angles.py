"""Angles of phasors: from degrees or radians as recorded, wrapped or not, to one that is smooth."""

from math import pi

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

TURNS = {"deg": 360.0, "rad": 2.0 * pi}  # of a turn in a unit
MOST_BETWEEN_SAMPLES = 0.25  # turns: an angle that moves farther may have been wrapped or not


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
    """Return how often angles (M,) jump by most of a turn of their unit."""
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
