"""What contradicts itself in the opening of a breaker."""

from collections.abc import Iterator

from exfit.case.checks.bump_test import moves_of, place_faults
from exfit.case.checks.node import ContentNode
from exfit.case.checks.record import driving_faults
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, EVENTS, SPEED, PlantKind
from exfit.util.text import show


def breaker_faults(test: ContentNode, record: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of a breaker that opens, beside the rest of its test and its record."""
    if test.at(BREAKER).is_section:
        yield from _opening_faults(test, record, kind)
    elif test.value == {} and kind.events == (BREAKER,):
        yield test.at(BREAKER).fault(f"is missing: nothing else acts with plant {kind.name}")


def _opening_faults(test: ContentNode, record: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of an opening that is given."""
    breaker, channels = test.at(BREAKER), record.at("channels")
    driving = driving_signals(test, record, kind)
    if breaker.at("speed").text == "recorded" and SPEED not in channels:
        yield breaker.at("speed").fault("recorded needs the channel speed in the record")
    if SPEED in driving:
        yield from driving_faults(channels.at(SPEED))
    for signal in driving:
        for key in ("scale", "offset"):
            if channels.at(signal, key).is_section:
                text = "must be a number: the signal drives the simulation"
                yield channels.at(signal, key).fault(text)
    if driving and record.at("delay").value not in (None, 0, 0.0):
        text = f"not allowed where the record's {' and '.join(driving)} drives the simulation"
        yield record.at("delay").fault(text)
    yield from _free_instant_faults(test, driving)
    opens = breaker.at("opens")
    if opens.start is not None:
        yield from place_faults(opens, opens.start, test.at("duration").number)
        yield from _switching_faults(test, opens.start)


def driving_signals(test: ContentNode, record: ContentNode, kind: PlantKind) -> tuple[str, ...]:
    """Return the channels of a record that drive the machine from the opening of a breaker on."""
    breaker, channels = test.at(BREAKER), record.at("channels")
    if not breaker.is_section:
        return ()
    simulated = breaker.at("speed").text == "simulated"
    possible = (*(() if kind.has_exciter else kind.driving), *(() if simulated else (SPEED,)))
    return tuple(signal for signal in possible if signal in channels)


def _free_instant_faults(test: ContentNode, driving: tuple[str, ...]) -> Iterator[Fault]:
    """Refuse an instant of the opening that cannot be found: it shifts the whole response."""
    opens = test.at(BREAKER, "opens")
    if not opens.is_section:
        return
    others = [name for name in (*EVENTS, "begin") if name != BREAKER and name in test]
    if others:
        yield opens.fault(f"must be a number where the test has {' and '.join(others)} as well")
    if driving:
        text = f"must be a number: the record's {' and '.join(driving)} drives the simulation"
        yield opens.fault(text)


def _switching_faults(test: ContentNode, opens: float) -> Iterator[Fault]:
    """Refuse switchings in a network from which the machine is already parted."""
    for name in ("E", "angle", "network"):
        for event in test.at(name).entries:
            at = event.at("at").number
            if at is not None and at >= opens:
                yield _no_effect(event.at("at"), at, opens)
    for place, at in moves_of(test.at("angle")):
        if at >= opens:
            yield _no_effect(place, at, opens)


def _no_effect(place: ContentNode, at: float, opens: float) -> Fault:
    """Return a switching that comes too late."""
    text = f"{show(at)} s: no effect, as the breaker is open from {show(opens)} s on"
    return place.fault(text)
