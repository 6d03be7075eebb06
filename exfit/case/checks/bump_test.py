"""What contradicts itself in a test: its steps, its references, its breaker, what a fit finds."""

from collections.abc import Iterator
from itertools import pairwise

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, EVENTS, REFERENCES, SPEED, SWITCHED, PlantKind
from exfit.util.text import show

AUTOMATIC = ("at", "step")  # what a record shows of the first step of the reference
RECORDED = "recorded"  # in place of steps: the channel of the record


def bump_test_faults(test: ContentNode, network: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of a test; ``network`` is that of its plant."""
    duration = test.at("duration").number
    for name in EVENTS:
        yield from _step_faults(test, name)
        if "table" in test.at(name):
            from exfit.case.checks.tables import table_faults

            yield from table_faults(test.at(name), duration)
        for place, at in moves_of(test.at(name)):
            yield from place_faults(place, at, duration)
        if name not in kind.events and name in test:
            yield test.at(name).fault(f"not allowed with plant {kind.name}")
    if "fault" in test:
        from exfit.case.checks.terminal_fault import terminal_fault_faults

        yield from terminal_fault_faults(test.at("fault"), duration)
    if not kind.finds_rest and test.at("frequency_offset").value is not None:
        yield test.at("frequency_offset").fault(no_event(kind))
    if {"speed", "speed_change"} & test.content.keys():
        from exfit.case.checks.speed import speed_faults

        yield from speed_faults(test, kind)
    yield from _switch_faults(test, network, kind)
    if not kind.plays_back and test.content and not {*EVENTS} & test.content.keys():
        yield test.fault(f"no step: give one of {', '.join(kind.events)}")
    yield from _rest_faults(test, kind)


def _switch_faults(test: ContentNode, network: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield switchings of what the network does not have."""
    there = {row.symbol for row in kind.network(network.content)}
    for switch in test.at("network").entries if "network" in kind.events else ():
        for name in SWITCHED:
            if switch.at(name).number is not None and name not in there:
                steps = "; test.E changes it by steps" if name == "E" else ""
                yield switch.at(name).fault(f"only where plant.network gives {name}{steps}")


def _rest_faults(test: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield what contradicts itself in the state of rest before a test."""
    steady, instants = test.at("steady_until"), [at for _, at in instants_of(test)]
    if kind.plays_back and "begin" in test:
        text = f"not allowed with plant {kind.name}: the record drives the simulation"
        yield test.at("begin").fault(text)
    if steady.number is None:
        if kind.plays_back and not kind.finds_rest and not instants:
            yield steady.fault("is missing: until when is the record at rest?")
    elif instants and steady.number > min(instants):
        text = f"{show(steady.number)} s is after the first step, at {show(min(instants))} s"
        yield steady.fault(text)
    if kind.per_unit:
        vt0 = test.at("vt0")
        for node, voltage in ((vt0, vt0.start), (vt0.at("min"), vt0.at("min").number)):
            if voltage is not None and voltage <= 0:
                yield node.fault(f"{show(voltage)} is not above 0")


def no_event(kind: PlantKind) -> str:
    """Say why a key of a grid event is refused."""
    return f"not allowed with plant {kind.name}: no grid event drives it"


def missing_without_record(test: ContentNode) -> Iterator[Fault]:
    """Demand of a test what otherwise a record gives."""
    if "begin" in test:
        yield test.at("begin").fault("only with a record; without one the time begins at 0")
    for key in ("duration", "vt0"):
        if test.content and key not in test:
            yield test.at(key).fault("is missing: without a record it must be given")


def instants_of(test: ContentNode) -> Iterator[tuple[ContentNode, float]]:
    """Yield the readable instants of all events of a test, with their places."""
    for name in EVENTS:
        for event in test.at(name).entries:
            at = event.at("at").start
            if at is not None:
                yield event.at("at"), at
        yield from moves_of(test.at(name))
    opens = test.at(BREAKER, "opens")
    if opens.start is not None:
        yield opens, opens.start


def rows_of(given: ContentNode) -> list[tuple[float, float]]:
    """Return the rows of a table; none where one of them is no row."""
    pairs = [row.pair for row in given.at("table").entries]
    rows = [row for row in pairs if row is not None]
    return rows if len(rows) == len(pairs) else []


def moves_of(given: ContentNode) -> Iterator[tuple[ContentNode, float]]:
    """Yield the instants from which on the lines of a table rise or fall, with their places."""
    for k, ((time, value), (_, then)) in enumerate(pairwise(rows_of(given))):
        if then != value:
            yield given.at("table", k), time


def _step_faults(test: ContentNode, name: str) -> Iterator[Fault]:
    """Yield steps that change nothing, are out of order, or outside the duration."""
    before = ContentNode((), None)
    for step in test.at(name).entries:
        if name == "network" and step.is_section and not {*SWITCHED} & step.content.keys():
            yield step.fault("changes nothing: give R, X, E or a value of the load")
        at, start, ramp = step.at("at").start, before.at("at").start, before.at("ramp").number
        if at is not None:
            if start is not None and at <= start:
                text = f"{show(at)} s is not after {show(start)} s, the step before"
                yield step.at("at").fault(text)
            elif start is not None and ramp is not None and at < start + ramp:
                end = show(start + ramp)
                text = f"{show(at)} s is before {end} s, where the ramp before ends"
                yield step.at("at").fault(text)
            yield from place_faults(step.at("at"), at, test.at("duration").number)
        before = step


def place_faults(place: ContentNode, at: float, end: float | None) -> Iterator[Fault]:
    """Yield an instant outside a test that begins at 0 and has a known end."""
    if end is not None and not 0 <= at < end:
        yield place.fault(f"{show(at)} s lies outside 0 ... {show(end)} s, the duration")


def driving_signals(test: ContentNode, record: ContentNode, kind: PlantKind) -> tuple[str, ...]:
    """Return the channels of a record that drive the machine from the opening of a breaker on."""
    breaker = test.at(BREAKER)
    if not breaker.is_section:
        return ()
    simulated = breaker.at("speed").text == "simulated"
    possible = (*(() if kind.has_exciter else kind.driving), *(() if simulated else (SPEED,)))
    return tuple(signal for signal in possible if signal in record.at("channels"))


def driving_faults(
    channel: ContentNode, idle: tuple[str, ...], fitted: bool = False
) -> Iterator[Fault]:
    """Yield the keys of a channel that are of no use where it drives the simulation.

    ``fitted``: its scale and its offset may be found.
    """
    for key in idle:
        if key in channel:
            text = "has no effect: the signal drives the simulation and is not compared"
            yield channel.at(key).fault(text)
    for key in () if fitted else ("scale", "offset"):
        if channel.at(key).is_section:
            yield channel.at(key).fault("must be a number: the signal drives the simulation")


def reference_faults(
    test: ContentNode, record: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what a test takes from a channel of its record, or from a file."""
    for signal in REFERENCES:
        given, channel = test.at(signal), record.at("channels", signal)
        recorded, elsewhere = channel.value is not None, given.value is not None
        if given.text == RECORDED:
            from exfit.case.checks.recorded import recorded_faults

            yield from recorded_faults(test, record, signal, kind, has_record)
        elif recorded and signal in kind.recorded_inputs:
            text = f"drives nothing: give test.{signal}: {RECORDED}"
            if elsewhere:
                advice = f"give {RECORDED} there, or leave this channel out"
                text = f"test.{signal} gives the signal as well: {advice}"
            yield channel.fault(text)
        elif recorded and elsewhere and signal in kind.driving:
            text = f"the record's channel {signal} gives the signal as well: leave one of them out"
            yield given.fault(text)
        if signal in kind.recorded_inputs:
            yield from driving_faults(channel, ("weight", "noise", "outliers", "averaged"))
        if "file" in given and kind.plays_back:
            text = f"not allowed with plant {kind.name}: give the record a channel {signal}"
            yield given.fault(text)


def findable_faults(
    test: ContentNode, record: ContentNode, kind: PlantKind, has_record: bool
) -> Iterator[Fault]:
    """Yield the faults of what the fit shall find about a record: instants, sizes, levels."""
    for value in _findable(test, record):
        from exfit.case.checks.found import value_faults

        *_, above, key = value.place
        yield from value_faults(value)
        scale = kind.scaled and key == "scale" and above != "vt"
        of_event = kind.finds_rest and key in ("frequency_offset", "delay")
        if kind.plays_back and not scale and not of_event:
            yield value.fault(f"not allowed with plant {kind.name}: the record drives it")
        elif value.at("start").text == "auto":
            if not has_record:
                yield value.at("start").fault("auto needs a record")
            elif "vt" not in record.at("channels"):
                yield value.at("start").fault("auto needs vt in the record")
    yield from _shown_faults(test, record.at("channels"))
    delay = record.at("delay")
    if kind.plays_back and not kind.finds_rest and (delay.number or 0.0) != 0.0:
        yield delay.fault(f"not allowed with plant {kind.name}")


def _findable(test: ContentNode, record: ContentNode) -> list[ContentNode]:
    """Return the values that the fit shall find, given as {start, min, max}."""
    steps = [step for name in REFERENCES for step in test.at(name).entries]
    channels = [channel for _, channel in record.at("channels").sections]
    places = [
        test.at("vt0"),
        *(step.at(key) for step in steps for key in AUTOMATIC),
        test.at(BREAKER, "opens"),
        test.at("frequency_offset"),
        test.at("speed"),
        test.at("speed_change"),
        record.at("delay"),
        *(channel.at(key) for channel in channels for key in ("scale", "offset")),
    ]
    return [place for place in places if place.is_section]


def _shown_faults(test: ContentNode, channels: ContentNode) -> Iterator[Fault]:
    """Yield what a record cannot show: a ramp, a level of an unknown scale; a wrong sine."""
    for step in test.at("vref").entries:
        if "ramp" in step and "auto" in (step.at(key, "start").text for key in AUTOMATIC):
            text = "auto is for a step: for a ramp give start, min and max of at and step"
            yield step.at("ramp").fault(text)
    unknown = [key for key in ("scale", "offset") if channels.at("vt", key).is_section]
    shown = "vt0" not in test or test.at("vt0", "start").text == "auto"
    if test.content and unknown and shown:
        text = f"is missing: the record does not show it while {unknown[0]} of vt is fitted"
        yield test.at("vt0").fault(text)
    for _, channel in channels.sections:
        if "sine" in channel:
            from exfit.case.checks.found import frequency_faults

            yield from frequency_faults(channel.at("sine", "frequency"))
