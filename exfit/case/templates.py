"""The lines of a case file that is made for a user to edit: values with their meanings."""

import json
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from exfit.models.machines import Machine
from exfit.models.sheet import Model, Parameter
from exfit.util.sources import SOURCES
from exfit.util.text import yaml_number

MEANING_AT = 24  # column of the comments
WIDTH = 80  # columns of a case
NO_BREAK = "\N{NO-BREAK SPACE}"  # within a pair of a name and a word


def parameter_line(row: Parameter, value: str, indent: str, remark: str = "") -> str:
    """Return the line of a parameter, with its unit and meaning as a comment."""
    return commented(f"{indent}{row.symbol}: {value}", f"{row.unit}, {row.meaning}{remark}")


def commented(text: str, comment: str) -> str:
    """Return a line of a case with a comment, at one place where the line is short."""
    return f"{text:{MEANING_AT}}# {comment}" if len(text) < MEANING_AT else f"{text}  # {comment}"


def inputs_lines(model: Model | Machine, inputs: tuple[str, ...]) -> Iterator[str]:
    """Yield the line of a stabiliser's input signals, where they are not those of its model."""
    if isinstance(model, Model) and inputs and inputs != model.inputs:
        yield commented(f"  inputs: [{', '.join(inputs)}]", "as the codes of its record say")


def in_comment(text: str) -> str:
    """Return a text that fits into a comment: in one line, of characters that YAML allows."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def source_lines(sources: Mapping[str, str], indent: str) -> Iterator[str]:
    """Yield the lines that say where values come from, as far as that is stated."""
    stated = [f"{name}: {word}" for name, word in sources.items() if word in SOURCES]
    if not stated:
        return
    yield f"{indent}# each is from: {', '.join(SOURCES)}"
    yield f"{indent}sources:"
    yield from _flow_mapping(stated, f"{indent}  ")


@dataclass(frozen=True)
class PlannerUnit:
    """A unit of a planner's file: its bus, its machine id, and the path of the file."""

    bus: int
    id: str
    file: str

    def __str__(self) -> str:
        return f"{Path(self.file).name}, bus {self.bus}, machine {self.id}"


def as_found_lines(
    unit: PlannerUnit, model: str, values: Mapping[str, float], unused: Mapping[str, float]
) -> Iterator[str]:
    """Yield the section that says what was in the planner's base, by the names of the system.

    ``unused`` are values there that the planner's program does without.
    """
    yield "as_found:               # in the planner's base; a report compares it"
    yield f"  source: {quoted(str(unit))}"
    yield f"  bus: {unit.bus}"
    yield f"  id: {quoted(unit.id)}"
    yield f"  file: {quoted(unit.file)}"
    yield f"  model: {model}"
    yield "  parameters:"
    yield from _flow_mapping(_pairs(values), "    ")
    if unused:
        yield "  unused:"
        yield from _flow_mapping(_pairs(unused), "    ")


def _pairs(values: Mapping[str, float]) -> list[str]:
    return [f"{name}: {yaml_number(value)}" for name, value in values.items()]


def quoted(text: str) -> str:
    """Return a text between quotes in YAML, with codes for letters that it does not allow."""
    letters = json.dumps(text, ensure_ascii=False)
    return "".join(x if x.isprintable() else f"\\U{ord(x):08x}" for x in letters)


def _flow_mapping(pairs: Iterable[str], indent: str) -> Iterator[str]:
    """Yield the lines of a mapping in braces, none of its pairs broken."""
    lines = textwrap.wrap(
        "{" + ", ".join(pair.replace(" ", NO_BREAK) for pair in pairs) + "}",
        WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent} ",
    )
    yield from (line.replace(NO_BREAK, " ") for line in lines)
