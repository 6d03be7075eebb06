"""The case file that a unit of a planner's dynamics file makes: to be read, run, and edited."""

from pathlib import Path

from exfit.case.case_draft import (
    CaseDraft,
    Noted,
    Section,
    in_comment,
    parameter,
    with_sources,
)
from exfit.errors import DynamicsError, ExfitError
from exfit.features.planner.fields import text_of
from exfit.features.planner.records import PSSE, SPEED_FLAG
from exfit.features.planner.unit import Unit, UnitPart, read_unit
from exfit.features.start.starting_case import inputs_section
from exfit.features.start.starting_unit import PartData, UnitData
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.util.files import read_limited
from exfit.util.sources import TYPICAL

LARGEST_FILE = 32_000_000  # bytes; that of a whole interconnection has fewer
TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}], "duration": 10.0}


def import_unit(path: Path, bus: int | None = None, machine_id: str | None = None) -> Unit:
    """Read a unit of a file as ``read_unit`` does; raises DynamicsError."""
    return read_unit(text_of(read_file(path), str(path)), str(path), bus, machine_id)


def read_file(path: Path) -> bytes:
    """Read the content of a dynamics file; raises DynamicsError where it cannot be read."""
    try:
        return read_limited(path, LARGEST_FILE)
    except ExfitError as error:
        raise DynamicsError([str(error)]) from None


def imported_case(unit: Unit, file: str) -> CaseDraft:
    """Make the case of a unit on open circuit, with a comment for all that it rests on.

    ``file`` is the path of the dynamics file as the case names it.
    """
    exciter = unit.exciter
    plant = {
        "type": OPEN_CIRCUIT.name,
        "machine": _named(unit.machine),
        **_parameters(unit.machine),
    }
    values = Noted(_values(exciter), "what a fit shall find goes under free")
    sections: Section = {
        "model": _named(exciter),
        **_forms(exciter),
        "plant": plant,
        **{part.definition.kind: _added(part) for part in unit.added},
        "test": Noted(TEST, "a 5 % step; a record takes the place of the duration"),
        "parameters": _with_sources({"fixed": values}, exciter),
        "as_found": as_found(unit, file),
    }
    name = Path(file).name
    heading = f"Unit {unit.id} at bus {unit.bus} of {name}, on open circuit."
    return CaseDraft(
        sections, (heading, *(f"Line {line}: {text}." for line, text in unit.warnings))
    )


def unit_data(unit: Unit, file: str) -> UnitData:
    """Take the models of a unit of a file, whose path the case names, with their values.

    The file does not say where its values come from; what it does not hold is typical.
    """

    def data(part: UnitPart) -> PartData:
        absent = dict.fromkeys(part.definition.absent, TYPICAL)
        origin = f"those of {Path(file).name}"
        model, times_speed = part.definition.model, part.times_speed
        return PartData(model, part.values, absent, origin, part.inputs, times_speed)

    added = {part.definition.kind: data(part) for part in unit.added}
    exciter = data(unit.exciter)
    found = as_found(unit, file)
    return UnitData(exciter.model.name, exciter, data(unit.machine), added, found)


def as_found(unit: Unit, file: str) -> Section:
    """Make the section of what the file holds of the unit, for the report to compare with.

    ``unused`` are values there that the planner's program does without.
    """
    parts = (unit.exciter, unit.machine, *unit.added)
    values = {
        _prefix(part) + row.symbol: part.values[row.symbol]
        for part in parts
        for row in part.definition.model.sheet
        if row.symbol in part.definition.names
    }
    unused = {_prefix(part) + symbol: value for part in parts for symbol, value in part.unused}
    name = in_comment(unit.id)
    source = f"{Path(file).name}, bus {unit.bus}, machine {name}"
    return {
        "source": Noted(source, above="in the planner's base; a report compares it"),
        "bus": unit.bus,
        "id": name,
        "file": file,
        "model": unit.exciter.definition.model.name,
        "parameters": values,
        **({"unused": unused} if unused else {}),
    }


def _prefix(part: UnitPart) -> str:
    """Begin the names of the parameters of a part as the system does."""
    return "" if part.definition.kind == "exciter" else f"{part.definition.kind}."


def _named(part: UnitPart) -> Noted:
    definition = part.definition
    return Noted(definition.model.name, f"{definition.record.name} on line {part.line}")


def _forms(exciter: UnitPart) -> Section:
    """Say the form of the saturation curve, and that the speed multiplies efd, where it does."""
    section: Section = {}
    if {"E1", "SE1", "E2", "SE2"} <= exciter.values.keys():
        of_psse = exciter.definition.program == PSSE
        section["saturation"] = Noted("quadratic", "as PSS/E" if of_psse else "taken as in PSS/E")
    if exciter.times_speed:
        name = exciter.definition.record.name
        of_record = exciter.definition.record.times_speed
        origin = f"as InterPSS and ANDES have {name}" if of_record else f"{SPEED_FLAG} of {name}"
        text = f"{origin}; acts where the speed is not rated"
        section["efd_times_speed"] = Noted(True, text)
    return section


def _added(part: UnitPart) -> Section:
    inputs = inputs_section(part.definition.model, part.inputs)
    return {"model": _named(part), **inputs, **_parameters(part)}


def _parameters(part: UnitPart) -> Section:
    return _with_sources({"parameters": _values(part)}, part)


def _values(part: UnitPart) -> Section:
    absent = part.definition.absent
    return {
        row.symbol: parameter(
            row,
            part.values[row.symbol],
            "; typical, not in the file" if row.symbol in absent else "",
        )
        for row in part.definition.model.sheet
    }


def _with_sources(section: Section, part: UnitPart) -> Section:
    """Say which values are not of the file; it does not say where its own come from."""
    return with_sources(section, dict.fromkeys(part.definition.absent, TYPICAL))
