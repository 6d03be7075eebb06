"""The case file of a unit of a planner's dynamics file."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from exfit.case.case_draft import CaseDraft, Noted, Section, in_comment, parameter, with_sources
from exfit.errors import DynamicsError, ExfitError
from exfit.features.planner.buses import NO_BUSES, Buses
from exfit.features.planner.fields import DynamicsFault, text_of
from exfit.features.planner.records import PSSE, SPEED_FLAG, Reading
from exfit.features.planner.units import (
    DynamicsUnits,
    RefusedUnit,
    Unit,
    WithoutExciter,
    read_unit,
    read_units,
)
from exfit.features.start.starting_case import (
    PartData,
    UnitData,
    differs_in_psse,
    inputs_section,
    put_added,
)
from exfit.plants.machine_on_load import MACHINE_ON_LOAD
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.util.files import read_limited
from exfit.util.vocabulary import PLANNER, TYPICAL

LARGEST_FILE = 32_000_000  # bytes; that of a whole interconnection has fewer
TEST = {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}], "duration": 10.0}
REJECTION = {"vt0": 1.0, "breaker": {"opens": 1.0}, "duration": 10.0}
BEFORE = {"P": 0.0, "Q": -0.3}  # pu: current on the d axis alone


def import_unit(
    path: Path,
    bus: int | str | None = None,
    machine_id: str | None = None,
    buses: Buses = NO_BUSES,
) -> Unit:
    """Read a unit of a file as ``read_unit`` does; raises DynamicsError."""
    return read_unit(text_of(read_file(path), str(path)), str(path), bus, machine_id, buses)


def machine_without_exciter(
    path: Path, bus: int | str | None, machine_id: str | None, buses: Buses
) -> RefusedUnit | None:
    """Return the unit that is meant if it is a machine without an exciter; raises DynamicsError."""
    units = units_of_file(path, buses)
    all_units: list[Unit | RefusedUnit] = [*units.units, *units.refused]
    meant = [
        unit
        for unit in all_units
        if bus in (None, unit.bus, unit.bus_name) and machine_id in (None, unit.id)
    ]
    only = meant[0] if len(meant) == 1 else None
    return only if isinstance(only, RefusedUnit) and only.alone is not None else None


def units_of_file(path: Path, buses: Buses = NO_BUSES) -> DynamicsUnits:
    """Read all units of a file; raises DynamicsError where it cannot be read."""
    return read_units(text_of(read_file(path), str(path)), path, buses)


def read_file(path: Path) -> bytes:
    """Read the content of a dynamics file; raises DynamicsError where it cannot be read."""
    try:
        return read_limited(path, LARGEST_FILE)
    except ExfitError as error:
        raise DynamicsError(str(error)) from None


def imported_case(unit: Unit, file: str) -> CaseDraft:
    """Make the case of a unit on open circuit, with a comment for the origin of its values.

    ``file`` is the path of the dynamics file as the case names it.
    """
    exciter, machine, record = unit.exciter, unit.machine, unit.exciter.definition.record
    sections: Section = {"model": _named(exciter)}
    if {"E1", "SE1", "E2", "SE2"} <= exciter.values.keys():
        of_psse = exciter.definition.program == PSSE
        sections["saturation"] = Noted("quadratic", "as PSS/E" if of_psse else "taken as in PSS/E")
    if exciter.times_speed:
        origin = f"{SPEED_FLAG} of {record.name}"
        if record.times_speed:
            origin = f"as InterPSS and ANDES have {record.name}"
        sections["efd_times_speed"] = Noted(True, f"{origin}; acts at other than rated speed")
    plant = {"type": OPEN_CIRCUIT.name, "machine": _named(machine), **_parameters(machine)}
    sections["plant"] = plant
    for part in unit.added:
        inputs = inputs_section(part.definition.model, part.inputs)
        model = _named(part)
        if differs_in_psse(part.definition.model):
            model = replace(model, behind=f"{model.behind}; on load with plant.dialect: psse")
        section = {"model": model, **inputs, **_parameters(part)}
        put_added(sections, part.definition.kind, section)
    if unit.limiters:
        sections["limiters"] = [
            {"model": _named(part), "place": part.place, **_parameters(part)}
            for part in unit.limiters
        ]
    values = _parameters(exciter)
    fixed = Noted(values.pop("parameters"), "move what is to be fitted to free")
    sections |= {
        "test": Noted(TEST, "a 5 % step; a record replaces the duration"),
        "parameters": {"fixed": fixed, **values},
        "as_found": as_found(unit, file),
    }
    heading = f"Unit {unit.id} at bus {_bus_of(unit)} of {Path(file).name}, on open circuit."
    return CaseDraft(sections, (heading, *_notes(unit.warnings)))


def case_of_machine(unit: RefusedUnit, alone: WithoutExciter, file: str) -> CaseDraft:
    """Make the case of a machine without an exciter: at constant field voltage its breaker opens.

    ``file`` is the path of the dynamics file as the case names it.
    """
    machine = alone.machine
    plant = {"type": MACHINE_ON_LOAD.name, "machine": _named(machine), **_parameters(machine)}
    sections: Section = {
        "plant": {**plant, "network": Noted(BEFORE, "until the breaker opens")},
        "test": Noted(REJECTION, "a load rejection; a record replaces the duration"),
        "as_found": _as_found(unit, file, None, (machine,)),
    }
    heading = (
        f"Machine {unit.id} at bus {_bus_of(unit)} of {Path(file).name}, without an exciter: at "
        "constant field voltage, on load until its breaker opens."
    )
    return CaseDraft(sections, (heading, *_notes(alone.warnings)))


def _notes(warnings: Iterable[DynamicsFault]) -> Iterator[str]:
    """Yield the comments that say what is left out."""
    yield from (f"Line {line}: {text}." for line, text in warnings)


def _named(part: Reading) -> Noted:
    definition = part.definition
    return Noted(definition.model.name, f"{definition.record.name} on line {part.line}")


def _parameters(part: Reading) -> Section:
    """Make the values of a part, with which of them are not of the file."""
    absent = part.definition.absent
    values = {
        row.symbol: parameter(
            row,
            part.values[row.symbol],
            "; not in the file" if row.symbol in absent else "",
        )
        for row in part.definition.model.sheet
    }
    return with_sources({"parameters": values}, _sources(part))


def _sources(part: Reading) -> dict[str, str]:
    """Name the sources of the values of a part: the planner's file, or else units of its kind."""
    absent = part.definition.absent
    return {
        row.symbol: TYPICAL if row.symbol in absent else PLANNER
        for row in part.definition.model.sheet
    }


def unit_data(unit: Unit, file: str) -> UnitData:
    """Take the models of a unit of a file, whose path the case names, with their values."""

    def data(part: Reading) -> PartData:
        origin = f"those of {Path(file).name}"
        model, times_speed = part.definition.model, part.times_speed
        own = _sources(part)
        return PartData(model, part.values, own, origin, part.inputs, times_speed, part.place)

    added = {part.definition.kind: data(part) for part in unit.added}
    exciter, machine = data(unit.exciter), data(unit.machine)
    limiters = tuple(map(data, unit.limiters))
    found = as_found(unit, file)
    return UnitData(exciter.model.name, exciter, machine, added, limiters, found)


def _bus_of(unit: Unit | RefusedUnit) -> str:
    """Return the number of the bus of a unit and, if it is known, its name."""
    return in_comment(f"{unit.bus} {unit.bus_name}".strip())


def as_found(unit: Unit, file: str) -> Section:
    """Make the section of what the file holds of the unit, for the report to compare with."""
    parts = (unit.exciter, unit.machine, *unit.added, *unit.limiters)
    return _as_found(unit, file, unit.exciter, parts)


def _as_found(
    unit: Unit | RefusedUnit, file: str, exciter: Reading | None, parts: Iterable[Reading]
) -> Section:
    """Make that section of some parts of a unit, and of the model of its exciter.

    ``unused`` are values there that the planner's program ignores.
    """
    values, unused = dict[str, float](), dict[str, float]()
    for part in parts:
        definition, prefix = part.definition, part.definition.prefix
        for row in definition.model.sheet:
            if row.symbol in definition.names:
                values[prefix + row.symbol] = part.values[row.symbol]
        unused |= {prefix + symbol: value for symbol, value in part.unused}
    name = in_comment(unit.id)
    source = f"{Path(file).name}, bus {_bus_of(unit)}, machine {name}"
    return {
        "source": Noted(source, above="the model in the planner's base, for the report"),
        "bus": unit.bus,
        "id": name,
        "file": file,
        **({} if exciter is None else {"model": exciter.definition.model.name}),
        "parameters": values,
        **({"unused": unused} if unused else {}),
    }
