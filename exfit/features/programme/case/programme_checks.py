"""Contradictions in the tests at rest of a programme, given in place or in a file."""

from collections.abc import Iterator, Sequence

from exfit.case.checks.model import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.features.programme.case.schema_at_rest import CURVE_SIGNALS, POINT_SIGNALS
from exfit.records.units import needs_base
from exfit.signals import FIELDS, TERMINALS
from exfit.util.text import show

AUTO = "auto"


def steady_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in the points of a steady test, beside its free parameters."""
    yield from points_faults(test, POINT_SIGNALS, TERMINALS)
    columns = test.at("columns")
    given = "file" in test and "points" not in test
    if given and not any(signal in columns for signal in FIELDS):
        yield columns.at(FIELDS[0]).fault(f"is missing: a column of {' or '.join(FIELDS)}")
    for signal, column in columns.sections:
        yield from _column_faults(signal, column)
    yield from _noise_faults(test)


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
    if signal in FIELDS:
        yield from _free_base_faults(base)
        return
    fields = " or ".join(FIELDS)
    if base.is_section:
        yield base.fault(f"must be a number: only that of {fields} can be fitted")
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


def points_faults(
    test: ContentNode, signals: Sequence[str], needed: Sequence[str]
) -> Iterator[Fault]:
    """Yield the faults of points: ``signals`` in the order of a row, whose last may be left out.

    ``needed`` are those for which a file must have a column.
    """
    if "points" in test:
        yield from _inline_faults(test, signals)
    elif "file" not in test:
        yield test.at("file").fault("is missing: give a file, or points")
    else:
        yield from _file_faults(test.at("columns"), needed)


def _inline_faults(test: ContentNode, signals: Sequence[str]) -> Iterator[Fault]:
    for key in ("file", "sheet"):
        if key in test:
            yield test.at(key).fault("not allowed with points, which are given here")
    for _, column in test.at("columns").sections:
        if "column" in column or column.text is not None:
            place = column.at("column") if "column" in column else column
            yield place.fault(f"not allowed with points, whose columns are {', '.join(signals)}")
    rows = test.at("points").entries
    short, whole = (", ".join(names) for names in (signals[:-1], signals))
    for row in rows:
        count, first = len(row.entries), len(rows[0].entries)
        if count not in (len(signals) - 1, len(signals)):
            yield row.fault(f"{count} numbers; [{short}] or [{whole}] needed")
        elif count != first:
            yield row.fault(f"{count} numbers, but the first point has {first}")


def _file_faults(columns: ContentNode, needed: Sequence[str]) -> Iterator[Fault]:
    for signal in needed:
        if signal not in columns:
            yield columns.at(signal).fault("is missing: the column of the file")
    for _, column in columns.sections:
        if column.is_section and "column" not in column:
            yield column.at("column").fault("is missing: the column of the file")


def saturation_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in a saturation test."""
    yield from points_faults(test, CURVE_SIGNALS, CURVE_SIGNALS[:2])
    columns, winding = test.at("columns"), test.at("winding")
    vt = columns.at("vt")
    if "base" in vt and "unit" not in vt:
        yield vt.at("unit").fault("is missing: in which unit is base?")
    unit = vt.at("unit").text
    if unit is not None and "base" not in vt and needs_base(unit):
        yield vt.at("base").fault(f"is missing: what is 1 pu in {unit}?")
    for signal in CURVE_SIGNALS[1:]:
        if "base" in columns.at(signal):
            yield columns.at(signal, "base").fault("not allowed: the test measures it")
    if "hot" in winding and "temperature" not in winding:
        yield winding.at("temperature").fault("is missing: hot converts the resistance from it")
    if winding.content and test.at("brushless").value is True:
        yield winding.fault("not allowed with brushless: the field winding is not accessible")
