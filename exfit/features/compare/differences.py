"""The differences of responses on one clock."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import TAIL
from exfit.errors import RecordError
from exfit.features.compare.curves import Curve
from exfit.results.comparisons import Overlay

Array = NDArray[np.float64]

FEWEST_IN_COMMON = 2  # instants
SAME_INSTANT = 1e-9  # s: whatever the digits of a file


@dataclass(frozen=True, eq=False)
class Difference:
    """What a signal of ``second`` is above that of ``first``, (M,) per unit at ``time`` (M,) in s.

    ``values`` are the two signals (2, M); ``interpolation`` is by how much, at most, a cubic and
    a straight line between the samples of the coarser clock differ: 0 on a common one.
    """

    signal: str
    first: str
    second: str
    time: Array
    values: Array
    interpolation: float

    @property
    def error(self) -> Array:
        """The difference itself."""
        return np.asarray(self.values[1] - self.values[0])

    @property
    def count(self) -> int:
        """How many instants have samples of both."""
        return int(np.count_nonzero(np.isfinite(self.error)))

    @property
    def f(self) -> float:
        """Half the sum of its squares over these instants, pu²: it grows with their number."""
        return 0.5 * float(np.nansum(self.error**2))

    @property
    def rmse(self) -> float:
        """Its root mean square over these instants, per unit."""
        return self._match.rmse

    @property
    def fit_percent(self) -> float:
        """100 (1 - |difference| / |first - its mean|): 100 is perfect, 0 as bad as a constant."""
        return self._match.fit_percent

    @property
    def _match(self) -> Overlay:
        return Overlay(self.values[0], self.values[1])

    @property
    def rms(self) -> float:
        """Its root mean square over time, per unit."""
        kept, weights = np.isfinite(self.error), _durations(self.time)
        mean = np.average(self.error[kept] ** 2, weights=weights[kept])
        return float(np.sqrt(mean))

    @property
    def largest(self) -> tuple[float, float]:
        """Its value where it is largest, with its sign, and when, s."""
        k = int(np.nanargmax(np.abs(self.error)))
        return float(self.error[k]), float(self.time[k])

    @property
    def finals(self) -> tuple[float, float]:
        """The final values of both: means over the last twentieth of the time that both show."""
        kept = np.isfinite(self.error)
        time = self.time[kept]
        tail = time >= time[-1] - TAIL * (time[-1] - time[0])
        means = np.mean(self.values[:, kept][:, tail], axis=1)
        return float(means[0]), float(means[1])

    def as_json(self) -> dict[str, Any]:
        """Return the figures, without the samples."""
        value, at = self.largest
        first, second = self.finals
        return {
            "signal": self.signal,
            "difference": f"{self.second} - {self.first}",
            "f": self.f,
            "rmse": self.rmse,
            "fit_percent": self.fit_percent,
            "samples": self.count,
            "rms": self.rms,
            "largest": value,
            "largest_at": at,
            f"final_{self.first}": first,
            f"final_{self.second}": second,
            "interpolation": self.interpolation,
            "from": float(self.time[0]),
            "until": float(self.time[-1]),
            "instants": len(self.time),
        }


def differences(curves: Sequence[Curve], signals: Sequence[str]) -> list[Difference]:
    """Subtract the first from the other responses, then the record where there is one.

    The first are on the finest of their clocks over the time that all responses cover, the others
    at the instants of the record in that time. Not all curves need to have all of the signals.
    Raises RecordError where they share no time.
    """
    responses = [curve for curve in curves if not curve.measured]
    time = max((_covered(curve.time, responses) for curve in responses), key=len)
    _refuse_apart(time, responses)
    from_reference = [*_from(responses[0], responses[1:], signals, time)]
    for record in curves[len(responses) :]:
        instants = _covered(record.time, curves)
        _refuse_apart(instants, curves)
        from_reference += _from(record, responses, signals, instants)
    return from_reference


def _covered(time: Array, curves: Sequence[Curve]) -> Array:
    """Return those of the instants (M,) that all curves cover."""
    begin = max(float(curve.time[0]) for curve in curves) - SAME_INSTANT
    end = min(float(curve.time[-1]) for curve in curves) + SAME_INSTANT
    return np.asarray(time[(time >= begin) & (time <= end)])


def _refuse_apart(time: Array, curves: Sequence[Curve]) -> None:
    """Raise RecordError where curves have no time in common, or hardly any."""
    if len(time) < FEWEST_IN_COMMON:
        spans = (f"{curve.path}: {curve.time[0]:g} ... {curve.time[-1]:g} s" for curve in curves)
        raise RecordError(
            f"no time in common: {', '.join(spans)}; --align puts the steps together, "
            "--shift B=SECONDS moves the time of one"
        )


def _from(
    first: Curve, others: Sequence[Curve], signals: Sequence[str], time: Array
) -> Iterator[Difference]:
    """Yield the differences of others from the first at some instants."""
    for second in others:
        for signal in signals:
            if signal in first.signals and signal in second.signals:
                yield _difference(signal, first, second, time)


def _difference(signal: str, first: Curve, second: Curve, time: Array) -> Difference:
    """Return the difference of a signal at some instants."""
    read = [_at(time, curve.time, curve.signals[signal]) for curve in (first, second)]
    values = np.stack([samples for samples, _ in read])
    if not np.isfinite(values).all(axis=0).any():
        both = f"{first.path} and {second.path}"
        raise RecordError(f"{both}: {signal}: no instant has samples of both")
    return Difference(signal, first.name, second.name, time, values, max(bend for _, bend in read))


def _at(time: Array, clock: Array, samples: Array) -> tuple[Array, float]:
    """Return samples read at other instants, and by how much cubic and straight lines differ.

    Nothing is read across a sample that is left out.
    """
    nearest = np.clip(np.searchsorted(clock, time - SAME_INSTANT), 0, len(clock) - 1)
    exact = np.abs(clock[nearest] - time) <= SAME_INSTANT
    read = np.where(exact, samples[nearest], np.nan)
    if exact.all():
        return read, 0.0
    from scipy.interpolate import Akima1DInterpolator

    straight = np.interp(time, clock, samples)
    kept = np.isfinite(samples)
    if np.count_nonzero(kept) <= FEWEST_IN_COMMON:
        return np.where(exact, read, straight), 0.0
    cubic = Akima1DInterpolator(clock[kept], samples[kept], method="makima")(
        np.clip(time, clock[kept][0], clock[kept][-1])
    )
    between = ~exact & np.isfinite(straight)
    read = np.where(between, cubic, read)
    return read, float(np.max(np.abs(cubic - straight)[between], initial=0.0))


def _durations(time: Array) -> Array:
    """Weigh each instant (M,) by the time it stands for: half the way to its neighbours, s."""
    steps = np.diff(time)
    return np.asarray(0.5 * (np.append(steps, 0.0) + np.append(0.0, steps)))
