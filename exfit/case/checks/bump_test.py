"""What contradicts itself in a test: its steps and its references."""

from collections.abc import Iterator, Sequence
from itertools import pairwise

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import BREAKER, EVENTS, PlantKind
from exfit.util.text import show

Row = tuple[float, float]


def table_faults(given: ContentNode, duration: float | None) -> Iterator[Fault]:
    """Yield the faults of a reference that is a table; ``duration`` of a test without a record."""
    rows = rows_of(given)
    if rows is None or len(rows) < 2:
        return
    table = given.at("table")
    yield from _row_order_faults(table, [time for time, _ in rows])
    (first, level), (last, _) = rows[0], rows[-1]
    if all(value == level for _, value in rows):
        yield table.fault(f"stays at {show(level)}: there is no test")
    elif duration is not None and not first <= 0.0 <= duration <= last:
        covered = f"{show(first)} ... {show(last)} s"
        text = f"{covered} does not cover the test, 0 ... {show(duration)} s: add a row"
        yield table.fault(text)


def _row_order_faults(table: ContentNode, times: Sequence[float]) -> Iterator[Fault]:
    """Yield the rows whose time goes back, or is that of two others."""
    for k, (before, time) in enumerate(pairwise(times), 1):
        if time < before:
            yield table.at(k).fault(f"{show(time)} s is before {show(before)} s, the row before")
        elif k > 1 and times[k - 2] == time:
            text = f"{show(time)} s is given more than twice: a step has two rows"
            yield table.at(k).fault(text)


def rows_of(given: ContentNode) -> list[Row] | None:
    """Return the rows of a table; None where one of them is none."""
    rows = [row.pair for row in given.at("table").entries]
    return None if None in rows else [row for row in rows if row is not None]


def moves_of(given: ContentNode) -> Iterator[tuple[ContentNode, float]]:
    """Yield the instants from which on the lines of a table rise or fall, with their places."""
    rows = rows_of(given) or []
    for k, ((time, value), (_, then)) in enumerate(pairwise(rows)):
        if then != value:
            yield given.at("table", k), time


def bump_test_faults(test: ContentNode, network: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of a test; ``network`` is that of its plant."""
    for name in EVENTS:
        yield from _step_faults(test, name)
        yield from table_faults(test.at(name), test.at("duration").number)
        for place, at in moves_of(test.at(name)):
            yield from place_faults(place, at, test.at("duration").number)
        if name in test and name not in kind.events:
            yield test.at(name).fault(f"not allowed with plant {kind.name}")
    for switch in test.at("network").entries:
        if switch.at("E").number is not None and "E" not in network:
            text = "only where plant.network gives E; test.E changes it by steps"
            yield switch.at("E").fault(text)
    if kind.plays_back:
        yield from _playback_faults(test, kind)
    elif test.content and not {*EVENTS} & test.content.keys():
        yield test.fault(f"no step: give one of {', '.join(kind.events)}")
    yield from _rest_faults(test)
    if kind.per_unit:
        yield from _voltage_faults(test.at("vt0"))


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


def missing_without_record(test: ContentNode) -> Iterator[Fault]:
    """Demand of a test what otherwise a record gives."""
    if "begin" in test:
        text = "only with a record; without one the time begins at 0"
        yield test.at("begin").fault(text)
    if test.content and "duration" not in test:
        text = "is missing: without a record it must be given"
        yield test.at("duration").fault(text)
    if test.content and "vt0" not in test:
        yield test.at("vt0").fault("is missing: without a record it must be given")


def _playback_faults(test: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Check the keys of a test in which a record drives the simulation."""
    if "begin" in test:
        text = f"not allowed with plant {kind.name}: the record drives the simulation"
        yield test.at("begin").fault(text)
    steady = test.at("steady_until")
    if steady.number is None and not kind.finds_rest and not any(instants_of(test)):
        yield steady.fault("is missing: until when is the record at rest?")


def _rest_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield a state of rest that lasts beyond the first step."""
    first = min((at for _, at in instants_of(test)), default=None)
    steady = test.at("steady_until")
    if steady.number is not None and first is not None and steady.number > first:
        text = f"{show(steady.number)} s is after the first step, at {show(first)} s"
        yield steady.fault(text)


def _voltage_faults(vt0: ContentNode) -> Iterator[Fault]:
    """Refuse a voltage before the first step that no machine has."""
    lowest = vt0.at("min")
    if vt0.start is not None and vt0.start <= 0:
        yield vt0.fault(f"{show(vt0.start)} is not above 0")
    if lowest.number is not None and lowest.number <= 0:
        yield lowest.fault(f"{show(lowest.number)} is not above 0")


def _step_faults(test: ContentNode, name: str) -> Iterator[Fault]:
    """Yield steps that change nothing, are out of order, or outside the duration."""
    before: ContentNode | None = None
    for step in test.at(name).entries:
        if step.at("step").start == 0:
            yield step.at("step").fault("0 is not a step")
        if name == "network" and step.is_section and not {"R", "X", "E"} & step.content.keys():
            yield step.fault("changes nothing: give R, X or E")
        at = step.at("at").start
        if at is not None:
            yield from _order_faults(step.at("at"), at, before)
            yield from place_faults(step.at("at"), at, test.at("duration").number)
        before = step


def _order_faults(place: ContentNode, at: float, before: ContentNode | None) -> Iterator[Fault]:
    """Yield a step that is not after the one before, or before the end of the ramp before."""
    start = None if before is None else before.at("at").start
    ramp = None if before is None else before.at("ramp").number
    if start is not None and at <= start:
        yield place.fault(f"{show(at)} s is not after {show(start)} s, the step before")
    elif start is not None and ramp is not None and at < start + ramp:
        text = f"{show(at)} s is before {show(start + ramp)} s, where the ramp before ends"
        yield place.fault(text)


def place_faults(place: ContentNode, at: float, end: float | None) -> Iterator[Fault]:
    """Yield an instant outside a test that begins at 0 and has a known end."""
    if end is not None and not 0 <= at < end:
        yield place.fault(f"{show(at)} s lies outside 0 ... {show(end)} s, the duration")
