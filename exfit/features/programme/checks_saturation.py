"""What contradicts itself in the section of a saturation test."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.features.programme.checks_points import points_faults
from exfit.features.programme.schema_saturation import CURVE_SIGNALS
from exfit.records.units import needs_base


def saturation_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield what contradicts itself in a saturation test."""
    yield from points_faults(test, CURVE_SIGNALS, CURVE_SIGNALS[:2])
    yield from _unit_faults(test.at("columns"))
    yield from _winding_faults(test)


def _unit_faults(columns: ContentNode) -> Iterator[Fault]:
    vt = columns.at("vt")
    if "base" in vt and "unit" not in vt:
        yield vt.at("unit").fault("is missing: in which unit is base?")
    unit = vt.at("unit").text
    if unit is not None and "base" not in vt and needs_base(unit):
        yield vt.at("base").fault(f"is missing: what is 1 pu in {unit}?")
    for signal in CURVE_SIGNALS[1:]:
        if "base" in columns.at(signal):
            yield columns.at(signal, "base").fault("not allowed: the test measures it")


def _winding_faults(test: ContentNode) -> Iterator[Fault]:
    winding = test.at("winding")
    if "hot" in winding and "temperature" not in winding:
        yield winding.at("temperature").fault("is missing: hot converts the resistance from it")
    if winding.content and test.at("brushless").value is True:
        yield winding.fault("not allowed with brushless: the field winding is not accessible")
