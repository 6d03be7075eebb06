"""Where a sampled signal jumps though it moves all along: a switching in the grid."""

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import SECOND_DIFFERENCE, spread
from exfit.util.sorting import median

Array = NDArray[np.float64]
Jump = tuple[int, int]  # the samples before and after it

NEIGHBOUR = 0.25  # of a jump: by less the signal changes in as long a time before and after it
NOISE = (10.0, 4.0)  # times the noise: what a jump must exceed, and may be added to NEIGHBOUR
LONGEST = 0.04  # s: a jump between two samples that a filter of the recorder spreads over three


def jumps_while_moving(time: Array, samples: Array, least: float) -> list[Jump]:
    """Return where a signal (M,) jumps by at least so much, in order.

    A jump is complete between two samples or, where the recorder spreads it, three that are within
    0.04 s: as long before and after it the signal changes by less than a quarter as much.

    Args:
        time: (M,), s, increasing.
        samples: (M,), finite.
        least: in the unit of the signal.
    """
    if len(samples) < 3:
        return []
    noise = float(spread(np.diff(samples, 2)) / SECOND_DIFFERENCE)
    spacing = float(median(np.diff(time)))
    widths = (1, 2) if 2.0 * spacing <= LONGEST else (1,)
    found: list[Jump] = []
    for width in widths:
        for first in _alone(samples, width, max(least, NOISE[0] * noise), NOISE[1] * noise):
            jump = (first, first + width)
            if not any(jump[0] <= after and before <= jump[1] for before, after in found):
                found.append(jump)
    return sorted(found)


def _alone(samples: Array, width: int, least: float, noise: float) -> list[int]:
    """Return before which changes in ``width`` intervals as long ones change by far less."""
    changes = np.abs(samples[width:] - samples[:-width])
    beside = np.full((2, len(changes)), np.inf)  # at the ends: what lies beyond is not known
    beside[0, width:] = changes[:-width]
    beside[1, :-width] = changes[width:]
    alone = beside.max(axis=0) <= NEIGHBOUR * changes + noise
    return [int(place) for place in np.flatnonzero((changes > least) & alone)]
