"""The largest line in the spectrum of errors, and whether white noise has one as large.

Sources: Fisher 1929 (the distribution of the largest share that one frequency has of the power);
Percival & Walden 1993, section 10.9.
"""

from math import inf, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.sampling import even_step

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Range = tuple[float, float]

FEWEST_PERIODS = 3  # in a record: with fewer a line is like the response, or a drift
FEWEST_FREQUENCIES = 5
FINE = 20  # frequencies between two neighbours of the periodogram


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
) -> Line:
    """Return the largest line in errors (kept,) at the kept ones of the instants (M,), s.

    ``slopes`` (kept, N) are the derivatives of the errors to what a fit moves: the line is found
    together with the linear change of these. It lies ``within`` a range (Hz). Raises ValueError
    where the clock is uneven, or where the record shows too few frequencies.
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
    about = 0.5 * float(time[0] + time[-1])
    basis = np.zeros((len(errors), 0)) if slopes is None else _orthonormal(slopes)
    near = np.clip(spacing * (nearest + np.linspace(-1.0, 1.0, 2 * FINE + 1)), *within)
    fits = [_regression(errors, cosine_and_sine(f, time[kept] - about), basis) for f in near]
    best = int(np.argmin([rest for _, rest in fits]))
    cosine, sine = fits[best][0].tolist()
    share = float(power[nearest] / np.sum(power))
    counts = int(np.count_nonzero(power)), int(np.count_nonzero(inside))
    p_value = share_by_chance(share, *counts)
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


def _orthonormal(slopes: Array) -> Array:
    """Return an orthonormal basis of the columns of slopes (M, N)."""
    scaled = slopes / np.maximum(np.linalg.norm(slopes, axis=0), np.finfo(float).tiny)
    left, singular, _ = np.linalg.svd(scaled, full_matrices=False)
    return np.asarray(left[:, singular > len(left) * np.finfo(float).eps])


def _regression(errors: Array, pair: Array, basis: Array) -> tuple[Array, float]:
    """Return the amplitudes (2,) of a pair (M, 2) in errors (M,), and the square of the rest."""
    own = pair - basis @ (basis.T @ pair)
    others = errors - basis @ (basis.T @ errors)
    amplitudes = np.asarray(np.linalg.lstsq(own, others, rcond=None)[0], dtype=float)
    return amplitudes, float(np.sum((others - own @ amplitudes) ** 2))
