"""What contradicts itself in the section of a steady test."""

from collections.abc import Iterator

from exfit.case.checks.bounds import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.features.programme.checks_points import points_faults
from exfit.features.programme.schema_steady import POINT_SIGNALS
from exfit.records.units import needs_base
from exfit.signals import FIELDS, TERMINALS
from exfit.util.text import show

AUTO = "auto"


def steady_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield what contradicts itself in the points of a steady test, beside what is free."""
    yield from points_faults(test, POINT_SIGNALS, TERMINALS)
    if "points" not in test:
        yield from _field_faults(test)
    for signal, column in test.at("columns").sections:
        yield from _column_faults(signal, column)
    yield from _noise_faults(test)


def _field_faults(test: ContentNode) -> Iterator[Fault]:
    columns = test.at("columns")
    if "file" in test and not any(signal in columns for signal in FIELDS):
        yield columns.at(FIELDS[0]).fault(f"is missing: a column of {' or '.join(FIELDS)}")


def _column_faults(signal: str, column: ContentNode) -> Iterator[Fault]:
    unit, base = column.at("unit").text, column.at("base")
    if "base" in column and "unit" not in column:
        yield column.at("unit").fault("is missing: in which unit is base?")
    if unit and "base" not in column and "scale" not in column and needs_base(unit):
        yield base.fault(f"is missing: what is 1 pu in {unit}?")
    if column.at("scale").number == 0.0:
        yield column.at("scale").fault("must not be 0")
    if base.number is not None and base.number <= 0.0:
        yield base.fault(f"{show(base.number)} is not above 0")
    yield from _free_base_faults(base) if signal in FIELDS else _terminal_faults(column)


def _terminal_faults(column: ContentNode) -> Iterator[Fault]:
    """Yield what only a column of the field may have."""
    fields = " or ".join(FIELDS)
    if column.at("base").is_section:
        yield column.at("base").fault(f"must be a number: only that of {fields} can be fitted")
    if "noise" in column:
        yield column.at("noise").fault(f"only allowed for {fields}")


def _free_base_faults(base: ContentNode) -> Iterator[Fault]:
    if not base.is_section:
        return
    yield from bound_faults(base)
    for key in ("start", "min"):
        number = base.at(key).number
        if number is not None and number <= 0.0:
            yield base.at(key).fault(f"{show(number)} is not above 0")
    if base.at("start").text != AUTO:
        for key in ("min", "max"):
            if key not in base:
                yield base.at(key).fault("is missing: only start: auto needs no bounds")


def _noise_faults(test: ContentNode) -> Iterator[Fault]:
    columns = test.at("columns")
    fields = [columns.at(signal) for signal in FIELDS if signal in columns]
    if any("noise" in column for column in fields):
        for column in fields:
            if "noise" not in column:
                yield column.at("noise").fault("is missing: the other one has it")
