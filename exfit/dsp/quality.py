"""What a recorder did to a channel: spikes, rounding, intervals in which it was stuck."""

from math import log, nan
from statistics import NormalDist

import numpy as np

from exfit.dsp.filtering import OUTLIER_WINDOW, outliers
from exfit.dsp.noise import noise
from exfit.util.arrays import Array, Mask, Places, distinct, median, median_step

EXCERPT, EXCERPT_PARTS = 200_000, 20  # samples that are enough to estimate noise; in parts
JUMP_SHARE = 0.75  # of a spike's least size: it begins or ends with such a jump
FEW_SPIKES, SPIKE_SHARE = 3, 0.005  # samples, or of all: more are the signal's own
LONGEST_SPIKE = 2  # samples
MOVES = 10.0  # times the noise: what certainly moves
SPIKE_LIMIT = 6.0  # times the noise: a sample farther off the line through its neighbours is one
LEVEL_SAMPLES = 3  # on each side of a spike, whose median is the level: it stays
NEARLY, MOST_NEARLY = 2.0 / 3.0, 0.5  # of the limit; of the spikes: so many come near it at most
MOST_MULTIPLES = 1e12  # of a step between numbers: doubles show no grid that is finer
OFF_GRID = 0.05  # of a step: numbers farther off its grid are not rounded to it
STUCK_RUN, FEWEST_STUCK = 3.0, 20  # times the longest run by chance, and samples
WAVE_POWER = 0.9  # of the power of a waveform, near its mains frequency
LARGEST_MEAN = 0.2  # of the standard deviation: the mean of a waveform is smaller
WAVE_SAMPLES = 4096  # the first ones, from which the frequency is taken
FEWEST_CYCLES = 3.0  # that a waveform must show


def moves(samples: Array) -> bool:
    """Check whether a channel (M,) without gaps certainly moves beyond its noise."""
    return float(np.ptp(samples)) > MOVES * noise_of(samples)


def noise_of(samples: Array) -> float:
    """Return the noise of a channel (M,), of a long one from parts all over it."""
    return noise(_excerpt(samples)) if len(samples) >= OUTLIER_WINDOW else 0.0


def present_median(values: Array) -> float:
    """Return the median of the samples (M,) that are numbers, nan where none is."""
    present = values[np.isfinite(values)]
    return float(median(present)) if len(present) else nan


def spikes(time: Array, samples: Array, scatter: float, limit: float) -> Places:
    """Return the places of the spikes of a channel (M,), given the ``scatter`` of its noise.

    They are the outliers beyond ``limit`` times the noise, if these are what a recorder does to a
    signal: few, each alone between samples of one level, and apart from all others in size. There
    is none in a signal that scatters widely by itself, as the field voltage of a thyristor bridge,
    and none where it jumps.
    """
    outlying = _outlying(time, samples, scatter, limit)
    # the first and the last sample return to no level
    outlying = outlying[(outlying > 0) & (outlying < len(samples) - 1)]
    few = 0 < len(outlying) <= max(FEW_SPIKES, SPIKE_SHARE * len(samples))
    if not few:
        return np.zeros(0, np.intp)
    for run in np.split(outlying, np.flatnonzero(np.diff(outlying) > 1) + 1):
        before = samples[max(run[0] - LEVEL_SAMPLES, 0) : run[0]]
        after = samples[run[-1] + 1 : run[-1] + 1 + LEVEL_SAMPLES]
        change = abs(float(median(after) - median(before)))
        if len(run) > LONGEST_SPIKE or change > limit * scatter:
            return np.zeros(0, np.intp)
    nearly = len(_outlying(time, samples, scatter, NEARLY * limit)) - len(outlying)
    by_chance = 2.0 * NormalDist().cdf(-NEARLY * limit) * len(samples)
    apart = nearly <= max(FEW_SPIKES - 1, MOST_NEARLY * len(outlying) + 3.0 * by_chance)
    return outlying if apart else np.zeros(0, np.intp)


def _outlying(time: Array, samples: Array, scatter: float, limit: float) -> Places:
    """Return the places of the outliers that begin or end with a jump of most of the limit.

    The others are not looked at, which makes long records quick: at a limit of six, one sample in
    700 of white noise jumps like that.
    """
    jumps = np.flatnonzero(np.abs(np.diff(samples)) > JUMP_SHARE * limit * scatter)
    if len(samples) < OUTLIER_WINDOW or not len(jumps):
        return np.zeros(0, np.intp)
    near = _near(jumps, len(samples), OUTLIER_WINDOW)
    around = np.flatnonzero(_near(jumps, len(samples), 2 * OUTLIER_WINDOW))
    outlying = around[outliers(time[around], samples[around], limit, scatter)]
    return np.asarray(outlying[near[outlying]])


def quantum(samples: Array) -> float | None:
    """Return the step of which the numbers of a channel are multiples, None where there is none."""
    values = distinct(_excerpt(samples))
    if len(values) < 3:
        return None
    steps = np.diff(values)
    step = float(np.min(steps))
    if float(np.max(steps)) > MOST_MULTIPLES * step:  # no double tells them from whole numbers
        return None
    multiples = steps / step
    if np.max(np.abs(multiples - np.round(multiples))) > OFF_GRID:
        return None
    return float(np.ptp(values) / round(float(np.ptp(values)) / step))


def stuck(samples: Array) -> tuple[tuple[int, int], ...]:
    """Return first and last place of each run of equal samples that is longer than by chance.

    Rounded noise repeats its most frequent number with a probability p; then the longest of the
    runs among M samples is about log(M (1 - p)) / log(1/p) long (Schilling 1990). Returned are
    those more than three times as long.
    """
    starts = np.concatenate([[0], np.flatnonzero(np.diff(samples)) + 1])
    lengths = np.diff(np.concatenate([starts, [len(samples)]]))
    if len(starts) == 1:
        return ((0, len(samples) - 1),)
    if np.max(lengths) <= FEWEST_STUCK:
        return ()
    longest = int(np.argmax(lengths))
    others = np.delete(samples, slice(starts[longest], starts[longest] + lengths[longest]))
    _, counts = np.unique(others, return_counts=True)
    share = float(np.max(counts)) / len(others) if np.max(counts) > 1 else 0.0
    # that a sample repeats the one before, the longest run left out
    repeats = max(share, float(np.sum(np.delete(lengths, longest) - 1)) / len(others))
    if repeats >= 1.0:  # two levels, as of a switch: each stays by its nature
        return ()
    chances = len(samples) * (1.0 - repeats)
    longest_by_chance = log(max(chances, 1.0)) / -log(repeats) if repeats > 0.0 else 1.0
    long = np.flatnonzero(lengths > max(STUCK_RUN * longest_by_chance, FEWEST_STUCK))
    return tuple((int(starts[k]), int(starts[k] + lengths[k] - 1)) for k in long)


def mains_frequency(time: Array, samples: Array) -> float | None:
    """Return the frequency (Hz) of a channel that is a waveform of the mains, else None."""
    from exfit.dsp.three_phase import MAINS_FREQUENCIES

    t, y = time[:WAVE_SAMPLES], samples[:WAVE_SAMPLES]
    if len(y) < OUTLIER_WINDOW or t[-1] - t[0] <= 0.0 or np.isinf(y).any():
        return None
    with np.errstate(all="ignore"):  # of numbers that are too large for a sum
        mean, deviation = float(np.mean(y)), float(np.std(y))
    if not 0.0 < deviation < np.inf or abs(mean) > LARGEST_MEAN * deviation:
        return None
    step = median_step(t)
    power = np.abs(np.fft.rfft((y - mean) * np.hanning(len(y)))) ** 2
    frequencies = np.fft.rfftfreq(len(y), step)
    top = int(np.argmax(power))
    lobe = slice(max(top - 2, 0), top + 3)  # that of the Hann window
    frequency = float(power[lobe] @ frequencies[lobe] / np.sum(power[lobe]))
    if not MAINS_FREQUENCIES[0] <= frequency <= MAINS_FREQUENCIES[1] or top < FEWEST_CYCLES:
        return None
    return frequency if np.sum(power[lobe]) > WAVE_POWER * np.sum(power) else None


def _excerpt(samples: Array) -> Array:
    """Return a channel, of a long one evenly spaced parts."""
    if len(samples) <= EXCERPT:
        return samples
    length = EXCERPT // EXCERPT_PARTS
    starts = np.linspace(0, len(samples) - length, EXCERPT_PARTS).astype(int)
    return np.concatenate([samples[k : k + length] for k in starts])


def _near(places: Places, count: int, far: int) -> Mask:
    """Mask of ``count`` samples: those that lie no farther than ``far`` from any of the places."""
    edges = np.zeros(count + 1, np.int64)
    np.add.at(edges, np.maximum(places - far, 0), 1)
    np.add.at(edges, np.minimum(places + far + 1, count), -1)
    return np.asarray(np.cumsum(edges[:-1]) > 0)
