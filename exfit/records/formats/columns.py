"""A table whose columns are fetched one by one, as all readers of binary files give it."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.clock import are_soc, find_clock, in_seconds, soc_in_seconds
from exfit.records.formats.memory import MemoryLimit
from exfit.records.formats.table import (
    NONE,
    Array,
    column_error,
    increases,
    positions,
    refuse_uneven,
)

T = TypeVar("T")

PANIC = "PanicException"  # of packages in Rust
SECOND = np.timedelta64(1, "s")


@dataclass(frozen=True, eq=False)
class Columns:
    """A RecordTable over columns that are fetched by position when they are requested.

    ``fetch`` returns float64, or datetime64[ns] for timestamps and timedelta64[ns] for times of
    day, nan or NaT where a sample is missing; it raises RecordError for a column of anything else.
    ``where`` names the place of a sample, counted from 0; ``refuse_larger`` raises TooLargeError
    where columns, by name, need too much memory. ``time_columns`` are those of the time
    where the kind of file defines them, ``stamps`` those that hold timestamps.
    """

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: Mapping[str, str]
    fetch: Callable[[int], NDArray[Any]]
    where: Callable[[int], str]
    refuse_larger: Callable[[Sequence[str]], None]
    time_columns: tuple[str, ...] = ()
    stamps: tuple[str, ...] = ()

    @cached_property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time, or those of date and time; empty where none seems to."""
        return self.time_columns or find_clock(self.names, self.stamps, partial(increases, self))

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,) unconverted, nan where a sample is missing in a ``gappy`` one.

        Raises RecordError for a column that is missing or there twice, that holds no numbers or
        lacks one, and for columns that are not equally long.
        """
        names = [*names]
        self.refuse_larger(names)
        places = positions(self.path, self.names, names)
        columns = {}
        for name, at in places.items():
            column = self.fetch(at) if name in gappy else self._whole(name, at)
            if column.dtype.kind != "f":
                raise column_error(self.path, name, "timestamps, not numbers")
            columns[name] = np.asarray(column, np.float64)
        refuse_uneven(self.path, columns)
        return columns

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s; of timestamps and epochs, since the first of them.

        ``columns`` are one, or a date and a time of day; ``unit`` is that of numbers: s, ms, us or
        min. Raises RecordError where it contradicts the file, and where a sample is missing.
        """
        if are_soc(columns):
            return soc_in_seconds(self.path, columns, self.numbers(columns))
        self.refuse_larger(columns)
        places = positions(self.path, self.names, columns)
        whole = {name: self._whole(name, at) for name, at in places.items()}
        refuse_uneven(self.path, whole)
        first = columns[0]
        if len(whole) == 1 and whole[first].dtype.kind == "f":
            return in_seconds(self.path, first, whole[first], self.units.get(first), unit)
        if unit is not None:
            raise column_error(self.path, first, f"timestamps, not numbers of {unit}")
        ticks = self._ticks(whole)
        return np.asarray((ticks - ticks[0]) / SECOND, np.float64)

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0, as messages name it."""
        return self.where(row)

    def _whole(self, name: str, at: int) -> NDArray[Any]:
        """Return a column that lacks no sample."""
        column = self.fetch(at)
        lost = np.flatnonzero(np.isnan(column))  # NaT too
        if lost.size:
            raise column_error(self.where(int(lost[0])), name, "the sample is missing")
        return column

    def _ticks(self, columns: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """Return instants of one column, or of a date and a time of day."""
        kinds = "".join(sorted(column.dtype.kind for column in columns.values()))
        if kinds not in ("M", "m", "Mm"):
            names = " and ".join(map(repr, columns))
            raise RecordError(f"{self.path}: columns {names} are not a date and a time of day")
        first, *rest = columns.values()
        return first + rest[0] if rest else first


@dataclass(frozen=True, eq=False)
class Contents:
    """Columns of a binary file as its reader finds them; ``fetch`` as that of `Columns`.

    ``lengths`` are their numbers of samples. ``counted`` is what messages call a sample; ``rows``
    are the numbers of samples in the file, None where these are counted from 1.
    """

    sha256: str
    names: Sequence[str]
    units: Mapping[str, str]
    lengths: Sequence[int]
    fetch: Callable[[int], NDArray[Any]]
    counted: str
    rows: Sequence[int] | None = None
    stamps: Sequence[str] = ()


def table_of(path: Path, contents: Contents, limit: MemoryLimit) -> Columns:
    """Make a table of what was found in a file, whose columns take no more memory than allowed."""
    rows, lengths = contents.rows, dict(zip(contents.names, contents.lengths, strict=True))
    return Columns(
        path=path,
        sha256=contents.sha256,
        names=tuple(contents.names),
        units=contents.units,
        fetch=contents.fetch,
        where=lambda row: f"{path}: {contents.counted} {row + 1 if rows is None else rows[row]}",
        refuse_larger=lambda columns: limit.check_columns(
            [lengths.get(name, 0) for name in columns]
        ),
        stamps=tuple(contents.stamps),
    )


def missing_package(path: Path, package: str, extra: str) -> RecordError:
    """Return the error of an optional package that is not installed."""
    return RecordError(
        f'{path}: reading it needs the package {package}: pip install "exfit[{extra}]"'
    )


def sound(path: Path, kind: str, read: Callable[[], T]) -> T:
    """Read a file by a package; raises RecordError where it is not of that kind."""
    try:
        return read()
    except (RecordError, MemoryError):
        raise
    except BaseException as error:  # damaged files make a package fail in many ways
        if not (isinstance(error, Exception) or type(error).__name__ == PANIC):
            raise
        what = str(error).partition("\n")[0] or type(error).__name__
        raise RecordError(f"{path}: not {kind}, or damaged: {what}") from None
