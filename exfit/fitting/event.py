"""What a record of a grid event gives a unit that it drives: the rest before it, the inputs.

Switchings in the grid that it shows are left out of the comparison, or found in their instants.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import BumpTest, Recording
from exfit.dsp.jumps import FEWEST_SAMPLES, jumps_while_moving, rest_end
from exfit.dsp.sampling import MOST_UNEVEN
from exfit.errors import RecordError
from exfit.fitting.channels import with_filter
from exfit.fitting.experiment import Switching
from exfit.fitting.nuisances import TURN, Found, Nuisance, prefix_from
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.recordings import deviation, record_of
from exfit.records.record import Record
from exfit.signals import RESTING
from exfit.simulation.inputs import InputStep, RecordedInput, SplinedInput
from exfit.util.arrays import Array
from exfit.util.text import show

Input = RecordedInput | SplinedInput

LEAST_JUMPS = {"vt": 0.005, "angle": 0.02}  # pu, rad: a smaller one of the grid does no harm
WORTH_FINDING = 2.0  # times that: the instant of a smaller one moves a response by mere noise
BESIDE = 3  # samples on each side of a jump, through which a line runs to its instant
WITHIN = 1e-3  # of the time between two samples: as near to them an instant may be


def with_even_clock(record: Record) -> Record:
    """Return a record whose time stamps are even, where only their rounding made them uneven.

    While the frequency is off, an angle read 0.03 ms late is off by as much as its noise.
    """
    time = record.time
    even = np.linspace(time[0], time[-1], len(time))
    rounded = np.max(np.abs(time - even)) < MOST_UNEVEN * (even[1] - even[0])
    return replace(record, time=even) if rounded else record


def with_rest(test: BumpTest, record: Record) -> BumpTest:
    """Return a test of an event with the end of the rest before it, as the record shows it.

    Raises RecordError where the record shows no rest, or nothing that moves.
    """
    if test.steady_until is not None:
        samples = int(np.count_nonzero(record.time < test.steady_until))
        if samples < FEWEST_SAMPLES:
            text = f"{samples} samples before test.steady_until = {show(test.steady_until)} s"
            raise RecordError(f"{record.source}: {text}; the rest needs {FEWEST_SAMPLES}")
        return test
    showing = dict[str, tuple[Array, Array]]()
    for signal in RESTING:
        if signal in record.signals:
            there = np.isfinite(record.signals[signal])
            showing[signal] = record.time[there], record.signals[signal][there]
    if "angle" in record.signals:  # by its turning
        turning = np.diff(np.unwrap(record.signals["angle"])) / np.diff(record.time)
        showing["angle"] = record.time[:-1], turning
    ends: list[float] = []
    for signal, (time, course) in showing.items():
        if not len(course) or np.ptp(course) == 0.0:
            continue
        try:
            ends.append(float(time[rest_end(course)]))
        except ValueError as fault:
            if "never" not in str(fault):
                text = f"{signal}: {fault}; give test.steady_until, or a record that begins earlier"
                raise RecordError(f"{record.source}: {text}") from None
    if not ends:
        text = "no signal leaves its noise: there is no event; give test.steady_until"
        raise RecordError(f"{record.source}: {text}, the end of the rest")
    return test.model_copy(update={"steady_until": min([*ends, *test.instants])})


def event_inputs(
    test: BumpTest, record: Record, switchings: Sequence[Switching]
) -> dict[str, SplinedInput]:
    """Return vt and its angle as inputs of the unit, as deviations from the rest before the event.

    Those of the angle are from its even course there. It is recorded, or the integral of the
    recorded frequency, less the mean of that at rest.
    """
    time, jumps = record.time, dict[str, tuple[tuple[int, int], ...]](vt=(), angle=())
    for switching in switchings:
        jumps[switching.signal] = (*jumps[switching.signal], switching.jump)
    voltage = SplinedInput(time, deviation(test, record, "vt"), jumps["vt"])
    if "angle" not in record.signals:
        frequency = deviation(test, record, "frequency")
        return {"vt": voltage, "angle": SplinedInput(time, TURN * frequency, integrated=True)}
    angle, resting = np.unwrap(record.signals["angle"]), time < (test.steady or np.inf)
    slope, level = np.polyfit(time[resting] - time[0], angle[resting], 1)
    moved = angle - level - slope * (time - time[0])
    return {"vt": voltage, "angle": SplinedInput(time, moved, jumps["angle"])}


# ---- switchings


def switchings_of(record: Record) -> tuple[Switching, ...]:
    """Return the jumps of what drives a unit in the record of an event: switchings in the grid."""
    driving = {"vt": record.signals["vt"]}
    if "angle" in record.signals:
        driving["angle"] = np.unwrap(record.signals["angle"])
    return tuple(
        Switching(
            signal,
            (first, last),
            0.5 * float(record.time[first] + record.time[last]),
            float(samples[last] - samples[first]),
        )
        for signal, samples in driving.items()
        for first, last in jumps_while_moving(record.time, samples, LEAST_JUMPS[signal])
    )


def _named_groups(switchings: Sequence[Switching], prefix: str) -> dict[str, tuple[Switching, ...]]:
    """Return what each large switching does to vt and its angle, by the name of its instant."""
    groups: list[tuple[Switching, ...]] = []
    for switching in sorted(switchings, key=lambda each: each.jump):
        if groups and any(switching.jump[0] < each.jump[1] for each in groups[-1]):
            groups[-1] = (*groups[-1], switching)
        else:
            groups.append((switching,))
    large = [
        group
        for group in groups
        if any(abs(each.change) > WORTH_FINDING * LEAST_JUMPS[each.signal] for each in group)
    ]
    return {
        f"{prefix}switching{number if number > 1 else ''}.at": group
        for number, group in enumerate(large, 1)
    }


def names_of_switchings(case: Case, recording: Recording) -> Iterator[str]:
    """Yield the names of the instants that a fit finds in the record of an event.

    Raises RecordError where that cannot be read.
    """
    file = recording.record
    if case.kind.finds_rest and file.switchings == "find":
        record = with_filter(record_of(case, recording), file.filter)
        yield from _named_groups(switchings_of(record), prefix_from(recording.name))


def switchings_as_steps(
    inputs: dict[str, Input], switchings: Sequence[Switching], prefix: str, first: int
) -> tuple[dict[str, Input], list[InputStep], list[Found]]:
    """Take the switchings out of inputs: each becomes a step whose instant a fit finds.

    It lies between the samples of the jump. ``first`` is the place of these steps among all, and
    ``prefix`` begins the names.
    """
    smooth = {name: own for name, own in inputs.items() if isinstance(own, SplinedInput)}
    steps, found = list[InputStep](), list[Found]()
    for name, group in _named_groups(switchings, prefix).items():
        before = min(each.jump[0] for each in group)
        after = max(each.jump[1] for each in group)
        time = smooth["vt"].time
        low, high = float(time[before]), float(time[after])
        at, margin = 0.5 * (low + high), WITHIN * (high - low)
        instant = FreeParameter(name, at, low + margin, high - margin, logarithmic=False)
        place = first + len(steps)
        found.append((Nuisance(name, "switching", place, count=len(group)), instant))
        for each in group:
            smooth[each.signal], size = _without_jump(smooth[each.signal], before, after, at)
            steps.append(InputStep(at, size, each.signal, smooth=True))
    return {**inputs, **smooth}, steps, found


def _without_jump(
    own: SplinedInput, before: int, after: int, at: float
) -> tuple[SplinedInput, float]:
    """Return an input without a jump, and its size at an instant (s), by lines on each side."""
    sides = slice(max(before - BESIDE + 1, 0), before + 1), slice(after, after + BESIDE)
    levels = [np.polyfit(own.time[side] - at, own.samples[side], 1)[1] for side in sides]
    size = float(levels[1] - levels[0])
    samples = np.array(own.samples)
    samples[after:] -= size
    inside = slice(before, after + 1)
    ends = own.time[[before, after]], samples[[before, after]]
    samples[inside] = np.interp(own.time[inside], *ends)
    jumps = tuple(jump for jump in own.jumps if not before <= jump[0] < after)
    return SplinedInput(own.time, samples, jumps, own.integrated), size
