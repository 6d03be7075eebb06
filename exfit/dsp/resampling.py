"""Signals on a slower, even clock, without aliases and without delay."""

from collections.abc import Mapping
from fractions import Fraction
from math import ceil, floor

import numpy as np

from exfit.dsp.sampling import GAP_STEPS
from exfit.util.arrays import Array, median

OFF_CLOCK = 0.01  # of a sampling step: an instant may lie so far off, as stamps are rounded
PASSBAND = 0.8  # of half the new rate: up to here a signal stays as it is
ATTENUATION = 72.0  # dB by the formula, 70 in fact: of a step, less than a recorder resolves
OVERSAMPLING = 2  # times the mean rate, of the even clock that uneven samples are put on
MOST_DENOMINATOR = 1000  # largest of a ratio of rates that is taken exactly
RATE_TOLERANCE = 1e-4  # of the rate: a recorder's own is as close to its nominal one
SAMPLES_FOR_SPLINE = 5  # to one of the new rate, where these are read off a cubic spline
FEWEST_SAMPLES_TO_RESAMPLE = 2


def resampled(
    time: Array, signals: Mapping[str, Array], rate: float
) -> tuple[Array, dict[str, Array]]:
    """Return signals on an even clock of a lower ``rate`` (Hz), which begins with the record.

    The anti-alias filter is a finite impulse response, symmetric and so of zero phase, designed
    with a Kaiser window: up to 0.8 of half the new rate amplitudes stay within 0.03 %, and from
    half the new rate on they are 70 dB down. It reaches over 23 new samples to either side. Beyond
    its ends the record goes on as its image, turned about the first and last sample, through which
    the result passes with all their noise; lines stay lines.

    A simulation is not filtered alike: what lies beyond 0.4 of the rate is missing from the record
    only, and rings about the instant of a step, before it too. Of a lag of 20 ms this takes 2.8 %
    of its rise at 200 Hz and 0.56 % at 1 kHz, of another 0.11 / (rate * time constant), less for a
    signal without a kink.

    White noise keeps 0.88 rate / old rate of its variance; neighbours are then correlated by 0.13,
    the next by -0.12, so that second differences give 0.88 of its standard deviation.

    The clock's rate is the requested one within 0.01 %, so that a recorder whose own is not quite
    the nominal one needs no curve between its samples. Uneven samples are first put on an even
    clock of twice their mean rate or finer by a cubic spline, which weakens a wave of frequency f
    by (f / (mean rate - f))**4: 0.02 % at a tenth of the mean rate, 0.4 % at a fifth.

    Args:
        time: (M,), s, increasing.
        signals: (M,) each, finite.
        rate: below the record's mean rate.

    Source: Kaiser 1974 (window); Unser 1999 (spline).

    Raises:
        ValueError: a signal has a sample that is no finite number, the record a gap of more than
            three sampling steps, or the rate is not between that of two samples and the record's.
    """
    own = _mean_rate(time, signals, rate)
    away = time - np.linspace(time[0], time[-1], len(time))
    if float(np.max(np.abs(away))) * own > OFF_CLOCK:
        ratio = ceil(OVERSAMPLING * own / rate)
        fine = _clock(
            time, ratio * rate, floor((time[-1] - time[0]) * ratio * rate + OFF_CLOCK) + 1
        )
        return fine[::ratio], {
            name: _filtered(_spline(time, signal, fine), ratio * rate, Fraction(1, ratio), rate)
            for name, signal in signals.items()
        }
    share = Fraction(rate / own).limit_denominator(MOST_DENOMINATOR)
    exact = abs(float(share) * own - rate) <= RATE_TOLERANCE * rate
    if not exact:
        least = SAMPLES_FOR_SPLINE * rate / own  # a whole number, or one over it, not below
        share = Fraction(1, floor(1.0 / least)) if least <= 1.0 else Fraction(ceil(least))
    fine = _clock(time, float(share) * own, floor((len(time) - 1) * share) + 1)
    filtered = {name: _filtered(signal, own, share, rate) for name, signal in signals.items()}
    if exact:
        return fine, filtered
    clock = _clock(time, rate, floor((fine[-1] - fine[0]) * rate) + 1)
    return clock, {name: _spline(fine, signal, clock) for name, signal in filtered.items()}


def _mean_rate(time: Array, signals: Mapping[str, Array], rate: float) -> float:
    """Return the mean rate (Hz) of a record; raises ValueError where it cannot be resampled."""
    for name, signal in signals.items():
        lost = ~np.isfinite(signal)
        if lost.any():
            raise ValueError(
                f"{name}: no finite number at {time[lost][0]:g} s; resampling needs every sample"
            )
    if len(time) < FEWEST_SAMPLES_TO_RESAMPLE:
        raise ValueError(
            f"{len(time)} samples: resampling needs at least {FEWEST_SAMPLES_TO_RESAMPLE}"
        )
    steps = np.diff(time)
    longest, usual = int(np.argmax(steps)), float(median(steps))
    if steps[longest] > GAP_STEPS * usual:
        raise ValueError(
            f"a gap of {steps[longest]:g} s after {time[longest]:g} s: resampling bridges at most "
            f"{GAP_STEPS:g} sampling steps of {usual:g} s"
        )
    length = float(np.ptp(time))
    own = len(steps) / length
    if not 1.0 / length <= rate < own:
        raise ValueError(
            f"{rate:g} Hz: it must lie between {1.0 / length:.3g} Hz, two samples, and the "
            f"record's mean rate of {own:.6g} Hz"
        )
    return own


def _clock(time: Array, rate: float, count: int) -> Array:
    return np.asarray(time[0] + np.arange(count) / rate)


def _spline(time: Array, signal: Array, at: Array) -> Array:
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(time, signal)(at))


def _filtered(signal: Array, own: float, share: Fraction, rate: float) -> Array:
    """Return an even signal at a share of its ``own`` rate (Hz), free of all above ``rate`` / 2."""
    from scipy.signal import firwin, kaiserord, upfirdn

    up, down = share.as_integer_ratio()
    finest, half = own * up, 0.5 * rate
    taps, beta = kaiserord(ATTENUATION, (1.0 - PASSBAND) * half / (0.5 * finest))
    late = ceil(taps / (2 * down))  # new samples, whole ones: they are left out again
    cutoff = 0.5 * (1.0 + PASSBAND) * half
    response = firwin(2 * late * down + 1, cutoff, window=("kaiser", beta), fs=finest)
    # apart from the line between its ends a signal starts and stops at zero, and a level, which is
    # large, meets no ripple
    line = np.linspace(signal[0], signal[-1], len(signal))
    before = ceil(late / up)
    longer = np.pad(signal - line, before * down, mode="reflect", reflect_type="odd")
    first = late + before * up
    count = floor((len(signal) - 1) * share) + 1
    filtered = upfirdn(up * response, longer, up, down)[first : first + count]
    rise = (signal[-1] - signal[0]) / (len(signal) - 1)
    return np.asarray(filtered + signal[0] + rise * np.arange(count) * (down / up))
