"""What contradicts itself in the section of a steady test."""

from collections.abc import Iterator

from exfit.case.checks.bounds import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.schema.steady_tests import POINT_SIGNALS
from exfit.case.yaml import Fault
from exfit.records.units import needs_base
from exfit.signals import FIELDS, TERMINALS
from exfit.util.text import show

ROW_LENGTHS = (len(POINT_SIGNALS) - 1, len(POINT_SIGNALS))  # without efd, and with it
AUTO = "auto"


def steady_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield what contradicts itself in the points of a steady test, beside what is free."""
    if "points" in test:
        yield from _inline_faults(test)
    elif "file" not in test:
        yield test.at("file").fault("is missing: give a file, or points")
    else:
        yield from _file_faults(test)
    for signal, column in test.at("columns").sections:
        yield from _column_faults(signal, column)
    yield from _noise_faults(test)


def _inline_faults(test: ContentNode) -> Iterator[Fault]:
    for key in ("file", "sheet"):
        if key in test:
            yield test.at(key).fault("not allowed with points, which are given here")
    for _, column in test.at("columns").sections:
        if "column" in column or column.text is not None:
            place = column.at("column") if "column" in column else column
            yield place.fault(
                f"not allowed with points, whose columns are {', '.join(POINT_SIGNALS)}"
            )
    rows = test.at("points").entries
    for row in rows:
        count, first = len(row.entries), len(rows[0].entries)
        if count not in ROW_LENGTHS:
            yield row.fault(f"{count} numbers; [p, q, vt, ifd] or [p, q, vt, ifd, efd] needed")
        elif count != first:
            yield row.fault(f"{count} numbers, but the first point has {first}")


def _file_faults(test: ContentNode) -> Iterator[Fault]:
    columns = test.at("columns")
    for signal in TERMINALS:
        if signal not in columns:
            yield columns.at(signal).fault("is missing: the column of the file")
    if not any(signal in columns for signal in FIELDS):
        yield columns.at(FIELDS[0]).fault(f"is missing: a column of {' or '.join(FIELDS)}")
    for _, column in columns.sections:
        if column.is_section and "column" not in column:
            yield column.at("column").fault("is missing: the column of the file")


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
