"""Points that were read from instruments: columns of a file, or numbers in the case itself."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.records.formats import open_table
from exfit.records.formats.table import RecordTable, column_error
from exfit.records.units import alike

Array = NDArray[np.float64]


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
    """Read columns of a recorder's file of any kind; it needs no time.

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


def given_points(rows: Sequence[Sequence[float]], signals: Sequence[str], source: Path) -> Points:
    """Take the columns of numbers that a case itself gives, by signal, in the order of a row."""
    columns = dict(zip(signals, np.array(rows).T, strict=False))
    digest = hashlib.sha256(json.dumps([list(row) for row in rows]).encode()).hexdigest()
    return Points(columns, {}, source, digest)


def _check_unit(table: RecordTable, column: str, unit: str | None) -> None:
    in_file = table.units.get(column)
    if unit is not None and in_file is not None and not alike(in_file, unit):
        raise column_error(table.path, column, f"in {in_file} as the file says, not in {unit}")
