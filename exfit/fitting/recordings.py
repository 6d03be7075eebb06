"""The records of a case: read, and checked against its tests."""

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.checks.record import BEFORE_RECORD
from exfit.case.schema import (
    BumpTest,
    ChannelSection,
    CurrentPhasor,
    PhasesSection,
    PhasorsSection,
    RecordFile,
    Recording,
    ReferenceFile,
    StatusSection,
    Time,
    TimeColumn,
    Unknown,
    VoltagePhasor,
    start_value,
)
from exfit.errors import CaseError, RecordError
from exfit.records.clock import Clock
from exfit.records.reading import ThreePhases, read_record
from exfit.records.record import Record
from exfit.records.units import base_of_own
from exfit.signals import OF_EVENT, SIGNALS
from exfit.util.sorting import median
from exfit.util.text import show

if TYPE_CHECKING:
    from exfit.records.phasors import Phasor, Phasors
    from exfit.records.status import Status

Array = NDArray[np.float64]

OTHER_CLOCK = 50.0  # between a record and a step: ms, or cycles of the mains, are taken for s
SLOW_SAMPLES = 0.5  # s apart: no recorder of a step is slower
TINY = 1e-9  # of an instant: a record ends later


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
        return measured(case, recording.test, section)
    signals = {
        signal: _with_start_of_scale(given.signals[signal], channel)
        for signal, channel in section.channels.items()
    }
    record = replace(given, signals=MappingProxyType(signals))
    _refuse_steps_outside(case, recording.test, record, given.source)
    return record


def _with_start_of_scale(samples: Array, channel: ChannelSection | PhasesSection) -> Array:
    """Return samples with the start of a scale and an offset that the fit finds."""
    if not isinstance(channel, ChannelSection):
        return samples
    scale = start_value(channel.scale) if isinstance(channel.scale, Unknown) else None
    offset = start_value(channel.offset) if isinstance(channel.offset, Unknown) else None
    return samples * (1.0 if scale is None else scale) + (offset or 0.0)


def measured(case: Case, test: BumpTest, file: RecordFile) -> Record:
    """Return the record of a test of a case, read from its file.

    Raises RecordError where it cannot be read, or where the steps of the test lie outside it.
    """
    f0 = case.plant.given.get("f0", 1.0)
    record = read_section(file, case.folder, case.kind.per_unit, f0)
    _refuse_steps_outside(case, test, record, record.source)
    return record


def read_section(file: RecordFile, folder: Path, per_unit: bool, f0: float = 1.0) -> Record:
    """Read the record of a section, its file relative to a folder.

    ``per_unit``: numbers that the section takes as they are must not be in another unit by the
    file. ``f0`` is the rated frequency, Hz. Raises RecordError where it cannot be read.
    """
    return read_record(
        folder / file.file,
        clock_of(file.time),
        {signal: source_of(channel, signal, f0) for signal, channel in file.channels.items()},
        file.window,
        file.gaps == "skip",
        file.sheet,
        file.resample,
        frozenset(
            signal
            for signal, channel in file.channels.items()
            if per_unit and standing_alone(channel)
        ),
        file.memory,
        phasors_of(file.phasors),
        status_of(file.status),
        file.repeats,
    )


def _refuse_steps_outside(case: Case, test: BumpTest, record: Record, path: Path) -> None:
    """Raise RecordError where a record does not hold the test that the case describes."""
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
            text = (
                f"holds {show(start)} ... {show(end)} s, but {case.path} has a step at {show(at)} s"
            )
            hint = f"; {BEFORE_RECORD}" if at < start else _clock_hint(at / max(end, at * TINY))
            raise RecordError(f"{path}: {text}{hint}")
    _refuse_other_clock(case, test, record, path)
    _refuse_short_tables(case, test, (float(start), float(end)), path)
    steady = test.steady
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


def _clock_hint(ratio: float) -> str:
    """Return a question where a step is that many times later than a record ends."""
    return "; is the time column in another unit?" if ratio > OTHER_CLOCK else ""


def _refuse_other_clock(case: Case, test: BumpTest, record: Record, path: Path) -> None:
    """Raise RecordError where the steps lie between the first samples, which are seconds apart."""
    step = float(median(np.diff(record.time)))
    if test.begin is not None or not test.instants or step < SLOW_SAMPLES:
        return
    last = test.instants[-1] - float(record.time[0])
    if last < step and len(record.time) * step > OTHER_CLOCK * last:
        raise RecordError(
            f"{path}: samples are {show(step)} s apart, but {case.path} has its last step "
            f"{show(last)} s after the first of them: is the time column in another unit?"
        )


def _refuse_short_tables(
    case: Case, test: BumpTest, covered: tuple[float, float], path: Path
) -> None:
    """Raise CaseError where a table does not cover a test from its start to its end (s)."""
    for signal, table in test.tables.items():
        first, last = table[0][0], table[-1][0]
        if not first <= covered[0] <= covered[1] <= last:
            rows, whole = (f"{show(a)} ... {show(b)} s" for a, b in ((first, last), covered))
            text = f"{rows} does not cover the test, {whole} of {path}: add a row"
            raise CaseError([f"{case.path}: test.{signal}.table: {text}"])


def clock_of(time: Time) -> Clock:
    """Return the place of the time in a file."""
    if isinstance(time, str):
        return Clock((time,))
    if isinstance(time, TimeColumn):
        return Clock((time.column,), time.unit)
    return Clock(time)


def phasors_of(section: PhasorsSection | None) -> "Phasors | None":
    """Return the phasors of a record, None without any."""
    if section is None:
        return None
    from exfit.records.phasors import Phasors

    current = None if section.current is None else _phasor(section.current)
    return Phasors(_phasor(section.voltage), current, section.kV, section.MVA)


def _phasor(section: VoltagePhasor | CurrentPhasor) -> "Phasor":
    from exfit.records.phasors import Phasor

    connection = section.connection if isinstance(section, VoltagePhasor) else None
    return Phasor(section.magnitude, section.angle, section.unit, section.angle_unit, connection)


def status_of(section: StatusSection | None) -> "Status | None":
    """Return the flags of a record, None without any."""
    if section is None:
        return None
    from exfit.records.status import Status

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


def source_of(
    channel: ChannelSection | PhasesSection, signal: str, f0: float
) -> Column | ThreePhases:
    """Return the place of a signal: a column, or three; ``f0`` is the rated frequency, Hz."""
    if isinstance(channel, ChannelSection):
        column = column_of(channel)
        if signal in OF_EVENT and channel.unit is not None:
            return column._replace(base=base_of_own(channel.unit, SIGNALS[signal].unit, f0))
        return column
    return ThreePhases(
        channel.phases,
        channel.kind,
        channel.unit,
        channel.base,
        channel.connection,
        channel.cycles,
    )
