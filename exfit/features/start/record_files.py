"""Which record belongs to which unit of a planner's file: by names that begin with its bus.

101_1.csv, 101-1-up.csv    machine 1 at bus 101, also behind the word bus
101_1/                     a folder of its records
101.csv, 101/              the machine at bus 101, where it is the only one
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from exfit.errors import ExfitError
from exfit.records.formats import BESIDE_CFG, COMTRADE, WORKBOOKS
from exfit.util.files import siblings

TEXTS = (".csv", ".tsv", ".txt", ".asc", ".dat")
SUFFIXES = (*TEXTS, *COMTRADE, ".mat", ".parquet", *WORKBOOKS)
# the bus, then behind a separator one or two letters or digits, which no further one follows
NAME = re.compile(
    r"(?:bus[-_ ]*)?(?P<bus>[0-9]{1,6})(?:[-_ ]+(?P<id>[A-Za-z0-9]{1,2}))?(?![A-Za-z0-9]).*",
    re.IGNORECASE | re.DOTALL,
)


class UnitKey(NamedTuple):
    """The bus of a unit and its machine id in capitals."""

    bus: int
    id: str

    def __str__(self) -> str:
        return f"bus {self.bus}, machine {self.id}"


@dataclass(frozen=True)
class JoinedRecords:
    """The records of each unit, those that cannot be joined to one, and others by their names.

    ``faults`` begin with the path; ``others`` have no bus in their names.
    """

    of_unit: Mapping[UnitKey, tuple[Path, ...]]
    faults: tuple[str, ...]
    others: tuple[Path, ...]


def records_in(folder: Path, units: Iterable[UnitKey]) -> JoinedRecords:
    """Return the records of a folder by their units; raises ExfitError where it cannot be read."""
    known = [*units]
    records: dict[UnitKey, list[Path]] = {}
    faults, others = list[str](), list[Path]()
    for entry in _entries(folder):
        files = [*records_among(_entries(entry) if entry.is_dir() else [entry])]
        if not files:
            continue
        parts = NAME.fullmatch(entry.name if entry.is_dir() else entry.stem)
        if parts is None:
            others.append(entry)
            continue
        try:
            unit = unit_named(int(parts["bus"]), parts["id"], known)
        except ExfitError as fault:
            faults.append(f"{entry}: {fault}")
        else:
            records.setdefault(unit, []).extend(files)
    of_unit = {unit: tuple(files) for unit, files in records.items()}
    return JoinedRecords(of_unit, tuple(faults), tuple(others))


def unit_named(bus: int, machine_id: str | None, units: Sequence[UnitKey]) -> UnitKey:
    """Return the unit of a bus and an id, or the only one at the bus where no id is given.

    Raises ExfitError where there is none or several.
    """
    at_bus = [unit for unit in units if unit.bus == bus]
    if not at_bus:
        raise ExfitError(f"bus {bus}: no such unit can be imported")
    ids = ", ".join(unit.id for unit in at_bus)
    if machine_id is None:
        if len(at_bus) > 1:
            raise ExfitError(f"bus {bus}: {len(at_bus)} machines, {ids}; which one is not said")
        return at_bus[0]
    own = [unit for unit in at_bus if unit.id == machine_id.upper()]
    if not own:
        raise ExfitError(f"bus {bus}: machine {machine_id}: not one of its machines: {ids}")
    return own[0]


def _entries(folder: Path) -> list[Path]:
    try:
        return sorted(entry for entry in folder.iterdir() if not entry.name.startswith("."))
    except OSError as fault:
        raise ExfitError(f"{folder}: cannot be read: {fault.strerror}") from None


def records_among(files: Iterable[Path]) -> Iterator[Path]:
    """Yield the files that are records; a file of data beside its .cfg counts once."""
    for file in files:
        suffix = file.suffix.lower()
        beside = suffix in BESIDE_CFG and siblings(file, ".cfg")
        if suffix in SUFFIXES and not beside and file.is_file():
            yield file
