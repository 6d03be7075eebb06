"""A table of tests: when each was made in which record, how large it was, whether it validates."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from exfit.case.starting.bases import Base, base_of
from exfit.case.starting.starting_tests import StartingTest, renamed, started
from exfit.errors import ExfitError
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import DetectedTest, tests_of
from exfit.util.text import near

COLUMNS = ("file", "at", "step", "base", "validates")
YES, NO = ("yes", "y", "x", "1", "true"), ("", "no", "n", "0", "false", "-")
NEAREST = 5.0  # s: how far a noted instant may be from the step that the record shows


class TableRow(NamedTuple):
    """A row of a table, from a ``place``: what is None is not given."""

    place: str
    file: Path | None
    at: float | None
    step: float | None
    base: Base | None
    validates: bool | None


def read_test_table(path: Path) -> tuple[TableRow, ...]:
    """Return the rows of a CSV file with columns file, at (s), step (pu), base, validates.

    All may be missing; files are relative to the table's folder. Raises ExfitError with all faults.
    """
    names, table = _cells(path)
    unknown = [name for name in names if name not in COLUMNS]
    if unknown:
        raise ExfitError(f"{path}:1: column {', '.join(unknown)}; {near(unknown[0], COLUMNS)}")
    rows, faults = list[TableRow](), list[str]()
    for place, cells in table:
        try:
            rows.append(_row(cells, place, path.parent))
        except ExfitError as fault:
            faults.append(str(fault))
    if faults or not rows:
        raise ExfitError("\n".join(faults) or f"{path}: no row below the names of the columns")
    return tuple(rows)


def _cells(path: Path) -> tuple[list[str], list[tuple[str, dict[str, str]]]]:
    """Return the names of the columns, and the cells of each row by name, behind its place."""
    lines = _lines(path)
    separator = ";" if ";" in lines[0] else ","
    reader = csv.DictReader(lines, delimiter=separator, skipinitialspace=True, restval="")
    names = reader.fieldnames = [name.strip().lower() for name in reader.fieldnames or ()]
    return names, [
        (f"{path}:{reader.line_num}", {name: cells[name].strip() for name in names})
        for cells in reader
    ]


def _lines(path: Path) -> list[str]:
    """Return the lines of a table; raises ExfitError where it cannot be read or is empty."""
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as fault:
        raise ExfitError(f"{path}: cannot be read: {fault.strerror}") from None
    except UnicodeDecodeError:
        raise ExfitError(f"{path}: cannot be read: not UTF-8 text") from None
    if not lines:
        raise ExfitError(f"{path}: the file is empty; columns: {', '.join(COLUMNS)}")
    return lines


def tests_of_table(
    rows: Sequence[TableRow], inspections: Mapping[Path, Inspection], bases: Mapping[str, Base]
) -> tuple[StartingTest, ...]:
    """Return the tests that rows name, whose files are all inspected, in order of the rows.

    Where no row says which tests validate, every other one does. Raises ExfitError where a record
    shows no step at the instant of a row.
    """
    alternate = all(row.validates is None for row in rows)
    tests, recorded = list[StartingTest](), list[DetectedTest]()
    for k, row in enumerate(rows):
        assert row.file is not None
        inspection = inspections[row.file]
        test = _nearest(row, tests_of(inspection))
        own = bases if row.base is None else {**bases, "vt": row.base}
        validates = k % 2 == 1 if alternate else bool(row.validates)
        try:
            tests.append(started(inspection, test, row.step, own, validates))
        except ExfitError as fault:
            raise ExfitError(f"{row.place}: {fault}") from None
        recorded.append(test)
    if all(test.validates for test in tests):
        raise ExfitError(f"{rows[0].place}: every test validates; at least one must be fitted")
    return renamed(tests, recorded)


def _row(cells: Mapping[str, str], place: str, folder: Path) -> TableRow:
    numbers = dict(_numbers(cells, place))
    word = cells.get("validates", "").lower()
    if word not in (*YES, *NO):
        raise ExfitError(f"{place}: validates: {word!r} is neither yes nor no")
    base = cells.get("base", "")
    return TableRow(
        place,
        folder / cells["file"] if cells.get("file") else None,
        numbers.get("at"),
        numbers.get("step"),
        base_of(base, f"{place}: base") if base else None,
        word in YES if "validates" in cells else None,
    )


def _numbers(cells: Mapping[str, str], place: str) -> Iterator[tuple[str, float]]:
    """Yield the numbers that are given; raises ExfitError for what is none."""
    for name in ("at", "step"):
        text = cells.get(name, "")
        if not text:
            continue
        try:
            yield name, float(text)
        except ValueError:
            raise ExfitError(f"{place}: {name}: {text!r} is not a number") from None


def _nearest(row: TableRow, tests: Sequence[DetectedTest]) -> DetectedTest:
    """Return the test of a record that a row means; raises ExfitError where there is none."""
    shown = ", ".join(f"{test.at:.1f}" for test in tests) or "none"
    if row.at is None:
        if len(tests) == 1:
            return tests[0]
        raise ExfitError(f"{row.place}: at: missing; {row.file} shows steps at (s): {shown}")
    at = row.at
    near_by = [test for test in tests if abs(test.at - at) <= NEAREST]
    if not near_by:
        where = f"no step within {NEAREST:g} s of {at:g} s"
        raise ExfitError(f"{row.place}: at: {where}; {row.file} shows steps at (s): {shown}")
    return min(near_by, key=lambda test: abs(test.at - at))
