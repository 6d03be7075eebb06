"""Which signal each channel is: what is sure, what is a guess and why, and what must be asked."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from exfit.records.channel_inspection import AT_REST_PU, InspectedChannel, InspectedPhases
from exfit.records.channel_names import (
    CONTROL_ERROR,
    Clarity,
    Guess,
    NameReading,
    guess_signals,
    read_name,
)
from exfit.records.field_base import PERCENT
from exfit.records.steps import RecordedStep
from exfit.records.units import quantity_of
from exfit.signals import OF_BUMP_TEST, SIGNALS

RESPONDING = (*OF_BUMP_TEST, "vref")  # signals that move for good with a step of the reference
LARGEST_DEVIATION = 0.5  # pu: where a speed rests nearer to zero, it is a deviation
LARGEST_ERROR = 0.5  # of all that a control error moves: how far from zero it rests


@dataclass(frozen=True)
class Identity:
    """The signal that a channel is taken for; ``question`` is what must be asked about it."""

    signal: str | None = None
    sure: bool = False
    why: str = ""
    question: str = ""
    system_base: bool = False


def identified(
    channels: Sequence[InspectedChannel],
    steps: Sequence[RecordedStep],
    groups: Sequence[InspectedPhases] = (),
    of_pmu: Collection[str] = (),
) -> tuple[InspectedChannel, ...]:
    """Return the channels with the signals that they are by name, unit, level and steps.

    Those of ``groups`` are phases, and no signal by themselves; nor are those ``of_pmu``, the
    phasors of a measurement unit.
    """
    candidates = _candidates(channels, groups, of_pmu)
    units = {name: channel.unit for name, channel in candidates.items() if channel.unit}
    moving = {name for step in steps for name in step.sizes}
    guesses = guess_signals([*candidates], units, moving)
    taken = {guess.signal for guess in guesses.values()} | {"vt" for _ in (*groups[:1], *of_pmu)}
    identities = {}
    for name, channel in candidates.items():
        if name in guesses:
            identities[name] = _identity(channel, guesses[name], name in moving, bool(steps))
        elif name in moving or not steps:
            identities[name] = Identity(question=_open_question(channel, taken, candidates))
    return tuple(_with(channel, identities) for channel in channels)


def _candidates(
    channels: Sequence[InspectedChannel],
    groups: Sequence[InspectedPhases],
    of_pmu: Collection[str],
) -> dict[str, InspectedChannel]:
    """Return the channels that may be a signal, by name."""
    phases = {name for group in groups for name in group.columns}.union(of_pmu)
    return {
        channel.name: channel
        for channel in channels
        if not (channel.name in phases or channel.constant or _is_control_error(channel))
    }


def _with(channel: InspectedChannel, identities: Mapping[str, Identity]) -> InspectedChannel:
    identity = identities.get(channel.name, Identity())
    return replace(
        channel,
        signal=identity.signal,
        sure=identity.sure,
        why=identity.why,
        question=identity.question,
        system_base=identity.system_base,
    )


def _is_control_error(channel: InspectedChannel) -> bool:
    """Check whether a channel that may be a control error rests at zero, as one does."""
    others = read_name(channel.name, channel.unit).others
    swing = channel.high - channel.low
    return CONTROL_ERROR in others and abs(channel.level) < LARGEST_ERROR * swing


def _identity(channel: InspectedChannel, guess: Guess, moves: bool, tested: bool) -> Identity:
    """Identify a channel; ``tested`` says whether the record shows any step."""
    reading, signal = guess.reading, guess.signal
    still = tested and not moves and signal in RESPONDING
    question = "; ".join(_questions(channel, guess, still))
    sure = reading.clarity <= Clarity.WORDS and not (reading.others or guess.rivals or still)
    reasons = "; ".join(_reasons(channel, reading, moves))
    return Identity(signal, sure, reasons, question, reading.system_base)


def _reasons(channel: InspectedChannel, reading: NameReading, moves: bool) -> Iterator[str]:
    """Give the reasons for the signal of a channel: name, unit, level, shape."""
    if reading.why:
        yield reading.why
    if quantity_of(channel.unit):
        yield f"its unit: {channel.unit}{' alone' if reading.clarity is Clarity.UNIT else ''}"
    low, high = AT_REST_PU
    if reading.signal == "vt" and channel.seems_per_unit and low <= channel.level <= high:
        yield f"its level: {channel.level:.4g} pu at rest"
    if moves:
        yield "its shape: it moves with the step"


def _questions(channel: InspectedChannel, guess: Guess, still: bool) -> Iterator[str]:
    reading, signal = guess.reading, guess.signal
    what = SIGNALS[signal].name
    for other in reading.others:
        yield f"is it the {what}, or {other}? It is taken for {signal}, by {reading.why}"
    if reading.clarity is Clarity.QUANTITY and not _looks_terminal(channel):
        yield f"is it the {what}? {reading.why} does not say of what"
    if guess.rivals:
        rivals = " or ".join(guess.rivals)
        yield f"is it the {what}, or is {rivals}? The first is taken for {signal}"
    if still:
        yield f"is it the {what}? It does not move with the step"
    if signal == "speed" and abs(channel.level) < LARGEST_DEVIATION:
        yield f"is it the speed's deviation? It rests at {channel.level:.2g}: then offset: 1"
    if reading.system_base:
        yield (
            f"1 pu of {reading.why} is that of the grid, mostly 100 MVA: its base is the rated MVA "
            "over it"
        )


def _looks_terminal(channel: InspectedChannel) -> bool:
    """Check unit and level of a voltage for those of a generator's terminals."""
    low, high = AT_REST_PU
    level = channel.level / PERCENT if channel.unit == "%" else channel.level
    return channel.unit == "kV" or (channel.unit in ("%", "pu", None) and low <= level <= high)


def _open_question(
    channel: InspectedChannel, taken: Collection[str], candidates: Mapping[str, InspectedChannel]
) -> str:
    """Question about a channel that is taken for no signal, "" for none."""
    reading = read_name(channel.name, channel.unit)
    if reading.others and not {*reading.others} & {*taken}:
        return f"is it {' or '.join(reading.others)}? {reading.why} fits either"
    if reading.signal is not None and reading.signal not in taken:
        return _question_among(channel, reading.signal, candidates)
    return "" if reading.why else _question_by_unit(channel, taken)


def _question_among(
    channel: InspectedChannel, signal: str, candidates: Mapping[str, InspectedChannel]
) -> str:
    """Return the question which of several columns is a signal."""
    rivals = [
        name
        for name, other in candidates.items()
        if other is not channel and read_name(name, other.unit).signal == signal
    ]
    return f"is it {signal}, the {SIGNALS[signal].name}, or is {' or '.join(rivals)}?"


def _question_by_unit(channel: InspectedChannel, taken: Collection[str]) -> str:
    """Return the question which signal that is still missing a channel of a fitting unit is."""
    quantity = quantity_of(channel.unit)
    missing = [
        signal
        for signal in OF_BUMP_TEST
        if signal not in taken and quantity in (None, SIGNALS[signal].quantity)
    ]
    return f"is it {' or '.join(missing)}? It moves with the step" if missing else ""
