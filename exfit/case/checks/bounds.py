"""What contradicts itself in the bounds and the start of a value that a fit finds."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.util.text import show


def bound_faults(section: ContentNode) -> Iterator[Fault]:
    """Yield why ``start``, ``min`` and ``max`` of a section contradict each other."""
    start, low, high = (section.at(key).number for key in ("start", "min", "max"))
    if section.content.get("bounds") == "none":
        given = [key for key in ("min", "max") if key in section]
        yield from (section.at(key).fault("not allowed with bounds: none") for key in given)
    elif low is not None and high is not None and low >= high:
        yield section.at("min").fault(f"{show(low)} is not below max = {show(high)}")
    elif start is not None and _outside(start, low, high):
        limits = " ... ".join("?" if limit is None else show(limit) for limit in (low, high))
        yield section.at("start").fault(f"{show(start)} lies outside its bounds {limits}")


def _outside(start: float, low: float | None, high: float | None) -> bool:
    """Return whether a start lies outside its bounds, as far as these are readable."""
    return (low is not None and start < low) or (high is not None and start > high)
