"""What contradicts itself in the points of a test at rest, given in place or in a file."""

from collections.abc import Iterator, Sequence

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault


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
