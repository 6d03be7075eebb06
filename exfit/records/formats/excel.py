"""Excel workbooks, by python-calamine: a sheet with a row of names above rows of numbers."""

import hashlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from functools import partial
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import is_units, names_of, quoted, units_of
from exfit.records.formats.columns import Contents, missing_package, sound
from exfit.records.formats.table import column_error, read_bytes

if TYPE_CHECKING:
    from python_calamine import CalamineWorkbook

Row = Sequence[Any]

FEWEST_CELLS = 2  # of a row that holds a sample: the time and one signal
STAMP_KINDS = ("timestamp", "time of day")  # kinds of cells
WORKBOOK = "an Excel workbook"


@dataclass(frozen=True)
class _Sheet:
    """A table on a sheet: the column names by place, their units, and the rows of its samples."""

    name: str
    rows: Sequence[Row]
    places: tuple[int, ...]
    names: tuple[str, ...]
    units: dict[str, str]
    samples: tuple[int, ...]


def read(path: Path, sheet: str | None = None) -> Contents:
    """Read the table on a sheet of an Excel workbook (.xlsx, .xlsm, .xls) or an .ods.

    Above the samples is a row of names, between them perhaps a row of units; what is
    higher, as titles do, is left out, and so are blank rows and columns. Timestamps
    are good to 1 ms, as Excel shows them. A cell with an error, as #DIV/0!, is a missing sample.

    Args:
        path: the workbook.
        sheet: the sheet's name; None: the only one with a table.

    Raises:
        RecordError: a file that is damaged, no table in it, several of them and no sheet named, or
            the package python-calamine missing.
    """
    data = read_bytes(path)
    tables = _tables(path, _workbook(path, data), sheet)
    if len(tables) > 1:
        names = ", ".join(repr(table.name) for table in tables)
        raise RecordError(f"{path}: name one of the sheets with a table: {names}")
    if not tables:
        where = "" if sheet is None else f" on the sheet {sheet!r}"
        raise RecordError(
            f"{path}: no table{where}: a row of names above rows of numbers, {FEWEST_CELLS} or more"
        )
    return _contents(hashlib.sha256(data).hexdigest(), tables[0], sheet is not None, path)


def texts_of_sheets(path: Path) -> dict[str, list[list[str]]]:
    """Read the cells of all sheets as texts, by name; whole numbers have no point.

    Raises RecordError for a file that is damaged.
    """
    book = _workbook(path, read_bytes(path))
    return {
        name: [[*map(_text, row)] for row in sound(path, WORKBOOK, partial(_rows, book, name))]
        for name in book.sheet_names
    }


def _text(cell: Any) -> str:
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return str(int(cell)) if cell.is_integer() else repr(cell)
    if isinstance(cell, datetime | date):
        return cell.isoformat()
    return str(cell).strip()


def _workbook(path: Path, data: bytes) -> "CalamineWorkbook":
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise missing_package(path, "python-calamine", "excel") from None
    return sound(path, WORKBOOK, lambda: CalamineWorkbook.from_filelike(io.BytesIO(data)))


def _tables(path: Path, book: "CalamineWorkbook", sheet: str | None) -> list[_Sheet]:
    """Return the tables of a workbook, or that of one sheet."""
    names = book.sheet_names
    if sheet is not None and sheet not in names:
        raise RecordError(f"{path}: no sheet {sheet!r}; there are {', '.join(map(repr, names))}")
    tables = (
        _table(name, sound(path, WORKBOOK, partial(_rows, book, name)))
        for name in (names if sheet is None else [sheet])
    )
    return [table for table in tables if table is not None]


def _rows(book: "CalamineWorkbook", name: str) -> list[Row]:
    return [*book.get_sheet_by_name(name).to_python(skip_empty_area=False)]


def _table(name: str, rows: Sequence[Row]) -> _Sheet | None:
    """Return the first table on a sheet: a row of names right above the first sample."""
    filled = [at for at, row in enumerate(rows) if row.count("") < len(row)]
    for place, at in enumerate(filled):
        if not _is_sample(rows[at]):
            continue
        head = filled[max(place - 2, 0) : place]
        units = head.pop() if len(head) > 1 and _is_units(rows[head[-1]]) else None
        if head and _is_head(rows[head[-1]], rows[at]):
            return _sheet(name, rows, head[-1], units, tuple(filled[place:]))
    return None


def _is_sample(row: Row) -> bool:
    """Check for a row of a sample: numbers and timestamps, more of them than of texts."""
    texts = sum(isinstance(cell, str) and cell != "" for cell in row)
    numbers = sum(not isinstance(cell, str) for cell in row)
    return numbers >= FEWEST_CELLS and numbers > texts


def _is_units(row: Row) -> bool:
    return all(isinstance(cell, str) for cell in row) and is_units(row)


def _is_head(row: Row, below: Row) -> bool:
    """Check for a row that names the columns of the one below: texts over two cells or more."""
    named = [isinstance(cell, str) and cell.strip() != "" for cell in row]
    over = sum(name and cell != "" for name, cell in zip(named, below, strict=True))
    return over >= FEWEST_CELLS and all(isinstance(cell, str) for cell in row)


def _sheet(
    name: str, rows: Sequence[Row], head: int, units: int | None, samples: tuple[int, ...]
) -> _Sheet:
    below = rows[head if units is None else units]
    places = [
        at for at in range(len(below)) if any(rows[row][at] != "" for row in (head, *samples))
    ]
    all_names = names_of(rows[head])
    names = tuple(all_names[at] for at in places)
    own_units = () if units is None else [below[at] for at in places]
    return _Sheet(name, rows, tuple(places), names, units_of(names, own_units), samples)


def _contents(sha256: str, sheet: _Sheet, name_sheet: bool, path: Path) -> Contents:
    counted = f"sheet {sheet.name!r}, row" if name_sheet else "row"
    samples = [sheet.rows[row] for row in sheet.samples]

    def fetch(at: int) -> NDArray[Any]:
        cells = [*map(itemgetter(sheet.places[at]), samples)]
        return _column(
            cells, sheet.names[at], lambda row: f"{path}: {counted} {sheet.samples[row] + 1}"
        )

    return Contents(
        sha256=sha256,
        names=sheet.names,
        units=sheet.units,
        lengths=[len(samples)] * len(sheet.names),
        fetch=fetch,
        counted=counted,
        rows=[row + 1 for row in sheet.samples],
        stamps=[
            name
            for name, at in zip(sheet.names, sheet.places, strict=True)
            if _kind(samples[0][at]) in STAMP_KINDS
        ],
    )


def _column(cells: Sequence[Any], name: str, where: Callable[[int], str]) -> NDArray[Any]:
    """Return cells of one kind as an array: numbers, timestamps or times of day."""
    if {*map(type, cells)} == {float}:  # as nearly always: five times as fast
        return np.array(cells, np.float64)
    kinds = [_kind(cell) for cell in cells]
    kind = next((kind for kind in kinds if kind not in ("", "text")), "number")
    for row, cell in enumerate(cells):
        if kinds[row] not in ("", kind):
            raise column_error(where(row), name, f"{quoted(cell)} is not a {kind}")
    convert, missing, dtype = ARRAYS[kind]
    return np.array(
        [convert(cell) if own else missing for cell, own in zip(cells, kinds, strict=True)], dtype
    )


def _kind(cell: Any) -> str:
    """Kind of a cell, "" of a blank one."""
    if isinstance(cell, str):
        return "text" if cell.strip() else ""
    if isinstance(cell, date | datetime):
        return "timestamp"
    return "time of day" if isinstance(cell, time | timedelta) else "number"


def _of_day(cell: time | timedelta) -> timedelta:
    """Return the time since midnight."""
    if isinstance(cell, timedelta):
        return cell
    return timedelta(
        hours=cell.hour, minutes=cell.minute, seconds=cell.second, microseconds=cell.microsecond
    )


# kind of the cells -> what converts one, what replaces a missing one, and the type of the array
ARRAYS: dict[str, tuple[Callable[[Any], Any], Any, str]] = {
    "number": (float, np.nan, "float64"),
    "timestamp": (lambda stamp: stamp, None, "datetime64[ns]"),
    "time of day": (_of_day, None, "timedelta64[ns]"),
}
