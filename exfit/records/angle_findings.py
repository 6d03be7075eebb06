"""What speaks against an angle of a phasor: turns that cannot be counted, another frequency."""

from collections.abc import Iterator
from math import pi

import numpy as np
from numpy.typing import NDArray

from exfit.records.angles import AngleError, unwrapped

Array = NDArray[np.float64]

LEAST_MOVE = 2e-3  # Hz, rms: with less neither shows the other
SMOOTHED_OVER = 0.2  # s
LIKE_FREQUENCY = (0.5, 2.0)  # times what the frequency moves by
ALIKE = 0.5  # correlation


def angle_findings(time: Array, name: str, angle: Array, frequency: Array | None) -> Iterator[str]:
    """Yield what is wrong with an angle (M,) in rad beside the recorded frequency (M,) in Hz."""
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
