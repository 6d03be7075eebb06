"""What a recorder did to a channel: spikes, steps of its numbers, stretches where it stuck."""

from math import log

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.filtering import WINDOW, outliers
from exfit.dsp.noise import noise

Array = NDArray[np.float64]
Places = NDArray[np.intp]

EXCERPT, STRETCHES = 200_000, 20  # samples that tell noise well enough, of as many stretches
SPIKE = 6.0  # times the noise
JUMPS = 4.5  # times the noise: a spike begins or ends with one; of white noise 1 in 700 does
REPEATED = 0.05  # of a step: numbers farther off its grid are not rounded to it
LONGER_RUN, FEWEST_STUCK = 3.0, 20  # times what chance makes of it, and samples
MAINS = (40.0, 70.0)  # Hz
WAVE = 0.9  # of the power of what oscillates, about its mains frequency
CENTRED = 0.2  # of the standard deviation: a waveform has no mean
LOOKED_AT = 4096  # samples, for the frequency
CYCLES = 3.0  # that a waveform must show


def noise_of(samples: Array) -> float:
    """Return the noise of a channel (M,), of a long one from stretches all over it."""
    return noise(_excerpt(samples)) if len(samples) >= WINDOW else 0.0


def spikes(time: Array, samples: Array, scatter: float) -> Places:
    """Return the places of the spikes of a channel (M,), given its noise.

    They are the outliers at six standard deviations of the noise that begin or end with a jump of
    four and a half; the others are not looked at, which makes long records quick.
    """
    jumps = np.flatnonzero(np.abs(np.diff(samples)) > JUMPS * scatter)
    if len(samples) < WINDOW or not len(jumps):
        return np.zeros(0, np.intp)
    near = _near(jumps, len(samples), WINDOW)
    around = np.flatnonzero(_near(jumps, len(samples), 2 * WINDOW))
    off = around[outliers(time[around], samples[around], SPIKE, scatter)]
    return np.asarray(off[near[off]])


def quantum(samples: Array) -> float | None:
    """Return the step that the numbers of a channel are multiples of, None where there is none."""
    values = np.unique(_excerpt(samples))
    if len(values) < 3:
        return None
    steps = np.diff(values)
    step = float(np.min(steps))
    multiples = steps / step
    if np.max(np.abs(multiples - np.round(multiples))) > REPEATED:
        return None
    return float(np.ptp(values) / round(float(np.ptp(values)) / step))


def stuck(samples: Array) -> tuple[tuple[int, int], ...]:
    """Return first and last place of each stretch that stands still for longer than by chance.

    Rounded noise repeats its most frequent number with a probability p; then the longest of the
    runs among M samples is about log(M (1 - p)) / log(1/p) long (Schilling 1990). Told is what is
    three times as long.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(samples)) + 1])
    lengths = np.diff(np.concatenate([starts, [len(samples)]]))
    if len(starts) == 1:
        return ((0, len(samples) - 1),)
    if np.max(lengths) <= FEWEST_STUCK:
        return ()
    repeats = _repeats(samples, starts, lengths)
    chances = len(samples) * (1.0 - repeats)
    likely = log(max(chances, 1.0)) / -log(repeats) if repeats > 0.0 else 1.0
    long = np.flatnonzero(lengths > max(LONGER_RUN * likely, FEWEST_STUCK))
    return tuple((int(starts[k]), int(starts[k] + lengths[k] - 1)) for k in long)


def _repeats(samples: Array, starts: Places, lengths: Places) -> float:
    """Return how probably a sample repeats the one before, the longest run left out."""
    longest = int(np.argmax(lengths))
    others = np.delete(samples, slice(starts[longest], starts[longest] + lengths[longest]))
    _, counts = np.unique(others, return_counts=True)
    share = float(np.max(counts)) / len(others)
    runs = np.delete(lengths, longest)
    return max(share if np.max(counts) > 1 else 0.0, float(np.sum(runs - 1)) / len(others))


def mains_frequency(time: Array, samples: Array) -> float | None:
    """Return the frequency (Hz) of a channel that is a waveform of the mains, else None."""
    t, y = time[:LOOKED_AT], samples[:LOOKED_AT]
    if len(y) < WINDOW or t[-1] - t[0] <= 0.0:
        return None
    mean, moved = float(np.mean(y)), float(np.std(y))
    if moved == 0.0 or abs(mean) > CENTRED * moved:
        return None
    step = float(np.median(np.diff(t)))
    power = np.abs(np.fft.rfft((y - mean) * np.hanning(len(y)))) ** 2
    frequencies = np.fft.rfftfreq(len(y), step)
    top = int(np.argmax(power))
    lobe = slice(max(top - 2, 0), top + 3)  # that of the Hann window
    frequency = float(power[lobe] @ frequencies[lobe] / np.sum(power[lobe]))
    if not MAINS[0] <= frequency <= MAINS[1] or top < CYCLES:
        return None
    return frequency if np.sum(power[lobe]) > WAVE * np.sum(power) else None


def _excerpt(samples: Array) -> Array:
    """Return a channel, of a long one evenly spaced stretches."""
    if len(samples) <= EXCERPT:
        return samples
    length = EXCERPT // STRETCHES
    starts = np.linspace(0, len(samples) - length, STRETCHES).astype(int)
    return np.concatenate([samples[k : k + length] for k in starts])


def _near(places: Places, count: int, far: int) -> NDArray[np.bool_]:
    """Return which of ``count`` samples lie no farther than ``far`` from any of the places."""
    edges = np.zeros(count + 1, np.int64)
    np.add.at(edges, np.maximum(places - far, 0), 1)
    np.add.at(edges, np.minimum(places + far + 1, count), -1)
    return np.asarray(np.cumsum(edges[:-1]) > 0)
