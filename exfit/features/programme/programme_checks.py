"""Contradictions in the tests at rest of a programme, given in place or in a file."""

from collections.abc import Iterator, Sequence

from exfit.case.checks.model import bound_faults
from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.features.programme.programme_schema import CURVE_SIGNALS, POINT_SIGNALS
from exfit.records.units import needs_base
from exfit.signals import FIELDS, TERMINALS
from exfit.util.text import show

AUTO = "auto"


def steady_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in the points of a steady test, beside its free parameters."""
    yield from _points_faults(test, POINT_SIGNALS, TERMINALS)
    columns, either = test.at("columns"), " or ".join(FIELDS)
    fields = [columns.at(signal) for signal in FIELDS if signal in columns]
    if "file" in test and "points" not in test and not fields:
        yield columns.at(FIELDS[0]).fault(f"is missing: a column of {either}")
    for signal, column in columns.sections:
        base = column.at("base")
        yield from _conversion_faults(column)
        if signal in FIELDS:
            yield from _free_base_faults(base)
            continue
        if base.is_section:
            yield base.fault(f"must be a number: only that of {either} can be fitted")
        if "noise" in column:
            yield column.at("noise").fault(f"only allowed for {either}")
    without_noise = [column for column in fields if "noise" not in column]
    if len(without_noise) < len(fields):
        for column in without_noise:
            yield column.at("noise").fault("is missing: the other one has it")


def _conversion_faults(column: ContentNode) -> Iterator[Fault]:
    """Yield what is wrong with unit, base and scale of a column."""
    yield from _base_faults(column)
    yield from _not_above_zero(column.at("base"))
    if column.at("scale").number == 0.0:
        yield column.at("scale").fault("must not be 0")


def _base_faults(column: ContentNode) -> Iterator[Fault]:
    """Yield that a base lacks its unit, or a unit its base."""
    unit = column.at("unit").text
    if "base" in column and "unit" not in column:
        yield column.at("unit").fault("is missing: in which unit is base?")
    if unit and "base" not in column and "scale" not in column and needs_base(unit):
        yield column.at("base").fault(f"is missing: what is 1 pu in {unit}?")


def _free_base_faults(base: ContentNode) -> Iterator[Fault]:
    if not base.is_section:
        return
    yield from bound_faults(base)
    for key in ("start", "min"):
        yield from _not_above_zero(base.at(key))
    if base.at("start").text != AUTO:
        for key in ("min", "max"):
            if key not in base:
                yield base.at(key).fault("is missing: only start: auto needs no bounds")


def _not_above_zero(node: ContentNode) -> Iterator[Fault]:
    if node.number is not None and node.number <= 0.0:
        yield node.fault(f"{show(node.number)} is not above 0")


def _points_faults(
    test: ContentNode, signals: Sequence[str], needed: Sequence[str]
) -> Iterator[Fault]:
    """Yield the faults of points: ``signals`` in the order of a row, whose last may be left out.

    ``needed`` are those for which a file must have a column.
    """
    columns = test.at("columns")
    if "points" in test:
        yield from _inline_faults(test, signals)
        return
    if "file" not in test:
        yield test.at("file").fault("is missing: give a file, or points")
        return
    for signal in needed:
        if signal not in columns:
            yield columns.at(signal).fault("is missing: the column of the file")
    for _, column in columns.sections:
        if column.is_section and "column" not in column:
            yield column.at("column").fault("is missing: the column of the file")


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


def governor_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in a test of a governor."""
    columns, slow = test.at("columns"), "speed" in test.at("columns")
    yield from _points_faults(test, (), ("time",) if slow else ("p", "gate"))
    if slow and ("p" in columns) == ("gate" in columns):
        yield columns.at("gate").fault("give either gate or p beside speed")
    for _, column in columns.sections:
        base = column.at("base")
        yield from _conversion_faults(column)
        if base.is_section:
            yield base.fault("must be a number")
        if "noise" in column:
            yield column.at("noise").fault(f"only allowed for {' or '.join(FIELDS)}")


def saturation_test_faults(test: ContentNode) -> Iterator[Fault]:
    """Yield contradictions in a saturation test."""
    yield from _points_faults(test, CURVE_SIGNALS, CURVE_SIGNALS[:2])
    columns, winding = test.at("columns"), test.at("winding")
    yield from _base_faults(columns.at("vt"))
    for signal in CURVE_SIGNALS[1:]:
        if "base" in columns.at(signal):
            yield columns.at(signal, "base").fault("not allowed: the test measures it")
    if "hot" in winding and "temperature" not in winding:
        yield winding.at("temperature").fault("is missing: hot converts the resistance from it")
    if winding.content and test.at("brushless").value is True:
        yield winding.fault("not allowed with brushless: the field winding is not accessible")
