"""A recorder's file as a table: named columns of numbers, whatever kind of file it is."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError

Array = NDArray[np.float64]

NONE: frozenset[str] = frozenset()
COLUMNS_SHOWN = 30


class Table(Protocol):
    """Named columns, each (M,); what a fault is in, the messages call by its place in the file."""

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
        """Return columns (M,) as they stand, nan where a sample is missing in a ``gappy`` one.

        Raises RecordError for a column that is not there, and a cell that is no number.
        """

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s: numbers as they stand, timestamps since the first of them.

        ``unit`` is that of the numbers: s, ms, us or min; None: as the file says, else s. Raises
        RecordError where it contradicts the file, or a cell is neither number nor timestamp.
        """

    def place(self, row: int) -> str:
        """Return where a sample stands, counted from 0, as messages name it: record.csv:17."""


def position(path: Path, names: Sequence[str], name: str) -> int:
    """Return the position of a column; raises RecordError where it is not there, or there twice."""
    found = [at for at, known in enumerate(names) if known == name]
    if not found:
        known = ", ".join(repr(name) for name in names[:COLUMNS_SHOWN])
        more = f" and {len(names) - COLUMNS_SHOWN} more"
        shown = known + (more if len(names) > COLUMNS_SHOWN else "")
        raise RecordError(f"{path}: no column {name!r}; the columns are {shown}")
    if len(found) > 1:
        places = " and ".join(str(at + 1) for at in found)
        raise RecordError(f"{path}: {name!r} names more than one column: {places}")
    return found[0]
