"""What an engineer reads off a step response: rise, overshoot, peak, settling, final value."""

from dataclasses import dataclass
from math import nan
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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


@dataclass(frozen=True)
class Features:
    """Features of the response to one step: voltages per unit, times in s after the step.

    A time that the record is too short to show is None.
    """

    initial_value: Annotated[float, nan]
    final_value: Annotated[float, nan]
    rise_time: float | None
    overshoot_percent: Annotated[float, nan]
    peak_time: float | None
    settling_time: float | None


def features(time: Array, signal: Array, step_at: float, until: float) -> Features | None:
    """Return the features of a signal (M,) between a step of its reference and ``until`` (s).

    Rise is from 10 to 90 % of the way from the initial to the final value (means before the step
    and over the last twentieth), overshoot the excursion beyond the final value in percent of that
    way, settling the last time outside 2 % of it. None where nothing moves: there is no way.
    """
    after = (time >= step_at) & (time <= until)
    t, y = time[after] - step_at, signal[after]
    if len(t) < 2:
        return None
    before = signal[time < step_at]
    initial = float(np.mean(before)) if len(before) else float(y[0])
    tail = t >= t[-1] - TAIL * (t[-1] - t[0])
    final = float(np.mean(y[tail]))
    if final == initial:
        return None
    way = (y - initial) / (final - initial)
    peak = int(np.argmax(way))
    # a response that still rises at the end passes the mean of its tail without any overshoot
    overshoots = bool(way[peak] > 1.0 and not tail[peak])
    begin, end = (_first_crossing(t, way, level) for level in RISE_LEVELS)
    return Features(
        initial_value=initial,
        final_value=final,
        rise_time=None if begin is None or end is None else end - begin,
        overshoot_percent=100.0 * float(way[peak] - 1.0) if overshoots else 0.0,
        peak_time=float(t[peak]) if overshoots else None,
        settling_time=_settled(t, way),
    )


def _first_crossing(t: Array, way: Array, level: float) -> float | None:
    above = np.flatnonzero(way >= level)
    if not len(above):
        return None
    k = int(above[0])
    if k == 0:
        return float(t[0])
    return float(np.interp(level, way[k - 1 : k + 1], t[k - 1 : k + 1]))


def _settled(t: Array, way: Array) -> float | None:
    outside = np.flatnonzero(np.abs(way - 1.0) > BAND)
    if not len(outside):
        return float(t[0])
    k = int(outside[-1])
    return None if k == len(t) - 1 else float(t[k + 1])
