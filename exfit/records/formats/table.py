"""A recorder's file as a table: named columns of numbers, whatever kind of file it is."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.memory import TooLargeError, readable
from exfit.util.files import read_regular

Array = NDArray[np.float64]

NONE: frozenset[str] = frozenset()
COLUMNS_SHOWN = 30


class RecordTable(Protocol):
    """Named columns, each (M,); messages name a fault by its place in the file."""

    @property
    def path(self) -> Path:
        """The file."""

    @property
    def sha256(self) -> str:
        """The hash of its bytes; of a file in two parts, of both."""

    @property
    def names(self) -> tuple[str, ...]:
        """The columns, in the order of the file."""

    @property
    def units(self) -> Mapping[str, str]:
        """The units that the file itself gives, by column."""

    @property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time, or those of date and time; empty where none seems to."""

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,) unconverted, nan where a sample is missing in a ``gappy`` one.

        Raises RecordError for a column that is not there, and a cell that is no number.
        """

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s; of timestamps and epochs, since the first of them.

        ``unit`` is that of the numbers: s, ms, us or min; None: as the file says, else s. Raises
        RecordError where it contradicts the file, or a cell is neither number nor timestamp.
        """

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0, as messages name it: record.csv:17."""


def position(path: Path, names: Sequence[str], name: str) -> int:
    """Return the position of a column; raises RecordError where it is missing or there twice."""
    places = [at for at, other in enumerate(names) if other == name]
    if not places:
        raise RecordError(f"{path}: no column {name!r}{_near(name, names)}")
    if len(places) > 1:
        numbers = " and ".join(str(at + 1) for at in places)
        raise RecordError(f"{path}: {name!r} names more than one column: {numbers}")
    return places[0]


def positions(path: Path, names: Sequence[str], wanted: Iterable[str]) -> dict[str, int]:
    """Return the positions of many columns; raises RecordError as ``position`` does."""
    places = {name: at for at, name in enumerate(names)}
    if len(places) < len(names):
        return {name: position(path, names, name) for name in wanted}
    return {
        name: places[name] if name in places else position(path, names, name) for name in wanted
    }


def listed(names: Sequence[str]) -> str:
    """Return columns as a message lists them, the first of many."""
    first = ", ".join(map(repr, names[:COLUMNS_SHOWN]))
    more = f" and {len(names) - COLUMNS_SHOWN} more" if len(names) > COLUMNS_SHOWN else ""
    return first + more


def increases(table: RecordTable, columns: Sequence[str]) -> bool:
    """Check whether columns can be the time, numbers or timestamps that increase throughout."""
    try:
        instants = table.instants(columns)
    except TooLargeError:
        raise
    except RecordError:
        return False
    return bool(np.all(instants[1:] > instants[:-1]))


def refuse_uneven(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Raise a RecordError where columns, or a column and the time, differ in length."""
    sizes = {name: len(column) for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        first, *rest = sizes
        other = next(name for name in rest if sizes[name] != sizes[first])
        raise RecordError(
            f"{path}: column {first!r} has {sizes[first]} samples, {other!r} has {sizes[other]}"
        )


def column_error(place: Path | str, name: str, what: str) -> RecordError:
    """Return the error of a column or one of its cells: its place, its column, what is wrong."""
    return RecordError(f"{place}: column {name!r}: {what}")


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a file; raises RecordError where it cannot be read."""
    with readable(path):
        return read_regular(path)


def _near(name: str, names: Sequence[str]) -> str:
    """Return a hint at similar column names, and all of them.

    Where only capitals differ, that name alone is meant.
    """
    from difflib import get_close_matches

    folded = [other.casefold() for other in names]
    same = [other for other in names if other.casefold() == name.casefold()]
    close = get_close_matches(name.casefold(), folded)
    near = same or [other for other in names if other.casefold() in close]
    hint = f"did you mean {' or '.join(map(repr, near))}? The" if near else "the"
    return f"; {hint} columns are {listed(names)}"
