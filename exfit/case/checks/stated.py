"""What contradicts itself in what a case states: sources, standard errors, the model as found."""

from collections.abc import Iterator, Mapping
from pathlib import Path

from exfit.case.checks.node import ContentNode
from exfit.case.parts import Part, Parts, kind_of, plants_of_records
from exfit.case.ties import is_tie
from exfit.case.yaml import Fault
from exfit.errors import ModelError
from exfit.models import find
from exfit.plants import GOVERNOR, PlantKind
from exfit.util.text import Place, near
from exfit.util.vocabulary import TYPICAL


def stated_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of sources and standard errors, and of the model as found."""
    yield from source_faults(content, parts, kind)
    yield from as_found_faults(content, parts)


def source_faults(content: ContentNode, parts: Parts, kind: PlantKind) -> Iterator[Fault]:
    """Yield sources and standard errors of values that the case does not give, or that follow."""
    sections: dict[Place, list[Part]] = {}
    for part in parts.all:
        sections.setdefault(part.section, []).append(part)

    def given(places: list[Place]) -> dict[str, object]:
        return {key: value for at in places for key, value in content.at(*at).content.items()}

    for place, of_section in sections.items():
        known = [symbol for part in of_section for symbol in part.symbols]
        fixed = given([part.fixed for part in of_section])
        free = given([part.free for part in of_section if part.free])
        yield from _stated_faults(content.at(*place, "sources"), {**fixed, **free}, known)
        errors = content.at(*place, "std_errors")
        yield from _stated_faults(errors, fixed, known, free)
    for place in plants_of_records(content.content) if kind.closed_loop else ():
        network = content.at(*place, "network").content
        yield from _stated_faults(content.at(*place, "sources"), network, [])


def _stated_faults(
    stated: ContentNode,
    given: Mapping[str, object],
    known: list[str],
    free: Mapping[str, object] | None = None,
) -> Iterator[Fault]:
    """Yield the faults of what is stated of values that are given: their sources, or their errors.

    ``free`` are the values of which the fit finds the errors; None where sources are stated.
    """
    errors = free is not None
    for symbol, entry in stated.sections:
        if free is not None and symbol in free:
            yield entry.fault("is free: the fit finds its standard error; see prior")
        elif symbol in given:
            if is_tie(given[symbol]):
                what = "error" if errors else "source"
                yield entry.fault(f"follows others by {given[symbol]}: give no {what}")
        elif symbol in known:
            text = "of a value that the case does not give"
            sourced = f"source {text}: it is {TYPICAL}"
            yield entry.fault(f"standard error {text}" if errors else sourced)
        else:
            yield entry.fault(f"not given; {near(symbol, dict.fromkeys([*known, *given]))}")


def as_found_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield a model that is not in the catalogue, and parameters that no part has."""
    section = content.at("as_found")
    name, sheets = section.at("model"), {part.prefix: part.sheet for part in parts.all}
    if name.text:
        try:
            sheets[""] = find(name.text.removesuffix(".py"), Path()).sheet
        except ModelError as error:
            yield name.fault(str(error))
            return
        if not kind_of(content.at("plant").content).has_exciter:
            yield name.fault("not allowed with this plant: it has no exciter")
    rows = {prefix + row.symbol: row for prefix, sheet in sheets.items() for row in sheet}
    for symbol, value in (*section.at("parameters").sections, *_unused(section, parts)):
        if symbol not in rows:
            yield value.fault(f"not a parameter of the model as found; {near(symbol, rows)}")
        elif value.number is not None and (text := rows[symbol].range_fault(value.number)):
            yield value.fault(text)


def _unused(section: ContentNode, parts: Parts) -> list[tuple[str, ContentNode]]:
    """List the unused values but for those that only a governor's record has, as GGOV1's Trate."""
    own = parts.governor
    records = () if own is None else (*own.records, *own.pslf_records)
    ignored = {GOVERNOR + name for each in records for name in (*each.ignored, *dict(each.absent))}
    return [(name, node) for name, node in section.at("unused").sections if name not in ignored]
