"""What a fit finds about a record beside the parameters of the unit: instants, sizes, levels."""

from collections.abc import Collection, Iterator, Sequence
from math import pi
from typing import Literal

from exfit.case.schema import SINGLE, BumpTest, RecordFile, Recording, Unknown
from exfit.fitting.nuisances.kinds import Nuisance
from exfit.fitting.nuisances.sine import COSINE, FREQUENCY, SINE
from exfit.fitting.parameters import FreeParameter
from exfit.plants import BREAKER, REFERENCES, VT0
from exfit.signals import SIGNALS
from exfit.simulation.inputs import InputStep

OFFSET = "frequency_offset"
TURN = 2.0 * pi
OPENING = "breaker.opens"  # the name of the instant, as its place in a test


def shifted(test: BumpTest, file: RecordFile, steps: Sequence[InputStep]) -> bool:
    """Test whether the instant of a step can be found by shifting the whole response.

    That leaves the simulation as it is, and with it the steps at which limits are met; a smooth
    step that moves over the grid meets them now a step earlier, now later, and so gives the cost a
    kink for each. It needs an only step from rest, and signals that do not jump with it; or else,
    as with a breaker that opens, bounds between two samples.
    """
    if steps and steps[0].signal == BREAKER:
        return True
    jumps = any(SIGNALS[signal].jumps for signal in file.channels)
    return len(steps) == 1 and test.begin is None and not jumps


def finds_level(test: BumpTest, file: RecordFile) -> bool:
    """Test whether a fit finds the voltage before the test though the case does not ask for it.

    Where a breaker opens vt jumps from that level, and the jump is what shows X''d: the noise of
    the level's mean is noise of the jump, which the intervals must include.
    """
    return test.breaker is not None and test.vt0 is None and "vt" in file.channels


def prefix_of(recording: Recording) -> str:
    """Beginning of the names of a record's nuisances."""
    return prefix_from(recording.name)


def prefix_from(name: str) -> str:
    """Beginning of the names of the nuisances of a record of this name."""
    return "" if name == SINGLE else f"{name}."


def names_of(recording: Recording) -> tuple[str, ...]:
    """Return the names of all that a fit finds about a record."""
    test, file = recording.test, recording.record
    steps = [InputStep(0.0, 0.0, signal) for signal in REFERENCES for _ in test.events(signal)]
    prefix = prefix_of(recording)
    if test.breaker is not None:
        steps.append(InputStep(0.0, 1.0, BREAKER))
    if test.frequency_offset is not None:
        steps.append(InputStep(0.0, 0.0, "angle"))
    nuisances = [*_of_steps(prefix, test, steps, shift=False), *_of_record(prefix, test, file)]
    level = (f"{prefix}{VT0}",) if finds_level(test, file) else ()
    return (*(nuisance.name for nuisance, _ in nuisances), *level, *_sine_names(prefix, file))


def _sine_names(prefix: str, file: RecordFile) -> Iterator[str]:
    """Yield the names of all that a fit may find about the periodic disturbances of a record."""
    for signal, channel in file.channels.items():
        if channel.sine is not None:
            fixed = not isinstance(channel.sine.frequency, Unknown)
            for part in (COSINE, SINE) if fixed else (FREQUENCY, COSINE, SINE):
                yield f"{prefix}{signal}.sine.{part}"


def nuisance_parameters(
    prefix: str,
    test: BumpTest,
    file: RecordFile,
    steps: Sequence[InputStep],
    alone: bool = True,
    scaled: Collection[str] = (),
) -> tuple[tuple[Nuisance, ...], tuple[FreeParameter, ...]]:
    """List the nuisances of a record; the names begin with ``prefix``.

    ``alone`` says that nothing but the steps moves the unit; ``scaled`` are the channels that drive
    it, whose scale is a parameter of the system.
    """
    shift = alone and shifted(test, file, steps)
    nuisances = [*_of_steps(prefix, test, steps, shift), *_of_record(prefix, test, file, scaled)]
    return tuple(nuisance for nuisance, _ in nuisances), tuple(
        _free(nuisance.name, value) for nuisance, value in nuisances
    )


def _of_steps(
    prefix: str, test: BumpTest, steps: Sequence[InputStep], shift: bool
) -> Iterator[tuple[Nuisance, Unknown]]:
    for signal in REFERENCES:
        places = [place for place, change in enumerate(steps) if change.signal == signal]
        for number, (place, step) in enumerate(zip(places, test.events(signal), strict=True)):
            which = f"{prefix}{signal}{number + 1 if number else ''}"
            if isinstance(step.at, Unknown):
                yield Nuisance(f"{which}.at", "shift" if shift else "at", place), step.at
            if isinstance(step.step, Unknown):
                yield Nuisance(f"{which}.step", "step", place), step.step
    if isinstance(test.frequency_offset, Unknown):
        place = len(steps) - 1  # the last of all
        factor = TURN * steps[place].ramp
        yield Nuisance(f"{prefix}{OFFSET}", "drift", place, factor=factor), test.frequency_offset
    if test.breaker is not None and isinstance(test.breaker.opens, Unknown):
        # the only step of its test
        yield Nuisance(f"{prefix}{OPENING}", "shift"), test.breaker.opens


def _of_record(
    prefix: str, test: BumpTest, file: RecordFile, scaled: Collection[str] = ()
) -> Iterator[tuple[Nuisance, Unknown]]:
    if isinstance(test.vt0, Unknown):
        yield Nuisance(f"{prefix}{VT0}", "vt0"), test.vt0
    if isinstance(file.delay, Unknown):
        yield Nuisance(f"{prefix}delay", "delay"), file.delay
    kinds: tuple[Literal["scale", "offset"], ...] = ("scale", "offset")
    for signal, channel in file.channels.items():
        for kind in kinds:
            value = getattr(channel, kind, None)
            if isinstance(value, Unknown):
                driving = kind == "scale" and signal in scaled
                name = f"{prefix}{signal}.{kind}"
                yield Nuisance(name, "driving" if driving else kind, signal=signal), value


def _free(name: str, value: Unknown) -> FreeParameter:
    if value.start == "auto" or value.min is None or value.max is None:
        raise TypeError(f"{name} has no start or bounds")
    return FreeParameter(name, value.start, value.min, value.max, logarithmic=False)
