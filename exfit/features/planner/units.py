"""All units of a dynamics file: those that exfit has models for, and why others are left out."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from exfit.features.planner.fields import DynamicsFault
from exfit.features.planner.file_format import Head
from exfit.features.planner.formats import format_of
from exfit.features.planner.unit import (
    NEEDED,
    Unit,
    all_classical,
    by_unit,
    classical_machines,
    kind_left_out,
    missing_kinds,
    names_of,
    unit_of,
)
from exfit.util.text import closest

NEARLY_THE_NAME = 0.8  # of two names alike: a typing error, not another model


@dataclass(frozen=True)
class RefusedUnit:
    """A unit that cannot be imported: its records by name, and why.

    ``modelled``: it has a machine and an exciter that exfit knows, so that its values are at fault.
    """

    bus: int
    id: str
    line: int
    records: tuple[str, ...]
    modelled: bool
    faults: tuple[DynamicsFault, ...]


@dataclass(frozen=True)
class DynamicsUnits:
    """The units of a dynamics file in its order; ``faults`` are of records that belong to no unit.

    ``classical`` counts the classical machines without an exciter, which are no units.
    """

    units: tuple[Unit, ...]
    refused: tuple[RefusedUnit, ...]
    faults: tuple[DynamicsFault, ...]
    classical: int = 0


def read_units(text: str, file: str | Path) -> DynamicsUnits:
    """Return every unit of a dynamics file, whose name says the program that it is of.

    What is wrong with one does not hinder the others. A unit is what has a bus and a machine id:
    loads and other devices whose records begin so count as units without a machine.
    """
    heads, faults = format_of(file).heads(text)
    units, refused, classical = list[Unit](), list[RefusedUnit](), 0
    for own in by_unit(heads).values():
        if all_classical(own):
            classical += 1
            continue
        unit, wrong = unit_of(own)
        if unit is not None:
            units.append(unit)
        else:
            refused.append(_refused(own, wrong))
    return DynamicsUnits(tuple(units), tuple(refused), tuple(faults), classical)


def _refused(heads: Sequence[Head], faults: Sequence[DynamicsFault]) -> RefusedUnit:
    missing = missing_kinds(heads)
    own = [*faults, *_lacking(heads, missing)]
    return RefusedUnit(
        heads[0].bus,
        heads[0].id,
        heads[0].line,
        tuple(head.name for head in heads),
        not missing,
        tuple(sorted(own, key=lambda fault: fault.line)),
    )


def _lacking(heads: Sequence[Head], missing: Sequence[str]) -> Iterator[DynamicsFault]:
    """Name the part that a unit lacks of machine and exciter, and what may be meant."""
    classical = [*classical_machines(heads)]
    if classical or not missing:
        yield from classical
        return
    names = [name for kind in NEEDED for name in names_of(kind, heads[0].program)]
    unknown = [
        head for head in heads if head.definition is None and kind_left_out(head.name) is None
    ]
    text = f"no {' and no '.join(missing)} of the catalogue: "
    text += ", ".join(head.name for head in heads)
    yield DynamicsFault(heads[0].line, text)
    for head in unknown:
        meant = closest(head.name, names, NEARLY_THE_NAME)
        if meant is not None:
            yield DynamicsFault(head.line, f"{head.name}: did you mean {meant}?")
