"""A jump of a signal between two samples, as a breaker that opens makes it."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STANDS_OUT = 3.0  # times the next largest change between two samples


def largest_jump(samples: Array) -> int:
    """Return the last sample before the jump of a signal (M,), which is finite.

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
