"""The base of field voltage and field current in per unit: by where the machine rests with it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from exfit.records.channel_inspection import InspectedChannel

FIELD = ("efd", "ifd")
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


@dataclass(frozen=True)
class ScaleRange:
    """The factor on the numbers of a column, within its range, where it is to be found."""

    start: float
    low: float
    high: float


def is_on_load(channels: Sequence[InspectedChannel]) -> bool:
    """Check for active power at rest in a channel, or for a record of a load rejection."""
    power = _of(channels, "p")
    rejected = any(channel.rejected_load for channel in channels)
    return rejected or (power is not None and shows_power(power))


def shows_power(power: InspectedChannel) -> bool:
    """Check for power at rest in a channel of active power."""
    return abs(power.level) > max(ON_LOAD, CERTAIN_POWER * power.noise)


def scale_to_find(
    channel: InspectedChannel, channels: Sequence[InspectedChannel]
) -> ScaleRange | None:
    """Return the scale of a field channel with another base than the machine's; None for others."""
    level = _level_pu(channel)
    if channel.signal not in FIELD or level is None or level == 0.0:
        return None
    low, high = _range(channels)
    if low <= abs(level) <= high:
        return None
    usual = _voltage(channels) * (USUAL_ON_LOAD if is_on_load(channels) else USUAL_WITHOUT_LOAD)
    limits = sorted((low / channel.level, high / channel.level))
    return ScaleRange(usual / channel.level, *limits)


def base_findings(channels: Sequence[InspectedChannel]) -> Iterator[str]:
    """Find contradictions to a field voltage and current in per unit of the air-gap line."""
    in_range = {}
    for signal in FIELD:
        channel = _of(channels, signal)
        level = None if channel is None else _level_pu(channel)
        if channel is None or level is None:
            continue
        if scale_to_find(channel, channels) is not None:
            yield _out_of_range(channel, channels)
            continue
        in_range[channel.name] = level
        near = abs(level / _voltage(channels) - 1.0) < WITHOUT_SATURATION
        if near and not is_on_load(channels):
            yield (
                f"{channel.name}: rests at {_at(channel)}, as the voltage does: a machine without "
                f"saturation, or is 1 pu of {signal} that without load? Then its base is "
                "1 / (1 + S(1.0)), as 0.89"
            )
    if len(in_range) == len(FIELD) and min(in_range.values()) > 0.0:
        (first, at), (second, other) = in_range.items()
        if abs(at - other) > SAME_BASE * max(at, other):
            yield (
                f"{first} rests at {at:.4g}, {second} at {other:.4g}: in per unit of the air-gap "
                "line both are equal at rest, so that one of them has another base"
            )


def _out_of_range(channel: InspectedChannel, channels: Sequence[InspectedChannel]) -> str:
    low, high = _range(channels)
    where = "on load" if is_on_load(channels) else "with the breaker open"
    return (
        f"{channel.name}: rests at {_at(channel)}, the machine {where} at {low:.3g} to "
        f"{high:.3g} pu: 1 pu of {channel.signal} is that of the air-gap line; give the channel "
        "its base, or have its scale found"
    )


def _at(channel: InspectedChannel) -> str:
    return f"{channel.level:.4g}{' %' if channel.unit == '%' else ''}"


def _of(channels: Sequence[InspectedChannel], signal: str) -> InspectedChannel | None:
    return next((channel for channel in channels if channel.signal == signal), None)


def _level_pu(channel: InspectedChannel) -> float | None:
    """Return the level at rest of a channel that is taken for per unit or in per cent."""
    if channel.unit == "%":
        return channel.level / PERCENT
    return channel.level if channel.seems_per_unit else None


def _voltage(channels: Sequence[InspectedChannel]) -> float:
    """Return the voltage at rest, pu; 1 where it is not known."""
    voltage = _of(channels, "vt")
    level = None if voltage is None else _level_pu(voltage)
    return level if level is not None and level > 0.0 else 1.0


def _range(channels: Sequence[InspectedChannel]) -> tuple[float, float]:
    """Range in which field voltage and current rest, pu of the air-gap line."""
    reactive = _of(channels, "q")
    shares = WITHOUT_LOAD
    if is_on_load(channels):
        over = reactive is not None and reactive.level > 0.0
        shares = OVEREXCITED if over else ON_LOAD_ANYHOW
    low, high = (share * _voltage(channels) for share in shares)
    return low, high
