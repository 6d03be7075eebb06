"""What the channels of a record contradict in each other, or in what a test can be."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from exfit.records.channel_inspection import InspectedChannel
from exfit.records.steps import RecordedStep
from exfit.signals import SIGNALS

LARGEST_STEP = 0.2  # pu: no regulator is tested with more
FIELD = ("efd", "ifd")  # what rises for good where vt does
FOLLOWS = (*FIELD, "vref")
CERTAIN_CHANGE = (0.01, 6.0)  # of the level and times the noise: a change whose sign is certain


def contradictions(
    channels: Sequence[InspectedChannel], steps: Sequence[RecordedStep]
) -> Iterator[str]:
    """Find the contradictions between the channels of a file, in sentences."""
    by_signal = {channel.signal: channel for channel in channels if channel.signal}
    voltage = by_signal.get("vt")
    for step in steps:
        yield from _too_large(by_signal, step)
        disputed = sign_disputed_by(channels, steps, step)
        if voltage is not None:
            undisputed = {name: c for name, c in by_signal.items() if c not in disputed}
            yield from _opposite(voltage, undisputed, step)
        for channel in disputed:
            size = step.sizes[channel.name]
            yield (
                f"{channel.name}: {'falls' if size < 0.0 else 'rises'} by {abs(size):.3g} at "
                f"{step.at:.4g} s, against the voltage: which way that step went is open, give its "
                "size with its sign"
            )


def sign_disputed_by(
    channels: Iterable[InspectedChannel], steps: Sequence[RecordedStep], step: RecordedStep
) -> tuple[InspectedChannel, ...]:
    """Return the channels of the field that leave open which way a step went.

    They certainly move against the voltage, which hardly changes there, or with which they move at
    other steps: a channel that always moves against it is inverted.
    """
    by_signal = {channel.signal: channel for channel in channels if channel.signal}
    voltage = by_signal.get("vt")
    if voltage is None or step.sizes.get(voltage.name, 0.0) == 0.0:
        return ()
    field = (by_signal[signal] for signal in FIELD if signal in by_signal)
    return tuple(channel for channel in field if _disputes(channel, voltage, steps, step))


def _disputes(
    channel: InspectedChannel,
    voltage: InspectedChannel,
    steps: Sequence[RecordedStep],
    step: RecordedStep,
) -> bool:
    if channel.inverted or not _moved_with(voltage, channel, step, -1.0):
        return False
    hardly = not _certain(voltage, step.sizes[voltage.name])
    return hardly or any(_moved_with(voltage, channel, other, 1.0) for other in steps)


def size_in_words(size: float) -> str:
    """Describe a step of the reference (pu) as too large for a test."""
    return (
        f"{size:+.4g} pu is {100.0 * size:+.4g} % of rated voltage, beyond "
        f"{100.0 * LARGEST_STEP:g} %: no regulator is tested so; 5 % is 0.05 pu"
    )


def _too_large(channels: Mapping[str, InspectedChannel], step: RecordedStep) -> Iterator[str]:
    """Yield the changes of the voltage and its reference that no test makes."""
    for signal in ("vref", "vt"):
        channel = channels.get(signal)
        size = None if channel is None or step.from_start else channel.change_at(step)
        if channel is not None and size is not None and abs(size) > LARGEST_STEP:
            yield f"{channel.name}: changes at {step.at:.4g} s; {size_in_words(size)}"


def _opposite(
    voltage: InspectedChannel, channels: Mapping[str, InspectedChannel], step: RecordedStep
) -> Iterator[str]:
    """Yield the signals that fall for good where the voltage rises, or the other way round."""
    change = step.sizes.get(voltage.name)
    if change is None or not _certain(voltage, change):
        return
    for signal in FOLLOWS:
        channel = channels.get(signal)
        size = 0.0 if channel is None else step.sizes.get(channel.name, 0.0)
        if channel is None or channel.inverted or not _certain(channel, size):
            continue
        if size * change < 0.0:
            moves = ("falls", "rises") if size < 0.0 else ("rises", "falls")
            yield (
                f"{channel.name}: {moves[0]} by {abs(size):.3g} at {step.at:.4g} s where "
                f"{voltage.name} {moves[1]}: if it is the {SIGNALS[signal].name}, the channel is "
                "inverted, and scale: -1 with an offset turns it"
            )


def _moved_with(
    voltage: InspectedChannel, channel: InspectedChannel, step: RecordedStep, sign: float
) -> bool:
    """Check whether a channel certainly moves as the voltage does, or against it (-1)."""
    size = step.sizes.get(channel.name, 0.0)
    return _certain(channel, size) and sign * size * step.sizes.get(voltage.name, 0.0) > 0.0


def _certain(channel: InspectedChannel, size: float) -> bool:
    share, times = CERTAIN_CHANGE
    return abs(size) > max(share * abs(channel.level), times * channel.noise)
