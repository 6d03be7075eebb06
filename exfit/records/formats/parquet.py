"""Parquet files, by pyarrow; a column is read when it is requested."""

import hashlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import stated
from exfit.records.formats.columns import Contents, missing_package, sound
from exfit.records.formats.memory import readable
from exfit.records.formats.table import column_error
from exfit.records.units import unit_in
from exfit.util.root import on_disk

if TYPE_CHECKING:
    import pyarrow as pa
    from pyarrow.parquet import ParquetFile

PARQUET = "a Parquet file"
UNIT_KEYS = (b"unit", b"units")  # of a column's metadata


def read(path: Path) -> Contents:
    """Read a Parquet file: its columns of numbers, timestamps and times of day.

    Nulls are missing samples; the unit is that of the column's metadata (unit or units), else of
    its name. Raises RecordError for a file that is damaged or empty, or the package pyarrow
    missing.
    """
    try:
        from pyarrow.parquet import ParquetFile
    except ImportError:
        raise missing_package(path, "pyarrow", "parquet") from None
    with readable(path), on_disk(path).open("rb") as data:
        sha256 = hashlib.file_digest(data, "sha256").hexdigest()

    def opened() -> "ParquetFile":
        return ParquetFile(on_disk(path), page_checksum_verification=True)

    schema, rows = sound(path, PARQUET, lambda: _outline(opened))
    if rows == 0:
        raise RecordError(f"{path}: no samples in it")
    return Contents(
        sha256=sha256,
        names=schema.names,
        units=stated(
            {field.name: _unit_of(field.metadata or {}) or unit_in(field.name) for field in schema}
        ),
        lengths=[rows] * len(schema.names),
        fetch=lambda at: _fetch(path, opened, schema.field(at)),
        counted="row",
        stamps=[field.name for field in schema if _is_stamp(field.type)],
    )


def _outline(opened: "Callable[[], ParquetFile]") -> "tuple[pa.Schema, int]":
    with opened() as file:
        groups = (file.metadata.row_group(at) for at in range(file.num_row_groups))
        rows = sum(group.num_rows for group in groups)
        return file.schema_arrow, max(file.metadata.num_rows, rows)


def _unit_of(metadata: Mapping[bytes, bytes]) -> str | None:
    return next(
        (metadata[key].decode("utf-8", "replace") for key in UNIT_KEYS if key in metadata), None
    )


def _is_stamp(kind: "pa.DataType") -> bool:
    from pyarrow import types

    return types.is_temporal(kind) and not types.is_interval(kind)


def _fetch(path: Path, opened: "Callable[[], ParquetFile]", field: "pa.Field") -> NDArray[Any]:
    """Return a column as float64, datetime64[ns] or timedelta64[ns]."""
    steps = _steps(field.type)
    if not steps:
        raise column_error(path, field.name, f"{field.type}, not numbers")

    def read() -> "pa.ChunkedArray":
        with opened() as file:
            return file.read(columns=[field.name]).column(0)

    return _cast(path, field.name, sound(path, PARQUET, read), steps)


def _cast(
    path: Path, name: str, column: "pa.ChunkedArray", steps: "tuple[pa.DataType, ...]"
) -> NDArray[Any]:
    from pyarrow import ArrowInvalid
    from pyarrow.types import is_floating

    try:
        for kind in steps:
            # an integer beyond 2**53 becomes the float64 next to it; a date beyond ns does not
            column = column.cast(kind, safe=not is_floating(kind))
    except ArrowInvalid as error:
        raise column_error(path, name, str(error)) from None
    return np.asarray(column.to_numpy())


def _steps(kind: "pa.DataType") -> "tuple[pa.DataType, ...]":
    """Return the types by which a column is cast to one that NumPy knows; none for text."""
    from pyarrow import duration, float64, int64, time64, timestamp, types

    if types.is_dictionary(kind):
        kind = kind.value_type
    if types.is_timestamp(kind) or types.is_date(kind):
        return (timestamp("ns"),)
    if types.is_duration(kind):
        return (duration("ns"),)
    if types.is_time(kind):
        return (time64("ns"), int64(), duration("ns"))
    number = types.is_integer(kind) or types.is_floating(kind) or types.is_decimal(kind)
    if number or types.is_boolean(kind) or types.is_null(kind):
        return (float64(),)
    return ()
