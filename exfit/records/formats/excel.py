"""Excel workbooks, by python-calamine: a sheet with a row of names above rows of numbers."""

import hashlib
import io
from collections.abc import Callable, Iterator, Sequence
from datetime import date, datetime, time, timedelta
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import is_units, names_of, quoted, units_of
from exfit.records.formats.columns import Columns, missing_package, sound
from exfit.records.formats.table import column_error, read_bytes

Row = Sequence[Any]

FEWEST_CELLS = 2  # of a row that holds a sample: the time and one signal
STAMP_KINDS = ("timestamp", "time of day")  # kinds of cells
WORKBOOK = "an Excel workbook"


def read(path: Path, sheet: str | None = None) -> Columns:
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
    tables = {}
    for name, cells in _sheets(path, data, sheet):
        found = _table_in(cells)
        if found is not None:
            tables[name] = found
    if len(tables) > 1:
        names = ", ".join(map(repr, tables))
        raise RecordError(f"{path}: name one of the sheets with a table: {names}")
    if not tables:
        where = "" if sheet is None else f" on the sheet {sheet!r}"
        raise RecordError(
            f"{path}: no table{where}: a row of names above rows of numbers, {FEWEST_CELLS} or more"
        )
    ((name, (head, units, samples)),) = tables.items()
    rows = [head, *samples.values()]
    places = [at for at in range(len(head)) if any(row[at] != "" for row in rows)]
    named = names_of(head)
    columns = tuple(named[at] for at in places)
    first = next(iter(samples.values()))
    sample = f"{path}: row" if sheet is None else f"{path}: sheet {name!r}, row"

    def fetch(at: int) -> NDArray[Any]:
        cells = [row[places[at]] for row in samples.values()]
        return _column(cells, columns[at], lambda row: f"{sample} {[*samples][row]}")

    return Columns(
        path=path,
        sha256=hashlib.sha256(data).hexdigest(),
        names=columns,
        units=units_of(columns, [units[at] for at in places] if units else ()),
        lengths=[len(samples)] * len(columns),
        fetch=fetch,
        sample=sample,
        rows=[*samples],
        stamps=tuple(
            column
            for column, at in zip(columns, places, strict=True)
            if _kind(first[at]) in STAMP_KINDS
        ),
    )


def texts_of_sheets(path: Path) -> dict[str, list[list[str]]]:
    """Read the cells of all sheets as texts, by name; whole numbers have no point.

    Raises RecordError for a file that is damaged.
    """
    sheets = _sheets(path, read_bytes(path))
    return {name: [[*map(_text, row)] for row in rows] for name, rows in sheets}


def _text(cell: Any) -> str:
    if isinstance(cell, bool):
        return "yes" if cell else "no"
    if isinstance(cell, float):
        return str(int(cell)) if cell.is_integer() else repr(cell)
    if isinstance(cell, datetime | date):
        return cell.isoformat()
    return str(cell).strip()


def _sheets(path: Path, data: bytes, sheet: str | None = None) -> Iterator[tuple[str, list[Row]]]:
    """Yield the name and the rows of each sheet, or of the one that is named."""
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise missing_package(path, "python-calamine", "excel") from None
    book = sound(path, WORKBOOK, lambda: CalamineWorkbook.from_filelike(io.BytesIO(data)))
    names = book.sheet_names
    if sheet is not None and sheet not in names:
        raise RecordError(f"{path}: no sheet {sheet!r}; there are {', '.join(map(repr, names))}")

    def rows(name: str) -> list[Row]:
        return [*book.get_sheet_by_name(name).to_python(skip_empty_area=False)]

    for name in names if sheet is None else [sheet]:
        yield name, sound(path, WORKBOOK, partial(rows, name))


def _table_in(rows: Sequence[Row]) -> tuple[Row, Row, dict[int, Row]] | None:
    """Find the first table on a sheet: a row of names, perhaps one of units, and the samples.

    The samples are rows by their number; right above the first of them are names or units.
    """
    filled = [at for at, row in enumerate(rows) if row.count("") < len(row)]
    for place, at in enumerate(filled):
        above = [rows[number] for number in filled[max(place - 2, 0) : place]]
        if not above or not _is_sample(rows[at]):
            continue
        units: Row = ()
        if len(above) > 1 and _are_texts(above[-1]) and is_units(above[-1]):
            units = above.pop()
        head = above[-1]
        named = (name.strip() and cell != "" for name, cell in zip(head, rows[at], strict=True))
        if _are_texts(head) and sum(map(bool, named)) >= FEWEST_CELLS:
            return head, units, {number + 1: rows[number] for number in filled[place:]}
    return None


def _is_sample(row: Row) -> bool:
    """Check for a row of a sample: numbers and timestamps, more of them than of texts."""
    texts = sum(isinstance(cell, str) and cell != "" for cell in row)
    numbers = sum(not isinstance(cell, str) for cell in row)
    return FEWEST_CELLS <= numbers > texts


def _are_texts(row: Row) -> bool:
    return all(isinstance(cell, str) for cell in row)


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


def _since_midnight(cell: time | timedelta) -> timedelta:
    return cell if isinstance(cell, timedelta) else datetime.combine(date.min, cell) - datetime.min


# kind of the cells -> what converts one, what replaces a missing one, and the type of the array
ARRAYS: dict[str, tuple[Callable[[Any], Any], Any, str]] = {
    "number": (float, np.nan, "float64"),
    "timestamp": (lambda stamp: stamp, None, "datetime64[ns]"),
    "time of day": (_since_midnight, None, "timedelta64[ns]"),
}
