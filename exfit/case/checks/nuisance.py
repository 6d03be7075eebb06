"""What contradicts itself in the values of a record or its test that a fit is to find."""

from collections.abc import Iterator, Sequence

from exfit.case.checks.model import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, REFERENCES, PlantKind
from exfit.util.text import show

AUTOMATIC = ("at", "step")  # what a record shows of the first step of the reference
LEVEL_OF = "vt"  # the signal whose level at rest a machine starts with
LEVEL = "vt0"  # what it shows before that step


def nuisance_faults(
    test: ContentNode, record: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what the fit shall find about a record: instants, sizes, levels."""
    for value in _findable(test, record):
        if not value.is_section:
            continue
        yield from _value_faults(value)
        if kind.plays_back and not (_scale_of(value, kind) or _of_event(value, kind)):
            yield value.fault(f"not allowed with plant {kind.name}: the record drives it")
        elif value.at("start").text == "auto":
            yield from _automatic_faults(value.at("start"), record, has_record)
    yield from _ramp_faults(test.at("vref").entries)
    yield from _level_faults(test, record.at("channels", "vt"))
    for _, channel in record.at("channels").sections:
        yield from _frequency_faults(channel.at("sine", "frequency"))
    delay = record.at("delay")
    if kind.plays_back and not kind.finds_rest and (delay.number or 0.0) != 0.0:
        yield delay.fault(f"not allowed with plant {kind.name}")


def _scale_of(value: ContentNode, kind: PlantKind) -> bool:
    """Tell if a value is the scale of a channel that a fit may find in a playback."""
    *_, signal, key = value.place
    return bool(kind.scaled) and key == "scale" and signal != LEVEL_OF


def _of_event(value: ContentNode, kind: PlantKind) -> bool:
    """Tell if a value is one of an event: the offset of its frequency, or a delay."""
    return kind.finds_rest and value.place[-1] in ("frequency_offset", "delay")


def _findable(test: ContentNode, record: ContentNode) -> Iterator[ContentNode]:
    """Yield the places at which a number or {start, min, max} is allowed."""
    yield test.at("vt0")
    for name in REFERENCES:
        for step in test.at(name).entries:
            yield step.at("at")
            yield step.at("step")
    yield test.at(BREAKER, "opens")
    yield test.at("frequency_offset")
    yield record.at("delay")
    for _, channel in record.at("channels").sections:
        yield channel.at("scale")
        yield channel.at("offset")


def _automatic_faults(start: ContentNode, record: ContentNode, has_record: bool) -> Iterator[Fault]:
    if not has_record:
        yield start.fault("auto needs a record")
    elif "vt" not in record.at("channels"):
        yield start.fault("auto needs vt in the record")


def _frequency_faults(frequency: ContentNode) -> Iterator[Fault]:
    """Yield the faults of the frequency of a periodic disturbance."""
    if frequency.is_section:
        automatic = frequency.at("start").text == "auto"
        yield from _bound_faults(frequency, needed=not automatic)
    for number in (frequency, frequency.at("start"), frequency.at("min"), frequency.at("max")):
        if number.number is not None and number.number <= 0.0:
            yield number.fault(f"{show(number.number)} Hz must be above 0")


def _ramp_faults(steps: Sequence[ContentNode]) -> Iterator[Fault]:
    for step in steps:
        automatic = "auto" in (step.at(key, "start").text for key in AUTOMATIC)
        if automatic and "ramp" in step:
            text = "auto finds a step: of a ramp give start, min and max of at and step"
            yield step.at("ramp").fault(text)


def _level_faults(test: ContentNode, vt: ContentNode) -> Iterator[Fault]:
    """Yield the voltage that is missing where a fit finds scale or offset of the recorded one."""
    unknown = [key for key in ("scale", "offset") if vt.at(key).is_section]
    shown = "vt0" not in test or test.at("vt0", "start").text == "auto"
    if test.content and unknown and shown:
        text = f"is missing: the record does not show it where {unknown[0]} of vt is to be found"
        yield test.at("vt0").fault(text)


def _value_faults(value: ContentNode) -> Iterator[Fault]:
    """Yield the faults of one value that the fit shall find: its bounds and its start."""
    key = value.place[-1]
    automatic = value.at("start").text == "auto"
    of_step = key in AUTOMATIC and value.place[-3:-1] == ("vref", 0)
    if automatic and not (of_step or key == LEVEL or value.place[-2] == BREAKER):
        text = "auto finds the first step of vref, its at and its step, vt0, or breaker.opens"
        yield value.at("start").fault(text)
    yield from _bound_faults(value, needed=not automatic)
    low, high = value.at("min").number, value.at("max").number
    if key in ("step", "scale") and low is not None and high is not None and low <= 0 <= high:
        yield value.at("min").fault(f"{show(low)} ... {show(high)} contains 0")


def _bound_faults(value: ContentNode, needed: bool) -> Iterator[Fault]:
    """Yield the bounds that are missing where they are ``needed``, or contradict the start."""
    for bound in ("min", "max"):
        if bound not in value and needed:
            yield value.at(bound).fault("is missing")
    yield from bound_faults(value)
