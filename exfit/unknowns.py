"""What a fit finds about a record beside the parameters of the unit: instants, sizes, levels."""

from collections.abc import Iterator, Sequence
from typing import Any, Literal

from exfit.case import BumpTest, Case, RecordFile, Recording, Unknown, known
from exfit.errors import CaseError, RecordError
from exfit.experiment import Nuisance
from exfit.onset import find_step
from exfit.record import Record
from exfit.residuals import Free
from exfit.simulate import Change

JUMPS = ("efd",)  # signals that follow a step at once

AROUND = 0.25  # s: how far the instant may be from where a record shows the step
SHARE = 0.5  # of the size that a record shows: how far the size may be from it


def started(case: Case, recording: Recording, record: Record) -> BumpTest:
    """Return the test of a recording with a start and bounds for all that a fit finds.

    Where the instant of a step is to be found, the record is at rest until its lower bound.
    Raises CaseError or RecordError where the record shows no step to start from.
    """
    test = recording.test
    steps = [_bounded(case, recording, record, k) for k in range(len(test.vref))]
    instants = [step.at for step in (*steps, *test.vs) if isinstance(step.at, Unknown)]
    steady = test.steady_until
    if steady is None and instants:
        lowest = [one.min for one in instants if one.min is not None]
        others = [at for at in (known(step.at) for step in (*steps, *test.vs)) if at is not None]
        steady = max(min([*lowest, *others]), float(record.time[1]))
    return test.model_copy(update={"vref": tuple(steps), "steady_until": steady})


def _bounded(case: Case, recording: Recording, record: Record, k: int) -> Any:
    """Return a step of the reference, with numbers where it says auto."""
    step = recording.test.vref[k]
    auto = [
        key
        for key in ("at", "step")
        if isinstance(value := getattr(step, key), Unknown) and value.start == "auto"
    ]
    if not auto:
        return step
    if "vt" not in record.signals:
        raise CaseError([f"{case.path}: test.vref[{k}]: auto needs vt in the record"])
    try:
        found = find_step(record.time, record.signals["vt"])
    except ValueError as fault:
        raise RecordError(f"{record.source}: {fault}; {case.path} asks for start: auto") from fault
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
            place = f"{case.path}: test.vref[{k}].{key}"
            raise CaseError(
                [f"{place}: the record shows {start:.4g}, outside {low:g} ... {high:g}"]
            )
        update[key] = Unknown(start=start, min=low, max=high)
    return step.model_copy(update=update)


def shifted(test: BumpTest, file: RecordFile, steps: Sequence[Change]) -> bool:
    """Tell whether the instant of a step can be found by shifting the whole response.

    That leaves the simulation as it is, and with it the steps at which limits are met; a smooth
    step that moves over the grid meets them now a step earlier, now later, and so gives the cost a
    kink for each. It needs an only step from rest, and signals that do not jump with it.
    """
    return len(steps) == 1 and test.begin is None and not set(JUMPS) & set(file.channels)


def unknowns(
    prefix: str, test: BumpTest, file: RecordFile, steps: Sequence[Change]
) -> tuple[tuple[Nuisance, ...], tuple[Free, ...]]:
    """Return what a fit finds about a record; the names begin with ``prefix``."""
    shift = shifted(test, file, steps)
    found = [*_of_steps(prefix, test, steps, shift), *_of_record(prefix, test, file)]
    return tuple(one for one, _ in found), tuple(free for _, free in found)


def _of_steps(
    prefix: str, test: BumpTest, steps: Sequence[Change], shift: bool
) -> Iterator[tuple[Nuisance, Free]]:
    for signal in ("vref", "vs"):
        places = [place for place, change in enumerate(steps) if change.signal == signal]
        for number, (place, step) in enumerate(zip(places, getattr(test, signal), strict=True)):
            which = f"{prefix}{signal}{number + 1 if number else ''}"
            if isinstance(step.at, Unknown):
                kind: Literal["at", "shift"] = "shift" if shift else "at"
                yield Nuisance(f"{which}.at", kind, place), _free(f"{which}.at", step.at)
            if isinstance(step.step, Unknown):
                yield Nuisance(f"{which}.step", "step", place), _free(f"{which}.step", step.step)


def _of_record(prefix: str, test: BumpTest, file: RecordFile) -> Iterator[tuple[Nuisance, Free]]:
    if isinstance(test.vt0, Unknown):
        yield Nuisance(f"{prefix}vt0", "vt0"), _free(f"{prefix}vt0", test.vt0)
    if isinstance(file.delay, Unknown):
        yield Nuisance(f"{prefix}delay", "delay"), _free(f"{prefix}delay", file.delay)
    kinds: tuple[Literal["scale", "offset"], ...] = ("scale", "offset")
    for signal, channel in file.channels.items():
        for kind in kinds:
            value = getattr(channel, kind)
            if isinstance(value, Unknown):
                name = f"{prefix}{signal}.{kind}"
                yield Nuisance(name, kind, signal=signal), _free(name, value)


def _free(name: str, value: Unknown) -> Free:
    if value.start == "auto" or value.min is None or value.max is None:
        raise TypeError(f"{name} has no start or bounds")
    return Free(name, value.start, value.min, value.max, logarithmic=False)
