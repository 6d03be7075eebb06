"""What contradicts itself in the faults at the terminals that a test makes."""

from collections.abc import Iterator

from exfit.case.checks.bump_test import place_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.util.text import show


def terminal_fault_faults(given: ContentNode, duration: float | None) -> Iterator[Fault]:
    """Yield faults at the terminals that are none, or last beyond the next one or the test."""
    before: float | None = None
    for entry in given.entries:
        at, cleared = entry.at("at").number, entry.at("cleared").number
        impedance = [entry.at(key) for key in ("R", "X") if key in entry]
        if entry.is_section and all(node.number == 0.0 for node in impedance):
            yield entry.fault("has no impedance: give R or X above 0, such as X: 0.001")
        if at is not None and before is not None and at < before:
            text = f"{show(at)} s: the fault before lasts until {show(before)} s"
            yield entry.at("at").fault(text)
        if at is not None and cleared is not None and cleared <= at:
            yield entry.at("cleared").fault(f"{show(cleared)} s is not after {show(at)} s")
        elif cleared is not None:
            yield from place_faults(entry.at("cleared"), cleared, duration)
        before = cleared
