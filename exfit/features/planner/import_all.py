"""Cases of all units of a dynamics file, with their records where there are any."""

import csv
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from pathlib import Path

from exfit.case.suggestion import Base, RecordSettings, relative
from exfit.errors import ExfitError
from exfit.features.planner.fields import DynamicsFault, located, text_of
from exfit.features.planner.import_case import imported_case, read_file, unit_data
from exfit.features.planner.unit import Unit
from exfit.features.planner.units import DynamicsUnits, RefusedUnit, read_units
from exfit.features.start.made_case import MadeCase, case_of_plan, case_of_records
from exfit.features.start.record_files import UnitKey, records_in, unit_named
from exfit.features.start.tables import CaseOfTable, case_name_of, read_case_table

WRITTEN, RECORDED, REFUSED, NO_MODEL = "written", "written with records", "refused", "no model"


@dataclass(frozen=True)
class ImportPlan:
    """The units of a dynamics file, and the files or the rows of a table that belong to them.

    ``faults`` are of what belongs to no unit; ``others`` are records without a bus in their names.
    """

    dyr: Path
    units: DynamicsUnits
    files: Mapping[UnitKey, tuple[Path, ...]]
    rows: Mapping[UnitKey, CaseOfTable]
    faults: tuple[str, ...]
    others: tuple[Path, ...]

    def name_of(self, unit: Unit) -> str:
        """Return the name of the file of a unit's case."""
        planned = self.rows.get(key_of(unit))
        name = case_name_of(unit.bus, unit.id) if planned is None else planned.name
        return f"{name}.yaml"

    @property
    def names(self) -> list[str]:
        """The names of all files of cases."""
        return [self.name_of(unit) for unit in self.units.units]


@dataclass(frozen=True)
class RecordOptions:
    """What is common to all records: sizes of steps, bases by signal, how they are read."""

    sizes: tuple[str, ...] = ()
    bases: Mapping[str, Base] = field(default_factory=dict)
    settings: RecordSettings = field(default_factory=RecordSettings)


@dataclass(frozen=True)
class ImportedUnit:
    """A unit of the file and what became of it: a row of units.csv."""

    bus: int
    id: str
    line: int
    machine: str
    exciter: str
    stabiliser: str
    governor: str
    status: str
    case: str
    records: str
    notes: str


@dataclass(frozen=True)
class ImportedUnits:
    """All units of a file, the texts of the cases by their names, and what is doubtful in them.

    ``unused`` are sizes of steps that are of no test.
    """

    units: tuple[ImportedUnit, ...]
    texts: Mapping[str, str]
    doubts: tuple[str, ...]
    unused: tuple[str, ...]


def plan_import(dyr: Path, records: Path | None = None) -> ImportPlan:
    """Plan an import: the units of a file, with records of a folder or a table.

    Raises DynamicsError where the file cannot be read, ExfitError where the folder or table cannot.
    """
    units = read_units(text_of(read_file(dyr), str(dyr)), dyr)
    known = [key_of(unit) for unit in units.units]
    faults = located(units.faults, str(dyr))
    if records is None:
        return ImportPlan(dyr, units, {}, {}, tuple(faults), ())
    if records.is_dir():
        joined = records_in(records, known)
        faults += joined.faults
        return ImportPlan(dyr, units, joined.of_unit, {}, tuple(faults), joined.others)
    rows: dict[UnitKey, CaseOfTable] = {}
    for case in read_case_table(records, dyr):
        try:
            _add(case, known, rows)
        except ExfitError as fault:
            faults.append(f"{case.place}: {fault}")
    return ImportPlan(dyr, units, {}, rows, tuple(faults), ())


def _add(case: CaseOfTable, known: Sequence[UnitKey], rows: dict[UnitKey, CaseOfTable]) -> None:
    """Add the case of a table to that of its unit; raises ExfitError where that has one."""
    assert case.bus is not None
    unit = unit_named(case.bus, case.machine_id, known)
    if unit in rows:
        raise ExfitError(f"{unit}: also in {rows[unit].place}, under the name {rows[unit].name}")
    rows[unit] = case


def import_all(plan: ImportPlan, folder: Path, options: RecordOptions) -> ImportedUnits:
    """Return the cases of all units as they will be written into a folder."""
    rows, texts, doubts, used = list[ImportedUnit](), dict[str, str](), list[str](), set[str]()
    file = relative(plan.dyr, folder)
    for unit in plan.units.units:
        name = plan.name_of(unit)
        try:
            made = _made(unit, plan, file, folder, options)
        except ExfitError as fault:
            rows.append(_row(unit, plan, "", str(fault).splitlines()))
            continue
        texts[name] = made.draft.text
        doubts += made.doubts
        used.update(made.sizes)
        rows.append(_row(unit, plan, name, _in_words(unit.warnings)))
    rows += [_refused_row(unit) for unit in plan.units.refused]
    unused = tuple(size for size in options.sizes if size not in used)
    return ImportedUnits(
        tuple(sorted(rows, key=lambda row: row.line)), texts, tuple(doubts), unused
    )


def units_table(units: Iterable[ImportedUnit]) -> str:
    """Return all units of a file as CSV."""
    out = io.StringIO()
    names = [column.name for column in fields(ImportedUnit)]
    writer = csv.DictWriter(out, names, lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(unit) for unit in units)
    return out.getvalue()


def key_of(unit: Unit) -> UnitKey:
    """Return the bus of a unit and its id in capitals."""
    return UnitKey(unit.bus, unit.id.upper())


def _made(
    unit: Unit, plan: ImportPlan, file: str, folder: Path, options: RecordOptions
) -> MadeCase:
    """Return the case of a unit; raises ExfitError where a record of it cannot be used."""
    key, bases = key_of(unit), options.bases
    if key in plan.rows:
        return case_of_plan(plan.rows[key], unit_data(unit, file), folder, bases)
    if key not in plan.files:
        return MadeCase(imported_case(unit, file), ())
    inspections = [options.settings.inspect(path) for path in plan.files[key]]
    return case_of_records(inspections, unit_data(unit, file), folder, options.sizes, bases)


def _row(unit: Unit, plan: ImportPlan, case: str, notes: Iterable[str]) -> ImportedUnit:
    key = key_of(unit)
    planned = plan.rows.get(key)
    files = plan.files.get(key, ()) if planned is None else tuple(planned.settings)
    written = RECORDED if files else WRITTEN
    added = {part.definition.kind: part.definition.record.name for part in unit.added}
    return ImportedUnit(
        bus=unit.bus,
        id=unit.id,
        line=unit.machine.line,
        machine=unit.machine.definition.record.name,
        exciter=unit.exciter.definition.record.name,
        stabiliser=added.get("stabiliser", ""),
        governor=added.get("governor", ""),
        status=written if case else REFUSED,
        case=case,
        records="; ".join(str(path) for path in files),
        notes="; ".join(notes),
    )


def _refused_row(unit: RefusedUnit) -> ImportedUnit:
    status = REFUSED if unit.modelled else NO_MODEL
    notes = "; ".join(_in_words(unit.faults))
    return ImportedUnit(unit.bus, unit.id, unit.line, "", "", "", "", status, "", "", notes)


def _in_words(faults: Iterable[DynamicsFault]) -> Iterator[str]:
    return (f"line {fault.line}: {fault.text}" for fault in faults)
