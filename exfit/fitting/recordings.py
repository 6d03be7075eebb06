"""The records of a case: read, checked against its tests, and their levels at rest."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.checks.record import BEFORE_RECORD
from exfit.case.schema import (
    BumpTest,
    ChannelSection,
    PhasesSection,
    PhasorsSection,
    RecordFile,
    Recording,
    ReferenceFile,
    StatusSection,
    Time,
    TimeColumn,
    Unknown,
    start_value,
)
from exfit.errors import CaseError, RecordError
from exfit.plants import DRIVING_SCALE, VT0
from exfit.plants.parts import initial
from exfit.records.clock import Clock
from exfit.records.reading import ThreePhases, read_record
from exfit.records.record import Record
from exfit.records.units import base_of_own
from exfit.signals import OF_EVENT, SIGNALS
from exfit.util.arrays import Array, median_step
from exfit.util.text import show

if TYPE_CHECKING:
    from exfit.records.phasors import Phasors, Status


Span = tuple[float, float]

OTHER_CLOCK = 50.0  # between a record and a step: ms, or cycles of the mains, are taken for s
POSSIBLE_VOLTAGES = (0.1, 2.0)  # pu: voltages beyond are those of another unit or base
SLOW_SAMPLES = 0.5  # s apart: no recorder of a step is slower


class Column(NamedTuple):
    """The place of a signal in a file and how it becomes per unit."""

    column: str
    scale: float
    offset: float
    unit: str | None
    base: float | None


def record_of(case: Case, recording: Recording) -> Record:
    """Return the record of a recording: as it was given, else read from its file.

    Raises RecordError where it cannot be read, or where the steps of the test lie outside it.
    """
    given, section = case.given_records.get(recording.name), recording.record
    if given is None:
        f0 = case.plant.given.get("f0", 1.0)
        record = read_section(section, case.folder, case.kind.per_unit, f0)
    else:
        signals = {signal: given.signals[signal] for signal in section.channels}
        for signal, channel in section.channels.items():
            if isinstance(channel, ChannelSection):  # the start of what the fit finds
                column = column_of(channel)
                scale = column.scale if isinstance(channel.scale, Unknown) else 1.0
                offset = column.offset if isinstance(channel.offset, Unknown) else 0.0
                signals[signal] = signals[signal] * scale + offset
        record = replace(given, signals=MappingProxyType(signals))
    _refuse_other_test(case, recording.test, record)
    return record


def read_section(file: RecordFile, folder: Path, per_unit: bool, f0: float = 1.0) -> Record:
    """Read the record of a section, its file relative to a folder.

    ``per_unit``: numbers that the section takes as they are must not be in another unit by the
    file. ``f0`` is the rated frequency, Hz. Raises RecordError where it cannot be read.
    """
    alone = (name for name, each in file.channels.items() if per_unit and standing_alone(each))
    return read_record(
        folder / file.file,
        clock_of(file.time),
        {signal: _source_of(channel, signal, f0) for signal, channel in file.channels.items()},
        file.window,
        file.gaps == "skip",
        file.sheet,
        file.resample,
        frozenset(alone),
        file.memory,
        None if file.phasors is None else phasors_of(file.phasors),
        None if file.status is None else _status_of(file.status),
        file.repeats,
    )


def span_of(test: BumpTest, record: Record) -> Span:
    """Start of the simulation along a record, and end of the record, s."""
    begin = float(record.time[0]) if test.begin is None else test.begin
    return begin, float(record.time[-1])


def _refuse_other_test(case: Case, test: BumpTest, record: Record) -> None:
    """Raise RecordError, or CaseError of a table, where a record does not hold its test."""
    path, steady = record.source, test.steady
    start, end = record.time[0], record.time[-1]
    if test.begin is not None:
        if test.begin > start:
            raise RecordError(
                f"{path}: begins at {show(start)} s, before {case.path} begins to simulate it "
                f"at {show(test.begin)} s"
            )
        start = test.begin
    for at in test.instants:
        if not start <= at < end:
            hint = ""
            if at < start:
                hint = f"; {BEFORE_RECORD}"
            elif at > OTHER_CLOCK * max(end, 0.0):
                hint = "; is the time column in another unit?"
            raise RecordError(
                f"{path}: holds {show(start)} ... {show(end)} s, but {case.path} has a step at "
                f"{show(at)} s{hint}"
            )
    _refuse_other_clock(case, test, record)
    _refuse_short_tables(case, test, (float(start), float(end)), path)
    if steady is not None and steady > end:
        raise RecordError(
            f"{path}: ends at {show(end)} s, before test.steady_until = {show(steady)} s "
            f"of {case.path}"
        )
    if start_value(test.vt0) is None and steady is not None and not start < steady:
        what = "the first step" if test.steady_until is None else "test.steady_until"
        raise RecordError(
            f"{path}: begins at {show(start)} s, with {what}: nothing before it shows "
            f"vt0, and {case.path} does not give it"
        )


def _refuse_other_clock(case: Case, test: BumpTest, record: Record) -> None:
    """Raise RecordError where the steps lie between the first samples, which are seconds apart."""
    spacing = median_step(record.time)
    if test.begin is None and test.instants and spacing >= SLOW_SAMPLES:
        last = test.instants[-1] - float(record.time[0])
        if last < spacing and len(record.time) * spacing > OTHER_CLOCK * last:
            raise RecordError(
                f"{record.source}: samples are {show(spacing)} s apart, but the last step of "
                f"{case.path} is {show(last)} s after the first of them: is the time column in "
                "another unit?"
            )


def _refuse_short_tables(case: Case, test: BumpTest, covered: Span, path: Path) -> None:
    """Raise CaseError where a table does not cover a test from its start to its end (s)."""
    for signal, table in test.tables.items():
        first, last = table[0][0], table[-1][0]
        if not first <= covered[0] <= covered[1] <= last:
            rows, whole = (f"{show(a)} ... {show(b)} s" for a, b in ((first, last), covered))
            text = f"{rows} does not cover the test, {whole} of {path}: add a row"
            raise CaseError(f"{case.path}: test.{signal}.table: {text}")


# ---- sections as the reader takes them


def clock_of(time: Time) -> Clock:
    """Return the place of the time in a file."""
    if isinstance(time, TimeColumn):
        return Clock((time.column,), time.unit)
    return Clock((time,) if isinstance(time, str) else time)


def phasors_of(section: PhasorsSection) -> "Phasors":
    """Return the phasors of a record."""
    from exfit.records.phasors import Phasor, Phasors

    own, other = section.voltage, section.current
    voltage = Phasor(own.magnitude, own.angle, own.unit, own.angle_unit, own.connection)
    current = None
    if other is not None:
        current = Phasor(other.magnitude, other.angle, other.unit, other.angle_unit)
    return Phasors(voltage, current, section.kV, section.MVA)


def _status_of(section: StatusSection) -> "Status":
    from exfit.records.phasors import Status

    return Status(section.column, tuple(map(str, section.accept)))


def column_of(channel: ChannelSection) -> Column:
    """Return the column of a channel; where a fit finds scale or offset, with their starts."""
    scale, offset = start_value(channel.scale), start_value(channel.offset)
    return Column(
        channel.column, 1.0 if scale is None else scale, offset or 0.0, channel.unit, channel.base
    )


def standing_alone(channel: ChannelSection | PhasesSection | ReferenceFile) -> bool:
    """Test whether a case takes the numbers of a column for per unit."""
    if isinstance(channel, PhasesSection):
        return False
    return channel.unit is None and channel.base is None and channel.scale == 1.0


def _source_of(
    channel: ChannelSection | PhasesSection, signal: str, f0: float
) -> Column | ThreePhases:
    """Return the place of a signal: a column, or three; ``f0`` is the rated frequency, Hz."""
    if isinstance(channel, PhasesSection):
        connection = (channel.connection, channel.cycles)
        return ThreePhases(channel.phases, channel.kind, channel.unit, channel.base, *connection)
    column = column_of(channel)
    if signal in OF_EVENT and channel.unit is not None:
        return column._replace(base=base_of_own(channel.unit, SIGNALS[signal].unit, f0))
    return column


# ---- levels of a record at its start, where its signals are at rest


def levels_of(case: Case, test: BumpTest, record: Record) -> dict[str, float]:
    """Parameters that a record gives: the levels of its signals at the start."""
    kind = case.kind
    if "governor" in kind.needs:
        return {initial(signal): mean_at_rest(test, record, signal) for signal in kind.levels}
    vt0, (low, high) = initial_level(test, record, "vt"), POSSIBLE_VOLTAGES
    if kind.per_unit and (kind.has_machine or not kind.levels) and not low <= vt0 <= high:
        outside = f"{vt0:.4g} pu, outside {low:g} ... {high:g}"
        if isinstance(test.vt0, float):
            raise RecordError(f"{record.source}: vt0, which its test states, is {outside}")
        raise RecordError(
            f"{record.source}: vt rests at {outside}: its unit, base or scale is another"
        )
    levels = {initial("speed"): 1.0} if "speed" in kind.levels else {}
    for signal in kind.levels:
        if signal in record.signals:
            levels[initial(signal)] = mean_at_rest(test, record, signal)
    levels |= {VT0: vt0, **speed_at_start(test)}
    if kind.scaled:
        levels[DRIVING_SCALE] = 1.0
    given = {initial(name): v for name, v in case.plant.given.items() if name in kind.driving}
    return {**levels, **given}


def speed_at_start(test: BumpTest) -> dict[str, float]:
    """Return the parameter of the speed before a test, none where that is rated."""
    rated = test.speed is test.speed_change is None
    return {} if rated else {initial("speed"): start_value(test.speed) or 1.0}


def deviation(test: BumpTest, record: Record, signal: str) -> Array:
    """Deviation of a recorded signal (M,) from its start."""
    return record.signals[signal] - initial_level(test, record, signal)


def initial_level(test: BumpTest, record: Record, signal: str) -> float:
    """Return the level of a signal before the first step.

    It is the record's mean, of the voltage as the test gives it if it does.
    """
    vt0 = start_value(test.vt0) if signal == "vt" else None
    return mean_at_rest(test, record, signal) if vt0 is None else vt0


def mean_at_rest(test: BumpTest, record: Record, signal: str) -> float:
    """Return the mean of a recorded signal while the unit is still at rest.

    Raises RecordError where it has no sample there.
    """
    until = np.inf if test.steady is None else test.steady
    rest = record.signals[signal][record.time < until]
    rest = rest[np.isfinite(rest)]
    if not len(rest):
        raise RecordError(
            f"{record.source}: {signal}: no sample before {show(until)} s: its start is unknown"
        )
    return float(np.mean(rest))
