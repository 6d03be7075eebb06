"""A table whose columns are fetched one by one, as all readers of binary files give it."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.clock import are_soc, find_clock, in_seconds, soc_in_seconds
from exfit.records.formats.table import (
    NONE,
    MemoryLimit,
    StoppedError,
    column_error,
    increases,
    positions,
    positions_of_each,
    refuse_uneven,
)
from exfit.util.arrays import Array

T = TypeVar("T")

PANIC = "PanicException"  # of packages in Rust
SECOND = np.timedelta64(1, "s")


@dataclass(frozen=True, eq=False)
class Columns:
    """A RecordTable over columns that are fetched by position when they are requested.

    ``fetch`` returns float64, or datetime64[ns] for timestamps and timedelta64[ns] for times of
    day, nan or NaT where a sample is missing; it raises RecordError for a column of anything else.
    ``lengths`` are the numbers of samples. ``sample`` is what messages call one; ``rows`` are the
    numbers of the samples in the file, None where these are counted from 1. ``stamps`` are the
    columns that hold timestamps, ``time_columns`` those of the time where the kind of file defines
    them. ``limit`` is that of the memory, of which ``held`` bytes are taken.
    """

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: Mapping[str, str]
    lengths: Sequence[int]
    fetch: Callable[[int], NDArray[Any]]
    sample: str
    rows: Sequence[int] | None = None
    stamps: tuple[str, ...] = ()
    time_columns: tuple[str, ...] = ()
    limit: MemoryLimit | None = None
    held: int = 0

    @cached_property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time, or those of date and time; empty where none seems to."""
        return self.time_columns or find_clock(self.names, self.stamps, partial(increases, self))

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,), nan for samples that a ``gappy`` one lacks; see RecordTable."""
        columns = self._fetched([*names], gappy)
        return {name: self._as_numbers(name, column) for name, column in columns.items()}

    def each(self, names: Sequence[str]) -> Iterator[tuple[str, Array | RecordError]]:
        """Yield columns (M,) or their faults, fetched one by one; see RecordTable."""
        places, refused = positions_of_each(self.path, self.names, names)
        if self.limit is not None:
            self.limit.check_columns([self.lengths[at] for at in places.values()], self.held)
        for name in names:
            found: Array | RecordError
            try:
                found = refused.get(name) or self._as_numbers(name, self.fetch(places[name]))
            except StoppedError:
                raise
            except RecordError as fault:
                found = fault
            yield name, found

    def _as_numbers(self, name: str, column: NDArray[Any]) -> Array:
        if column.dtype.kind != "f":
            raise column_error(self.path, name, "timestamps, not numbers")
        return np.asarray(column, np.float64)

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s, of numbers in ``unit`` or of timestamps; see RecordTable."""
        if are_soc(columns):
            return soc_in_seconds(self.path, columns, self.numbers(columns))
        whole = self._fetched(columns, NONE)
        first = columns[0]
        kinds = "".join(sorted(column.dtype.kind for column in whole.values()))
        if kinds == "f":
            return in_seconds(self.path, first, whole[first], self.units.get(first), unit)
        if unit is not None:
            raise column_error(self.path, first, f"timestamps, not numbers of {unit}")
        if kinds not in ("M", "m", "Mm"):
            named = " and ".join(map(repr, whole))
            raise RecordError(f"{self.path}: columns {named} are not a date and a time of day")
        ticks, *times = whole.values()
        for time in times:
            ticks = ticks + time
        return np.asarray((ticks - ticks[0]) / SECOND, np.float64)

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0, as messages name it."""
        return f"{self.sample} {row + 1 if self.rows is None else self.rows[row]}"

    def _fetched(self, names: Sequence[str], gappy: frozenset[str]) -> dict[str, NDArray[Any]]:
        """Fetch columns of one length, which lack no sample where they are not ``gappy``."""
        places = positions(self.path, self.names, names)
        if self.limit is not None:
            self.limit.check_columns([self.lengths[at] for at in places.values()], self.held)
        columns = {}
        for name, at in places.items():
            columns[name] = self.fetch(at)
            if name in gappy:
                continue
            lost = np.flatnonzero(np.isnan(columns[name]))  # NaT too
            if lost.size:
                raise column_error(self.place(int(lost[0])), name, "the sample is missing")
        refuse_uneven(self.path, columns)
        return columns


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
