"""The steps of a test as its record shows them, for a fit that finds their instants or sizes."""

from itertools import pairwise
from math import inf

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import (
    BumpTest,
    FindableStep,
    RecordFile,
    Recording,
    Unknown,
    start_value,
)
from exfit.dsp.jumps import largest_jump
from exfit.errors import CaseError, RecordError
from exfit.fitting.levels import initial_level
from exfit.fitting.nuisances.parameters import finds_level, prefix_of
from exfit.plants import REFERENCES
from exfit.records.record import Record

INSIDE_INTERVAL = 1e-6  # of it: a sample at its end would be on the other side of the jump
LEVEL_WITHIN = 0.02  # of the mean of a record at rest: how far the voltage there may be from it


def with_detected_steps(case: Case, recording: Recording, record: Record) -> BumpTest:
    """Return the test of a recording with a start and bounds for all that a fit finds.

    Where the instant of a step is to be found, the record is at rest until its lower bound.
    Raises CaseError or RecordError where the record shows no step to start from.
    """
    place = f"{case.path}: {prefix_of(recording)}test"
    test = recording.test
    channel = recording.record.channels.get("vt")
    limit = None if channel is None else channel.outliers
    if isinstance(test.vref, tuple):
        steps = tuple(
            _bounded(f"{place}.vref[{k}]", step, record, limit) for k, step in enumerate(test.vref)
        )
        instants = [start_value(step.at) or 0.0 for step in steps]
        for k, (before, at) in enumerate(pairwise(instants), 1):
            if at <= before:
                text = f"{at:g} s is not after {before:.4g} s, where the record shows the step"
                raise CaseError([f"{place}.vref[{k}].at: {text} before"])
        test = test.model_copy(update={"vref": steps})
    if test.breaker is not None:
        opens = _bounded_opening(f"{place}.breaker.opens", test.breaker.opens, record)
        breaker = test.breaker.model_copy(update={"opens": opens})
        test = test.model_copy(update={"breaker": breaker})
    test = test.model_copy(update={"steady_until": _steady_until(test, recording.record, record)})
    given = Unknown(start="auto") if finds_level(test, recording.record) else test.vt0
    if isinstance(given, Unknown) and given.start == "auto":
        from exfit.records.steps import bounds_about

        level = initial_level(test, record, "vt")
        bounds = bounds_about(level, LEVEL_WITHIN)
        vt0 = _with_bounds(f"{place}.vt0", given, level, *bounds)
        test = test.model_copy(update={"vt0": vt0})
    return test


def _steady_until(test: BumpTest, file: RecordFile, record: Record) -> float | None:
    """Find the end of the rest, s: the earliest instant that it may show."""
    delay = _lowest(file.delay)
    events = (event for signal in REFERENCES for event in test.events(signal))
    opening = () if test.breaker is None else (test.breaker.opens,)
    instants = (*(event.at for event in events), *opening)
    unknown = [at for at in instants if isinstance(at, Unknown)]
    if test.steady_until is not None or not (unknown or delay < 0.0):
        return test.steady_until
    if not test.instants:
        return test.steady_until
    earliest = min([*test.instants, *map(_lowest, unknown)])
    return max(earliest + min(delay, 0.0), float(record.time[1]))


def _bounded_opening(place: str, opens: float | Unknown, record: Record) -> float | Unknown:
    """Find the opening of the breaker, where it says auto between the samples of a jump.

    There nothing that is compared jumps with the instant: the cost is smooth in it. The jump is
    that of vt or, where a recorder has averaged that, of another signal.
    """
    if not isinstance(opens, Unknown) or opens.start != "auto":
        return opens
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
    auto = [
        key
        for key in ("at", "step")
        if isinstance(value := getattr(step, key), Unknown) and value.start == "auto"
    ]
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
    update = {}
    for key in auto:
        update[key] = _with_bounds(f"{place}.{key}", getattr(step, key), *bounds[key])
    return step.model_copy(update=update)


def _with_bounds(place: str, given: Unknown, start: float, low: float, high: float) -> Unknown:
    """Return a start that a record shows, with its bounds where the case gives none."""
    low = low if given.min is None else given.min
    high = high if given.max is None else given.max
    if not low <= start <= high:
        text = f"the record shows {start:.4g}, outside {low:g} ... {high:g}"
        raise CaseError([f"{place}: {text}"])
    return Unknown(start=start, min=low, max=high)
