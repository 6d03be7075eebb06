"""Records of a PMU at a unit's terminals, made of a known course, and the files that hold them."""

from dataclasses import dataclass, replace

import numpy as np

KV, MVA, F0 = 18.0, 120.0, 60.0
SECONDS = 12.0


@dataclass(frozen=True)
class Course:
    """The terminals of a unit, per unit on its base, angle in rad; each (M,)."""

    time: np.ndarray
    vt: np.ndarray
    angle: np.ndarray
    p: np.ndarray
    q: np.ndarray

    @property
    def frequency(self):
        """Return the frequency (Hz)."""
        return F0 + np.gradient(self.angle, self.time) / (2.0 * np.pi)

    def with_(self, **changes):
        """Return a course with other signals."""
        return replace(self, **changes)


def smooth_course(rate=60, seconds=SECONDS, slip=0.02):
    """Return a course of no unit in particular: a swing on a frequency that is ``slip`` Hz off."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    after = np.maximum(time - 2.0, 0.0)
    swing = np.exp(-0.4 * after) * np.sin(2.0 * np.pi * 0.9 * after)
    return Course(
        time,
        1.01 + 0.02 * swing,
        0.4 + 2.0 * np.pi * slip * time + 0.1 * swing,
        0.8 - 0.15 * swing,
        0.15 + 0.1 * swing,
    )


def phasors_of(course, kv=KV, mva=MVA):
    """Return voltage from phase to ground (kV) and line current (A) as complex numbers, (M,)."""
    voltage = course.vt * np.exp(1j * course.angle)
    current = np.conj((course.p + 1j * course.q) / voltage)
    return voltage * kv / np.sqrt(3.0), current * 1e3 * mva / (np.sqrt(3.0) * kv)


def degrees(phasor):
    """Return the angle of a phasor in degrees, wrapped at +-180."""
    return np.degrees(np.angle(phasor))


def write_table(path, columns, separator=","):
    """Write columns of numbers or texts by name, and return the path."""
    names = [*columns]
    rows = zip(*(map(_cell, columns[name]) for name in names), strict=True)
    lines = [separator.join(names), *(separator.join(row) for row in rows)]
    path.write_text("\n".join(lines) + "\n")
    return path


def _cell(value):
    return value if isinstance(value, str) else f"{value:.9g}"


def stamps(time, start="2024-05-17T14:31:07"):
    """Return timestamps in UTC of times in s."""
    first = np.datetime64(start, "us")
    return [f"{first + np.timedelta64(round(1e6 * at), 'us')}Z" for at in time]


def pmu_columns(course):
    """Return the columns of a positive-sequence PMU, as openPDC names them."""
    voltage, current = phasors_of(course)
    return {
        "Timestamp (UTC)": stamps(course.time),
        "UNIT1-PM1 (V)": 1e3 * np.abs(voltage),
        "UNIT1-PA1 (deg)": degrees(voltage),
        "UNIT1-PM2 (A)": np.abs(current),
        "UNIT1-PA2 (deg)": degrees(current),
        "UNIT1-FQ (Hz)": course.frequency,
        "UNIT1-DF (Hz/s)": np.gradient(course.frequency, course.time),
        "UNIT1-SF": ["0"] * len(course.time),
    }
