"""Records: signals measured on one clock, read from a recorder's file and made per unit."""

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Literal, NamedTuple, NoReturn, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.dsp.resampling import resampled
from exfit.dsp.three_phase import Connection, PhasorCourse, vt_of_rms, vt_of_waveforms
from exfit.errors import RecordError
from exfit.records.formats import open_table
from exfit.records.formats.table import NONE, Table, column_error, read_bytes, refuse_uneven
from exfit.records.units import alike, needs_base, unit_of, usual

Array = NDArray[np.float64]

FEWEST_SAMPLES = 2
PERCENT = "%"


class Clock(NamedTuple):
    """The column with the time, or those of date and time of day; the unit where it is numbers."""

    columns: tuple[str, ...]
    unit: str | None = None

    @property
    def label(self) -> str:
        """The columns as messages name them."""
        kind = "column" if len(self.columns) == 1 else "columns"
        return f"{kind} {' and '.join(map(repr, self.columns))}"


class ChannelLike(Protocol):
    """Where a signal stands in a file and how it becomes per unit."""

    @property
    def column(self) -> str:
        """Name of the column."""

    @property
    def scale(self) -> float:
        """Factor on the column's numbers."""

    @property
    def offset(self) -> float:
        """What is added after scaling."""

    @property
    def unit(self) -> str | None:
        """Unit of the column's numbers, where it is known."""

    @property
    def base(self) -> float | None:
        """What 1 pu is in that unit; None: the numbers are taken as they stand."""


class ThreePhases(NamedTuple):
    """Where the three phases of the terminal voltage stand, and how they become one, per unit.

    ``base`` is the rated line-to-line RMS voltage in ``unit``, ``cycles`` the window of waveforms.
    """

    columns: tuple[str, str, str]
    kind: Literal["waveform", "rms"]
    unit: str
    base: float
    connection: Connection
    cycles: int


@dataclass(frozen=True, eq=False)
class Record:
    """Signals in per unit, each (M,) like ``time`` in s, which increases; arrays are read-only.

    A sample that is missing is nan, in a signal and only where ``read_record`` was told so. What
    was taken from waveforms is ``averaged`` over a window (s) about each instant, by signal.
    """

    time: Array
    signals: Mapping[str, Array]
    source: Path
    sha256: str
    averaged: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def from_arrays(
        cls,
        time: ArrayLike,
        signals: Mapping[str, ArrayLike],
        source: str | Path = "arrays",
        missing: bool = False,
    ) -> Self:
        """Return the record of signals that are arrays already; it keeps copies of them.

        Args:
            time: (M,), s, increasing.
            signals: signal name -> samples (M,), per unit.
            source: what messages and results name in place of a file.
            missing: whether a sample may be missing from a signal: nan.

        Raises:
            RecordError: fewer than two samples, no signal or one without any sample, arrays that
                are not one-dimensional, real and equally long, a value that is no finite number,
                or time that does not increase.
        """
        source = Path(source)
        if not signals:
            raise RecordError(f"{source}: no signals")
        if "time" in signals:
            raise RecordError(f"{source}: a signal cannot be named time")
        instants = _real_array(source, "time", time)
        samples = {name: _real_array(source, name, signal) for name, signal in signals.items()}
        if len(instants) < FEWEST_SAMPLES:
            raise RecordError(
                f"{source}: {len(instants)} samples; at least {FEWEST_SAMPLES} are needed"
            )
        for name, values in {"time": instants, **samples}.items():
            _check_samples(source, name, values, len(instants), missing and name in samples)
        check_increasing(instants, "time", lambda row: f"{source}: sample {row}")
        return cls(instants, MappingProxyType(samples), source, _content_hash(instants, samples))


def read_record(
    path: Path,
    clock: Clock,
    channels: Mapping[str, ChannelLike | ThreePhases],
    window: tuple[float, float] | None = None,
    missing: bool = False,
    sheet: str | None = None,
    rate: float | None = None,
    per_unit: frozenset[str] = NONE,
) -> Record:
    """Return the record of a file: each signal is ``column / base * scale + offset``.

    Args:
        path: a recorder's file of any kind that ``open_table`` knows.
        clock: where the time stands; timestamps become s since the first of them.
        channels: signal name -> column, its unit and base, scale and offset, or three phases. The
            base of a field current is that of the air-gap line: what gives 1 pu voltage without
            saturation.
        window: first and last instant kept, s, both included; what lies outside may hold gaps, and
            no waveform is looked at there.
        missing: whether a sample may be missing from a signal: an empty cell or nan becomes nan.
        sheet: of a workbook.
        rate: Hz, of a slower, even clock; None: the record's own.
        per_unit: signals whose columns are taken for per unit: the file must not say otherwise.

    Raises:
        RecordError: a file that cannot be read, a column that is missing, in another unit or of
            another length than the time, a cell that is no finite number, time that does not
            increase, fewer than two samples, a signal without any, waveforms that are none, or a
            record that cannot be resampled.
    """
    table = open_table(path, sheet)
    _check_units(table, channels, per_unit)
    time = table.instants(clock.columns, clock.unit)
    check_finite(time, clock.label, table.place)
    check_increasing(time, clock.label, table.place)
    names = [name for channel in channels.values() for name in _columns(channel)]
    gappy = frozenset(names) - {*clock.columns} if missing else NONE
    columns = table.numbers(dict.fromkeys(names), gappy)
    refuse_uneven(path, {clock.columns[0]: time} | columns)
    kept = _kept(path, time, window)
    courses = {
        name: _of_phases(path, time, columns, channel, kept)
        for name, channel in channels.items()
        if isinstance(channel, ThreePhases)
    }
    for voltage, course in courses.values():
        if course is not None:
            kept = kept[np.isfinite(voltage[kept])]
    signals = {
        name: _frozen(courses[name][0][kept])
        if isinstance(channel, ThreePhases)
        else _signal(table, channel, columns[channel.column], kept, missing)
        for name, channel in channels.items()
    }
    averaged = {name: one.window for name, (_, one) in courses.items() if one is not None}
    time = time[kept]
    if rate is not None:
        try:
            time, signals = resampled(time, signals, rate)
        except ValueError as fault:
            raise RecordError(f"{path}: resample: {fault}") from None
    frozen = {name: _frozen(signal) for name, signal in signals.items()}
    return Record(_frozen(time), MappingProxyType(frozen), path, table.sha256, averaged)


def _columns(channel: ChannelLike | ThreePhases) -> tuple[str, ...]:
    """Return the columns that a channel is read from."""
    return channel.columns if isinstance(channel, ThreePhases) else (channel.column,)


def _of_phases(
    path: Path,
    time: Array,
    columns: Mapping[str, Array],
    channel: ThreePhases,
    inside: NDArray[np.intp],
) -> tuple[Array, PhasorCourse | None]:
    """Return the voltage (M,) of three phases per unit, and what was found of their waveforms.

    It is told from the samples ``inside`` the window, and nan at the others. Raises RecordError
    where the columns are not the three phases of one voltage.
    """
    phases = np.stack([columns[name][inside] for name in channel.columns], axis=1)
    voltage, of = np.full(len(time), np.nan), (channel.base, channel.connection)
    try:
        if channel.kind == "rms":
            voltage[inside] = vt_of_rms(phases, *of)
            return voltage, None
        course = vt_of_waveforms(time[inside], phases, *of, channel.cycles)
    except ValueError as fault:
        named = ", ".join(map(repr, channel.columns))
        raise RecordError(f"{path}: columns {named}: {fault}") from None
    voltage[inside[course.kept]] = course.voltage
    return voltage, course


def read_columns(path: Path, names: Iterable[str]) -> dict[str, Array]:
    """Return columns of a file by name, as they stand; raises RecordError like read_record."""
    columns = open_table(path).numbers(names)
    return {name: _frozen(column) for name, column in columns.items()}


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes; raises RecordError where it cannot be read."""
    return hashlib.sha256(read_bytes(path)).hexdigest()


def _check_units(
    table: Table, channels: Mapping[str, ChannelLike | ThreePhases], per_unit: frozenset[str]
) -> None:
    """Raise a RecordError for a column that the file says to be in another unit."""
    for signal, channel in channels.items():
        for column in _columns(channel):
            said = table.units.get(column)
            if said is None:
                continue
            if channel.unit is not None and not alike(said, channel.unit):
                what = f"in {said} as the file says, not in {channel.unit}"
                raise column_error(table.path, column, what)
            if signal in per_unit and unit_of(said) and needs_base(said):
                what = f"in {said} as the file says, and not per unit: give {signal} {_how(said)}"
                raise column_error(table.path, column, what)


def _how(unit: str) -> str:
    """Return what makes numbers of a unit per unit, as a case has it."""
    if usual(unit) == PERCENT:
        return f"scale: 0.01, or unit: {PERCENT!r} and base: 100"
    return f"unit: {unit} and base: what 1 pu is in {unit}"


def check_finite(time: Array, label: str, place: Callable[[int], str]) -> None:
    """Raise a RecordError where time is not finite; ``place`` names a sample, counted from 0."""
    lost = np.flatnonzero(~np.isfinite(time))
    if lost.size:
        raise RecordError(f"{place(int(lost[0]))}: {label}: {time[lost[0]]} is not a finite number")


def check_increasing(time: Array, label: str, place: Callable[[int], str]) -> None:
    """Raise a RecordError where time does not increase; ``place`` names a sample, from 0."""
    back = np.flatnonzero(time[1:] <= time[:-1])
    if back.size:
        before, now = time[back[0]], time[back[0] + 1]
        kind = "repeats" if now == before else "goes back behind"
        what = f"{label}: time {now} s {kind} the {before} s before it"
        raise RecordError(f"{place(int(back[0]) + 1)}: {what}")


def _real_array(source: Path, name: str, values: ArrayLike) -> Array:
    """Return a read-only copy (M,) of real numbers; raises RecordError for anything else."""
    given = np.asarray(values)
    if given.ndim != 1:
        raise RecordError(f"{source}: {name}: {given.ndim} dimensions in place of 1")
    if not np.can_cast(given.dtype, np.float64, "same_kind"):
        raise RecordError(f"{source}: {name}: {given.dtype} in place of real numbers")
    copy = np.array(given, np.float64)
    copy.flags.writeable = False
    return copy


def _check_samples(source: Path, name: str, values: Array, count: int, missing: bool) -> None:
    """Raise a RecordError where an array is of another length than the time or not finite."""
    if len(values) != count:
        raise RecordError(f"{source}: {name}: {len(values)} samples, but time has {count}")
    gaps = np.isnan(values) & missing
    if gaps.all():
        raise RecordError(f"{source}: {name}: every sample is missing")
    lost = np.flatnonzero(~np.isfinite(values) & ~gaps)
    if lost.size:
        row = lost[0]
        raise RecordError(f"{source}: sample {row}: {name}: {values[row]} is not a finite number")


def _content_hash(time: Array, signals: Mapping[str, Array]) -> str:
    """Return the SHA-256 of a record without a file, whatever the order of its signals."""
    digest = hashlib.sha256(time.astype("<f8").tobytes())
    for name in sorted(signals):
        digest.update(b"\0" + name.encode() + b"\0" + signals[name].astype("<f8").tobytes())
    return digest.hexdigest()


def _kept(path: Path, time: Array, window: tuple[float, float] | None) -> NDArray[np.intp]:
    """Return the positions of the samples in the window."""
    start, end = window or (time[0], time[-1])
    kept = np.flatnonzero((time >= start) & (time <= end))
    if kept.size < FEWEST_SAMPLES:
        place = f" in the window {start:g} ... {end:g} s" if window else ""
        raise RecordError(
            f"{path}: {kept.size} of {time.size} samples ({time[0]:g} ... {time[-1]:g} s)"
            f"{place}; at least {FEWEST_SAMPLES} are needed"
        )
    return kept


def _signal(
    table: Table, channel: ChannelLike, column: Array, kept: NDArray[np.intp], missing: bool
) -> Array:
    """Return a channel in per unit; raises RecordError where it is not finite, nor missing."""
    with np.errstate(over="ignore", invalid="ignore"):
        own = column[kept] if channel.base is None else column[kept] / channel.base
        signal = own * channel.scale + channel.offset
    gaps = np.isnan(column[kept]) & missing
    if gaps.all():
        raise RecordError(f"{table.path}: column {channel.column!r}: every sample is missing")
    lost = np.flatnonzero(~np.isfinite(signal) & ~gaps)
    if lost.size:
        row = int(kept[lost[0]])
        scaled = "" if not np.isfinite(column[row]) else f" * {channel.scale:g}"
        _refuse(
            table, row, f"column {channel.column!r}: {column[row]}{scaled} is not a finite number"
        )
    return _frozen(signal)


def _refuse(table: Table, row: int, what: str) -> NoReturn:
    """Raise a RecordError for a row, counted from 0."""
    raise RecordError(f"{table.place(row)}: {what}")


def _frozen(values: Array) -> Array:
    values = np.ascontiguousarray(values)
    values.flags.writeable = False
    return values
