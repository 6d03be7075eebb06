"""A table of tests: when each was made in which record, how large it was, whether it validates."""

from collections.abc import Callable, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import NamedTuple, TypeVar

from exfit.case.draft.bases import Base, base_of
from exfit.errors import ExfitError, FileError
from exfit.features.start.cells import Cells, read_cells
from exfit.features.start.starting_tests import StartingTest, renamed, started
from exfit.records.inspection import Inspection
from exfit.records.recorded_tests import DetectedTest, tests_of

COLUMNS = ("file", "at", "step", "base", "validates")
YES, NO = ("yes", "y", "x", "1", "true"), ("", "no", "n", "0", "false", "-")
NEAREST = 5.0  # s: how far a noted instant may be from the step that the record shows


Value = TypeVar("Value")


class TableRow(NamedTuple):
    """A row of a table, from a ``place``: what is None is not given."""

    place: str
    file: Path | None
    at: float | None
    step: float | None
    base: Base | None
    validates: bool | None


def read_test_table(path: Path) -> tuple[TableRow, ...]:
    """Return the rows of a CSV file or workbook: columns file, at (s), step (pu), base, validates.

    All may be missing; files are relative to the table's folder. Raises ExfitError with all faults.
    """
    faults = list[str]()
    rows = [table_row(row, path.parent, faults) for row in read_cells(path, COLUMNS)]
    if faults:
        raise FileError(faults)
    return tuple(rows)


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


def table_row(row: Cells, folder: Path, faults: list[str]) -> TableRow:
    """Return a row with the files of a folder; add all that is wrong with it."""
    place, cells = row
    base = checked(row, "base", lambda text: base_of(text, f"{place}: base"), faults)
    word = cells.get("validates", "").lower()
    if word not in (*YES, *NO):
        faults.append(f"{place}: validates: {word!r} is neither yes nor no")
    return TableRow(
        place,
        folder / cells["file"] if cells.get("file") else None,
        number_in(row, "at", faults),
        number_in(row, "step", faults),
        base,
        word in YES if "validates" in cells else None,
    )


def number_in(row: Cells, name: str, faults: list[str]) -> float | None:
    """Return the number in a column, None where it is blank; add what is wrong with it."""

    def number(text: str) -> float:
        try:
            value = float(text)
        except ValueError:
            raise ExfitError(f"{row.place}: {name}: {text!r} is not a number") from None
        if not isfinite(value):
            raise ExfitError(f"{row.place}: {name}: {text!r} is not a finite number")
        return value

    return checked(row, name, number, faults)


def checked(row: Cells, name: str, read: Callable[[str], Value], faults: list[str]) -> Value | None:
    """Return what a cell holds, None where it is blank; add what is wrong with it."""
    text = row.by_name.get(name, "")
    try:
        return read(text) if text else None
    except ExfitError as fault:
        faults.append(str(fault))
        return None


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
