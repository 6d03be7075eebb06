"""A table in memory, in place of a file."""

from dataclasses import dataclass, field
from pathlib import Path

from exfit.errors import RecordError


@dataclass(frozen=True)
class Columns:
    """A table in memory; a column of words has no numbers."""

    content: dict
    units: dict = field(default_factory=dict)
    clock: tuple = ("t",)
    path: Path = Path("record.csv")
    sha256: str = ""

    @property
    def names(self):
        return tuple(self.content)

    def numbers(self, names, gappy=frozenset()):
        for name in names:
            if isinstance(self.content[name], str):
                raise RecordError(f"record.csv:2: column {name!r}: not a number")
        return {name: self.content[name] for name in names}

    def each(self, names):
        for name in names:
            try:
                yield name, self.numbers([name])[name]
            except RecordError as fault:
                yield name, fault

    def instants(self, columns, unit=None):
        return self.content[columns[0]]

    def place(self, row):
        return f"record.csv:{row + 2}"
