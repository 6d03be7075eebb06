"""What contradicts itself in the section of a saturation test."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.schema.saturation_tests import CURVE_SIGNALS
from exfit.case.yaml import Fault
from exfit.records.units import needs_base

ROW_LENGTHS = (2, 3)  # [vt, ifd], and efd


def saturation_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield what contradicts itself in a saturation test."""
    if "points" in test:
        yield from _inline_faults(test)
    elif "file" not in test:
        yield test.at("file").fault("is missing: give a file, or points")
    else:
        yield from _file_faults(test)
    yield from _unit_faults(test.at("columns"))
    yield from _winding_faults(test)


def _inline_faults(test: ContentNode) -> Iterator[Fault]:
    for key in ("file", "sheet"):
        if key in test:
            yield test.at(key).fault("not allowed with points, which are given here")
    for _, column in test.at("columns").sections:
        if "column" in column or column.text is not None:
            place = column.at("column") if "column" in column else column
            yield place.fault(
                f"not allowed with points, whose columns are {', '.join(CURVE_SIGNALS)}"
            )
    rows = test.at("points").entries
    for row in rows:
        count, first = len(row.entries), len(rows[0].entries)
        if count not in ROW_LENGTHS:
            yield row.fault(f"{count} numbers; [vt, ifd] or [vt, ifd, efd] needed")
        elif count != first:
            yield row.fault(f"{count} numbers, but the first point has {first}")


def _file_faults(test: ContentNode) -> Iterator[Fault]:
    columns = test.at("columns")
    for signal in CURVE_SIGNALS[:2]:
        if signal not in columns:
            yield columns.at(signal).fault("is missing: the column of the file")
    for _, column in columns.sections:
        if column.is_section and "column" not in column:
            yield column.at("column").fault("is missing: the column of the file")


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
