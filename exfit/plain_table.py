"""A CSV file with commas and one row of names as a table; the plainest of the readers."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exfit.errors import RecordError
from exfit.readers.clock import seconds_per_unit
from exfit.readers.table import NONE, Array
from exfit.record import _columns, _read_table, _Table


@dataclass(frozen=True)
class Plain:
    """See `exfit.readers.table.Table`."""

    content: _Table
    units: Mapping[str, str] = field(default_factory=dict)

    @property
    def path(self) -> Path:
        """The file."""
        return self.content.path

    @property
    def sha256(self) -> str:
        """Its hash."""
        return self.content.sha256

    @property
    def names(self) -> tuple[str, ...]:
        """The columns."""
        return self.content.names

    @property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time."""
        return tuple(n for n in self.names if n.lower() in ("t", "time", "time (s)", "zeit"))[:1]

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns."""
        found = _columns(self.content, list(names), gappy)
        return {name: np.ascontiguousarray(column) for name, column in found.items()}

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time in s."""
        factor = seconds_per_unit(self.path, columns[0], None, unit)
        return self.numbers(columns[:1])[columns[0]] * factor

    def place(self, row: int) -> str:
        """Return where a sample stands."""
        return f"{self.path.name}:{self.content.first_line + row}"


def open_table(path: Path, sheet: str | None = None) -> Plain:
    """Return the table of a file; raises RecordError."""
    if sheet is not None:
        raise RecordError(f"{path}: a CSV file has no sheets")
    return Plain(_read_table(path))
