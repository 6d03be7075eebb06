"""What a record of a grid event gives a unit that it drives: the rest before it, the inputs."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.case.schema import BumpTest, start_value
from exfit.dsp.jumps import FEWEST_SAMPLES, rest_end
from exfit.dsp.sampling import MOST_UNEVEN
from exfit.errors import RecordError
from exfit.fitting.levels import deviation, initial_level
from exfit.fitting.recorded.switchings import Switching
from exfit.records.record import Record
from exfit.signals import RESTING
from exfit.simulation.inputs import InputStep, RecordedInput, SplinedInput
from exfit.util.text import show

Array = NDArray[np.float64]

TURN = 2.0 * np.pi


def offset_step(test: BumpTest, begin: float, end: float) -> tuple[InputStep, ...]:
    """Return the change of the angle by what is added to the recorded frequency, if it is."""
    offset = start_value(test.frequency_offset)
    if offset is None:
        return ()
    return (InputStep(begin, offset * TURN * (end - begin), "angle", ramp=end - begin),)


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
        _refuse_short_rest(test.steady_until, record)
        return test
    ends: list[float] = []
    for signal, time, samples in _showing_rest(record):
        if np.ptp(samples) == 0.0:
            continue
        try:
            ends.append(float(time[rest_end(samples)]))
        except ValueError as fault:
            if "never" not in str(fault):
                text = f"{signal}: {fault}; give test.steady_until, or a record that begins earlier"
                raise RecordError(f"{record.source}: {text}") from None
    if not ends:
        text = "no signal moves out of its noise: there is no event; test.steady_until says"
        raise RecordError(f"{record.source}: {text} until when the record is at rest")
    return test.model_copy(update={"steady_until": min([*ends, *test.instants])})


def _refuse_short_rest(until: float, record: Record) -> None:
    samples = int(np.count_nonzero(record.time < until))
    if samples < FEWEST_SAMPLES:
        text = f"{samples} samples before test.steady_until = {show(until)} s"
        raise RecordError(f"{record.source}: {text}; the rest needs {FEWEST_SAMPLES}")


def _showing_rest(record: Record) -> Iterator[tuple[str, Array, Array]]:
    """Yield signals with their time from which the rest shows; of an angle, its turning."""
    for signal in RESTING:
        if signal in record.signals:
            samples = record.signals[signal]
            there = np.isfinite(samples)
            yield signal, record.time[there], samples[there]
    if "angle" in record.signals:
        yield (
            "angle",
            record.time[:-1],
            np.diff(np.unwrap(record.signals["angle"])) / np.diff(record.time),
        )


def _jumps(switchings: Sequence[Switching], signal: str) -> tuple[tuple[int, int], ...]:
    return tuple(switching.jump for switching in switchings if switching.signal == signal)


def angle_of_event(
    test: BumpTest, record: Record, switchings: Sequence[Switching] = ()
) -> SplinedInput:
    """Deviation of the angle of the recorded voltage from its even course before the event.

    It is recorded, or the integral of the recorded frequency, less the mean of that at rest.
    """
    time = record.time
    if "angle" not in record.signals:
        frequency = record.signals["frequency"] - initial_level(test, record, "frequency")
        return SplinedInput(time, TURN * frequency, integrated=True)
    angle, resting = np.unwrap(record.signals["angle"]), time < (test.steady or np.inf)
    slope, level = np.polyfit(time[resting] - time[0], angle[resting], 1)
    moved = angle - level - slope * (time - time[0])
    return SplinedInput(time, moved, _jumps(switchings, "angle"))


def event_inputs(
    test: BumpTest, record: Record, switchings: Sequence[Switching] = ()
) -> dict[str, RecordedInput | SplinedInput]:
    """Inputs of the unit by a record of an event: vt and its angle."""
    moved = deviation(test, record, "vt")
    voltage = SplinedInput(record.time, moved, _jumps(switchings, "vt"))
    return {"vt": voltage, "angle": angle_of_event(test, record, switchings)}
