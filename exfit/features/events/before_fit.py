"""What is wrong with the records of grid events, before anything is fitted."""

from collections.abc import Mapping
from dataclasses import replace
from math import pi
from types import MappingProxyType

from exfit.case.case import Case
from exfit.case.schema import Recording
from exfit.errors import SimulationError
from exfit.features.events.record_causes import clock_causes, mismatch, record_causes, swing_causes
from exfit.fitting.build import build_experiment
from exfit.fitting.recorded.event import with_rest
from exfit.fitting.recordings import record_of
from exfit.records.record import Record
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison
from exfit.results.verdict import Cause

Values = Mapping[str, float]

DEGREES = 180.0 / pi
# what may have become of an angle -> the words for it, and what turns it back
WRONG_ANGLES: Mapping[float, tuple[str, str]] = {
    -1.0: ("with the other sign", "scale: -1 on the channel angle turns it"),
    1.0 / DEGREES: (
        "divided by 57.3",
        "degrees are taken for radians: the unit of the angle is deg",
    ),
    DEGREES: ("times 57.3", "radians are taken for degrees: the unit of the angle is rad"),
}
FAR_BETTER = 0.25  # of the mismatch: what is left of it with another angle
STILL_UNLIKE = 0.2  # of the sizes of both: a better one is not right


def event_causes(case: Case, recording: Recording) -> tuple[Cause, ...]:
    """Find what is wrong with the record of an event: its clock, its levels, its swings.

    Each of these hides what comes after it.
    """
    record = record_of(case, recording)
    of_clock = tuple(clock_causes(record))
    if of_clock:
        return of_clock
    steady = with_rest(recording.test, record).steady
    if steady is None:
        return ()
    of_record = record_causes(record, steady)
    if of_record:
        return of_record
    comparison = _compared(case, recording)
    if comparison is None:
        return ()
    of_swings = tuple(swing_causes(comparison, steady))
    if of_swings and "p" in comparison.overlays and "angle" in record.signals:
        of_angle = _other_angle(case, recording, record, steady, mismatch(comparison, steady))
        return of_angle or of_swings
    return of_swings


def _compared(case: Case, recording: Recording) -> Comparison | None:
    """Return the match with the response to the start values, None where there is none."""
    values = case.values()
    try:
        setup = build_experiment(case, recording, values)
        ready = setup.with_enough_substeps(setup.with_start_values(values))
        return compare_with_record(ready, ready.name, values)
    except SimulationError:  # a fit reports it
        return None


def _other_angle(
    case: Case, recording: Recording, record: Record, steady: float, before: float
) -> tuple[Cause, ...]:
    """Return what was taken for the angle where with another one the power matches far better."""
    for factor, (words, remedy) in WRONG_ANGLES.items():
        signals = {**record.signals, "angle": factor * record.signals["angle"]}
        turned = replace(record, signals=MappingProxyType(signals))
        comparison = _compared(case.with_record(turned, recording.name), recording)
        if comparison is None:
            continue
        after = mismatch(comparison, steady)
        if after < min(FAR_BETTER * before, STILL_UNLIKE):
            return (
                Cause(
                    f"with the angle {words}, p swings as the response: {100.0 * after:.2g} % of "
                    f"both is left between them, with the angle as it is {100.0 * before:.2g} %",
                    remedy,
                ),
            )
    return ()
