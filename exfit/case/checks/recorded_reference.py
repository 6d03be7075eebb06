"""What contradicts itself in a reference that was recorded, in the record or in a file."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import channel_faults
from exfit.case.yaml import Fault
from exfit.plants import REFERENCES, PlantKind

RECORDED = "recorded"  # in place of steps: the channel of the record


def recorded_reference_faults(
    test: ContentNode, record: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what a test takes from a channel of its record, or from a file."""
    for signal in REFERENCES:
        given, channel = test.at(signal), record.at("channels", signal)
        if given.text == RECORDED:
            yield from _recorded_faults(test, signal, channel, kind, has_record)
            if "resample" in record:
                text = f"not allowed with test.{signal}: {RECORDED}: its filter smears the jumps"
                yield record.at("resample").fault(text)
        elif channel.value is not None and signal in kind.recorded_inputs:
            yield channel.fault(_not_used(signal, given))
        elif channel.value is not None and given.value is not None and signal in kind.driving:
            text = f"the record's channel {signal} gives the signal as well: leave one of them out"
            yield given.fault(text)
        if signal in kind.recorded_inputs:
            yield from _driving_faults(channel)
        if "file" in given:
            if kind.plays_back:
                text = f"not allowed with plant {kind.name}: give the record a channel {signal}"
                yield given.fault(text)
            yield from channel_faults(signal, given, kind.per_unit)


def stabiliser_channel_faults(
    channels: ContentNode, stabiliser: ContentNode, kind: PlantKind
) -> Iterator[Fault]:
    """Yield the recorded output of a stabiliser beside the stabiliser itself."""
    if kind.plays_back and "vs" in channels and stabiliser.content:
        text = "not allowed with a stabiliser, whose output it is: leave one of them out"
        yield channels.at("vs").fault(text)


def _not_used(signal: str, given: ContentNode) -> str:
    """Return what to do about a channel that drives nothing."""
    if given.value is None:
        return f"drives nothing: give test.{signal}: {RECORDED}"
    return (
        f"test.{signal} gives the signal as well: give {RECORDED} there, or leave this channel out"
    )


def _recorded_faults(
    test: ContentNode, signal: str, channel: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    given = test.at(signal)
    if kind.plays_back:
        text = f"not allowed with plant {kind.name}: record.channels.{signal} drives it without"
        yield given.fault(text)
    elif not has_record:
        yield given.fault(f"{RECORDED} needs a record")
    elif channel.value is None:
        yield channel.fault(f"is missing: test.{signal} is {RECORDED}")
    if "begin" in test and not kind.plays_back:
        text = f"not allowed with {signal}: {RECORDED}: the record shows it from its start only"
        yield test.at("begin").fault(text)


def _driving_faults(channel: ContentNode) -> Iterator[Fault]:
    """Yield the keys of a channel that are of use only where it is compared."""
    for key in ("weight", "noise", "outliers", "averaged"):
        if key in channel:
            text = "has no effect: the signal drives the simulation and is not compared"
            yield channel.at(key).fault(text)
    for key in ("scale", "offset"):
        if channel.at(key).is_section:
            yield channel.at(key).fault("must be a number: the signal drives the simulation")
