"""What an engineer reads off a step response: rise, overshoot, settling, damping, final value."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Annotated, NamedTuple

import numpy as np

from exfit.util.arrays import Array, Mask, Places

TAIL = 0.05  # share of the response after the step whose mean is its final value
BAND = 0.02  # of the step: within it the response has settled
RISE_LEVELS = (0.1, 0.9)  # of the step


LABELS = (
    ("initial value", "initial_value", "pu"),
    ("final value", "final_value", "pu"),
    ("rise time 10-90 %", "rise_time", "s"),
    ("overshoot", "overshoot_percent", "%"),
    ("peak time", "peak_time", "s"),
    ("settling time 2 %", "settling_time", "s"),
)  # of the features, with name and unit
TIMES = ("rise_time", "peak_time", "settling_time", "delay")
MAY_BE_MISSING = (*TIMES, "damping_ratio")


class RemovedLine(NamedTuple):
    """A line of the spectrum that features are read without: Hz, and pu."""

    frequency: float
    amplitude: float

    @property
    def text(self) -> str:
        """The line in words."""
        return f"the line of {self.frequency:.4g} Hz, amplitude {self.amplitude:.2g} pu"


@dataclass(frozen=True)
class Features:
    """Features of the response to one step: voltages per unit, times in s after the step.

    A time that the record is too short to show is None. Of a noisy record ``errors`` holds by how
    much a feature may be off, half of its 95 % interval, and ``why`` the reason where the noise
    hides it; ``without`` are the lines, of a ripple or an oscillation, that were removed before.
    """

    initial_value: Annotated[float, nan]
    final_value: Annotated[float, nan]
    rise_time: float | None
    overshoot_percent: Annotated[float, nan]
    peak_time: float | None
    settling_time: float | None
    delay: float | None = None
    damping_ratio: float | None = None
    errors: Mapping[str, float] = field(default_factory=dict)
    why: Mapping[str, str] = field(default_factory=dict)
    without: tuple[RemovedLine, ...] = ()

    @property
    def removed(self) -> str:
        """The lines that they are read without, in words; empty where none was removed."""
        return " and ".join(line.text for line in self.without)


def features(time: Array, signal: Array, step_at: float, until: float) -> Features | None:
    """Return the features of a signal (M,) between a step of its reference and ``until`` (s).

    Rise is from 10 to 90 % of the way from the initial to the final value (means before the step
    and over the last twentieth), overshoot the excursion beyond the final value in percent of that
    way, settling the last time outside 2 % of it, delay the time until 10 % of it. The damping
    ratio is that of a second-order system with the same decrement from the largest swing about the
    final value to the next one, on its other side. None where nothing moves: there is no way.
    Source: IEEE Std 421.2 (step response); IEC 61400-21-1 (delay, there the reaction time).
    """
    after = (time >= step_at) & (time <= until)
    t, y = time[after] - step_at, signal[after]
    if len(t) < 2:
        return None
    before = signal[time < step_at]
    return features_after(t, y, float(np.mean(before)) if len(before) else float(y[0]))


def features_after(t: Array, y: Array, initial: float) -> Features | None:
    """Return the features of a response (M,) at times t (M,) after its step, from a level."""
    figures = {
        name: float(value) for name, (value,) in figures_of(t, y[None], np.array([initial])).items()
    }
    if isnan(figures["overshoot_percent"]):
        return None
    times = {name: None if isnan(figures[name]) else figures[name] for name in MAY_BE_MISSING}
    return Features(**{**figures, **times})  # type: ignore[arg-type]


def figures_of(t: Array, curves: Array, initial: Array) -> dict[str, Array]:
    """Return the features (K,) of responses (K, M) at times t (M,), from levels (K,), by name.

    A time that is not shown is nan; so is all else of a response that goes nowhere.
    """
    tail = t >= t[-1] - TAIL * (t[-1] - t[0])
    final = curves[:, tail].mean(axis=1)
    with np.errstate(all="ignore"):
        way = (curves - initial[:, None]) / (final - initial)[:, None]
    way[final == initial] = np.nan
    begin, end = (_first_crossings(t, way, level) for level in RISE_LEVELS)
    peak = np.argmax(way, axis=1)
    at, height = _vertices(t, way, peak)
    # a response that still rises at the end passes the mean of its tail without any overshoot
    overshoots = (height > 1.0) & ~tail[peak]
    overshoot = np.where(overshoots, 100.0 * (height - 1.0), 0.0)
    return {
        "initial_value": initial,
        "final_value": final,
        "rise_time": end - begin,
        "delay": begin,
        "damping_ratio": _damping_ratios(curves - final[:, None], tail),
        "overshoot_percent": np.where(final == initial, np.nan, overshoot),
        "peak_time": np.where(overshoots, at, np.nan),
        "settling_time": _settled(t, way),
    }


def _damping_ratios(swing: Array, tail: Mask) -> Array:
    """Damping ratios of swings (K, M) about their final values, nan where they do not swing.

    A swing is a turning point at more than 2 % of the range, before the tail.
    """
    way = np.sign(np.diff(swing, axis=1))
    turns = np.zeros(swing.shape, dtype=bool)
    turns[:, 1:-1] = (way[:, 1:] * way[:, :-1] < 0.0) & ~tail[1:-1]
    size = np.where(turns, np.abs(swing), 0.0)
    row, first = np.arange(len(swing)), np.argmax(size, axis=1)
    side = np.sign(swing[row, first])[:, None]
    after = np.arange(swing.shape[1]) > first[:, None]
    second = np.argmax(np.where(after & turns, -side * swing, 0.0), axis=1)
    steps = np.arange(swing.shape[1], dtype=float)  # evenly enough for the height of a vertex
    _, larger = _vertices(steps, side * swing, first)
    _, smaller = _vertices(steps, -side * swing, second)
    read = (size[row, first] > BAND * np.ptp(swing, axis=1)) & (second > 0) & (smaller > 0.0)
    with np.errstate(all="ignore"):
        decrement = np.log(larger / smaller)
        ratio = decrement / np.hypot(np.pi, decrement)
    return np.where(read, ratio, np.nan)


def _first_crossings(t: Array, way: Array, level: float) -> Array:
    """Times at which responses (K, M) first reach a level, nan where they never do."""
    above = way >= level
    k, row = np.argmax(above, axis=1), np.arange(len(way))
    before = np.maximum(k - 1, 0)
    crossing = _between(t, way, row, before, k, np.full(len(way), level))
    return np.where(above[row, k], np.where(k == 0, t[0], crossing), np.nan)


def _settled(t: Array, way: Array) -> Array:
    """Times at which responses (K, M) are last outside their bands, nan where they end there."""
    outside = np.abs(way - 1.0) > BAND
    last, row = len(t) - 1 - np.argmax(outside[:, ::-1], axis=1), np.arange(len(way))
    after = np.minimum(last + 1, len(t) - 1)
    edge = np.where(way[row, last] > 1.0, 1.0 + BAND, 1.0 - BAND)
    entered = np.where(last == len(t) - 1, np.nan, _between(t, way, row, last, after, edge))
    return np.where(outside.any(axis=1), entered, t[0])


def _between(
    t: Array,
    way: Array,
    row: Places,
    before: Places,
    after: Places,
    level: Array,
) -> Array:
    """Times at which the lines through two samples of each response pass a level."""
    low, high = way[row, before], way[row, after]
    with np.errstate(all="ignore"):
        share = np.clip((level - low) / (high - low), 0.0, 1.0)
    share = np.where(high == low, 1.0, share)
    return np.asarray(t[before] + share * (t[after] - t[before]))


def _vertices(t: Array, way: Array, peak: Places) -> tuple[Array, Array]:
    """Return time and height of the parabola through the highest sample and its neighbours."""
    row, count = np.arange(len(way)), len(t)
    inner = (peak > 0) & (peak < count - 1)
    middle = np.clip(peak, 1, max(count - 2, 1)) if count > 2 else peak
    if count < 3:
        return t[peak], way[row, peak]
    before, after = t[middle] - t[middle - 1], t[middle + 1] - t[middle]
    with np.errstate(all="ignore"):  # between times that nearly agree
        rise = (way[row, middle] - way[row, middle - 1]) / before
        fall = (way[row, middle + 1] - way[row, middle]) / after
        bend = (fall - rise) / (before + after)
        slope = (rise * after + fall * before) / (before + after)
        shift = -0.5 * slope / bend
        lift = 0.5 * slope * shift
    inner &= (bend < 0.0) & np.isfinite(lift)
    shift, height = np.where(inner, shift, 0.0), way[row, peak] + np.where(inner, lift, 0.0)
    return t[peak] + shift, height
