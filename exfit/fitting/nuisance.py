"""What a fit finds about a record beside the parameters of the unit: instants, sizes, levels."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Literal

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import SINGLE, BumpTest, FindableStep, RecordFile, Recording, Unknown, known
from exfit.dsp.filtering import outliers
from exfit.dsp.step_detection import find_step
from exfit.errors import CaseError, RecordError
from exfit.fitting.experiment import Nuisance
from exfit.fitting.parameters import FreeParameter
from exfit.records.record import Record
from exfit.signals import SIGNALS
from exfit.simulation.inputs import InputStep

AROUND = 0.25  # s: how far the instant may be from where a record shows the step
SHARE = 0.5  # of the size that a record shows: how far the size may be from it


def with_detected_steps(case: Case, recording: Recording, record: Record) -> BumpTest:
    """Return the test of a recording with a start and bounds for all that a fit finds.

    Where the instant of a step is to be found, the record is at rest until its lower bound.
    Raises CaseError or RecordError where the record shows no step to start from.
    """
    place = f"{case.path}: {prefix_of(recording)}test"
    test = recording.test
    channel = recording.record.channels.get("vt")
    limit = None if channel is None else channel.outliers
    steps = tuple(
        _bounded(f"{place}.vref[{k}]", one, record, limit) for k, one in enumerate(test.vref)
    )
    instants = [known(step.at) or 0.0 for step in steps]
    for k, (before, at) in enumerate(pairwise(instants), 1):
        if at <= before:
            text = f"{at:g} s is not after {before:.4g} s, where the record shows the step before"
            raise CaseError([f"{place}.vref[{k}].at: {text}"])
    test = test.model_copy(update={"vref": steps})
    return test.model_copy(update={"steady_until": _steady_until(test, recording.record, record)})


def _steady_until(test: BumpTest, file: RecordFile, record: Record) -> float | None:
    """Return until when a record is at rest, s: until the earliest instant that it may show."""
    delay = _lowest(file.delay)
    found = [step.at for step in (*test.vref, *test.vs) if isinstance(step.at, Unknown)]
    if test.steady_until is not None or not (found or delay < 0.0):
        return test.steady_until
    earliest = min([*test.instants, *map(_lowest, found)]) if test.instants else inf
    return max(earliest + min(delay, 0.0), float(record.time[1]))


def _lowest(value: float | Unknown) -> float:
    """Return the least that a value may be."""
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
    vt = record.signals["vt"]
    seen = np.isfinite(vt)
    try:
        if limit is not None:
            seen[seen] = ~outliers(record.time[seen], vt[seen], limit)
        found = find_step(record.time[seen], vt[seen])
    except ValueError as fault:
        raise RecordError(f"{record.source}: {fault}; {place} asks for start: auto") from fault
    first, last = float(record.time[0]), float(record.time[-1])
    bounds = {
        "at": (found.at, max(first, found.at - AROUND), min(last, found.at + AROUND)),
        "step": (found.size, *sorted(((1 - SHARE) * found.size, (1 + SHARE) * found.size))),
    }
    update = {}
    for key in auto:
        value, (start, low, high) = getattr(step, key), bounds[key]
        low = low if value.min is None else value.min
        high = high if value.max is None else value.max
        if not low <= start <= high:
            text = f"the record shows {start:.4g}, outside {low:g} ... {high:g}"
            raise CaseError([f"{place}.{key}: {text}"])
        update[key] = Unknown(start=start, min=low, max=high)
    return step.model_copy(update=update)


def shifted(test: BumpTest, file: RecordFile, steps: Sequence[InputStep]) -> bool:
    """Tell whether the instant of a step can be found by shifting the whole response.

    That leaves the simulation as it is, and with it the steps at which limits are met; a smooth
    step that moves over the grid meets them now a step earlier, now later, and so gives the cost a
    kink for each. It needs an only step from rest, and signals that do not jump with it.
    """
    jumps = any(SIGNALS[signal].jumps for signal in file.channels)
    return len(steps) == 1 and test.begin is None and not jumps


def prefix_of(recording: Recording) -> str:
    """Return how the names of all begin that a fit finds about a record."""
    return "" if recording.name == SINGLE else f"{recording.name}."


def names_of(recording: Recording) -> tuple[str, ...]:
    """Return the names of all that a fit finds about a record."""
    test, file = recording.test, recording.record
    steps = [
        InputStep(0.0, 0.0, signal) for signal in ("vref", "vs") for _ in getattr(test, signal)
    ]
    return tuple(one.name for one, _ in _found(prefix_of(recording), test, file, steps))


def nuisance_parameters(
    prefix: str, test: BumpTest, file: RecordFile, steps: Sequence[InputStep]
) -> tuple[tuple[Nuisance, ...], tuple[FreeParameter, ...]]:
    """Return what a fit finds about a record; the names begin with ``prefix``."""
    found = [*_found(prefix, test, file, steps)]
    return tuple(one for one, _ in found), tuple(_free(one.name, value) for one, value in found)


def _found(
    prefix: str, test: BumpTest, file: RecordFile, steps: Sequence[InputStep]
) -> Iterator[tuple[Nuisance, Unknown]]:
    yield from _of_steps(prefix, test, steps, shifted(test, file, steps))
    yield from _of_record(prefix, test, file)


def _of_steps(
    prefix: str, test: BumpTest, steps: Sequence[InputStep], shift: bool
) -> Iterator[tuple[Nuisance, Unknown]]:
    for signal in ("vref", "vs"):
        places = [place for place, change in enumerate(steps) if change.signal == signal]
        for number, (place, step) in enumerate(zip(places, getattr(test, signal), strict=True)):
            which = f"{prefix}{signal}{number + 1 if number else ''}"
            if isinstance(step.at, Unknown):
                yield Nuisance(f"{which}.at", "shift" if shift else "at", place), step.at
            if isinstance(step.step, Unknown):
                yield Nuisance(f"{which}.step", "step", place), step.step


def _of_record(prefix: str, test: BumpTest, file: RecordFile) -> Iterator[tuple[Nuisance, Unknown]]:
    if isinstance(test.vt0, Unknown):
        yield Nuisance(f"{prefix}vt0", "vt0"), test.vt0
    if isinstance(file.delay, Unknown):
        yield Nuisance(f"{prefix}delay", "delay"), file.delay
    kinds: tuple[Literal["scale", "offset"], ...] = ("scale", "offset")
    for signal, channel in file.channels.items():
        for kind in kinds:
            value = getattr(channel, kind, None)
            if isinstance(value, Unknown):
                yield Nuisance(f"{prefix}{signal}.{kind}", kind, signal=signal), value


def _free(name: str, value: Unknown) -> FreeParameter:
    if value.start == "auto" or value.min is None or value.max is None:
        raise TypeError(f"{name} has no start or bounds")
    return FreeParameter(name, value.start, value.min, value.max, logarithmic=False)


UNITS: Mapping[str, str] = {"at": "s", "step": "pu", "vt0": "pu", "delay": "s", "offset": "pu"}


def unit_of(name: str) -> str:
    """Return the unit of a value that no data sheet has: what is found about a record."""
    kind = name.rpartition(".")[2]
    return UNITS.get(kind, "")
