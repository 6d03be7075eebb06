"""Parquet files, by pyarrow; a column is read when it is requested."""

import hashlib
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import stated
from exfit.records.formats.columns import Columns, missing_package, sound
from exfit.records.formats.table import column_error, readable
from exfit.records.units import unit_in
from exfit.util.files import on_disk

if TYPE_CHECKING:
    import pyarrow as pa

PARQUET = "a Parquet file"
UNIT_KEYS = (b"unit", b"units")  # of a column's metadata


def read(path: Path) -> Columns:
    """Read a Parquet file: its columns of numbers, timestamps and times of day.

    Nulls are missing samples; the unit is that of the column's metadata (unit or units), else of
    its name. Raises RecordError for a file that is damaged or empty, or the package pyarrow
    missing.
    """
    try:
        from pyarrow import ArrowInvalid, types
        from pyarrow.parquet import ParquetFile
    except ImportError:
        raise missing_package(path, "pyarrow", "parquet") from None
    with readable(path), on_disk(path).open("rb") as data:
        sha256 = hashlib.file_digest(data, "sha256").hexdigest()

    def outline() -> "tuple[pa.Schema, int]":
        with ParquetFile(on_disk(path), page_checksum_verification=True) as file:
            groups = (file.metadata.row_group(at) for at in range(file.num_row_groups))
            rows = sum(group.num_rows for group in groups)
            return file.schema_arrow, max(file.metadata.num_rows, rows)

    def column(name: str) -> "pa.ChunkedArray":
        with ParquetFile(on_disk(path), page_checksum_verification=True) as file:
            return file.read(columns=[name]).column(0)

    def fetch(at: int) -> NDArray[Any]:
        field = schema.field(at)
        steps = _steps(field.type)
        if not steps:
            raise column_error(path, field.name, f"{field.type}, not numbers")
        values = sound(path, PARQUET, partial(column, field.name))
        try:
            for kind in steps:
                # an integer beyond 2**53 becomes the float64 next to it; a date beyond ns does not
                values = values.cast(kind, safe=not types.is_floating(kind))
        except ArrowInvalid as error:
            raise column_error(path, field.name, str(error)) from None
        return np.asarray(values.to_numpy())

    schema, rows = sound(path, PARQUET, outline)
    if rows == 0:
        raise RecordError(f"{path}: no samples in it")
    units = {}
    for field in schema:
        own = [field.metadata[key] for key in UNIT_KEYS if key in (field.metadata or {})]
        stated_unit = own[0].decode("utf-8", "replace") if own else ""
        units[field.name] = stated_unit or unit_in(field.name)
    return Columns(
        path=path,
        sha256=sha256,
        names=tuple(schema.names),
        units=stated(units),
        lengths=[rows] * len(schema.names),
        fetch=fetch,
        sample=f"{path}: row",
        stamps=tuple(
            field.name
            for field in schema
            if types.is_temporal(field.type) and not types.is_interval(field.type)
        ),
    )


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
