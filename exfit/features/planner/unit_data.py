"""The data of a new case from a unit of a planner's file."""

from pathlib import Path

from exfit.case.draft.starting_unit import PartData, UnitData
from exfit.features.planner.import_case import as_found
from exfit.features.planner.unit import Unit, UnitPart
from exfit.util.sources import TYPICAL


def unit_data(unit: Unit, file: str) -> UnitData:
    """Return the models of a unit of a file, whose path the case names, with their values.

    The file does not say where its values come from; what it does not hold is typical.
    """
    added = {part.definition.kind: _part(part, file) for part in unit.added}
    exciter = _part(unit.exciter, file)
    found = tuple(as_found(unit, file))
    machine = _part(unit.machine, file)
    return UnitData(exciter.model.name, exciter, machine, added, found)


def _part(part: UnitPart, file: str) -> PartData:
    absent = dict.fromkeys(part.definition.absent, TYPICAL)
    origin = f"those of {Path(file).name}"
    model, times_speed = part.definition.model, part.times_speed
    return PartData(model, part.values, absent, origin, part.inputs, times_speed)
