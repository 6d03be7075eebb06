"""What the channels of a record contradict in each other, or in what a test can be.

So it is with the way that they move at a step, and with the base of field voltage and field current
in per unit, by where the machine rests with it.
"""

from collections.abc import Iterator, Sequence
from math import copysign
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from exfit.signals import SIGNALS

if TYPE_CHECKING:
    from exfit.records.channel_inspection import InspectedChannel
    from exfit.records.steps import RecordedStep

Channels: TypeAlias = "Sequence[InspectedChannel]"

LARGEST_STEP = 0.2  # pu: no regulator is tested with more
FIELD = ("efd", "ifd")  # what rises for good where vt does
FOLLOWS = (*FIELD, "vref")
CERTAIN_CHANGE = (0.01, 6.0)  # of the level and times the noise: a change whose sign is certain
PERCENT = 100.0
ON_LOAD = 0.05  # pu of power at rest: with less the breaker is taken for open
CERTAIN_POWER = 10.0  # times its noise: with less a power is none
# of the voltage: where field voltage and current rest in per unit of the air-gap line
WITHOUT_LOAD = (0.95, 1.6)  # the air-gap line, and its excess by saturation
OVEREXCITED = (0.95, 5.0)  # to ceiling
ON_LOAD_ANYHOW = (0.5, 5.0)  # under-excited to ceiling
USUAL_WITHOUT_LOAD, USUAL_ON_LOAD = 1.1, 2.0
SAME_BASE = 0.2  # of their level: how far efd and ifd in per unit may be from each other at rest
WITHOUT_SATURATION = 0.01  # of the voltage: so near to it a machine rests that does not saturate


class ScaleRange(NamedTuple):
    """The factor on the numbers of a column, within its range, where it is to be found."""

    start: float
    low: float
    high: float


# ---- at a step


def contradictions(channels: Channels, steps: Sequence["RecordedStep"]) -> Iterator[str]:
    """Find the contradictions between the channels of a file, in sentences."""
    voltage = _of(channels, "vt")
    for step in steps:
        for channel in filter(None, (_of(channels, "vref"), voltage)):
            size = None if step.from_start else channel.change_at(step)
            if size is not None and abs(size) > LARGEST_STEP:
                yield f"{channel.name}: changes at {step.at:.4g} s; {size_in_words(size)}"
        disputed = sign_disputed_by(channels, steps, step)
        if voltage is not None:
            undisputed = [channel for channel in channels if channel not in disputed]
            yield from _opposite(voltage, undisputed, step)
        for channel in disputed:
            size = step.sizes[channel.name]
            yield (
                f"{channel.name}: {'falls' if size < 0.0 else 'rises'} by {abs(size):.3g} at "
                f"{step.at:.4g} s, against the voltage: the direction of that step is open, give "
                "its size with its sign"
            )


def size_in_words(size: float) -> str:
    """Describe a step of the reference (pu) as too large for a test."""
    return (
        f"{size:+.4g} pu is {100.0 * size:+.4g} % of rated voltage, beyond "
        f"{100.0 * LARGEST_STEP:g} %: too large for a test; 5 % is 0.05 pu"
    )


def sign_disputed_by(
    channels: Channels,
    steps: Sequence["RecordedStep"],
    step: "RecordedStep",
) -> tuple["InspectedChannel", ...]:
    """Return the channels of the field that leave open which way a step went.

    They certainly move against the voltage, which hardly changes there, or with which they move at
    other steps: a channel that always moves against it is inverted.
    """
    voltage = _of(channels, "vt")
    if voltage is None or step.sizes.get(voltage.name, 0.0) == 0.0:
        return ()
    hardly = not _certain(voltage, step.sizes[voltage.name])
    disputed = []
    for channel in filter(None, (_of(channels, signal) for signal in FIELD)):
        against = not channel.inverted and _moves_with(voltage, channel, step) < 0.0
        if against and (
            hardly or any(_moves_with(voltage, channel, other) > 0.0 for other in steps)
        ):
            disputed.append(channel)
    return tuple(disputed)


def direction_by_others(channels: Channels, step: "RecordedStep") -> float:
    """Sign of a step by the field and the reactive power; 0 where they show none, or both."""
    signs = {
        copysign(1.0, size)
        for channel in filter(None, (_of(channels, signal) for signal in (*FIELD, "q")))
        if not channel.inverted and _certain(channel, size := step.sizes.get(channel.name, 0.0))
    }
    return signs.pop() if len(signs) == 1 else 0.0


def _opposite(
    voltage: "InspectedChannel", channels: Channels, step: "RecordedStep"
) -> Iterator[str]:
    """Yield the signals that fall for good where the voltage rises, or the other way round."""
    if not _certain(voltage, step.sizes.get(voltage.name, 0.0)):
        return
    for channel in filter(None, (_of(channels, signal) for signal in FOLLOWS)):
        if not channel.inverted and _moves_with(voltage, channel, step) < 0.0:
            size = step.sizes[channel.name]
            moves = ("falls", "rises") if size < 0.0 else ("rises", "falls")
            yield (
                f"{channel.name}: {moves[0]} by {abs(size):.3g} at {step.at:.4g} s where "
                f"{voltage.name} {moves[1]}: if it is the {SIGNALS[str(channel.signal)].name}, the "
                "channel is inverted, and scale: -1 with an offset turns it"
            )


def _moves_with(
    voltage: "InspectedChannel", channel: "InspectedChannel", step: "RecordedStep"
) -> float:
    """Return more than 0 where a channel certainly moves as the voltage does, less if against."""
    size = step.sizes.get(channel.name, 0.0)
    return size * step.sizes.get(voltage.name, 0.0) if _certain(channel, size) else 0.0


def _certain(channel: "InspectedChannel", size: float) -> bool:
    share, times = CERTAIN_CHANGE
    return abs(size) > max(share * abs(channel.level), times * channel.noise)


def _of(channels: Channels, signal: str) -> "InspectedChannel | None":
    return next((channel for channel in channels if channel.signal == signal), None)


# ---- at rest


def is_on_load(channels: Channels) -> bool:
    """Check for active power at rest in a channel, or for a record of a load rejection."""
    power = _of(channels, "p")
    rejected = any(channel.rejected_load for channel in channels)
    return rejected or (power is not None and shows_power(power))


def shows_power(power: "InspectedChannel") -> bool:
    """Check for power at rest in a channel of active power."""
    return abs(power.level) > max(ON_LOAD, CERTAIN_POWER * power.noise)


def scale_to_find(channel: "InspectedChannel", channels: Channels) -> ScaleRange | None:
    """Return the scale of a field channel with another base than the machine's; None for others."""
    level = _level_pu(channel)
    if channel.signal not in FIELD or level is None or level == 0.0:
        return None
    low, high = _range(channels)
    if low <= abs(level) <= high or any(each.may_be_load for each in channels):
        return None
    usual = _voltage(channels) * (USUAL_ON_LOAD if is_on_load(channels) else USUAL_WITHOUT_LOAD)
    limits = sorted((low / channel.level, high / channel.level))
    return ScaleRange(usual / channel.level, *limits)


def base_findings(channels: Channels) -> Iterator[str]:
    """Find contradictions to a field voltage and current in per unit of the air-gap line."""
    on_load, in_range = is_on_load(channels), {}
    for channel in filter(None, (_of(channels, signal) for signal in FIELD)):
        level = _level_pu(channel)
        if level is None:
            continue
        rests = f"{channel.name}: rests at {channel.level:.4g}{' %' * (channel.unit == '%')}"
        if scale_to_find(channel, channels) is not None:
            low, high = _range(channels)
            yield (
                f"{rests}, the machine {'on load' if on_load else 'with the breaker open'} at "
                f"{low:.3g} to {high:.3g} pu: 1 pu of {channel.signal} is that of the air-gap "
                "line; give the base of the channel, or fit its scale"
            )
            continue
        in_range[channel.name] = level
        if abs(level / _voltage(channels) - 1.0) < WITHOUT_SATURATION and not on_load:
            yield (
                f"{rests}, as the voltage does: a machine without saturation, or is 1 pu of "
                f"{channel.signal} that at no load? Then its base is 1 / (1 + S(1.0)), e.g. 0.89"
            )
    if len(in_range) == len(FIELD) and min(in_range.values()) > 0.0:
        (first, at), (second, other) = in_range.items()
        if abs(at - other) > SAME_BASE * max(at, other):
            yield (
                f"{first} rests at {at:.4g}, {second} at {other:.4g}: in per unit of the air-gap "
                "line both are equal at rest, so one of the two bases is wrong"
            )


def _level_pu(channel: "InspectedChannel") -> float | None:
    """Return the level at rest of a channel that is taken for per unit or in per cent."""
    if channel.unit == "%":
        return channel.level / PERCENT
    return channel.level if channel.seems_per_unit else None


def _voltage(channels: Channels) -> float:
    """Return the voltage at rest, pu; 1 where it is not known."""
    voltage = _of(channels, "vt")
    level = None if voltage is None else _level_pu(voltage)
    return level if level is not None and level > 0.0 else 1.0


def _range(channels: Channels) -> tuple[float, float]:
    """Range in which field voltage and current rest, pu of the air-gap line."""
    reactive = _of(channels, "q")
    shares = WITHOUT_LOAD
    if is_on_load(channels):
        over = reactive is not None and reactive.level > 0.0
        shares = OVEREXCITED if over else ON_LOAD_ANYHOW
    low, high = (share * _voltage(channels) for share in shares)
    return low, high
