"""The largest line in the spectrum of errors, and whether white noise has one as large.

At rest it is a ripple of the mains, or an oscillation of the grid.

Sources: Fisher 1929 (the distribution of the largest share that one frequency has of the power);
Percival & Walden 1993, section 10.9.
"""

from dataclasses import dataclass
from math import inf, pi
from typing import NamedTuple

import numpy as np

from exfit.dsp.sampling import even_step
from exfit.util.arrays import Array, Mask, median_step

Range = tuple[float, float]

FEWEST_PERIODS = 3  # in a record: with fewer a line is like the response, or a drift
FEWEST_FREQUENCIES = 5
FINE = 20  # frequencies between two neighbours of the periodogram
NEARLY_BEST = 1e-9  # of the squares of the errors: normal equations are more exact than this,
NEARLY_ALIKE = 1e-5  # but where cosine and sine are nearly alike

# of a ripple
FEWEST_AT_REST = 64  # at rest: fewer show no line
MOST_AT_REST = 20_000  # of a rest, the last ones
MOST_FILLED_IN = 4  # times its samples: a rest with longer gaps shows no line
FEWEST_PERIODS_AT_REST = 8.0  # in the rest: with fewer a line is like a drift
BY_CHANCE = 1e-5  # probability that white noise has a line as large: a likelier one is none
LEAST_SHARE = 0.4  # of the standard deviation at rest: a smaller amplitude does no harm
LEAST_EXPLAINED = LEAST_SHARE**2 / 8.0  # a quarter of what a line so large explains at rest
SLOW = 5.0  # Hz: what oscillates more slowly is the grid or the unit, and no ripple
MAINS = (50.0, 60.0)  # Hz
HARMONICS = (1, 2, 3, 6, 12)  # of the mains that bridges and recorders leave
PASSED = 0.4  # of the frequency of a ripple: a low pass that removes it
FOLDED_WITHIN = 0.01  # of the rate of sampling: a line so near to a folded harmonic may be one


class Line(NamedTuple):
    """A cosine and a sine of one frequency (Hz), in the unit of the errors, about an instant (s).

    ``p_value`` is the probability that white noise has as large a line at one of the frequencies.
    """

    frequency: float
    cosine: float
    sine: float
    about: float
    p_value: float

    @property
    def amplitude(self) -> float:
        """Its amplitude, in the unit of the errors."""
        return float(np.hypot(self.cosine, self.sine))


def largest_line(
    time: Array,
    errors: Array,
    kept: Mask,
    slopes: Array | None = None,
    within: Range = (0.0, inf),
    by_chance: float = 1.0,
    least_explained: float = 0.0,
) -> Line:
    """Return the largest line in errors (kept,) at the kept ones of the instants (M,), s.

    ``slopes`` (kept, N) are the derivatives of the errors to what a fit moves: the line is found
    together with the linear change of these. It lies ``within`` a range (Hz). Raises ValueError
    where the clock is uneven, where the record shows too few frequencies, where white noise has as
    large a line with a higher probability than ``by_chance``, and where it explains less than a
    share of the squares of the errors, ``least_explained``.
    """
    spacing = 1.0 / (len(time) * even_step(time, "a line"))
    filled = np.zeros(len(time))
    filled[kept] = errors
    # the last one of an even number of samples has no sine
    power = np.abs(np.fft.rfft(filled)[: (len(time) + 1) // 2]) ** 2
    power[:FEWEST_PERIODS] = 0.0
    frequencies = spacing * np.arange(len(power))
    inside = (power > 0.0) & (frequencies >= within[0]) & (frequencies <= within[1])
    if np.count_nonzero(power) < FEWEST_FREQUENCIES or not inside.any():
        raise ValueError(f"{len(time)} samples show no line there")
    nearest = int(np.argmax(np.where(inside, power, 0.0)))
    share = float(power[nearest] / np.sum(power))
    counts = int(np.count_nonzero(power)), int(np.count_nonzero(inside))
    p_value = share_by_chance(share, *counts)
    if p_value > by_chance:
        raise ValueError(f"no line stands out of white noise: probability {p_value:.2g}")
    about = 0.5 * float(time[0] + time[-1])
    basis = np.zeros((len(errors), 0))
    if slopes is not None:
        scaled = slopes / np.maximum(np.linalg.norm(slopes, axis=0), np.finfo(float).tiny)
        left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
        basis = np.asarray(left[:, singular > len(left) * np.finfo(float).eps])
    even = spacing * (nearest + np.linspace(-1.0, 1.0, 2 * FINE + 1))
    near = np.clip(even, *within)
    others, t = errors - basis @ (basis.T @ errors), time[kept] - about
    explained = np.where(near == even, _explained(others, even, t, basis), np.nan)
    largest, squares = np.max(explained, initial=0.0, where=explained > 0.0), others @ others
    if largest < least_explained * squares:
        raise ValueError(f"no line explains {100.0 * least_explained:.2g} % of the squares")
    candidates = np.flatnonzero(~(explained < largest - NEARLY_BEST * squares))
    fits = [_regression(others, cosine_and_sine(near[k], t), basis) for k in candidates]
    first = int(np.argmin([rest for _, rest in fits]))
    best, (cosine, sine) = candidates[first], fits[first][0].tolist()
    return Line(float(near[best]), cosine, sine, about, p_value)


def cosine_and_sine(frequency: float, time: Array) -> Array:
    """Return the cosine and sine (M, 2) of a frequency (Hz) at instants (M,) in s."""
    angle = 2.0 * pi * frequency * time
    return np.column_stack([np.cos(angle), np.sin(angle)])


def share_by_chance(share: float, count: int, tested: int) -> float:
    """Probability that one of the ``tested`` frequencies has this share of white noise.

    ``count`` frequencies share its power. It is the first term of Fisher's sum, which is never too
    small, and too large by less than its square.
    """
    return min(1.0, tested * (1.0 - share) ** (count - 1))


def _explained(others: Array, frequencies: Array, t: Array, basis: Array) -> Array:
    """Compute what of the squares of errors (M,) each frequency (K,), evenly apart, explains.

    By normal equations, of all at once: `_regression` of each is exact, and takes ten times as
    long. It is nan where the cosine and the sine are nearly alike.
    """
    turn = np.exp(2j * pi * (frequencies[1] - frequencies[0]) * t)
    waves = np.empty((len(frequencies), len(t)), complex)
    waves[0] = np.exp(2j * pi * frequencies[0] * t)
    for k in range(1, len(frequencies)):
        np.multiply(waves[k - 1], turn, out=waves[k])
    with_errors, with_basis = waves @ others, waves @ basis
    squares = np.einsum("km,km->k", waves, waves) - np.sum(with_basis**2, axis=1)
    sizes = len(t) - np.sum(np.abs(with_basis) ** 2, axis=1)
    # those of the cosine and the sine without what the basis explains of them, and their product
    cosines, sines, both = (sizes + squares.real) / 2, (sizes - squares.real) / 2, squares.imag / 2
    determinant = cosines * sines - both**2
    alike = determinant <= NEARLY_ALIKE * (cosines + sines) ** 2
    explained = (
        sines * with_errors.real**2
        - 2.0 * both * with_errors.real * with_errors.imag
        + cosines * with_errors.imag**2
    )
    return np.asarray(np.where(alike, np.nan, explained / np.where(alike, 1.0, determinant)))


def _regression(others: Array, pair: Array, basis: Array) -> tuple[Array, float]:
    """Return the amplitudes (2,) of a pair (M, 2) in errors (M,), and the square of the rest.

    The errors are without what the orthonormal ``basis`` (M, N) explains of them.
    """
    own = pair - basis @ (basis.T @ pair)
    amplitudes = np.asarray(np.linalg.lstsq(own, others, rcond=None)[0], dtype=float)
    return amplitudes, float(np.sum((others - own @ amplitudes) ** 2))


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
        kind = "an oscillation" if self.frequency < SLOW else "a ripple"
        text = f"{kind} of {self.frequency:.3g} Hz, amplitude {self.amplitude:.2g}, at rest"
        if self.folded_from is None:
            return text
        return (
            f"{text}; it may be {self.folded_from:g} Hz, aliased by sampling at {self.rate:.4g} Hz"
        )

    @property
    def remedy(self) -> str:
        """What to do about it."""
        sine = "sine: {frequency: {start: auto}} on the channel fits it"
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
    t, y = time[rest][-MOST_AT_REST:], samples[rest][-MOST_AT_REST:]
    if len(t) < FEWEST_AT_REST:
        return None
    spacing = median_step(t)
    count = int((t[-1] - t[0]) / spacing)
    if count > MOST_FILLED_IN * len(t):
        return None
    even = t[0] + spacing * np.arange(count)
    way = np.linspace(-1.0, 1.0, len(even))
    level = np.interp(even, t, y)
    level = level - np.polyval(np.polyfit(way, level, 2), way)
    within = (FEWEST_PERIODS_AT_REST / (spacing * len(even)), 0.5 / spacing)
    try:
        line = largest_line(
            even, level, np.ones(len(even), bool), None, within, BY_CHANCE, LEAST_EXPLAINED
        )
    except ValueError:
        return None
    if line.amplitude < LEAST_SHARE * float(np.std(level)):
        return None
    return Ripple(line.frequency, line.amplitude, 1.0 / spacing)
