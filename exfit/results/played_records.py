"""A record that was played into a unit: what drove it, and how its response departs from it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import nan, pi
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.signals import label_of, unit_of_signal

Array = NDArray[np.float64]

FREQUENCY, HERTZ = "frequency", "Hz"
FROM_ANGLE = "frequency less rated (Hz)"


class Excursion(NamedTuple):
    """The largest departure of a signal from its rest, with its sign, and when it is reached."""

    value: float
    at: float

    def text(self, unit: str) -> str:
        """Return the departure in words; ``unit`` is that of the signal."""
        return f"{self.value:+.3g} {unit} at {self.at:.4g} s"


@dataclass(frozen=True)
class PlayedErrors:
    """How a simulated signal departs from its record, per unit, and when, in s.

    ``largest`` is the error of greatest magnitude, ``at_rest`` its mean before the event; the
    excursions are those of record and simulation, each from its own rest.
    """

    largest: Annotated[float, nan]
    largest_at: Annotated[float, nan]
    at_rest: Annotated[float, nan]
    measured: Excursion | None
    simulated: Excursion | None


@dataclass(frozen=True, eq=False)
class DrivingSignal:
    """A recorded signal (M,) that drove the simulation; ``label`` is that of an axis.

    The samples are in its ``unit``.
    """

    label: str
    unit: str
    samples: Array
    excursion: Excursion | None


@dataclass(frozen=True, eq=False)
class LeftOut:
    """What of a signal was recorded and simulated but is not compared (M,); nan elsewhere."""

    measured: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class PlayedRecord:
    """What of a record drove a simulation, and how what it gave departs from the rest of it.

    ``begins`` is the end of its state of rest, s; ``left_out`` has the signals of which masks leave
    something out.
    """

    begins: float
    driving: Mapping[str, DrivingSignal]
    errors: Mapping[str, PlayedErrors]
    left_out: Mapping[str, LeftOut] = field(default_factory=dict)


def left_out_of(whole: Array, compared: Array, simulated: Array) -> LeftOut | None:
    """Collect the samples of a recorded signal (M,) that masks leave out, None for nothing.

    A sample of what is compared comes with it on each side, so that lines meet.
    """
    masked = np.isfinite(whole) & ~np.isfinite(compared)
    if not masked.any():
        return None
    wider = masked.copy()
    wider[:-1] |= masked[1:]
    wider[1:] |= masked[:-1]
    return LeftOut(np.where(masked, whole, nan), np.where(wider, simulated, nan))


def driving_signals(
    time: Array, begins: float, recorded: Mapping[str, Array]
) -> dict[str, DrivingSignal]:
    """Return the signals that drive a simulation as figures show them: of an angle its frequency.

    ``time`` (M,) is in s, the ``recorded`` signals (M,) are those of the plant; ``begins`` is the
    end of their rest, s.
    """
    signals = {}
    for signal, samples in recorded.items():
        label, unit, drawn = label_of(signal), unit_of_signal(signal), samples
        if signal == "angle":
            signal, label, unit = FREQUENCY, FROM_ANGLE, HERTZ
            drawn = np.gradient(np.unwrap(samples), time) / (2.0 * pi)
        signals[signal] = DrivingSignal(label, unit, drawn, excursion(time, begins, drawn))
    return signals


def excursion(time: Array, begins: float, samples: Array) -> Excursion | None:
    """Largest departure of a signal (M,) from its mean before ``begins`` (s); None of gaps."""
    rest = _mean_before(time, begins, samples)
    if not np.isfinite(samples).any():
        return None
    departure = samples - (samples[np.isfinite(samples)][0] if np.isnan(rest) else rest)
    k = int(np.nanargmax(np.abs(departure)))
    return Excursion(float(departure[k]), float(time[k]))


def played_errors(time: Array, begins: float, measured: Array, simulated: Array) -> PlayedErrors:
    """Compute the errors of simulated samples (M,); nan is left out of both."""
    error = simulated - measured
    compared = np.isfinite(error)
    if not compared.any():
        return PlayedErrors(nan, nan, nan, None, None)
    k = int(np.nanargmax(np.abs(error)))
    return PlayedErrors(
        largest=float(error[k]),
        largest_at=float(time[k]),
        at_rest=_mean_before(time, begins, error),
        measured=excursion(time, begins, np.where(compared, measured, nan)),
        simulated=excursion(time, begins, np.where(compared, simulated, nan)),
    )


def _mean_before(time: Array, begins: float, samples: Array) -> float:
    """Return the mean of a signal (M,) before an instant (s); nan where it has no sample there."""
    rest = samples[(time < begins) & np.isfinite(samples)]
    return float(np.mean(rest)) if len(rest) else nan
