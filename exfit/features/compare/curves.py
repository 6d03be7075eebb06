"""Responses as curves, whatever program they are from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.clock import Clock, check_finite, check_increasing
from exfit.records.formats import RecordTable, open_table
from exfit.records.formats.table import listed, refuse_uneven
from exfit.records.units import needs_base
from exfit.signals import COMPARED

Array = NDArray[np.float64]

SIMULATED, MEASURED = "_simulated", "_measured"  # behind a signal in the table of a fit
RECORD = "record"  # the name of the curve that was measured


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

    columns: Mapping[str, Sequence[str]] = {}
    time: Sequence[str] = ()


USUAL_COLUMNS = ColumnChoice()


def read_curve(name: str, source: Path, choice: ColumnChoice) -> Curve:
    """Return a curve of a run's folder, its result.json, or a file of another program.

    Raises RecordError where it cannot be used.
    """
    path = _table_of(source)
    table = open_table(path)
    header, clock = table.names, _clock(table, choice.time)
    ending = MEASURED if name == RECORD else SIMULATED
    chosen = {signal: _chosen(table, names) for signal, names in choice.columns.items()}
    places = {signal: column for signal, column in chosen.items() if column is not None}
    for signal in COMPARED:
        convention = [column for column in (signal, signal + ending) if column in header]
        if convention:
            places.setdefault(signal, convention[0])
    _refuse_other_units(table, places)
    columns = table.numbers(places.values(), frozenset(places.values()))
    time = table.instants(clock)
    refuse_uneven(path, {clock[0]: time} | columns)
    _check_clock(table, clock, time)
    last = np.append(np.diff(time) > 0.0, True)  # of instants that repeat, what holds from then on
    signals = {signal: columns[column][last] for signal, column in places.items()}
    return Curve(name, path, table.sha256, time[last], signals, header, int(np.sum(~last)))


def _refuse_other_units(table: RecordTable, places: Mapping[str, str]) -> None:
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


def _chosen(table: RecordTable, names: Sequence[str]) -> str | None:
    """Return which of the names is a column; raises RecordError where several are."""
    columns = [name for name in dict.fromkeys(names) if name in table.names]
    if len(columns) > 1:
        raise RecordError(f"{table.path}: has several of the columns given: {listed(columns)}")
    return columns[0] if columns else None


def _clock(table: RecordTable, names: Sequence[str]) -> tuple[str, ...]:
    """Return the columns with the time: the one that is named, else those that seem to hold it."""
    column = _chosen(table, names)
    if column is not None:
        return (column,)
    if not table.clock:
        raise RecordError(
            f"{table.path}: no column seems to be the time; --time names one: {listed(table.names)}"
        )
    return table.clock


def _check_clock(table: RecordTable, clock: Sequence[str], time: Array) -> None:
    """Raise a RecordError where time is not finite or goes back; an instant may repeat."""
    label = Clock(tuple(clock)).label
    check_finite(time, label, table.place)
    check_increasing(time, label, table.place, may_repeat=True)


def refuse_unknown(choice: ColumnChoice, curves: Sequence[Curve]) -> None:
    """Raise a RecordError for a column that is named and in no file."""
    headers = {name for curve in curves for name in curve.columns}
    wanted = [name for names in (*choice.columns.values(), choice.time) for name in names]
    for column in wanted:
        if column not in headers:
            held = "; ".join(f"{curve.path} has {listed(curve.columns)}" for curve in curves)
            raise RecordError(f"no file has a column {column!r}; {held}")
