"""What contradicts itself in a test in which the breaker opens."""

from collections.abc import Iterator

from exfit.case.checks.bump_test import driving_faults, driving_signals, moves_of, place_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, EVENTS, SPEED, PlantKind
from exfit.util.text import show


def breaker_faults(test: ContentNode, record: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of a breaker that opens, beside the rest of its test and its record."""
    breaker, channels = test.at(BREAKER), record.at("channels")
    if test.value == {} and kind.events == (BREAKER,):
        yield breaker.fault(f"is missing: nothing else acts with plant {kind.name}")
    if not breaker.is_section:
        return
    driving, opens = driving_signals(test, record, kind), breaker.at("opens")
    if breaker.at("speed").text == "recorded" and SPEED not in channels:
        yield breaker.at("speed").fault("recorded needs the channel speed in the record")
    for signal in driving:
        idle = ("weight", "noise", "filter", "outliers", "sine") if signal == SPEED else ()
        yield from driving_faults(channels.at(signal), idle)
    if driving and (record.at("delay").value or 0) != 0:
        text = f"not allowed where the record's {' and '.join(driving)} drives the simulation"
        yield record.at("delay").fault(text)
    if opens.is_section:
        yield from _free_instant_faults(test, driving)
    if opens.start is not None:
        yield from _instant_faults(test, opens, opens.start)


def _free_instant_faults(test: ContentNode, driving: tuple[str, ...]) -> Iterator[Fault]:
    """Refuse an instant of the opening that cannot be found: it shifts the whole response."""
    opens = test.at(BREAKER, "opens")
    others = [name for name in (*EVENTS, "begin") if name != BREAKER and name in test]
    if others:
        text = f"must be a number where the test has {' and '.join(others)} as well"
        yield opens.fault(text)
    if driving:
        text = f"must be a number: the record's {' and '.join(driving)} drives the simulation"
        yield opens.fault(text)


def _instant_faults(test: ContentNode, opens: ContentNode, start: float) -> Iterator[Fault]:
    """Refuse an opening outside the test, and switchings of which the machine is parted."""
    yield from place_faults(opens, start, test.at("duration").number)
    events = [
        (event.at("at"), event.at("at").number)
        for name in ("E", "angle", "network")
        for event in test.at(name).entries
    ]
    for place, at in (*events, *moves_of(test.at("angle"))):
        if at is not None and at >= start:
            parted = f"the breaker is open from {show(start)} s on"
            yield place.fault(f"{show(at)} s: no effect, as {parted}")
