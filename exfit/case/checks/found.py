"""What contradicts itself in a value that the fit shall find about a record."""

from collections.abc import Iterator

from exfit.case.checks.bump_test import AUTOMATIC
from exfit.case.checks.model import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import BREAKER
from exfit.util.text import show


def frequency_faults(frequency: ContentNode) -> Iterator[Fault]:
    """Yield the faults of the frequency of a periodic disturbance."""
    if frequency.is_section:
        yield from _needed_bounds(frequency)
    for node in (frequency, *map(frequency.at, ("start", "min", "max"))):
        if node.number is not None and node.number <= 0.0:
            yield node.fault(f"{show(node.number)} Hz must be above 0")


def value_faults(value: ContentNode) -> Iterator[Fault]:
    """Yield the faults of one value that the fit shall find: its bounds and its start."""
    key = value.place[-1]
    first_step = key in AUTOMATIC and value.place[-3:-1] == ("vref", 0)
    shown = first_step or key == "vt0" or value.place[-2] == BREAKER
    if value.at("start").text == "auto" and not shown:
        text = "auto finds the first step of vref, its at and its step, vt0, or breaker.opens"
        yield value.at("start").fault(text)
    yield from _needed_bounds(value)
    low, high = value.at("min").number, value.at("max").number
    if key in ("step", "scale") and low is not None and high is not None and low <= 0 <= high:
        yield value.at("min").fault(f"{show(low)} ... {show(high)} contains 0")


def _needed_bounds(value: ContentNode) -> Iterator[Fault]:
    """Yield the bounds that are missing, unless a record shows the value, or contradict it."""
    for bound in ("min", "max"):
        if bound not in value and value.at("start").text != "auto":
            yield value.at(bound).fault("is missing")
    yield from bound_faults(value)
