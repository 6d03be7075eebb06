"""What a fit finds about a record beside the parameters of the unit: instants, sizes, levels."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import TYPE_CHECKING, Literal, TypeAlias

from exfit.case.schema import SINGLE, BumpTest, RecordFile, Recording, Unknown
from exfit.plants import BREAKER, DRIVING_SCALE, REFERENCES, SPEED, VT0
from exfit.signals import SIGNALS
from exfit.simulation.inputs import InputStep

if TYPE_CHECKING:
    from exfit.fitting.parameters import FreeParameter

NuisanceKind = Literal[
    "at", "shift", "step", "drift", "switching", "vt0", "speed", "delay", "scale", "offset",
    "driving", "frequency", "cosine", "sine",
]  # fmt: skip

NUISANCES: Mapping[NuisanceKind, tuple[str, str]] = {
    "at": ("s", "time of a step"),
    "shift": ("s", "time of a step"),
    "step": ("pu", "size of a step"),
    "switching": ("s", "time of a switching in the grid"),
    "drift": ("Hz", "offset of the frequency"),
    "vt0": ("pu", "voltage before the first step"),
    "speed": ("pu", "speed at the start"),
    "delay": ("s", "delay of the recorder"),
    "scale": ("", "factor of a channel"),
    "offset": ("pu", "offset of a channel"),
    "driving": ("", "factor of a channel that drives the machine"),
    "frequency": ("Hz", "frequency of a periodic disturbance"),
    "cosine": ("pu", "cosine amplitude of the disturbance, phase zero at mid-record"),
    "sine": ("pu", "sine amplitude of the disturbance, phase zero at mid-record"),
}  # unit and meaning of each kind


# those that are a parameter of the system
OF_SYSTEM: Mapping[NuisanceKind, str] = {"vt0": VT0, "speed": "speed0", "driving": DRIVING_SCALE}


@dataclass(frozen=True)
class Nuisance:
    """Free parameter of a record, under ``name``: it is none of the unit.

    ``step`` is the index in the inputs of a step whose instant or size it is, ``signal`` the
    channel whose scale, offset or periodic disturbance it is. The instant of an only step is a
    ``shift`` of the whole response: the simulation stays as it is. ``factor`` is what a step is of
    a value that makes it; a ``switching`` is the instant of ``count`` steps from that one on.
    """

    name: str
    kind: NuisanceKind
    step: int = 0
    signal: str = ""
    factor: float = 1.0
    count: int = 1

    @property
    def unit(self) -> str:
        """Its unit."""
        return NUISANCES[self.kind][0]

    @property
    def meaning(self) -> str:
        """Meaning in words."""
        return NUISANCES[self.kind][1]

    def rescales(self, signal: str) -> bool:
        """Test whether it is the scale or the offset of the channel of a signal."""
        return self.signal == signal and self.kind in ("scale", "offset")


Found: TypeAlias = "tuple[Nuisance, FreeParameter]"
TURN = 2.0 * pi
COSINE, SINE, FREQUENCY = "cosine", "sine", "frequency"
OPENING = "breaker.opens"  # the name of the instant, as its place in a test


def finds_level(test: BumpTest, file: RecordFile) -> bool:
    """Test whether a fit finds the voltage before the test though the case does not ask for it.

    Where a breaker opens vt jumps from that level, and the jump is what shows X''d: the noise of
    the level's mean is noise of the jump, which the intervals must include.
    """
    return test.breaker is not None and test.vt0 is None and "vt" in file.channels


def prefix_from(name: str) -> str:
    """Beginning of the names of the nuisances of a record of this name."""
    return "" if name == SINGLE else f"{name}."


def names_of(recording: Recording) -> Iterator[str]:
    """Yield the names of all that a fit finds about a record, but for switchings."""
    test, file, prefix = recording.test, recording.record, prefix_from(recording.name)
    steps = [InputStep(0.0, 0.0, signal) for signal in REFERENCES for _ in test.events(signal)]
    if test.breaker is not None:
        steps.append(InputStep(0.0, 1.0, BREAKER))
    if test.frequency_offset is not None:
        steps.append(InputStep(0.0, 0.0, "angle"))
    if test.speed_change is not None:
        steps.append(InputStep(0.0, 0.0, SPEED))
    yield from (nuisance.name for nuisance, _ in _of_steps(prefix, test, steps, shift=False))
    yield from (nuisance.name for nuisance, _ in _of_record(prefix, test, file))
    if finds_level(test, file):
        yield f"{prefix}{VT0}"
    for signal, channel in file.channels.items():
        if channel.sine is not None:
            fixed = not isinstance(channel.sine.frequency, Unknown)
            for part in (COSINE, SINE) if fixed else (FREQUENCY, COSINE, SINE):
                yield f"{prefix}{signal}.sine.{part}"


def nuisances_of(
    prefix: str,
    test: BumpTest,
    file: RecordFile,
    steps: Sequence[InputStep],
    alone: bool,
    scaled: Collection[str],
) -> list[Found]:
    """List the nuisances of a record; the names begin with ``prefix``.

    ``alone`` says that nothing but the steps moves the unit; ``scaled`` are the channels that drive
    it, whose scale is a parameter of the system.

    Shifting the whole response in place of a step leaves the simulation as it is, and with it the
    steps at which limits are met; a smooth step that moves over the grid meets them now a step
    earlier, now later, and so gives the cost a kink for each. It needs an only step from rest, and
    signals that do not jump with it; or else, as with a breaker that opens, bounds between two
    samples.
    """
    opens = bool(steps) and steps[0].signal == BREAKER
    jumps = any(SIGNALS[signal].jumps for signal in file.channels)
    shift = alone and (opens or (len(steps) == 1 and test.begin is None and not jumps))
    nuisances = list[Found]()
    of_steps = _of_steps(prefix, test, steps, shift)
    for nuisance, value in (*of_steps, *_of_record(prefix, test, file, scaled)):
        if value.start == "auto" or value.min is None or value.max is None:
            raise TypeError(f"{nuisance.name} has no start or bounds")
        from exfit.fitting.parameters import FreeParameter  # most simulations find nothing

        free = FreeParameter(nuisance.name, value.start, value.min, value.max, logarithmic=False)
        nuisances.append((nuisance, free))
    return nuisances


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
        name, place = f"{prefix}frequency_offset", len(steps) - 1  # the last of all
        yield Nuisance(name, "drift", place, factor=TURN * steps[place].ramp), test.frequency_offset
    if isinstance(test.speed_change, Unknown):
        yield Nuisance(f"{prefix}speed_change", "step", len(steps) - 1), test.speed_change
    if test.breaker is not None and isinstance(test.breaker.opens, Unknown):
        # the only step of its test
        yield Nuisance(f"{prefix}{OPENING}", "shift"), test.breaker.opens


def _of_record(
    prefix: str, test: BumpTest, file: RecordFile, scaled: Collection[str] = ()
) -> Iterator[tuple[Nuisance, Unknown]]:
    if isinstance(test.vt0, Unknown):
        yield Nuisance(f"{prefix}{VT0}", "vt0"), test.vt0
    if isinstance(test.speed, Unknown):
        yield Nuisance(f"{prefix}{SPEED}", "speed"), test.speed
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
