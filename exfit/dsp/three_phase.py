"""One terminal voltage from three recorded phases: waveforms or RMS values."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil, pi, sqrt
from types import MappingProxyType
from typing import Literal

import numpy as np

from exfit.dsp.sampling import even_step
from exfit.util.arrays import Array, Complex

Connection = Literal["phase-to-ground", "phase-to-phase"]

LINE_VOLTAGE: Mapping[Connection, float] = MappingProxyType(
    {"phase-to-ground": sqrt(3.0), "phase-to-phase": 1.0}
)  # over the voltage that is recorded, by the points between which it is
PHASES = 3
SPACE_VECTOR = sqrt(2.0) / PHASES * np.exp(2j * pi / PHASES * np.arange(PHASES))
MAINS_FREQUENCIES = (40.0, 70.0)  # Hz: systems of 50 and 60 Hz, and units that run off them
FEWEST_PER_CYCLE = 8  # samples: fewer do not show the third harmonic
FEWEST_CYCLES = 3  # beside the window: fewer do not determine the frequency
MOST_NEGATIVE = 0.2  # of the positive sequence: a unit shows 0.02, one that lost a phase 0.5
LOWEST_VOLTAGE = 0.1  # of the largest voltage: below it noise turns the phase
MOST_DRIFT = 1.0  # Hz: beyond it the window is no whole cycle to 2 %
HARMONICS = 40  # orders that the window takes out, as far as IEC 61000-3-2 counts them
NEAR_NYQUIST = 0.9  # of half the sampling rate: beyond it the samples show no harmonic
MOST_UNBALANCE = 0.05  # of the mean: IEC 60034-1 has machines made for a system of 0.01
MOST_OUTLIERS = 0.01  # of the samples: so many may lie off without a wrong column


@dataclass(frozen=True, eq=False)
class PositiveSequence:
    """The positive sequence of three waveforms: RMS ``voltage`` (K,) at ``time`` (K,), in s.

    It is the mean over a ``window`` (s) about each instant, and shorter than the record by one
    window: the samples ``rows`` of it. ``frequency`` (Hz) is the mean one.
    """

    time: Array
    voltage: Array
    rows: slice
    frequency: float
    window: float


def mean_rms(phases: Array) -> Array:
    """Return the mean (M,) of three RMS values (M, 3), nan where one of them is.

    It exceeds the positive sequence by less than the square of what negative and zero sequence
    are to it.

    Source: Fortescue 1918.

    Raises:
        ValueError: one phase is off the mean by more than 5 % in more than 1 % of the samples.
    """
    _check_columns(phases)
    mean = np.asarray(np.mean(phases, axis=1))
    present = np.isfinite(mean)
    if not present.any():
        raise ValueError("no sample has a number in all three phases")
    away = np.max(np.abs(phases[present] - mean[present, None]), axis=1)
    lasting = float(np.quantile(away - MOST_UNBALANCE * np.abs(mean[present]), 1.0 - MOST_OUTLIERS))
    if lasting > 0.0 or not np.median(mean[present]) > 0.0:
        levels = ", ".join(f"{level:.4g}" for level in np.median(phases[present], axis=0))
        raise ValueError(
            f"the phases' RMS values, {levels} (medians), lie more than "
            f"{100 * MOST_UNBALANCE:g} % off their mean: one is missing, or a column is "
            "another signal"
        )
    return mean


def positive_sequence(time: Array, phases: Array, cycles: int = 1) -> PositiveSequence:
    """Return the RMS value of the positive sequence of three waveforms (M, 3), without delay.

    Their space vector, turned back by the record's own frequency, is averaged over a window of
    whole cycles about each sample. So negative sequence, offset and harmonics cancel as far as
    they are constant; zero sequence is not in it. A voltage that moves appears as its moving
    average over the window, and so must a simulation before the two are compared. Where the
    frequency moves, the mean is corrected for how far the vector turns within the window.

    Args:
        time: (M,), s, increasing evenly.
        phases: instantaneous voltages in the order of the phases, in one unit.
        cycles: of the window, a whole number.

    Source: Clarke 1943 (space vector); Fortescue 1918 (sequences); IEEE C37.118.1-2011, annex C
    (phasors of a window of whole cycles about their instant).

    Raises:
        ValueError: a sample is no finite number, sampling is uneven by more than 1 % of a step or
            gives fewer than eight samples a cycle, the record is shorter than the window and three
            cycles, the frequency is not within 40 ... 70 Hz or moves by more than 1 Hz, the voltage
            falls below a tenth, or the negative sequence exceeds a fifth of the positive one.
    """
    if cycles < 1 or cycles != int(cycles):
        raise ValueError(f"a window of {cycles:g} cycles: it must be a whole number, 1 or more")
    _check_columns(phases)
    if not np.isfinite(phases).all():
        at = time[~np.isfinite(phases).all(axis=1)][0]
        raise ValueError(f"a waveform has no finite number at {at:g} s; none may be missing")
    step = float(np.mean(np.diff(time))) if len(time) > 1 else np.inf
    if step > 1.0 / (FEWEST_PER_CYCLE * MAINS_FREQUENCIES[0]):
        raise ValueError(
            f"a sampling rate of {1.0 / step:.4g} Hz: a waveform needs at least "
            f"{FEWEST_PER_CYCLE} samples a cycle"
        )
    step = even_step(time, "the phasor of a waveform")
    clock: Array = step * np.arange(len(time), dtype=np.float64)
    vector: Complex = np.asarray(phases @ SPACE_VECTOR, dtype=np.complex128)
    frequency = _frequency(clock, vector)
    _check_frequency(frequency, step, len(time), cycles)
    # once more from what is left when the ripple is gone
    positive = _windowed(vector, clock, frequency, cycles)
    frequency += _frequency(clock[: len(positive)], positive)
    positive = _windowed(vector, clock, frequency, cycles)
    negative = _windowed(vector.conj(), clock, frequency, cycles)
    half = (len(time) - len(positive)) // 2
    rows = slice(half, len(time) - half)
    window = cycles / frequency
    _check_balance(time[rows], np.abs(positive), np.abs(negative))
    phase = np.unwrap(np.angle(positive))
    reach = min(round(0.5 * window / step), (len(phase) - 1) // 2)
    inner = (phase[2 * reach :] - phase[: len(phase) - 2 * reach]) / (4.0 * pi * reach * step)
    drift = np.asarray(np.pad(inner, reach, mode="edge"))  # of the frequency from the mean
    if np.max(np.abs(drift)) > MOST_DRIFT:
        raise ValueError(
            f"the frequency moves by {np.max(np.abs(drift)):.3g} Hz off its mean of "
            f"{frequency:.5g} Hz; at most {MOST_DRIFT:g} Hz"
        )
    voltage = np.abs(positive) / np.sinc(drift * window)
    return PositiveSequence(time[rows], voltage, rows, frequency, window)


def _check_columns(phases: Array) -> None:
    if phases.ndim != 2 or phases.shape[1] != PHASES:
        raise ValueError(f"phases of shape {phases.shape}: {PHASES} columns are needed")


def _frequency(clock: Array, vector: Complex) -> float:
    """Frequency of a vector (M,) that turns, Hz."""
    middle = clock - np.mean(clock)
    return float(middle @ np.unwrap(np.angle(vector)) / (middle @ middle) / (2.0 * pi))


def _check_frequency(frequency: float, step: float, count: int, cycles: int) -> None:
    """Raise a ValueError where a frequency (Hz) is no unit's, or badly seen."""
    low, high = MAINS_FREQUENCIES
    if low <= -frequency <= high:
        raise ValueError(
            "the negative sequence dominates: two phases are swapped, or one has the wrong sign"
        )
    if not low <= frequency <= high:
        raise ValueError(
            f"the space vector of the three waveforms turns with {frequency:.3f} Hz; it must "
            f"be within {low:g} ... {high:g} Hz"
        )
    if frequency * step * FEWEST_PER_CYCLE > 1.0:
        raise ValueError(
            f"{1.0 / (frequency * step):.3g} samples a cycle of {frequency:.4g} Hz; a waveform "
            f"needs at least {FEWEST_PER_CYCLE}"
        )
    if count * step * frequency < cycles + FEWEST_CYCLES:
        raise ValueError(
            f"{count * step:.3g} s of {frequency:.4g} Hz; a window of {cycles} cycles needs "
            f"{cycles + FEWEST_CYCLES} cycles"
        )


def _windowed(vector: Complex, clock: Array, frequency: float, cycles: int) -> Complex:
    """Return the mean of a vector (M,), turned back, over each window that lies in the record."""
    from scipy.signal import oaconvolve

    weights = _weights(1.0 / (frequency * clock[1]), cycles)
    turned = vector * np.exp(-2j * pi * frequency * clock)
    return np.asarray(oaconvolve(turned, weights, mode="valid"))


def _weights(per_cycle: float, cycles: int) -> Array:
    """Return the weights (2 L + 1,) of samples in a window of whole cycles about the middle one.

    They are the integral of the line through the samples, changed as little as makes the mean of
    every harmonic zero.
    """
    width = per_cycle * cycles
    reach = ceil(0.5 * width)
    beyond = 0.5 * width - (reach - 1)
    one_side = np.ones(reach + 1)
    one_side[-1] = 0.5 * beyond**2
    one_side[-2] -= 0.5 * (1.0 - beyond) ** 2
    weights = np.concatenate([one_side[:0:-1], one_side]) / width
    orders = np.arange(1 + min(HARMONICS, int(0.5 * NEAR_NYQUIST * per_cycle)))
    harmonics = np.cos(2.0 * pi * np.outer(orders, np.arange(-reach, reach + 1)) / per_cycle)
    wanted = np.where(orders == 0, 1.0, 0.0)
    return np.asarray(weights + np.linalg.lstsq(harmonics, wanted - harmonics @ weights)[0])


def _check_balance(time: Array, positive: Array, negative: Array) -> None:
    """Raise a ValueError where the voltage is gone, or is not that of three phases."""
    low = int(np.argmin(positive))
    if positive[low] < LOWEST_VOLTAGE * np.max(positive):
        raise ValueError(
            f"at {time[low]:g} s the voltage is below {100 * LOWEST_VOLTAGE:g} % of its "
            "largest: its phase is lost there; choose a window of the record without it"
        )
    worst = int(np.argmax(negative / positive))
    share = float(negative[worst] / positive[worst])
    if share > MOST_NEGATIVE:
        raise ValueError(
            f"at {time[worst]:g} s the negative sequence is {100 * share:.3g} % of the positive "
            f"one, allowed is {100 * MOST_NEGATIVE:g} %: a phase is missing, or a column is "
            "another signal"
        )
