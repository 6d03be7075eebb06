"""The case file that a unit of a PSS/E dynamics file makes: to be read, run, and edited."""

from collections.abc import Iterator
from pathlib import Path
from textwrap import wrap

from exfit.case.templates import (
    WIDTH,
    PlannerUnit,
    as_found_lines,
    commented,
    in_comment,
    inputs_lines,
    parameter_line,
    source_lines,
)
from exfit.errors import DynamicsError, ExfitError
from exfit.features.planner.fields import text_of
from exfit.features.planner.records import PSSE, SPEED_FLAG
from exfit.features.planner.unit import Unit, UnitPart, read_unit
from exfit.models.sheet import Sheet
from exfit.util.files import read_limited
from exfit.util.sources import TYPICAL
from exfit.util.text import yaml_number

LARGEST_FILE = 32_000_000  # bytes; that of a whole interconnection has fewer
TEST = """\
test:                   # a 5 % step; a record takes the place of the duration
  vt0: 1.0
  vref: [{at: 1.0, step: 0.05}]
  duration: 10.0
"""


def import_unit(path: Path, bus: int | None = None, machine_id: str | None = None) -> Unit:
    """Return a unit of a file as ``read_unit`` does; raises DynamicsError."""
    return read_unit(text_of(read_file(path), str(path)), str(path), bus, machine_id)


def read_file(path: Path) -> bytes:
    """Return the content of a dynamics file; raises DynamicsError where it cannot be read."""
    try:
        return read_limited(path, LARGEST_FILE)
    except ExfitError as error:
        raise DynamicsError([str(error)]) from None


def case_text(unit: Unit, file: str) -> str:
    """Return the case of a unit on open circuit, with a comment for all that it rests on.

    ``file`` is the path of the dynamics file as the case names it.
    """
    lines = [*_heading(unit, file), *_exciter_name(unit.exciter), *_plant(unit.machine)]
    for part in unit.added:
        model = part.definition.model
        lines += [f"{part.definition.kind}:", commented(f"  model: {model.name}", _origin(part))]
        lines += inputs_lines(model, part.inputs)
        lines += ["  parameters:", *_values(part, "    "), *_sources(part)]
    lines += [*TEST.splitlines(), "parameters:"]
    lines += [commented("  fixed:", "what a fit shall find goes under free")]
    lines += [*_values(unit.exciter, "    "), *_sources(unit.exciter)]
    lines += as_found(unit, file)
    return "\n".join(lines) + "\n"


def as_found(unit: Unit, file: str) -> Iterator[str]:
    """Yield what the file holds of the unit, for the report to compare with."""
    values = {
        _prefix(part) + row.symbol: part.values[row.symbol]
        for part in (unit.exciter, unit.machine, *unit.added)
        for row in part.definition.model.sheet
        if row.symbol in part.definition.names
    }
    unused = {
        _prefix(part) + symbol: value
        for part in (unit.exciter, unit.machine, *unit.added)
        for symbol, value in part.unused
    }
    source = PlannerUnit(unit.bus, in_comment(unit.id), file)
    yield from as_found_lines(source, unit.exciter.definition.model.name, values, unused)


def _prefix(part: UnitPart) -> str:
    """Return how the names of the parameters of a part begin in the system."""
    return "" if part.definition.kind == "exciter" else f"{part.definition.kind}."


def _heading(unit: Unit, file: str) -> Iterator[str]:
    name = in_comment(Path(file).name)
    yield f"# Unit {in_comment(unit.id)} at bus {unit.bus} of {name}, on open circuit."
    for line, text in unit.warnings:
        remark = f"Line {line}: {in_comment(text)}."
        yield from wrap(remark, WIDTH, initial_indent="# ", subsequent_indent="#   ")


def _exciter_name(exciter: UnitPart) -> Iterator[str]:
    yield commented(f"model: {exciter.definition.model.name}", _origin(exciter))
    if {"E1", "SE1", "E2", "SE2"} <= exciter.values.keys():
        of_psse = exciter.definition.program == PSSE
        yield commented("saturation: quadratic", "as PSS/E" if of_psse else "taken as in PSS/E")
    if exciter.times_speed:
        name = exciter.definition.record.name
        of_record = exciter.definition.record.times_speed
        origin = f"as InterPSS and ANDES have {name}" if of_record else f"{SPEED_FLAG} of {name}"
        yield commented("efd_times_speed: true", f"{origin}; acts where the speed is not rated")


def _plant(machine: UnitPart) -> Iterator[str]:
    yield "plant:"
    yield "  type: open-circuit"
    yield commented(f"  machine: {machine.definition.model.name}", _origin(machine))
    yield "  parameters:"
    yield from _values(machine, "    ")
    yield from _sources(machine)


def _values(part: UnitPart, indent: str) -> Iterator[str]:
    rows: Sheet = part.definition.model.sheet
    for row in rows:
        remark = "; typical, not in the file" if row.symbol in part.definition.absent else ""
        yield parameter_line(row, yaml_number(part.values[row.symbol]), indent, remark)


def _sources(part: UnitPart) -> Iterator[str]:
    """Yield which values are not of the file; it does not say where its own come from."""
    yield from source_lines(dict.fromkeys(part.definition.absent, TYPICAL), "  ")


def _origin(part: UnitPart) -> str:
    return f"{part.definition.record.name} on line {part.line}"
