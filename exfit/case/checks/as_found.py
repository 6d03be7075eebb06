"""What contradicts itself in the model that a case says was in the planner's base."""

from collections.abc import Iterator
from pathlib import Path

from exfit.case.checks.node import ContentNode
from exfit.case.parts import Parts, kind_of
from exfit.case.yaml import Fault
from exfit.errors import ModelError
from exfit.models import GOVERNORS, find
from exfit.models.sheet import Parameter
from exfit.util.text import near


def as_found_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield a model that is not in the catalogue, and parameters that no part has."""
    section = content.at("as_found")
    rows = {part.prefix + row.symbol: row for part in parts.all for row in part.sheet}
    name = section.at("model")
    if name.text:
        try:
            sheet = find(name.text.removesuffix(".py"), Path()).sheet
        except ModelError as error:
            yield name.fault(str(error))
            return
        if not kind_of(content.at("plant").content).has_exciter:
            yield name.fault("not allowed with this plant: it has no exciter")
        rows = {**_of_others(rows), **{row.symbol: row for row in sheet}}
    for symbol, value in (*section.at("parameters").sections, *_unused(section, parts)):
        if symbol not in rows:
            yield value.fault(f"not a parameter of the model as found; {near(symbol, rows)}")
        elif value.number is not None and (text := rows[symbol].range_fault(value.number)):
            yield value.fault(text)


def _unused(section: ContentNode, parts: Parts) -> list[tuple[str, ContentNode]]:
    """Return what is unused but for what a governor's record alone has, as GGOV1's Trate."""
    listed = {
        part.prefix + name
        for part in parts.all
        if part.name in GOVERNORS
        for record in GOVERNORS[part.name].records
        for name in record.ignored
    }
    return [(name, node) for name, node in section.at("unused").sections if name not in listed]


def _of_others(rows: dict[str, Parameter]) -> dict[str, Parameter]:
    """Return the rows of all parts but the exciter."""
    return {name: row for name, row in rows.items() if "." in name}
