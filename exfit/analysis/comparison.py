"""Two responses beside each other, whatever program they are from, and their differences."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import TAIL, Features, features
from exfit.dsp.step_detection import DetectedStep, find_step
from exfit.errors import RecordError
from exfit.records.clock import Clock, check_finite, check_increasing
from exfit.records.formats import Table, open_table
from exfit.records.formats.table import listed, refuse_uneven
from exfit.records.units import needs_base
from exfit.results.comparisons import judged_of
from exfit.signals import COMPARED

Array = NDArray[np.float64]

SIMULATED, MEASURED = "_simulated", "_measured"  # behind a signal in the table of a fit
FEWEST_IN_COMMON = 2  # instants
SAME_INSTANT = 1e-9  # s: whatever the digits of a file
STEPS_APART = 0.05  # s: steps found closer than this may differ by the shape of the rise alone


@dataclass(frozen=True, eq=False)
class Curve:
    """A response: signals (M,) per unit at ``time`` (M,) in s, which increases; ``name`` is A, B.

    A sample that is left out is nan. ``columns`` are all of the file.
    """

    name: str
    path: Path
    sha256: str
    time: Array
    signals: Mapping[str, Array]
    columns: tuple[str, ...]
    repeated: int = 0


class ColumnChoice(NamedTuple):
    """Which columns are read: of signals, by their names, and of the time; else by convention."""

    columns: Mapping[str, str]
    time: str | None = None


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


@dataclass(frozen=True, eq=False)
class Agreement:
    """Two responses, and a record where one is given, with all their differences.

    ``features`` are those of the judged signal after the step at ``step_at`` (s), by the name of
    the curve; there are none where no step is known.
    """

    curves: tuple[Curve, ...]
    differences: tuple[Difference, ...]
    shift: float
    step_at: float | None
    judged: str
    features: Mapping[str, Features]
    notes: tuple[str, ...]

    @property
    def between(self) -> tuple[Difference, ...]:
        """The differences of the two responses, without those from the record."""
        return tuple(
            difference
            for difference in self.differences
            if (difference.first, difference.second) == ("A", "B")
        )

    def as_json(self) -> dict[str, Any]:
        """Return the figures, without the samples."""
        return {
            "curves": {
                entry.name: {
                    "file": str(entry.path),
                    "sha256": entry.sha256,
                    "samples": len(entry.time),
                }
                for entry in self.curves
            },
            "shift": self.shift,
            "differences": [entry.as_json() for entry in self.differences],
            "step_at": self.step_at,
            "features": {
                "signal": self.judged,
                **{name: asdict(entry) for name, entry in self.features.items()},
            },
            "notes": list(self.notes),
        }


def compare(
    a: Path,
    b: Path,
    record: Path | None,
    choice: ColumnChoice,
    shift: float = 0.0,
    step_at: float | None = None,
) -> Agreement:
    """Return how two responses, and a record, differ.

    Each is the folder or the result.json of a run, or a file of any kind that records have. All
    signals that A and B share are compared over the time that they share, on the finer of their
    clocks; between the samples of the coarser one lies a cubic (Akima 1970). A record is never
    interpolated: what is simulated is read at its instants.

    Args:
        a, b, record: where the curves are.
        choice: the columns of signals and time, in the files that have them.
        shift: s, added to the time of ``b``.
        step_at: s, the instant of the step on the clock of ``a``; by default it is detected.

    Raises RecordError where a file cannot be used, or they have no signal or time in common.
    """
    curves = [_curve("A", a, choice, SIMULATED), _curve("B", b, choice, SIMULATED, shift)]
    if record is not None:
        curves.append(_curve("record", record, choice, MEASURED))
    _refuse_unknown(choice, curves)
    shared = _shared_signals(curves[0], curves[1])
    differences = [_difference(signal, curves[0], curves[1]) for signal in shared]
    for measured in curves[2:]:
        differences += _from_record(measured, curves[:2], shared)
    judged = judged_of(shared)
    steps = {curve.name: _step_of(curve, judged) for curve in curves if judged in curve.signals}
    step = steps.get("record") or steps.get("A") or steps.get("B")
    at = step_at if step_at is not None or step is None else step.at
    return Agreement(
        tuple(curves),
        tuple(differences),
        shift,
        at,
        judged,
        {} if at is None else dict(_features_of(curves, judged, at)),
        tuple(_notes(curves, steps, shift)),
    )


def _shared_signals(a: Curve, b: Curve) -> list[str]:
    """Return the signals that two curves share; raises RecordError where there is none."""
    shared = [signal for signal in a.signals if signal in b.signals]
    if not shared:
        raise RecordError(
            f"{a.path} and {b.path}: no signal in common: A has {_listed(a)}, B has {_listed(b)}; "
            "name columns with --columns vt=COLUMN"
        )
    return shared


def _from_record(record: Curve, curves: Sequence[Curve], shared: Sequence[str]) -> list[Difference]:
    """Return how curves differ from a record; raises RecordError where it has none of the signals.

    A record need not have all of them.
    """
    measured = [signal for signal in shared if signal in record.signals]
    if not measured:
        raise RecordError(
            f"{record.path}: none of the signals {', '.join(shared)}; it has {_listed(record)}; "
            "name columns with --columns vt=COLUMN"
        )
    return [_difference(signal, record, curve) for curve in curves for signal in measured]


def _curve(name: str, source: Path, choice: ColumnChoice, ending: str, shift: float = 0.0) -> Curve:
    """Return a curve of a run's folder, its result.json, or a file of another program."""
    path = _table_of(source)
    table = open_table(path)
    header, clock = table.names, _clock(table, choice.time)
    places = {signal: column for signal, column in choice.columns.items() if column in header}
    for signal in COMPARED:
        convention = [column for column in (signal, signal + ending) if column in header]
        if convention:
            places.setdefault(signal, convention[0])
    _refuse_other_units(table, places)
    columns = table.numbers(places.values(), frozenset(places.values()))
    time = table.instants(clock) + shift
    refuse_uneven(path, {clock[0]: time} | columns)
    _check_clock(table, clock, time)
    last = np.append(np.diff(time) > 0.0, True)  # of instants that repeat, what holds from then on
    signals = {signal: columns[column][last] for signal, column in places.items()}
    return Curve(name, path, table.sha256, time[last], signals, header, int(np.sum(~last)))


def _refuse_other_units(table: Table, places: Mapping[str, str]) -> None:
    """Raise a RecordError for a column that its file says is not per unit."""
    for signal, column in places.items():
        unit = table.units.get(column)
        if unit is not None and needs_base(unit):
            raise RecordError(
                f"{table.path}: column {column!r} is in {unit}, {signal} is compared in pu"
            )


def _table_of(source: Path) -> Path:
    """Return the table of a run, or the file itself; raises RecordError where there is none."""
    folder = source.parent if source.name == "result.json" else source
    if source.name != "result.json" and not source.is_dir():
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


def _clock(table: Table, name: str | None) -> tuple[str, ...]:
    """Return the columns with the time: the one that is named, else those that seem to hold it."""
    if name is not None and name in table.names:
        return (name,)
    if not table.clock:
        raise RecordError(
            f"{table.path}: no column seems to be the time; --time names one: {listed(table.names)}"
        )
    return table.clock


def _check_clock(table: Table, clock: Sequence[str], time: Array) -> None:
    """Raise a RecordError where time is not finite or goes back; an instant may repeat."""
    label = Clock(tuple(clock)).label
    check_finite(time, label, table.place)
    check_increasing(time, label, table.place, may_repeat=True)


def _refuse_unknown(choice: ColumnChoice, curves: Sequence[Curve]) -> None:
    """Raise a RecordError for a column that is named and in no file."""
    headers = {name for curve in curves for name in curve.columns}
    wanted = [*choice.columns.values(), *(() if choice.time is None else (choice.time,))]
    for column in wanted:
        if column not in headers:
            held = "; ".join(f"{curve.path} has {listed(curve.columns)}" for curve in curves)
            raise RecordError(f"no file has a column {column!r}; {held}")


def _listed(curve: Curve) -> str:
    return ", ".join(curve.signals) or f"none of {', '.join(COMPARED)}"


def _difference(signal: str, first: Curve, second: Curve) -> Difference:
    """Return the difference of a signal over the time that two curves share."""
    begin = max(first.time[0], second.time[0]) - SAME_INSTANT
    end = min(first.time[-1], second.time[-1]) + SAME_INSTANT
    inside = [curve.time[(curve.time >= begin) & (curve.time <= end)] for curve in (first, second)]
    finer = 0 if first.name == "record" or len(inside[0]) >= len(inside[1]) else 1
    time = inside[finer]
    if len(time) < FEWEST_IN_COMMON:
        spans = (
            f"{curve.path}: {curve.time[0]:g} ... {curve.time[-1]:g} s" for curve in (first, second)
        )
        raise RecordError(f"no time in common: {', '.join(spans)}; --shift moves the time of B")
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
    """Return how long each instant (M,) stands for: half the way to its neighbours, s."""
    steps = np.diff(time)
    return np.asarray(0.5 * (np.append(steps, 0.0) + np.append(0.0, steps)))


def _step_of(curve: Curve, signal: str) -> DetectedStep | None:
    kept = np.isfinite(curve.signals[signal])
    try:
        return find_step(curve.time[kept], curve.signals[signal][kept])
    except ValueError:
        return None


def _features_of(curves: Sequence[Curve], signal: str, at: float) -> Iterator[tuple[str, Features]]:
    """Yield the features of each curve, until the first of them ends."""
    until = min(float(curve.time[-1]) for curve in curves)
    for curve in curves:
        if signal in curve.signals:
            kept = np.isfinite(curve.signals[signal])
            of_curve = features(curve.time[kept], curve.signals[signal][kept], at, until)
            if of_curve is not None:
                yield curve.name, of_curve


def _notes(
    curves: Sequence[Curve], steps: Mapping[str, DetectedStep | None], shift: float
) -> Iterator[str]:
    for curve in curves:
        if curve.repeated:
            yield (f"{curve.path}: {curve.repeated} instants repeat: the last row of each is used")
    first, second = steps.get("A"), steps.get("B")
    if first is not None and second is not None and abs(first.at - second.at) > STEPS_APART:
        wanted = shift + first.at - second.at
        yield (
            f"the step of A is at {first.at:.3f} s, that of B at {second.at:.3f} s: "
            f"--shift {wanted:.3f} puts them together"
        )
