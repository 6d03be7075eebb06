"""Switchings in the grid that a record of an event shows: left out, and found in their instants."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import MedianSection, RecordFile, Recording
from exfit.dsp.jumps import Jump, jumps_while_moving
from exfit.fitting.channels import with_filter
from exfit.fitting.nuisances.kinds import Nuisance
from exfit.fitting.nuisances.parameters import prefix_of
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.recordings import record_of
from exfit.records.record import Record
from exfit.simulation.inputs import InputStep, RecordedInput, SplinedInput
from exfit.util.sorting import median

Array = NDArray[np.float64]
Input = RecordedInput | SplinedInput

LEAST_JUMPS = {"vt": 0.005, "angle": 0.02}  # pu, rad: a smaller one of the grid does no harm
WORTH_FINDING = 2.0  # times that: the instant of a smaller one moves a response by mere noise
MASKED = 0.2  # s, before and after a switching, in which a record is not compared
BESIDE = 3  # samples on each side of a jump, through which a line runs to its instant
WITHIN = 1e-3  # of the time between two samples: as near to them an instant may be


class Switching(NamedTuple):
    """A jump of a signal that drives a unit: from which sample to which, when (s), by how much."""

    signal: str
    jump: Jump
    at: float
    change: float

    @property
    def is_large(self) -> bool:
        """Flag of a jump whose instant matters."""
        return abs(self.change) > WORTH_FINDING * LEAST_JUMPS[self.signal]

    @property
    def masked(self) -> tuple[float, float]:
        """The interval in which the record is not compared, s."""
        return self.at - MASKED, self.at + MASKED


Group = tuple[Switching, ...]  # what one switching does to vt and its angle


def switchings_of(case: Case, record: Record) -> tuple[Switching, ...]:
    """Return the jumps of what drives a unit in the record of an event: switchings in the grid."""
    if not case.kind.finds_rest:
        return ()
    return tuple(
        Switching(
            signal,
            (first, last),
            0.5 * float(record.time[first] + record.time[last]),
            float(samples[last] - samples[first]),
        )
        for signal, samples in _driving(record)
        for first, last in jumps_while_moving(record.time, samples, LEAST_JUMPS[signal])
    )


def _driving(record: Record) -> Iterator[tuple[str, Array]]:
    yield "vt", record.signals["vt"]
    if "angle" in record.signals:
        yield "angle", np.unwrap(record.signals["angle"])


def groups_of(switchings: Sequence[Switching]) -> list[Group]:
    """Group jumps between the same samples, in order of time."""
    groups: list[Group] = []
    for switching in sorted(switchings, key=lambda each: each.jump):
        first = switching.jump[0]
        if groups and any(first < each.jump[1] for each in groups[-1]):
            groups[-1] = (*groups[-1], switching)
        else:
            groups.append((switching,))
    return groups


def announced(file: RecordFile, switchings: tuple[Switching, ...]) -> tuple[Switching, ...]:
    """Return the switchings about which a record is not compared."""
    return () if file.switchings == "compare" else switchings


def masked(
    file: RecordFile, record: Record, switchings: tuple[Switching, ...]
) -> tuple[tuple[float, float], ...]:
    """Return the intervals (s) of a record that are not compared.

    Among them is its end where all channels were filtered: there a filter lacks what follows, and
    a unit that it drives by then moves otherwise.
    """
    about = (switching.masked for switching in announced(file, switchings))
    return (*file.mask, *about, *_filtered_end(file, record))


def _filtered_end(file: RecordFile, record: Record) -> Iterator[tuple[float, float]]:
    """Yield the end of a record over which its filter reaches, s."""
    if file.filter is None:
        return
    end = float(record.time[-1])
    if isinstance(file.filter, MedianSection):
        reach = file.filter.median // 2 * float(median(np.diff(record.time)))
    else:
        reach = 1.0 / file.filter.lowpass
    yield end - reach, end


class SwitchedInputs(NamedTuple):
    """The inputs of an event without its switchings, these as steps, and their instants."""

    inputs: dict[str, Input]
    steps: tuple[InputStep, ...] = ()
    nuisances: tuple[Nuisance, ...] = ()
    free: tuple[FreeParameter, ...] = ()


def switchings_as_steps(
    inputs: dict[str, Input],
    file: RecordFile,
    switchings: Sequence[Switching],
    prefix: str,
    first: int,
) -> SwitchedInputs:
    """Return the inputs with each switching as a step whose instant a fit finds, if it does.

    It lies between the samples of the jump. ``first`` is the place of these steps among all, and
    ``prefix`` begins the names.
    """
    smooth = {name: own for name, own in inputs.items() if isinstance(own, SplinedInput)}
    if file.switchings != "find" or not switchings:
        return SwitchedInputs(inputs)
    steps, nuisances, free = list[InputStep](), list[Nuisance](), list[FreeParameter]()
    for number, group in enumerate(_large(groups_of(switchings)), 1):
        before = min(each.jump[0] for each in group)
        after = max(each.jump[1] for each in group)
        time = smooth["vt"].time
        low, high = float(time[before]), float(time[after])
        at, margin = 0.5 * (low + high), WITHIN * (high - low)
        place = first + len(steps)
        for each in group:
            own = smooth[each.signal]
            size = _size(own, before, after, at)
            smooth[each.signal] = _without(own, before, after, size)
            steps.append(InputStep(at, size, each.signal, smooth=True))
        name = _name(prefix, number)
        nuisances.append(Nuisance(name, "switching", place, count=len(group)))
        free.append(FreeParameter(name, at, low + margin, high - margin, logarithmic=False))
    return SwitchedInputs({**inputs, **smooth}, tuple(steps), tuple(nuisances), tuple(free))


def _large(groups: Sequence[Group]) -> list[Group]:
    """Return the switchings whose instants matter."""
    return [group for group in groups if any(each.is_large for each in group)]


def names_of_switchings(case: Case, recording: Recording) -> Iterator[str]:
    """Yield the names of the instants that a fit finds in the record of an event.

    Raises RecordError where that cannot be read.
    """
    file = recording.record
    if case.kind.finds_rest and file.switchings == "find":
        record = with_filter(record_of(case, recording), file.filter)
        groups = _large(groups_of(switchings_of(case, record)))
        yield from (_name(prefix_of(recording), k) for k in range(1, len(groups) + 1))


def _name(prefix: str, number: int) -> str:
    return f"{prefix}switching{_number(number)}.at"


def _number(number: int) -> str:
    """Return the number of a switching in its name, none of the first one."""
    return str(number) if number > 1 else ""


def _size(own: SplinedInput, before: int, after: int, at: float) -> float:
    """Jump of an input at an instant, by lines through the samples on each side."""
    sides = slice(max(before - BESIDE + 1, 0), before + 1), slice(after, after + BESIDE)
    levels = [np.polyfit(own.time[side] - at, own.samples[side], 1)[1] for side in sides]
    return float(levels[1] - levels[0])


def _without(own: SplinedInput, before: int, after: int, size: float) -> SplinedInput:
    """Return an input without a jump; samples inside it lie in a line between its ends."""
    samples = np.array(own.samples)
    samples[after:] -= size
    inside = slice(before, after + 1)
    ends = own.time[[before, after]], samples[[before, after]]
    samples[inside] = np.interp(own.time[inside], *ends)
    jumps = tuple(jump for jump in own.jumps if not before <= jump[0] < after)
    return SplinedInput(own.time, samples, jumps, own.integrated)
