"""Read a record: the columns of a recorder's file become signals per unit."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

import numpy as np

from exfit.errors import RecordError
from exfit.records.clock import Clock, check_finite, check_increasing, check_steps, why_unusable
from exfit.records.formats import open_table
from exfit.records.formats.table import NONE, RecordTable, column_error, read_bytes, refuse_uneven
from exfit.records.record import FEWEST_SAMPLES, Record, read_only
from exfit.records.units import alike, needs_base, unit_of, usual
from exfit.signals import unit_of_signal
from exfit.util.arrays import Array, Places
from exfit.util.text import LARGEST, SMALLEST

if TYPE_CHECKING:
    from exfit.dsp.three_phase import Connection
    from exfit.records.phasors import Phasors, Status

Repeats = Literal["refuse", "first", "last"]

PERCENT = "%"
ANGLE = "angle"


class ChannelLike(Protocol):
    """The column of a signal in a file and its conversion to per unit."""

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
        """What 1 pu is in that unit; None: the numbers are not divided."""


class ThreePhases(NamedTuple):
    """The columns of the three phases of the terminal voltage, and their conversion to per unit.

    ``base`` is the rated line-to-line RMS voltage in ``unit``, ``cycles`` the window of waveforms.
    """

    columns: tuple[str, str, str]
    kind: Literal["waveform", "rms"]
    unit: str
    base: float
    connection: "Connection"
    cycles: int


def read_record(
    path: Path,
    clock: Clock,
    channels: Mapping[str, ChannelLike | ThreePhases],
    window: tuple[float, float] | None = None,
    missing: bool = False,
    sheet: str | None = None,
    rate: float | None = None,
    per_unit: frozenset[str] = NONE,
    memory: float | None = None,
    phasors: "Phasors | None" = None,
    status: "Status | None" = None,
    repeats: Repeats = "refuse",
) -> Record:
    """Return the record of a file: each signal is ``column / base * scale + offset``.

    Args:
        path: a recorder's file of any kind that ``open_table`` knows.
        clock: the columns of the time; timestamps become s since the first of them.
        channels: signal name -> column, its unit and base, scale and offset, or three phases. The
            base of a field current is that of the air-gap line: what gives 1 pu voltage without
            saturation.
        window: first and last instant kept, s, both included; what lies outside may hold gaps, and
            no waveform is looked at there.
        missing: whether a sample may be missing from a signal: an empty cell or nan becomes nan.
        sheet: of a workbook.
        rate: Hz, of a slower, even clock; None: the record's own.
        per_unit: signals whose columns are taken for per unit: the file must not say otherwise.
        memory: what reading may take, GB; None: 1, or four times the file's size up to 4.
        phasors: of a PMU, from which further columns are computed: phasors.vt and others.
        status: the flags of the rows; those of a row that is bad are missing samples.
        repeats: which of several rows with one time stamp counts. Rows that are alike are one.

    Raises:
        RecordError: a file that cannot be read or needs more memory, a column that is missing, in
            another unit or of another length than the time, a cell that is no finite number, time
            that goes back, or repeats with other numbers, fewer than two samples, a signal without
            any, waveforms that are none, a record that cannot be resampled, a row that its flags
            call bad where no sample may be missing, or an angle whose turns cannot be counted.
    """
    table = open_table(path, sheet, memory)
    _check_units(table, channels, per_unit)
    time = table.instants(clock.columns, clock.unit)
    check_finite(time, clock.label, table.place)
    check_increasing(time, clock.label, table.place, may_repeat=True)
    check_steps(time, clock.label, table.place)
    names = [name for channel in channels.values() for name in _column_names(channel)]
    gappy = frozenset(names) - {*clock.columns} if missing else NONE
    columns = _numbers(table, phasors, names, gappy)
    refuse_uneven(path, {clock.columns[0]: time} | columns)
    rows = _rows_in_window(path, time, window)
    rows, notes = _without_repeats(table, clock, time, columns, rows, repeats)
    if status is not None:
        from exfit.records.phasors import leave_out_bad

        leave_out_bad(table, status, columns, rows, missing)
    voltages = {
        name: _of_phases(table, time, columns, channel, rows)
        for name, channel in channels.items()
        if isinstance(channel, ThreePhases)
    }
    averaged = {name: window for name, (_, window) in voltages.items() if window is not None}
    for name in averaged:
        rows = rows[np.isfinite(voltages[name][0][rows])]
    signals = {
        name: voltages[name][0][rows]
        if isinstance(channel, ThreePhases)
        else _signal(table, channel, columns[channel.column], rows, missing)
        for name, channel in channels.items()
    }
    if ANGLE in signals:
        from exfit.records.phasors import smooth_angle

        column = _column_names(channels[ANGLE])[0]
        signals[ANGLE] = smooth_angle(table, column, signals[ANGLE], rows)
    time = time[rows]
    if rate is not None:
        time, signals = _resampled(path, time, signals, rate)
    return Record(
        read_only(time),
        MappingProxyType({name: read_only(signal) for name, signal in signals.items()}),
        path,
        table.sha256,
        averaged,
        notes,
    )


def _numbers(
    table: RecordTable, phasors: "Phasors | None", names: Sequence[str], gappy: frozenset[str]
) -> dict[str, Array]:
    if phasors is None:
        return table.numbers(dict.fromkeys(names), gappy)
    from exfit.records.phasors import numbers_with_phasors

    return numbers_with_phasors(table, phasors, dict.fromkeys(names), gappy)


def _resampled(
    path: Path, time: Array, signals: Mapping[str, Array], rate: float
) -> tuple[Array, dict[str, Array]]:
    from exfit.dsp.resampling import resampled

    try:
        return resampled(time, signals, rate)
    except ValueError as fault:
        raise RecordError(f"{path}: resample: {fault}") from None


def file_hash(path: Path) -> str:
    """Return the SHA-256 of a file's bytes; raises RecordError where it cannot be read."""
    return hashlib.sha256(read_bytes(path)).hexdigest()


def _column_names(channel: ChannelLike | ThreePhases) -> tuple[str, ...]:
    return channel.columns if isinstance(channel, ThreePhases) else (channel.column,)


def _check_units(
    table: RecordTable, channels: Mapping[str, ChannelLike | ThreePhases], per_unit: frozenset[str]
) -> None:
    """Raise a RecordError for a column that the file says to be in another unit."""
    for signal, channel in channels.items():
        for column in _column_names(channel):
            unit, own = table.units.get(column), unit_of_signal(signal)
            if unit is None:
                continue
            remedy = ""
            if channel.unit is not None and not alike(unit, channel.unit):
                remedy = f"not in {channel.unit}"
            elif signal in per_unit and needs_base(own) and not alike(unit, own):
                remedy = f"not in {own}: give {signal} unit: {unit}"
            elif signal in per_unit and not needs_base(own) and unit_of(unit) and needs_base(unit):
                scaling = (
                    f"scale: 0.01, or unit: {PERCENT!r} and base: 100"
                    if usual(unit) == PERCENT
                    else f"unit: {unit} and base: what 1 pu is in {unit}"
                )
                remedy = f"and not per unit: give {signal} {scaling}"
            if remedy:
                raise column_error(table.path, column, f"in {unit} as the file says, {remedy}")


def _rows_in_window(path: Path, time: Array, window: tuple[float, float] | None) -> Places:
    start, end = window or (time[0], time[-1])
    rows = np.flatnonzero((time >= start) & (time <= end))
    if rows.size < FEWEST_SAMPLES:
        place = f" in the window {start:g} ... {end:g} s" if window else ""
        raise RecordError(
            f"{path}: {rows.size} of {time.size} samples ({time[0]:g} ... {time[-1]:g} s)"
            f"{place}; at least {FEWEST_SAMPLES} are needed"
        )
    return rows


def _without_repeats(
    table: RecordTable,
    clock: Clock,
    time: Array,
    columns: Mapping[str, Array],
    rows: Places,
    repeats: Repeats,
) -> tuple[Places, tuple[str, ...]]:
    """Select the rows that have a time of their own each, and describe the others.

    Raises RecordError where all have one time, or rows of one differ and nothing says which counts.
    """
    again = rows[1:][np.diff(time[rows]) == 0.0]
    if not again.size:
        return rows, ()
    for name, column in columns.items():
        own, former = column[again], column[again - 1]
        differ = (own != former) & ~(np.isnan(own) & np.isnan(former))
        if repeats == "refuse" and differ.any():
            row = int(again[differ][0])
            raise RecordError(
                f"{table.place(row)}: {clock.label}: time {time[row]} s repeats, and {name!r} is "
                f"{column[row]:g} after {column[row - 1]:g}: which row is right? `repeats: first` "
                "or `repeats: last` beside the file of a record leaves out the other"
            )
    if len(rows) - len(again) < FEWEST_SAMPLES:
        raise RecordError(f"{table.path}: {clock.label}: all {len(rows)} samples have one time")
    left_out = again - 1 if repeats == "last" else again
    count = "1 row that repeats" if len(again) == 1 else f"{len(again)} rows that repeat"
    text = f"{count} the time of another, the first at {table.place(int(again[0]))}: left out"
    return rows[~np.isin(rows, left_out)], (text,)


def _of_phases(
    table: RecordTable,
    time: Array,
    columns: Mapping[str, Array],
    channel: ThreePhases,
    rows: Places,
) -> tuple[Array, float | None]:
    """Return the voltage (M,) per unit of three phases, nan but at the given rows.

    With it comes the window (s) of waveforms, over which it is averaged. Raises RecordError where
    the columns are not the three phases of one voltage.
    """
    from exfit.dsp.three_phase import LINE_VOLTAGE, mean_rms, positive_sequence

    phases = np.stack([columns[name][rows] for name in channel.columns], axis=1)
    huge = np.argwhere(np.isfinite(phases) & (np.abs(phases) > LARGEST))
    if huge.size:
        row, at = huge[0]
        what = f"{phases[row, at]} {why_unusable(phases[row, at])}"
        raise column_error(table.place(int(rows[row])), channel.columns[at], what)
    samples, per_unit = np.full(len(time), np.nan), LINE_VOLTAGE[channel.connection] / channel.base
    try:
        if channel.kind == "rms":
            samples[rows] = mean_rms(phases) * per_unit
            return samples, None
        phasor = positive_sequence(time[rows], phases, channel.cycles)
    except ValueError as fault:
        names = ", ".join(map(repr, channel.columns))
        raise RecordError(f"{table.path}: columns {names}: {fault}") from None
    samples[rows[phasor.rows]] = phasor.voltage * per_unit
    return samples, phasor.window


def _signal(
    table: RecordTable, channel: ChannelLike, column: Array, rows: Places, missing: bool
) -> Array:
    """Return a channel in per unit; raises RecordError where it is not finite, nor missing."""
    with np.errstate(over="ignore", invalid="ignore"):
        per_unit = column[rows] if channel.base is None else column[rows] / channel.base
        signal = per_unit * channel.scale + channel.offset
    gaps = np.isnan(column[rows]) & missing
    if gaps.all():
        raise RecordError(f"{table.path}: column {channel.column!r}: every sample is missing")
    lost = np.flatnonzero(~(np.abs(signal) <= LARGEST) & ~gaps)
    if lost.size:
        row = int(rows[lost[0]])
        scaled = "" if not np.isfinite(column[row]) else f" * {channel.scale:g}"
        what = f"{column[row]}{scaled} {why_unusable(signal[lost[0]])}"
        raise column_error(table.place(row), channel.column, what)
    peak = float(np.nanmax(np.abs(signal)))
    if 0.0 < peak < SMALLEST:
        what = f"at most {peak:g} pu throughout, below {SMALLEST:g}"
        raise column_error(table.path, channel.column, what)
    return np.asarray(signal, np.float64)
