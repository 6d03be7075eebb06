"""A table whose columns are fetched one by one: what the readers of binary files share."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.readers.clock import seconds_per_unit
from exfit.readers.table import NONE, Array

T = TypeVar("T")

COLUMNS_SHOWN = 30
SECOND = np.timedelta64(1, "s")


@dataclass(frozen=True, eq=False)
class Columns:
    """A Table over columns that are fetched when they are asked for, by position.

    ``fetch`` returns float64, or datetime64[ns] for timestamps and timedelta64[ns] for times of
    day, nan or NaT where a sample is missing; it raises RecordError for a column of anything else.
    ``where`` names the place of a sample, counted from 0.
    """

    path: Path
    sha256: str
    names: tuple[str, ...]
    units: Mapping[str, str]
    clock: tuple[str, ...]
    fetch: Callable[[int], NDArray[Any]]
    where: Callable[[int], str]

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,) as they stand, nan where a sample is missing in a ``gappy`` one.

        Raises RecordError for a column that is not there or there twice, that holds no numbers or
        lacks one, and for columns that are not equally long.
        """
        columns = {name: self._numbers(name, name in gappy) for name in names}
        self._refuse_uneven(columns)
        return columns

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s: numbers as they stand, timestamps since the first of them.

        ``columns`` are one, or a date and a time of day; ``unit`` is that of numbers: s, ms, us or
        min. Raises RecordError where it contradicts the file, and where a sample is missing.
        """
        found = {name: self._whole(name) for name in columns}
        self._refuse_uneven(found)
        first = columns[0]
        if len(found) == 1 and found[first].dtype.kind == "f":
            factor = seconds_per_unit(self.path, first, self.units.get(first), unit)
            return np.asarray(found[first] * factor, np.float64)
        if unit is not None:
            self._refuse(first, f"holds timestamps: they have no unit such as {unit}")
        ticks = self._ticks(found)
        return np.asarray((ticks - ticks[0]) / SECOND, np.float64)

    def place(self, row: int) -> str:
        """Return where a sample stands, counted from 0, as messages name it."""
        return self.where(row)

    def _numbers(self, name: str, gappy: bool) -> Array:
        column = self.fetch(self._position(name)) if gappy else self._whole(name)
        if column.dtype.kind != "f":
            self._refuse(name, "holds timestamps, not numbers")
        return np.asarray(column, np.float64)

    def _whole(self, name: str) -> NDArray[Any]:
        """Return a column that lacks no sample."""
        column = self.fetch(self._position(name))
        lost = np.flatnonzero(np.isnan(column))  # NaT too
        if lost.size:
            place = self.where(int(lost[0]))
            raise RecordError(f"{place}, column {name!r}: the sample is missing")
        return column

    def _ticks(self, found: Mapping[str, NDArray[Any]]) -> NDArray[Any]:
        """Return instants of one column, or of a date and a time of day."""
        kinds = "".join(sorted(column.dtype.kind for column in found.values()))
        if kinds not in ("M", "m", "Mm"):
            names = " and ".join(map(repr, found))
            raise RecordError(f"{self.path}: columns {names} are not a date and a time of day")
        first, *rest = found.values()
        return first + rest[0] if rest else first

    def _position(self, name: str) -> int:
        found = [at for at, known in enumerate(self.names) if known == name]
        if not found:
            raise RecordError(f"{self.path}: no column {name!r}{_near(name, self.names)}")
        if len(found) > 1:
            places = " and ".join(str(at + 1) for at in found)
            raise RecordError(f"{self.path}: {name!r} names more than one column: {places}")
        return found[0]

    def _refuse_uneven(self, columns: Mapping[str, NDArray[Any]]) -> None:
        sizes = {name: column.size for name, column in columns.items()}
        if len(set(sizes.values())) > 1:
            first, *rest = sizes
            other = next(name for name in rest if sizes[name] != sizes[first])
            raise RecordError(
                f"{self.path}: column {first!r} has {sizes[first]} samples, {other!r} has "
                f"{sizes[other]}"
            )

    def _refuse(self, name: str, what: str) -> NoReturn:
        raise RecordError(f"{self.path}: column {name!r} {what}")


def _near(name: str, names: Sequence[str]) -> str:
    """Return which columns there are, those first that read alike."""
    from difflib import get_close_matches

    near = get_close_matches(name, names)
    meant = f"; is {' or '.join(map(repr, near))} meant" if near else ""
    known = ", ".join(map(repr, names[:COLUMNS_SHOWN]))
    more = f" and {len(names) - COLUMNS_SHOWN} more" if len(names) > COLUMNS_SHOWN else ""
    return f"{meant}; the columns are {known}{more}"


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a file; raises RecordError where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise RecordError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:  # a name with a null character
        raise RecordError(f"{path}: cannot be read: {error}") from None


def needed(path: Path, package: str, extra: str) -> RecordError:
    """Return the error of an optional package that is not installed."""
    return RecordError(
        f'{path}: reading it needs the package {package}: pip install "exfit[{extra}]"'
    )


def sound(path: Path, kind: str, read: Callable[[], T]) -> T:
    """Return what a package reads of a file, or raise RecordError that it is none of its kind."""
    try:
        return read()
    except Exception as error:  # a damaged file fails in a package in many ways
        what = str(error).partition("\n")[0] or type(error).__name__
        raise RecordError(f"{path}: not {kind}, or damaged: {what}") from None
