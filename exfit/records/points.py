"""Points that were read from instruments: columns of a file, or of a table in the case itself."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats import open_table
from exfit.records.formats.table import Table, column_error, position
from exfit.records.units import alike

Array = NDArray[np.float64]
Row = Sequence[str | float]


@dataclass(frozen=True, eq=False)
class Points:
    """Columns (M,) of points in the units that they were read in.

    ``units`` are those that the source itself gives, by column.
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str]
    source: Path
    sha256: str


def read_points(path: Path, columns: Mapping[str, str | None], sheet: str | None = None) -> Points:
    """Return columns of a recorder's file of any kind; it needs no time.

    ``columns`` gives the unit of each column, None where that of the file counts. Raises
    RecordError for a file that cannot be read, a column that is missing or in another unit, or a
    cell that is no number.
    """
    table = open_table(path, sheet)
    numbers = table.numbers(columns)
    for column, unit in columns.items():
        _check_unit(table, column, unit)
    units = {column: table.units[column] for column in columns if column in table.units}
    return Points(numbers, units, path, table.sha256)


def table_points(rows: Sequence[Row], columns: Mapping[str, str | None], place: Path) -> Points:
    """Return columns of a table whose first row has their names.

    Raises RecordError for a column that is missing, a row of another length than the first, or a
    cell that is no number; ``place`` is what it begins with.
    """
    names, *points = rows
    for number, row in enumerate(points, 2):
        if len(row) != len(names):
            raise RecordError(
                f"{place}: table: row {number} has {len(row)} cells, the first one {len(names)}"
            )
    numbers = {
        column: np.array([
            _number(row[position(place, list(map(str, names)), column)], number, column, place)
            for number, row in enumerate(points, 2)
        ])
        for column in columns
    }  # fmt: skip
    content = json.dumps([list(row) for row in rows])
    return Points(numbers, {}, place, hashlib.sha256(content.encode()).hexdigest())


def _number(cell: str | float, row: int, column: str, place: Path) -> float:
    if isinstance(cell, str):
        raise column_error(f"{place}: table: row {row}", column, f"{cell!r} is not a number")
    return float(cell)


def _check_unit(table: Table, column: str, unit: str | None) -> None:
    in_file = table.units.get(column)
    if unit is not None and in_file is not None and not alike(in_file, unit):
        raise column_error(table.path, column, f"in {in_file} as the file says, not in {unit}")
