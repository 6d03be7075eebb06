"""Periodic disturbances of a channel at rest: ripple of the mains, sway of the grid."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.lines import largest_line
from exfit.util.sorting import median

Array = NDArray[np.float64]

FEWEST_SAMPLES = 64  # at rest: fewer show no line
MOST_SAMPLES = 20_000  # of a rest, the last ones
MOST_FILLED_IN = 4  # times its samples: a rest with longer gaps shows no line
FEWEST_PERIODS = 8.0  # in the rest: with fewer a line is like a drift
BY_CHANCE = 1e-5  # probability that white noise has a line as large: a likelier one is none
LEAST_SHARE = 0.4  # of the standard deviation at rest: a smaller amplitude does no harm
SLOW = 5.0  # Hz: what sways more slowly is the grid or the unit, and no ripple
MAINS = (50.0, 60.0)  # Hz
HARMONICS = (1, 2, 3, 6, 12)  # of the mains that bridges and recorders leave
PASSED = 0.4  # of the frequency of a ripple: a low pass that removes it
FOLDED_WITHIN = 0.01  # of the rate of sampling: a line so near to a folded harmonic may be one


@dataclass(frozen=True)
class Ripple:
    """A line at rest: its ``frequency`` (Hz) at a sampling ``rate`` (Hz), ``amplitude`` as read."""

    frequency: float
    amplitude: float
    rate: float

    @property
    def folded_from(self) -> float | None:
        """The harmonic of the mains (Hz) that the sampling may show as this line, else None."""
        near = FOLDED_WITHIN * self.rate
        sources = [harmonic * mains for harmonic in HARMONICS for mains in MAINS]
        if any(abs(source - self.frequency) <= near for source in sources):
            return None
        folded = {abs(each - self.rate * round(each / self.rate)): each for each in sources[::-1]}
        alike = [each for line, each in folded.items() if abs(line - self.frequency) <= near]
        return min(alike, default=None)

    @property
    def in_words(self) -> str:
        """What it is."""
        kind = "a sway" if self.frequency < SLOW else "a ripple"
        text = f"{kind} of {self.frequency:.3g} Hz, amplitude {self.amplitude:.2g}, at rest"
        if self.folded_from is None:
            return text
        return (
            f"{text}; it may be {self.folded_from:g} Hz, folded by sampling at {self.rate:.4g} Hz"
        )

    @property
    def remedy(self) -> str:
        """What to do about it."""
        sine = "sine: {frequency: {start: auto}} on the channel lets the fit find it"
        if self.folded_from is not None:
            return f"record faster or through an anti-alias filter, or {sine}"
        if self.frequency < SLOW:
            return sine
        lowpass = float(f"{PASSED * self.frequency:.2g}")
        return f"{sine}, or filter: {{lowpass: {lowpass:g}}} if the response is slower"


def ripple_at_rest(time: Array, samples: Array, rests: list[tuple[float, float]]) -> Ripple | None:
    """Return the line of a channel (M,) in the longest of its ``rests`` (s), None without one."""
    begin, end = max(rests, key=lambda rest: rest[1] - rest[0], default=(0.0, 0.0))
    rest = slice(*np.searchsorted(time, [begin, end]))
    t, y = time[rest][-MOST_SAMPLES:], samples[rest][-MOST_SAMPLES:]
    if len(t) < FEWEST_SAMPLES:
        return None
    spacing = float(median(np.diff(t)))
    count = int((t[-1] - t[0]) / spacing)
    if count > MOST_FILLED_IN * len(t):
        return None
    even = t[0] + spacing * np.arange(count)
    way = np.linspace(-1.0, 1.0, len(even))
    level = np.interp(even, t, y)
    level = level - np.polyval(np.polyfit(way, level, 2), way)
    within = (FEWEST_PERIODS / (spacing * len(even)), 0.5 / spacing)
    try:
        line = largest_line(even, level, np.ones(len(even), bool), within=within)
    except ValueError:
        return None
    if line.p_value > BY_CHANCE or line.amplitude < LEAST_SHARE * float(np.std(level)):
        return None
    return Ripple(line.frequency, line.amplitude, 1.0 / spacing)
