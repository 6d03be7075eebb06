"""The reference of a test where it was recorded: what drives the simulation, and its jumps."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import (
    MOST_ROWS,
    BumpTest,
    Filter,
    FindableStep,
    RecordFile,
    Recording,
    ReferenceFile,
    ReferenceTable,
    Unknown,
    start_value,
)
from exfit.dsp.jumps import LONGEST_JUMP, jumps, rest_end, settled
from exfit.errors import RecordError
from exfit.fitting.channels import filtering_of, without_masked
from exfit.fitting.recordings import Column, clock_of, record_of, standing_alone
from exfit.plants import REFERENCES
from exfit.records.reading import read_record
from exfit.records.record import Record
from exfit.simulation.inputs import RecordedInput
from exfit.util.sorting import median
from exfit.util.text import show

Array = NDArray[np.float64]
Span = tuple[float, float]

INVISIBLE = 1e-9  # pu: no recorder shows it


@dataclass(frozen=True, eq=False)
class References:
    """A test with its recorded signals, ready to be simulated.

    ``test`` has their jumps as steps whose instants are to be found, and the end of their steady
    part; ``recorded`` what is left of them beside the jumps. ``files`` are those they were read
    from where these are not the record, by signal.
    """

    test: BumpTest
    recorded: Mapping[str, RecordedInput]
    files: Mapping[str, Record]


@dataclass(frozen=True, eq=False)
class _Sampled:
    """A recorded signal (M,) of a test, and where messages find it."""

    source: str
    time: Array
    samples: Array
    filter: Filter | None

    def moves_from(self) -> float:
        """Find the end of its rest, s; raises RecordError where it never moves."""
        try:
            return float(self.time[rest_end(self.samples)])
        except ValueError as fault:
            raise RecordError(f"{self.source}: {fault}") from None

    def split(self, steady: float) -> tuple[tuple[FindableStep, ...], RecordedInput | None]:
        """Split it into its jumps, each between two samples, and how it deviates beside them.

        Both count from its mean until ``steady`` (s). It deviates by None where it only jumps.
        """
        first = int(np.searchsorted(self.time, steady))
        if first == 0:
            raise RecordError(f"{self.source}: no sample before {show(steady)} s: no level")
        jumping = jumps(self.time, self.samples)
        samples = settled(self.samples, first, jumping)
        changes = np.diff(samples)[jumping]
        steps = tuple(
            FindableStep(at=Unknown(start=0.5 * (start + end), min=start, max=end), step=change)
            for start, end, change in zip(
                self.time[jumping].tolist(),
                self.time[jumping + 1].tolist(),
                changes.tolist(),
                strict=True,
            )
        )
        jumped = np.zeros(len(samples))
        jumped[jumping + 1] = changes
        beside = samples - samples[0] - np.cumsum(jumped)
        if np.max(np.abs(beside)) < INVISIBLE:
            return steps, None
        filtering = filtering_of(self.source, self.time, self.filter)
        return steps, RecordedInput(
            self.time, beside if filtering is None else filtering.apply(beside)
        )


def references_of(
    case: Case,
    test: BumpTest,
    span: Span,
    record: Record | None = None,
    file: RecordFile | None = None,
) -> References:
    """Return a test as it is simulated through a span (s), with what is recorded of its reference.

    Raises RecordError where a recorded reference cannot be read, shows no move or does not cover
    the test.
    """
    files = {
        signal: _read(case, signal, given, span)
        for signal in REFERENCES
        if isinstance(given := test.reference(signal), ReferenceFile)
    }
    tables = {
        signal: ReferenceTable(table=_rows(record, signal))
        for signal, record in files.items()
        if is_table(record)
    }
    test = test.model_copy(update=tables)
    sampled = dict(_sampled(test, files, record, file))
    if not sampled:
        return References(test, {}, files)
    steady = _steady_until(test, file, sampled)
    parts = {signal: reference.split(steady) for signal, reference in sampled.items()}
    steps = {signal: jumping for signal, (jumping, _) in parts.items()}
    return References(
        test.model_copy(update={**steps, "steady_until": steady}),
        {signal: beside for signal, (_, beside) in parts.items() if beside is not None},
        files,
    )


def is_table(record: Record) -> bool:
    """Test whether a file is a table of few rows and not the samples of a recorder."""
    spacing = float(median(np.diff(record.time)))
    return spacing > LONGEST_JUMP and len(record.time) <= MOST_ROWS


def _rows(record: Record, signal: str) -> tuple[tuple[float, float], ...]:
    pairs = zip(record.time.tolist(), record.signals[signal].tolist(), strict=True)
    return tuple((time, value) for time, value in pairs)


def span_of(test: BumpTest, record: Record) -> Span:
    """Start of the simulation along a record, and end of the record, s."""
    begin = float(record.time[0]) if test.begin is None else test.begin
    return begin, float(record.time[-1])


def with_recorded_steps(case: Case, recording: Recording) -> Recording:
    """Return a recording whose test has the steps that a recorded reference shows."""
    test, file = recording.test, recording.record
    recorded = [signal for signal in REFERENCES if test.reference(signal) == "recorded"]
    if not recorded and not test.files:
        return recording
    record = without_masked(record_of(case, recording), file.mask, recorded)
    references = references_of(case, test, span_of(test, record), record, file)
    return recording.model_copy(update={"test": references.test})


def _sampled(
    test: BumpTest, files: Mapping[str, Record], record: Record | None, file: RecordFile | None
) -> Iterator[tuple[str, _Sampled]]:
    """Yield the signals of a test that were recorded."""
    for signal in REFERENCES:
        given = test.reference(signal)
        if isinstance(given, ReferenceFile):
            own = files[signal]
            place = f"{own.source}: {given.column}"
            yield signal, _Sampled(place, own.time, own.signals[signal], given.filter)
        elif given == "recorded" and record is not None and file is not None:
            place, section = f"{record.source}: {signal}", file.channels[signal]
            yield signal, _Sampled(place, record.time, record.signals[signal], section.filter)


def _steady_until(
    test: BumpTest, file: RecordFile | None, sampled: Mapping[str, _Sampled]
) -> float:
    """End of the rest of all that a test moves, s, as the record shows it."""
    if test.steady_until is not None:
        return test.steady_until
    delay = 0.0 if file is None else _least(file.delay)
    events = (event for signal in REFERENCES for event in test.events(signal))
    own = [reference.moves_from() for reference in sampled.values()]
    return min([*own, *test.instants, *(_least(event.at) for event in events)]) + min(delay, 0.0)


def _least(value: float | Unknown) -> float:
    low = value.min if isinstance(value, Unknown) else None
    return (start_value(value) or 0.0) if low is None else low


def _read(case: Case, signal: str, given: ReferenceFile, span: Span) -> Record:
    """Return a reference from a file of its own; RecordError where it does not cover the test."""
    column = Column(given.column, given.scale, 0.0, given.unit, given.base)
    alone = case.kind.per_unit and standing_alone(given)
    path = case.folder / given.file
    record = read_record(
        path,
        clock_of(given.time),
        {signal: column},
        sheet=given.sheet,
        per_unit=frozenset({signal} if alone else ()),
        memory=given.memory,
    )
    first, last = float(record.time[0]), float(record.time[-1])
    if not first <= span[0] <= span[1] <= last:
        covered, test = (f"{show(a)} ... {show(b)} s" for a, b in ((first, last), span))
        raise RecordError(f"{path}: covers {covered}, not the whole test, {test}")
    return replace(record, source=path)
