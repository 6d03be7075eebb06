"""The steps of a test as its record shows them: those to be found, and those of a reference.

A recorded reference drives the simulation; its jumps are steps whose instants a fit finds.
"""

from collections.abc import Iterable
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import NamedTuple

import numpy as np

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
from exfit.dsp.jumps import LONGEST_JUMP, jumps, largest_jump, rest_end, settled
from exfit.errors import CaseError, RecordError
from exfit.fitting.channels import filtering_of, without_masked
from exfit.fitting.nuisances import finds_level
from exfit.fitting.recordings import (
    Column,
    Span,
    clock_of,
    mean_at_rest,
    record_of,
    span_of,
    standing_alone,
)
from exfit.plants import REFERENCES
from exfit.records.reading import read_record
from exfit.records.record import Record
from exfit.simulation.inputs import RecordedInput
from exfit.util.arrays import Array, median_step
from exfit.util.text import show

INSIDE_INTERVAL = 1e-6  # of it: a sample at its end would be on the other side of the jump
LEVEL_WITHIN = 0.02  # of the mean of a record at rest: how far the voltage there may be from it
INVISIBLE = 1e-9  # pu: no recorder shows it


# ---- steps that a fit finds


def with_detected_steps(place: str, test: BumpTest, file: RecordFile, record: Record) -> BumpTest:
    """Return the test of a record with a start and bounds for all that a fit finds.

    ``place`` is where messages find it. Where the instant of a step is to be found, the record is
    at rest until its lower bound. Raises CaseError or RecordError where the record shows no step to
    start from.
    """
    channel = file.channels.get("vt")
    limit = None if channel is None else channel.outliers
    if isinstance(test.vref, tuple):
        steps = tuple(
            _bounded(f"{place}.vref[{k}]", step, record, limit) for k, step in enumerate(test.vref)
        )
        instants = [start_value(step.at) or 0.0 for step in steps]
        for k, (before, at) in enumerate(pairwise(instants), 1):
            if at <= before:
                text = f"{at:g} s is not after {before:.4g} s, where the record shows the step"
                raise CaseError(f"{place}.vref[{k}].at: {text} before")
        test = test.model_copy(update={"vref": steps})
    if test.breaker is not None:
        opens = test.breaker.opens
        if isinstance(opens, Unknown) and opens.start == "auto":
            opens = _opening(f"{place}.breaker.opens", opens, record)
        breaker = test.breaker.model_copy(update={"opens": opens})
        test = test.model_copy(update={"breaker": breaker})
    test = test.model_copy(update={"steady_until": _steady_until(test, file, record)})
    given = Unknown(start="auto") if finds_level(test, file) else test.vt0
    if isinstance(given, Unknown) and given.start == "auto":
        from exfit.records.steps import bounds_about

        level = mean_at_rest(test, record, "vt")
        vt0 = _with_bounds(f"{place}.vt0", given, level, *bounds_about(level, LEVEL_WITHIN))
        test = test.model_copy(update={"vt0": vt0})
    return test


def _steady_until(test: BumpTest, file: RecordFile, record: Record) -> float | None:
    """Find the end of the rest, s: the earliest instant that it may show."""
    delay = _lowest(file.delay)
    instants = [event.at for signal in REFERENCES for event in test.events(signal)]
    instants += [] if test.breaker is None else [test.breaker.opens]
    unknown = [at for at in instants if isinstance(at, Unknown)]
    if test.steady_until is not None or not (unknown or delay < 0.0) or not test.instants:
        return test.steady_until
    earliest = min([*test.instants, *map(_lowest, unknown)])
    return max(earliest + min(delay, 0.0), float(record.time[1]))


def _opening(place: str, opens: Unknown, record: Record) -> Unknown:
    """Find the opening of the breaker between the samples of a jump.

    There nothing that is compared jumps with the instant: the cost is smooth in it. The jump is
    that of vt or, where a recorder has averaged that, of another signal.
    """
    faults = []
    for signal in sorted(record.signals, key=lambda signal: signal != "vt"):
        samples = record.signals[signal]
        looked_at = np.isfinite(samples) & (record.time >= _lowest(opens))
        looked_at &= record.time <= (inf if opens.max is None else opens.max)
        try:
            before = largest_jump(samples[looked_at])
        except ValueError as fault:
            faults.append(f"{signal}: {fault}")
        else:
            start, end = map(float, record.time[looked_at][before : before + 2])
            margin = INSIDE_INTERVAL * (end - start)
            return Unknown(start=0.5 * (start + end), min=start + margin, max=end - margin)
    text = f"{record.source}: {'; '.join(faults)}; {place} has start: auto"
    raise RecordError(f"{text}: give start, min and max")


def _lowest(value: float | Unknown) -> float:
    if isinstance(value, Unknown):
        return -inf if value.min is None else value.min
    return value


def _bounded(place: str, step: FindableStep, record: Record, limit: float | None) -> FindableStep:
    """Return a step of the reference, with numbers where it says auto; ``limit``: of outliers."""
    sought = {"at": step.at, "step": step.step}
    auto = {
        key: value
        for key, value in sought.items()
        if isinstance(value, Unknown) and value.start == "auto"
    }
    if not auto:
        return step
    from exfit.dsp.filtering import outliers
    from exfit.dsp.step_detection import find_step
    from exfit.records.steps import bounds_about, bounds_of_instant

    vt = record.signals["vt"]
    kept = np.isfinite(vt)
    try:
        if limit is not None:
            kept[kept] = ~outliers(record.time[kept], vt[kept], limit)
        detected = find_step(record.time[kept], vt[kept])
    except ValueError as fault:
        raise RecordError(f"{record.source}: {fault}; {place} has start: auto") from fault
    bounds = {
        "at": (detected.at, *bounds_of_instant(detected.at, record.time)),
        "step": (detected.size, *bounds_about(detected.size)),
    }
    update = {
        key: _with_bounds(f"{place}.{key}", given, *bounds[key]) for key, given in auto.items()
    }
    return step.model_copy(update=update)


def _with_bounds(place: str, given: Unknown, start: float, low: float, high: float) -> Unknown:
    """Return a start that a record shows, with its bounds where the case gives none."""
    low = low if given.min is None else given.min
    high = high if given.max is None else given.max
    if not low <= start <= high:
        text = f"the record shows {start:.4g}, outside {low:g} ... {high:g}"
        raise CaseError(f"{place}: {text}")
    if low == high:
        raise CaseError(
            f"{place}: the record shows {start:.4g}, which sets no bounds: give min and max"
        )
    return Unknown(start=start, min=low, max=high)


# ---- recorded references


class _Sampled(NamedTuple):
    """A recorded signal (M,) of a test, and where messages find it."""

    source: str
    time: Array
    samples: Array
    filter: Filter | None


def with_recorded_steps(case: Case, recording: Recording) -> Recording:
    """Return a recording whose test has the steps that a recorded reference shows."""
    test, file = recording.test, recording.record
    recorded = [signal for signal in REFERENCES if test.reference(signal) == "recorded"]
    if not recorded and not test.files:
        return recording
    record = without_masked(record_of(case, recording), file.mask, recorded)
    test, _, _ = references_of(case, test, span_of(test, record), record, file)
    return recording.model_copy(update={"test": test})


def references_of(
    case: Case,
    test: BumpTest,
    span: Span,
    record: Record | None = None,
    file: RecordFile | None = None,
) -> tuple[BumpTest, dict[str, RecordedInput], dict[str, Record]]:
    """Return a test through a span (s) with what is recorded of its reference.

    The test has the jumps of that as steps whose instants are to be found, and the end of its
    steady part; then follow what is left of the signals beside their jumps, and those read from
    files that are not the record. Raises RecordError where a recorded reference cannot be read,
    shows no move or does not cover the test.
    """
    files, tables, sampled = dict[str, Record](), dict[str, ReferenceTable](), dict[str, _Sampled]()
    for signal in REFERENCES:
        given = test.reference(signal)
        if isinstance(given, ReferenceFile):
            own = files[signal] = _read(case, signal, given, span)
            samples = own.signals[signal]
            if is_table(own):
                rows = zip(own.time.tolist(), samples.tolist(), strict=True)
                tables[signal] = ReferenceTable(table=tuple(rows))
            else:
                place = f"{own.source}: {given.column}"
                sampled[signal] = _Sampled(place, own.time, samples, given.filter)
        elif given == "recorded" and record is not None and file is not None:
            place, filter = f"{record.source}: {signal}", file.channels[signal].filter
            sampled[signal] = _Sampled(place, record.time, record.signals[signal], filter)
    test = test.model_copy(update=tables)
    if not sampled:
        return test, {}, files
    steady = _end_of_rest(test, file, sampled.values())
    parts = {signal: _split(reference, steady) for signal, reference in sampled.items()}
    steps = {signal: jumping for signal, (jumping, _) in parts.items()}
    beside = {signal: beside for signal, (_, beside) in parts.items() if beside is not None}
    return test.model_copy(update={**steps, "steady_until": steady}), beside, files


def is_table(record: Record) -> bool:
    """Test whether a file is a table of few rows and not the samples of a recorder."""
    spacing = median_step(record.time)
    return spacing > LONGEST_JUMP and len(record.time) <= MOST_ROWS


def _end_of_rest(test: BumpTest, file: RecordFile | None, references: Iterable[_Sampled]) -> float:
    """Find the end of the rest of all that a test moves, s; RecordError where one never moves."""
    if test.steady_until is not None:
        return test.steady_until
    moves = [_least(event.at) for signal in REFERENCES for event in test.events(signal)]
    for reference in references:
        try:
            moves.append(float(reference.time[rest_end(reference.samples)]))
        except ValueError as fault:
            raise RecordError(f"{reference.source}: {fault}") from None
    delay = 0.0 if file is None else _least(file.delay)
    return min([*moves, *test.instants]) + min(delay, 0.0)


def _least(value: float | Unknown) -> float:
    low = value.min if isinstance(value, Unknown) else None
    return (start_value(value) or 0.0) if low is None else low


def _split(
    reference: _Sampled, steady: float
) -> tuple[tuple[FindableStep, ...], RecordedInput | None]:
    """Split it into its jumps, and how it deviates beside them; None if it only jumps."""
    source, time, recorded, filter = reference
    first = int(np.searchsorted(time, steady))
    if first == 0:
        raise RecordError(f"{source}: no sample before {show(steady)} s: no level")
    jumping = jumps(time, recorded)
    samples = settled(recorded, first, jumping)
    changes = np.diff(samples)[jumping]
    ends = (time[jumping].tolist(), time[jumping + 1].tolist())
    steps = tuple(
        FindableStep(at=Unknown(start=0.5 * (start + end), min=start, max=end), step=change)
        for start, end, change in zip(*ends, changes.tolist(), strict=True)
    )
    jumped = np.zeros(len(samples))
    jumped[jumping + 1] = changes
    beside = samples - samples[0] - np.cumsum(jumped)
    if np.max(np.abs(beside)) < INVISIBLE:
        return steps, None
    filtering = filtering_of(source, time, np.ones(len(time), dtype=bool), filter)
    return steps, RecordedInput(time, beside if filtering is None else filtering.apply(beside))


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
