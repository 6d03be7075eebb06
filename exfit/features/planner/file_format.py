"""The format of a program's planners' files: what begins a record, and how one is written."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from exfit.features.planner.fields import DynamicsFault, Field
from exfit.features.planner.records import PSSE, Definition
from exfit.util.text import show_value

WIDTH = 80  # columns of a file
LONGEST_ID = 2
LONGEST_BUS = 10  # digits that are looked at
MOST_BUSES = 10**6


class Head(NamedTuple):
    """A record by what it begins with, and the fields behind.

    ``definition`` is what exfit has a model of, None if it has none; ``base`` the MVA or MW that
    its values are on, where the record says so; ``faults`` are those of its fields.
    """

    bus: int
    name: str
    id: str
    line: int
    fields: tuple[Field, ...]
    definition: Definition | None
    program: str = PSSE
    base: float | None = None
    faults: tuple[DynamicsFault, ...] = ()


class Heads(NamedTuple):
    """The records of a file that belong to a unit, and what is wrong with others."""

    heads: list[Head]
    faults: list[DynamicsFault]


@dataclass(frozen=True)
class FileFormat:
    """The files of a program.

    ``heads(text)`` are the records of a file; ``record_text(definition, values, bus, id)`` is one
    of them; ``comment`` begins a line that is none; ``begins`` says how a record begins.
    """

    program: str
    suffix: str
    comment: str
    begins: str
    heads: Callable[[str], Heads]
    record_text: Callable[[Definition, Mapping[str, float], int, str], str]


def wrong_bus(field: Field) -> Iterator[str]:
    """Refuse a field that is not the number of a bus."""
    bus = field.text
    whole = not field.quoted and bus.isascii() and bus.isdigit()
    if not whole or not 0 < int(bus[:LONGEST_BUS]) < MOST_BUSES:
        advice = "; write the number in place of the name" if field.quoted else ""
        yield f"{show_value(bus)} is not the number of a bus{advice}"


def wrong_id(machine_id: str) -> Iterator[str]:
    """Refuse a text that is not the id of a machine."""
    if not 0 < len(machine_id) <= LONGEST_ID or not machine_id.isprintable():
        yield f"{show_value(machine_id)} is not a machine id of one or two characters"


def is_machine_id(text: str) -> bool:
    """Tell if a record that exfit writes can have this id of a machine."""
    return 1 <= len(text) <= LONGEST_ID and text.isascii() and text.isalnum()
