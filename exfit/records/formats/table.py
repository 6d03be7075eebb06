"""A recorder's file as a table: named columns of numbers, whatever kind of file it is.

A file of a few kilobytes can declare, or unpack to, more than any computer holds: what reading it
will need is estimated before it is read.
"""

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.util.arrays import Array
from exfit.util.files import read_regular, regular_size, why_unreadable

NONE: frozenset[str] = frozenset()
COLUMNS_SHOWN = 30

GIGABYTE = 1e9
LEAST_LIMIT = 1.0  # GB, where a case gives none
SHARE_OF_FILE = 4.0  # the limit is so many times the file's size, where that is more
MOST_BY_SIZE = 4.0  # GB, that the size of a file alone may lift the limit to
OWN = 0.15e9  # bytes, of Python and the libraries, without any file
NUMBER = 8  # bytes of a float64
WORKING_COLUMNS = 10  # as long as the record, which looking at a column takes at a time
HOW_TO_RAISE = "memory, in GB, raises it: of the record in a case, --memory of a command"


class StoppedError(RecordError):
    """A file whose reading is given up: it needs too much memory or time, or ends its reader."""


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

    def each(self, names: Sequence[str]) -> Iterator[tuple[str, Array | RecordError]]:
        """Yield names with their columns (M,), nan where a sample is missing, or their faults.

        No more columns than the kind of file asks for are read at a time. Raises StoppedError where
        all of them need too much memory.
        """

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s; of timestamps and epochs, since the first of them.

        ``unit`` is that of the numbers: s, ms, us or min; None: as the file says, else s. Raises
        RecordError where it contradicts the file, or a cell is neither number nor timestamp.
        """

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0, as messages name it: record.csv:17."""


class MemoryLimit(NamedTuple):
    """How much memory, in bytes, reading a file may take."""

    path: Path
    size: int
    most: float

    def check(self, needed: float, what: str) -> None:
        """Raise StoppedError where ``what`` needs more bytes than are allowed."""
        total = needed + OWN
        if total > self.most:
            raise StoppedError(
                f"{self.path}: {what}: reading needs about {total / GIGABYTE:.3g} GB of memory, "
                f"the limit is {self.most / GIGABYTE:.3g} GB; {HOW_TO_RAISE}"
            )

    def check_columns(self, lengths: Sequence[int], held: float = 0.0) -> None:
        """Raise StoppedError where columns of such lengths, beside ``held`` bytes, need more."""
        longest = max(lengths, default=0)
        needed = NUMBER * (sum(lengths) + WORKING_COLUMNS * longest)
        plural = "s" * (len(lengths) != 1)
        self.check(needed + held, f"{longest} samples in {len(lengths)} column{plural}")


def memory_limit(path: Path, memory: float | None, *beside: Path) -> MemoryLimit:
    """Return the limit for a file and those ``beside`` it; ``memory`` in GB, None: the usual one.

    Raises RecordError for what is no file, as a pipe or a device, which may never end, and for one
    that is larger than the limit.
    """
    size = 0
    for file in (path, *beside):
        with readable(file):
            size += regular_size(file)
    usual = max(LEAST_LIMIT, min(SHARE_OF_FILE * size / GIGABYTE, MOST_BY_SIZE))
    limit = MemoryLimit(path, size, GIGABYTE * (usual if memory is None else memory))
    limit.check(size, f"{size} bytes")
    return limit


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Raise RecordError for what keeps a file from being read."""
    try:
        yield
    except (OSError, ValueError) as fault:
        raise RecordError(f"{path}: cannot be read: {why_unreadable(fault)}") from None


def read_bytes(path: Path) -> bytes:
    """Return the bytes of a file; raises RecordError where it cannot be read."""
    with readable(path):
        return read_regular(path)


def positions(path: Path, names: Sequence[str], wanted: Iterable[str]) -> dict[str, int]:
    """Return the positions of columns; raises RecordError for one that is missing or twice."""
    places = {name: at for at, name in enumerate(names)}
    for name in (wanted := [*wanted]):
        if name not in places:
            raise RecordError(f"{path}: no column {name!r}; {_columns_like(name, names)}")
        if len(places) < len(names) and names.count(name) > 1:
            numbers = " and ".join(str(at) for at, other in enumerate(names, 1) if other == name)
            raise RecordError(f"{path}: {name!r} names more than one column: {numbers}")
    return {name: places[name] for name in wanted}


def positions_of_each(
    path: Path, names: Sequence[str], wanted: Sequence[str]
) -> tuple[dict[str, int], dict[str, RecordError]]:
    """Return the positions of columns, and the faults of those of which there are several."""
    places, refused = {name: at for at, name in enumerate(names)}, dict[str, RecordError]()
    for name, count in Counter(names).items() if len(places) < len(names) else ():
        if count > 1:
            try:
                positions(path, names, [name])
            except RecordError as fault:
                refused[name] = fault
    return {name: places[name] for name in wanted if name not in refused}, refused


def _columns_like(name: str, names: Sequence[str]) -> str:
    """Return all columns, and a hint at those of a similar name, or of one in other capitals."""
    from difflib import get_close_matches

    folded = [other.casefold() for other in names]
    same = [other for other in names if other.casefold() == name.casefold()]
    close = get_close_matches(name.casefold(), folded)
    near = same or [other for other in names if other.casefold() in close]
    hint = f"did you mean {' or '.join(map(repr, near))}? The" if near else "the"
    return f"{hint} columns are {listed(names)}"


def listed(names: Sequence[str]) -> str:
    """Return columns as a message lists them, the first of many."""
    first = ", ".join(map(repr, names[:COLUMNS_SHOWN]))
    more = f" and {len(names) - COLUMNS_SHOWN} more" if len(names) > COLUMNS_SHOWN else ""
    return first + more


def increases(table: RecordTable, columns: Sequence[str]) -> bool:
    """Check whether columns can be the time, numbers or timestamps that increase throughout."""
    try:
        instants = table.instants(columns)
    except StoppedError:
        raise
    except RecordError:
        return False
    return bool(np.all(instants[1:] > instants[:-1]))


def refuse_uneven(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Raise a RecordError where columns, or a column and the time, are empty or of two lengths."""
    first = next(iter(columns), "")
    for name, column in columns.items():
        if not len(column):
            raise RecordError(f"{path}: column {name!r} has no samples")
        if len(column) != len(columns[first]):
            counts = f"{first!r} has {len(columns[first])} samples, {name!r} has {len(column)}"
            raise RecordError(f"{path}: column {counts}")


def column_error(place: Path | str, name: str, what: str) -> RecordError:
    """Return the error of a column or one of its cells: its place, its column, what is wrong."""
    return RecordError(f"{place}: column {name!r}: {what}")
