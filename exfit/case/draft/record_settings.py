"""How the record of a new case is read."""

from dataclasses import dataclass, replace
from pathlib import Path

from exfit.records.formats import open_table
from exfit.records.inspection import Inspection, inspect


@dataclass(frozen=True)
class RecordSettings:
    """Columns of the time of a record and their unit, its sheet, the column of its voltage.

    ``memory`` (GB) is what reading may take. What is empty or None is as the file shows it.
    """

    clock: tuple[str, ...] = ()
    unit: str | None = None
    sheet: str | None = None
    voltage: str | None = None
    memory: float | None = None

    def inspect(self, file: Path) -> Inspection:
        """Inspect a recorder's file; raises RecordError where it is none."""
        table = open_table(file, self.sheet, self.memory)
        inspection = inspect(table, self.clock or None, self.unit)
        return replace(inspection, sheet=self.sheet, memory=self.memory)
