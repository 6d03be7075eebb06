"""Responses as curves, whatever program they are from, and their differences on one clock."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from exfit.dsp.features import TAIL
from exfit.errors import RecordError
from exfit.records.clock import Clock, check_finite, check_increasing
from exfit.records.formats import RecordTable, open_table
from exfit.records.formats.table import listed, refuse_uneven
from exfit.records.units import needs_base
from exfit.results.comparisons import Overlay
from exfit.signals import COMPARED
from exfit.util.arrays import Array
from exfit.util.file_names import WHOLE_FIT

SIMULATED, MEASURED = "_simulated", "_measured"  # behind a signal in the table of a fit
RECORD = "record"  # the name of the curve that was measured
FEWEST_IN_COMMON = 2  # samples
SAME_INSTANT = 1e-9  # s: whatever the digits of a file


@dataclass(frozen=True, eq=False)
class Curve:
    """A response: signals (M,) per unit at ``time`` (M,) in s, which increases; ``name`` is A, B.

    A sample that is left out is nan. ``columns`` are all of the file; ``shift`` (s) has been added
    to the time of the file.
    """

    name: str
    path: Path
    sha256: str
    time: Array
    signals: Mapping[str, Array]
    columns: tuple[str, ...]
    repeated: int = 0
    shift: float = 0.0

    @property
    def measured(self) -> bool:
        """Whether it is the record."""
        return self.name == RECORD

    def shifted(self, by: float) -> "Curve":
        """Return the curve with seconds added to its time."""
        return replace(self, time=self.time + by, shift=self.shift + by)


class ColumnChoice(NamedTuple):
    """Which columns are read, by signal, and for the time; else those of the usual names.

    Of several names for one of them, a file is read by the one that it has.
    """

    columns: Mapping[str, Sequence[str]]
    time: Sequence[str]


def read_curve(name: str, source: Path, choice: ColumnChoice) -> Curve:
    """Return a curve of a run's folder, its result.json, or a file of another program.

    Raises RecordError where it cannot be used.
    """
    path = _table_of(source)
    table = open_table(path)
    column = _chosen(table, choice.time)
    clock = table.clock if column is None else (column,)
    if not clock:
        raise RecordError(
            f"{path}: no column seems to be the time; --time names one: {listed(table.names)}"
        )
    places = _places(table, choice, MEASURED if name == RECORD else SIMULATED)
    columns = table.numbers(places.values(), frozenset(places.values()))
    time = table.instants(clock)
    refuse_uneven(path, {clock[0]: time} | columns)
    label = Clock(clock).label
    check_finite(time, label, table.place)
    check_increasing(time, label, table.place, may_repeat=True)
    last = np.append(np.diff(time) > 0.0, True)  # of times that repeat, what holds from then on
    for column, samples in columns.items():
        check_finite(np.nan_to_num(samples), column, table.place)
    signals = {signal: columns[column][last] for signal, column in places.items()}
    # an infinite sample is none, as in the counts of a comparison
    signals = {signal: np.where(np.isfinite(own), own, np.nan) for signal, own in signals.items()}
    return Curve(name, path, table.sha256, time[last], signals, table.names, int(np.sum(~last)))


def _places(table: RecordTable, choice: ColumnChoice, ending: str) -> dict[str, str]:
    """Return the column of each signal of a table: that chosen, or the usual one."""
    chosen = {signal: _chosen(table, names) for signal, names in choice.columns.items()}
    places = {signal: column for signal, column in chosen.items() if column is not None}
    for signal in COMPARED:
        usual = [column for column in (signal, signal + ending) if column in table.names]
        if usual:
            places.setdefault(signal, usual[0])
    for signal, column in places.items():
        unit = table.units.get(column)
        if unit is not None and needs_base(unit):
            where = f"{table.path}: column {column!r}"
            raise RecordError(f"{where} is in {unit}, {signal} is compared in pu")
    return places


def _table_of(source: Path) -> Path:
    """Return the table of a run, or the file itself; raises RecordError where there is none."""
    folder = source.parent if source.name == WHOLE_FIT else source
    if source.name != WHOLE_FIT and not source.is_dir():
        return source
    if (folder / "response.csv").is_file():
        return folder / "response.csv"
    others = [path.name for path in sorted(folder.glob("*.csv")) if _holds_response(path)]
    several = f"; name one of its files: {', '.join(others)}" if others else ""
    raise RecordError(f"{folder}: no response.csv in it{several}")


def _holds_response(path: Path) -> bool:
    try:
        return any(name.endswith(SIMULATED) for name in open_table(path).names)
    except RecordError:
        return False


def _chosen(table: RecordTable, names: Sequence[str]) -> str | None:
    """Return which of the names is a column; raises RecordError where several are."""
    columns = [name for name in dict.fromkeys(names) if name in table.names]
    if len(columns) > 1:
        raise RecordError(f"{table.path}: has several of the columns given: {listed(columns)}")
    return columns[0] if columns else None


def refuse_unknown(choice: ColumnChoice, curves: Sequence[Curve]) -> None:
    """Raise a RecordError for a column that is named and in no file."""
    headers = {name for curve in curves for name in curve.columns}
    wanted = [name for names in (*choice.columns.values(), choice.time) for name in names]
    for column in wanted:
        if column not in headers:
            held = "; ".join(f"{curve.path} has {listed(curve.columns)}" for curve in curves)
            raise RecordError(f"no file has a column {column!r}; {held}")


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
        """Number of times with samples of both."""
        return int(np.count_nonzero(np.isfinite(self.error)))

    @property
    def f(self) -> float:
        """Half the sum of its squares over these times, pu²: it grows with their number."""
        return 0.5 * float(np.nansum(self.error**2))

    @property
    def rmse(self) -> float:
        """Its root mean square over these times, per unit."""
        return Overlay(*self.values).rmse

    @property
    def fit_percent(self) -> float:
        """100 (1 - |difference| / |first - its mean|): 100 is perfect, 0 as bad as a constant."""
        return Overlay(*self.values).fit_percent

    @property
    def rms(self) -> float:
        """Its root mean square over time, per unit."""
        kept, steps = np.isfinite(self.error), np.diff(self.time)
        # each time stands for the way to its neighbours
        weights = np.append(steps, 0.0) + np.append(0.0, steps)
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
    at the samples of the record in that time. Not all curves need to have all of the signals.
    Raises RecordError where they share no time.
    """
    responses = [curve for curve in curves if not curve.measured]
    finest = max((_covered(curve.time, responses) for curve in responses), key=len)
    _refuse_apart(finest, responses)
    pairs = [(responses[0], second, finest) for second in responses[1:]]
    for record in curves[len(responses) :]:
        instants = _covered(record.time, curves)
        _refuse_apart(instants, curves)
        pairs += [(record, second, instants) for second in responses]
    found = []
    for first, second, time in pairs:
        for signal in signals:
            if signal not in first.signals or signal not in second.signals:
                continue
            read = [_at(time, curve.time, curve.signals[signal]) for curve in (first, second)]
            values = np.stack([samples for samples, _ in read])
            if not np.isfinite(values).all(axis=0).any():
                both = f"{first.path} and {second.path}"
                raise RecordError(f"{both}: {signal}: no time has samples of both")
            bend = max(bend for _, bend in read)
            found.append(Difference(signal, first.name, second.name, time, values, bend))
    return found


def _covered(time: Array, curves: Sequence[Curve]) -> Array:
    begin = max(float(curve.time[0]) for curve in curves) - SAME_INSTANT
    end = min(float(curve.time[-1]) for curve in curves) + SAME_INSTANT
    return np.asarray(time[(time >= begin) & (time <= end)])


def _refuse_apart(time: Array, curves: Sequence[Curve]) -> None:
    if len(time) < FEWEST_IN_COMMON:
        spans = (f"{curve.path}: {curve.time[0]:g} ... {curve.time[-1]:g} s" for curve in curves)
        raise RecordError(
            f"no time in common: {', '.join(spans)}; --align makes the steps coincide, "
            "--shift B=SECONDS shifts one of them"
        )


def _at(time: Array, clock: Array, samples: Array) -> tuple[Array, float]:
    """Return samples read at other times, and the difference of cubic and straight lines.

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
