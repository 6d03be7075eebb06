"""Tables of words and numbers that people write: their cells as text, each row with its place."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import NamedTuple

from exfit.errors import ExfitError, FileError
from exfit.records.formats import WORKBOOKS
from exfit.util.files import read_limited, utf8
from exfit.util.text import near

LARGEST_TABLE = 16_000_000  # bytes
MOST_COLUMNS = 1000  # of a table


class Cells(NamedTuple):
    """The cells of a row by the names of their columns; ``place`` is the file and its row."""

    place: str
    by_name: Mapping[str, str]


def is_table(path: Path) -> bool:
    """Tell by its suffix if a file is a table: CSV or a workbook."""
    return path.suffix.lower() in (".csv", *WORKBOOKS)


def read_cells(path: Path, columns: Sequence[str], prefixes: Sequence[str] = ()) -> list[Cells]:
    """Return the rows of a CSV file or of the only sheet of a workbook with a table.

    ``columns`` are the names that it may have; a name may begin with one of the ``prefixes``, too.
    Rows without a word are left out. Raises ExfitError where the file cannot be read or is empty,
    and with all columns that are unknown or repeated, and rows that are too long.
    """
    lines = [*_workbook_rows(path)] if path.suffix.lower() in WORKBOOKS else [*_csv_rows(path)]
    if not lines:
        raise ExfitError(f"{path}: the file is empty; columns: {', '.join(columns)}")
    (head, texts), rows = lines[0], lines[1:]
    names = _without_blank_end([text.strip() for text in texts])
    names = [name if name.startswith(tuple(prefixes)) else name.lower() for name in names]
    faults = [*_wrong_names(names, f"{path}:{head}", columns, prefixes)]
    for number, cells in rows:
        if len(_without_blank_end(cells)) > len(names):
            faults.append(f"{path}:{number}: more cells than columns: {len(cells)}, {len(names)}")
    if faults:
        raise FileError(faults)
    table = [
        Cells(
            f"{path}:{number}",
            {
                name: cell.strip()
                for name, cell in zip_longest(names, cells[: len(names)], fillvalue="")
            },
        )
        for number, cells in rows
    ]
    if not table:
        raise ExfitError(f"{path}: no row below the names of the columns")
    return table


def _wrong_names(
    names: Sequence[str], place: str, columns: Sequence[str], prefixes: Sequence[str]
) -> Iterator[str]:
    """Yield the names of columns that are unknown or repeated, or that there are too many."""
    if len(names) > MOST_COLUMNS:
        yield f"{place}: {len(names):,} columns; at most {MOST_COLUMNS:,} allowed"
        return
    known = (*columns, *(f"{prefix}..." for prefix in prefixes))
    for number, name in enumerate(names):
        if name in names[:number]:
            yield f"{place}: column {name}: given twice"
        elif name not in columns and not (prefixes and name.startswith(tuple(prefixes))):
            yield f"{place}: column {name or number + 1}; {near(name, known)}"


def _without_blank_end(cells: Sequence[str]) -> list[str]:
    """Return the cells up to the last that holds a word."""
    count = max((k + 1 for k, cell in enumerate(cells) if cell.strip()), default=0)
    return [*cells[:count]]


def _csv_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each row of a CSV file behind the number of its line."""
    lines = utf8(read_limited(path, LARGEST_TABLE), path).splitlines()
    separator = ";" if lines and ";" in lines[0] else ","
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                yield reader.line_num, cells
    except csv.Error as fault:
        raise ExfitError(f"{path}:{reader.line_num}: cannot be read: {fault}") from None


def _workbook_rows(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Yield the cells of each row of the only sheet with content behind its number."""
    from exfit.records.formats.child import texts_of_sheets

    sheets = {name: rows for name, rows in texts_of_sheets(path).items() if any(map(any, rows))}
    if len(sheets) > 1:
        raise ExfitError(f"{path}: several sheets: {', '.join(sheets)}; leave one with the table")
    for rows in sheets.values():
        for number, cells in enumerate(rows, start=1):
            if any(cells):
                yield number, cells
