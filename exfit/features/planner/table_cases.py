"""The cases of a table of records, made in the folder of a batch when they are needed."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from exfit.case.suggestion import relative
from exfit.errors import DynamicsError, ExfitError
from exfit.features.planner.fields import located, text_of
from exfit.features.planner.import_all import key_of
from exfit.features.planner.import_case import read_file, unit_data
from exfit.features.planner.unit import Unit
from exfit.features.planner.units import DynamicsUnits, RefusedUnit, read_units
from exfit.features.start.made_case import case_of_plan
from exfit.features.start.record_files import UnitKey, unit_named
from exfit.features.start.starting_unit import UnitData, unit_with
from exfit.features.start.tables import CaseOfTable, read_case_table
from exfit.util.files import write
from exfit.util.text import dotted

CASES = "cases"  # the folder of the cases in that of a batch


@dataclass(frozen=True)
class CaseMaker:
    """Makes a case of a table: called, it writes the file and returns "", or why there is none.

    ``units`` are those of each planner's file, or why it cannot be read.
    """

    case: CaseOfTable
    file: Path
    units: Mapping[Path, DynamicsUnits | str]

    def __call__(self) -> str:
        """Write the case, unless the file exists; return why it cannot be used, or ""."""
        try:
            draft = case_of_plan(self.case, self._unit(), self.file.parent, {}).draft
            text = draft.text
            if self._is_other(text):
                return (
                    f"{self.file} exists and is not what the table makes: remove it, or give it "
                    "as a case in place of the row"
                )
            write(self.file, text)
        except ExfitError as fault:
            return "; ".join(str(fault).splitlines())
        missing = [f"{dotted(value.place)} (line {value.line})" for value in draft.open_values()]
        if missing:
            return f"{self.case.place}: the table lacks what {self.file} has as ?: " + ", ".join(
                missing
            )
        return ""

    def _is_other(self, text: str) -> bool:
        """Tell if the file exists with another content."""
        return self.file.exists() and self.file.read_bytes() != text.encode()

    def _unit(self) -> UnitData:
        """Return the data of the unit; raises ExfitError where its file has none."""
        case, folder = self.case, self.file.parent
        planner = None
        if case.dyr is not None:
            units = self.units[case.dyr]
            if isinstance(units, str):
                raise ExfitError(units)
            unit = _unit_of(case, units, case.dyr)
            planner = unit_data(unit, relative(case.dyr, folder))
        return unit_with(case.model, case.machine, planner, folder)


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
    files = dict.fromkeys(case.dyr for case in cases if case.dyr is not None)
    units = {file: _units_in(file) for file in files}
    makers = (CaseMaker(case, Path(folder, CASES, f"{case.name}.yaml"), units) for case in cases)
    return {maker.file: maker for maker in makers}


def _units_in(file: Path) -> DynamicsUnits | str:
    """Return the units of a planner's file, or why it cannot be read."""
    try:
        return read_units(text_of(read_file(file), str(file)), file)
    except DynamicsError as fault:
        return str(fault)


def _unit_of(case: CaseOfTable, units: DynamicsUnits, file: Path) -> Unit:
    """Return the unit of a case: that of its bus and id, or the only one of the file.

    Raises ExfitError where there is none or several, or its records have faults.
    """
    if case.bus is None:
        if len(units.units) != 1:
            count = len(units.units)
            raise ExfitError(f"{case.place}: bus: missing; {file} has {count} units to import")
        return units.units[0]
    refused = _refused(case, units.refused)
    if refused is not None:
        raise DynamicsError(located(refused.faults, str(file)))
    by_key = {key_of(unit): unit for unit in units.units}
    try:
        return by_key[unit_named(case.bus, case.machine_id, [*by_key])]
    except ExfitError as fault:
        raise ExfitError(f"{case.place}: {file}: {fault}") from None


def _refused(case: CaseOfTable, units: Sequence[RefusedUnit]) -> RefusedUnit | None:
    """Return the unit of a case where it is among those that cannot be imported."""
    if case.machine_id is None:
        return None
    own = UnitKey(case.bus or 0, case.machine_id.upper())
    return next((unit for unit in units if (unit.bus, unit.id.upper()) == own), None)
