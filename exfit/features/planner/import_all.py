"""Cases of many units of dynamics files: of all of one file, or of a table of records."""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from os import PathLike
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

from exfit.case.suggestion import Base, RecordSettings, bases_of, relative
from exfit.errors import DynamicsError, ExfitError, FileError
from exfit.features.planner.buses import NO_BUSES
from exfit.features.planner.fields import located
from exfit.features.planner.import_case import (
    case_of_machine,
    imported_case,
    unit_data,
    units_of_file,
)
from exfit.features.planner.power_flow import read_buses, read_power_flow
from exfit.features.planner.units import DynamicsUnits, RefusedUnit, Unit, with_rating
from exfit.features.start.ratings import NO_RATINGS, Ratings
from exfit.features.start.record_files import UnitKey, records_in, unit_named
from exfit.features.start.starting_case import (
    MadeCase,
    UnitData,
    case_of_plan,
    case_of_records,
    unit_with,
)
from exfit.features.start.starting_tests import sizes_of
from exfit.features.start.tables import CaseOfTable, case_name_of, read_case_table
from exfit.plants import LOAD_CONTROLLER
from exfit.results.tables import csv_text
from exfit.signals import RECORDED as SIGNALS
from exfit.util.files import write, write_each
from exfit.util.text import dotted, first_texts, near

WRITTEN, RECORDED, REFUSED, NO_MODEL = "written", "written with records", "refused", "no model"
UNITS = "units.csv"
OF_TURBINE = ("governor", LOAD_CONTROLLER)  # in one column
CASES = "cases"  # the folder of the cases in that of a batch


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
    power_flows: Mapping[Path | None, Mapping[UnitKey, Ratings]]

    def ratings_of(self, unit: Unit, given: Ratings) -> Ratings:
        """Return the ratings of a unit: those given, of a power flow file, of its own record."""
        key = key_of(unit)
        planned = self.rows.get(key)
        files = (None,) if planned is None else (planned.raw, None)
        found = (self.power_flows.get(file, {}).get(key, NO_RATINGS) for file in files)
        ratings = given
        for other in (*found, ratings_of_record(unit)):
            ratings = ratings.over(other)
        return ratings

    def name_of(self, unit: Unit) -> str:
        """Return the name of the file of a unit's case."""
        planned = self.rows.get(key_of(unit))
        name = case_name_of(unit.bus, unit.id) if planned is None else planned.name
        return f"{name}.yaml"

    @property
    def names(self) -> list[str]:
        """The names of all files of cases."""
        alone = (unit for unit in self.units.refused if unit.alone is not None)
        machines = [f"{case_name_of(unit.bus, unit.id)}.yaml" for unit in alone]
        return [*(self.name_of(unit) for unit in self.units.units), *machines]


@dataclass(frozen=True)
class RecordOptions:
    """What is common to all: sizes of steps, bases by signal, how records are read, ratings."""

    sizes: Mapping[str, float] = field(default_factory=dict)
    bases: Mapping[str, Base] = field(default_factory=dict)
    settings: RecordSettings = field(default_factory=RecordSettings)
    ratings: Ratings = NO_RATINGS


class ImportedUnit(NamedTuple):
    """A unit of the file and what became of it: a row of units.csv."""

    bus: int
    name: str
    id: str
    line: int
    machine: str
    exciter: str
    stabiliser: str
    governor: str
    limiters: str
    status: str
    case: str
    records: str
    notes: str


@dataclass(frozen=True)
class ImportedUnits:
    """The units of a file with what became of each, and the texts of their cases by file name.

    ``doubts`` are what is doubtful in the cases, ``plan`` is what was to be imported.
    """

    units: tuple[ImportedUnit, ...]
    texts: Mapping[str, str]
    doubts: tuple[str, ...]
    plan: ImportPlan


def plan_import(dyr: Path, records: Path | None = None, raw: Path | None = None) -> ImportPlan:
    """Plan an import: the units of a file, with records of a folder or a table.

    ``raw`` is a power flow file, for units whose row of the table does not name another one.

    Raises DynamicsError where the file cannot be read, ExfitError where the folder or table cannot.
    """
    units = units_of_file(dyr, NO_BUSES if raw is None else read_buses(raw))
    known = [key_of(unit) for unit in units.units]
    faults = located(units.faults, str(dyr))
    flows: dict[Path | None, Mapping[UnitKey, Ratings]] = {}
    if raw is not None:
        flows[None] = read_power_flow(raw)
    if records is None:
        return ImportPlan(dyr, units, {}, {}, tuple(faults), (), flows)
    if records.is_dir():
        joined = records_in(records, known)
        faults += joined.faults
        return ImportPlan(dyr, units, joined.of_unit, {}, tuple(faults), joined.others, flows)
    rows: dict[UnitKey, CaseOfTable] = {}
    for case in read_case_table(records, dyr):
        assert case.bus is not None
        try:
            unit = unit_named(case.bus, case.machine_id, known)
        except ExfitError as fault:
            faults.append(f"{case.place}: {fault}")
            continue
        first = rows.setdefault(unit, case)
        if first is not case:
            other = f"also in {first.place}, under the name {first.name}"
            faults.append(f"{case.place}: {unit}: {other}")
    flows |= {case.raw: read_power_flow(case.raw) for case in rows.values() if case.raw}
    return ImportPlan(dyr, units, {}, rows, tuple(faults), (), flows)


def import_units(
    dyr: str | PathLike[str],
    folder: str | PathLike[str],
    records: str | PathLike[str] | None = None,
    steps: Sequence[str] = (),
    bases: Sequence[str] = (),
    time: Sequence[str] = (),
    time_unit: str | None = None,
    sheet: str | None = None,
    force: bool = False,
    kv: float | None = None,
    mva: float | None = None,
    connection: str | None = None,
    angle_unit: str | None = None,
    channels: Mapping[str, str] = MappingProxyType({}),
    raw: str | PathLike[str] | None = None,
) -> ImportedUnits:
    """Write a case for every unit of a planner's dynamics file, and units.csv with all units.

    Args:
        dyr: a file of PSS/E (.dyr) or of PSLF (.dyd).
        folder: where the cases and units.csv are written.
        records: a folder of records that are named by bus and id, or a table of them.
        steps: sizes of the steps of the records, pu: "0.05", of one test "up=0.05".
        bases: values of 1 pu of their signals: "vt=15.75kV".
        time: columns of their time.
        time_unit: s, ms, us or min.
        sheet: of Excel files.
        force: replace files that exist.
        kv: rated voltage of all units.
        mva: rated power of all units.
        connection: of their phasors: "phase-to-ground" or "phase-to-phase".
        angle_unit: of their phasors: "deg" or "rad".
        channels: columns of their records by signal: {"efd": "Field [V]"}.
        raw: a power flow file of PSS/E (.raw) with names of buses and ratings of the machines.

    Raises DynamicsError where the dynamics file cannot be read, ExfitError where records or options
    cannot be used. A unit that cannot be imported raises nothing: its ``status`` and ``notes`` say
    why.

    Example:
        >>> imported = exfit.import_units("planner.dyr", "cases", records="records")
        >>> [unit.case for unit in imported.units]
    """
    source = path_of(records)
    of_folder = any((steps, time, time_unit, sheet, channels))
    if of_folder and (source is None or not source.is_dir()):
        raise ExfitError(
            "steps, time, time_unit, sheet and channels: only with a folder of records"
        )
    options = RecordOptions(
        sizes_of(steps),
        bases_of(tuple(bases)),
        RecordSettings(tuple(time), time_unit, sheet, channels=channels),
        Ratings(kv, mva, connection, angle_unit),
    )
    folder = Path(folder)
    plan = plan_import(Path(dyr), source, path_of(raw))
    _refuse_existing([] if force else [folder / name for name in (*plan.names, UNITS)])
    rows, texts, doubts, used = list[ImportedUnit](), dict[str, str](), list[str](), set[str]()
    file = relative(plan.dyr, folder)
    for unit in plan.units.units:
        key, name = key_of(unit), plan.name_of(unit)
        unit = with_rating(unit, plan.ratings_of(unit, options.ratings).mva)
        planned = plan.rows.get(key)
        files = plan.files.get(key, ()) if planned is None else tuple(planned.settings)
        notes = [f"line {fault.line}: {fault.text}" for fault in unit.warnings]
        status = RECORDED if files else WRITTEN
        try:
            made = _made(unit, plan, file, folder, options)
        except ExfitError as fault:
            status, name, notes = REFUSED, "", str(fault).splitlines()
        else:
            texts[name] = made.draft.text
            doubts += made.doubts
            used.update(made.sizes)
        rows.append(_row(unit, status, name, files, notes))
    for left in plan.units.refused:
        name = f"{case_name_of(left.bus, left.id)}.yaml"
        rows.append(_refused(left, name))
        if left.alone is not None:
            texts[name] = case_of_machine(left, left.alone, file).text
    _refuse_unused(steps, used)
    rows.sort(key=lambda row: row.line)
    write_each(folder, {**texts, UNITS: csv_text([ImportedUnit._fields, *rows])})
    return ImportedUnits(tuple(rows), texts, tuple(doubts), plan)


def _refuse_unused(steps: Iterable[str], used: Set[str]) -> None:
    """Raise FileError with the sizes of steps that no test has the names of."""
    if unused := [size for size in steps if used.isdisjoint(sizes_of([size]))]:
        raise FileError(f"--step {size}: no test of that name in any record" for size in unused)


def columns_by_signal(texts: Iterable[str]) -> dict[str, str]:
    """Return columns by signal from texts as "efd=Field [V]"; raises FileError with all faults."""
    columns, faults = dict[str, str](), list[str]()
    for text in texts:
        signal, _, column = text.partition("=")
        if signal not in SIGNALS or not column:
            hint = near(signal, SIGNALS) if column else "give it as efd=Field"
            faults.append(f"--channel {text}: not a signal and its column; {hint}")
        columns[signal] = column
    if faults:
        raise FileError(faults)
    return columns


def _refuse_existing(files: Iterable[Path]) -> None:
    """Raise ExfitError with the files that exist."""
    if existing := [str(file) for file in files if file.exists()]:
        listed = "\n".join(first_texts(existing))
        raise ExfitError(f"{listed}\nexist already; --force writes over them")


def _row(
    unit: Unit, status: str, case: str, records: Iterable[Path], notes: Iterable[str]
) -> ImportedUnit:
    added = {part.definition.kind: part.definition.record.name for part in unit.added}
    return ImportedUnit(
        bus=unit.bus,
        name=unit.bus_name,
        id=unit.id,
        line=unit.machine.line,
        machine=unit.machine.definition.record.name,
        exciter=unit.exciter.definition.record.name,
        stabiliser=added.get("stabiliser", ""),
        governor=" ".join(added[kind] for kind in OF_TURBINE if kind in added),
        limiters=" ".join(part.definition.record.name for part in unit.limiters),
        status=status,
        case=case,
        records="; ".join(map(str, records)),
        notes="; ".join(notes),
    )


def _refused(unit: RefusedUnit, case: str) -> ImportedUnit:
    """Make the row of a unit that has no case, or of a machine alone."""
    alone, place = unit.alone, (unit.bus, unit.bus_name, unit.id, unit.line)
    faults = unit.faults if alone is None else alone.warnings
    text = "; ".join(f"line {fault.line}: {fault.text}" for fault in faults)
    if alone is not None:
        name = alone.machine.definition.record.name
        return ImportedUnit(*place, name, "", "", "", "", WRITTEN, case, "", text)
    status = REFUSED if unit.modelled else NO_MODEL
    return ImportedUnit(*place, "", "", "", "", "", status, "", "", text)


def _made(
    unit: Unit, plan: ImportPlan, file: str, folder: Path, options: RecordOptions
) -> MadeCase:
    """Return the case of a unit; raises ExfitError where a record of it cannot be used."""
    key, bases = key_of(unit), options.bases
    ratings = plan.ratings_of(unit, options.ratings)
    if key in plan.rows:
        return case_of_plan(plan.rows[key], unit_data(unit, file), folder, bases, ratings)
    if key not in plan.files:
        return MadeCase(imported_case(unit, file), ())
    inspections = [options.settings.inspect(path) for path in plan.files[key]]
    own = unit_data(unit, file)
    return case_of_records(inspections, own, folder, options.sizes, bases, ratings)


def path_of(file: str | PathLike[str] | None) -> Path | None:
    """Return the path of a file, None without one."""
    return None if file is None else Path(file)


def ratings_of_record(unit: Unit) -> Ratings:
    """Return what the records of a unit state of its ratings."""
    return Ratings(unit.kv, unit.mva, ra=unit.ra, compensation=unit.compensation)


def key_of(unit: Unit) -> UnitKey:
    """Return the bus of a unit and its id in capitals."""
    return UnitKey(unit.bus, unit.id.upper())


@dataclass(frozen=True)
class CaseMaker:
    """Makes a case of a table: called, it writes the file and returns "", or why there is none.

    ``units`` are those of each planner's file, ``power_flows`` the ratings of each power flow file,
    or why it cannot be read.
    """

    case: CaseOfTable
    file: Path
    units: Mapping[Path, DynamicsUnits | str]
    power_flows: Mapping[Path, Mapping[UnitKey, Ratings] | str]

    def __call__(self) -> str:
        """Write the case, unless the file exists; return why it cannot be used, or ""."""
        try:
            unit, ratings = self._unit()
            draft = case_of_plan(self.case, unit, self.file.parent, {}, ratings).draft
            if self.file.exists() and self.file.read_bytes() != draft.text.encode():
                return (
                    f"{self.file} exists with other content than the table makes: remove it, or "
                    "pass it as a case in place of the row"
                )
            write(self.file, draft.text)
        except ExfitError as fault:
            return "; ".join(str(fault).splitlines())
        missing = [f"{dotted(value.place)} (line {value.line})" for value in draft.open_values()]
        lacking = f"{self.case.place}: missing in the table ('?' in {self.file}): "
        return lacking + ", ".join(missing) if missing else ""

    def _unit(self) -> tuple[UnitData, Ratings]:
        """Return data and ratings of the unit; raises ExfitError where its file has none."""
        case, folder = self.case, self.file.parent
        planner, ratings = None, NO_RATINGS
        if case.dyr is not None:
            units = self.units[case.dyr]
            if isinstance(units, str):
                raise ExfitError(units)
            unit = _unit_of(case, units, case.dyr)
            planner = unit_data(unit, relative(case.dyr, folder))
            ratings = ratings_of_record(unit)
            flow = {} if case.raw is None else self.power_flows[case.raw]
            if isinstance(flow, str):
                raise ExfitError(flow)
            ratings = flow.get(key_of(unit), NO_RATINGS).over(ratings)
        return unit_with(case.model, case.machine, planner, folder), ratings


def cases_of_table(
    table: str | PathLike[str], folder: str | PathLike[str] = "fleet"
) -> dict[Path, Callable[[], str]]:
    """Prepare the cases of a table of records, each made when called, by their files.

    They lie in the folder ``cases`` of that of a batch, which calls each when its turn comes. A
    planner's file is read once.

    Raises ExfitError with all faults of the table, each with its row and column.

    Example:
        >>> made = exfit.cases_of_table("records.xlsx", "fleet")
        >>> fleet = exfit.batch([], "fleet", made=made)
    """
    cases = read_case_table(Path(table))
    units: dict[Path, DynamicsUnits | str] = {}
    for file in dict.fromkeys(case.dyr for case in cases if case.dyr is not None):
        try:
            units[file] = units_of_file(file)
        except DynamicsError as fault:
            units[file] = str(fault)
    flows: dict[Path, Mapping[UnitKey, Ratings] | str] = {}
    for file in dict.fromkeys(case.raw for case in cases if case.raw is not None):
        try:
            flows[file] = read_power_flow(file)
        except DynamicsError as fault:
            flows[file] = str(fault)
    makers = (
        CaseMaker(case, Path(folder, CASES, f"{case.name}.yaml"), units, flows) for case in cases
    )
    return {maker.file: maker for maker in makers}


def _unit_of(case: CaseOfTable, units: DynamicsUnits, file: Path) -> Unit:
    """Return the unit of a case: that of its bus and id, or the only one of the file.

    Raises ExfitError where there is none or several, or its records have faults.
    """
    if case.bus is None:
        if len(units.units) != 1:
            count = len(units.units)
            raise ExfitError(f"{case.place}: bus: missing; {file} has {count} units to import")
        return units.units[0]
    for refused in units.refused if case.machine_id is not None else ():
        if (refused.bus, refused.id.upper()) == (case.bus, str(case.machine_id).upper()):
            raise DynamicsError(located(refused.faults, str(file)))
    by_key = {key_of(unit): unit for unit in units.units}
    try:
        return by_key[unit_named(case.bus, case.machine_id, [*by_key])]
    except ExfitError as fault:
        raise ExfitError(f"{case.place}: {file}: {fault}") from None
