"""Values with their source and standard error, taken apart: numbers, and what is stated of each.

The rest of exfit has the numbers where the file gives the values, and in each section ``sources``
and ``std_errors`` by name, which a file may give as well.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, NamedTuple

from exfit.case.checks.model import percentage_faults
from exfit.case.checks.node import ContentNode
from exfit.case.load import Form, elsewhere, validated
from exfit.case.schema.values import PERCENT, spread_of
from exfit.case.yaml import Fault
from exfit.util.text import Place, dotted

Content = dict[str, Any]

GIVEN = ("fixed", "parameters", "network")  # keys with given values, of any section
FREE = "free"
SOURCES, STD_ERRORS = "sources", "std_errors"
STATED = {SOURCES: "source", STD_ERRORS: "std_error"}  # the map, and the key beside a value
PARTS = ("exciter", "machine", "stabiliser", "governor")


class Apart(NamedTuple):
    """The content of a file whose values are numbers or ties, with sources and errors by name.

    ``places`` has the place in the file of each of these that stands beside its value, ``faults``
    what is wrong with them beyond their form.
    """

    content: Content
    places: Mapping[Place, Place]
    faults: list[Fault]

    def in_file(self, faults: Iterable[Fault]) -> list[Fault]:
        """Return faults of the content with their places in the file."""
        return [fault._replace(place=self.places.get(fault.place, fault.place)) for fault in faults]

    def validated(self, content: Content, faults: list[Fault], form: type[Form]) -> Form | None:
        """Read the sections of the file's content, with all apart; add all faults of form."""
        document = validated(content, faults, form)
        faults += elsewhere(self.faults, faults)
        if document is None or not self.places:
            return document
        again = list[Fault]()
        document = validated(self.content, again, form)
        faults += elsewhere(self.in_file(again), faults)
        return document


def taken_apart(content: Content) -> Apart:
    """Take the sources and standard errors of a file's content out of its values.

    A value of the wrong form is left to the schema.
    """
    places, faults = dict[Place, Place](), list[Fault]()
    for place in sections_of(content):
        node = ContentNode((), content).at(*place)
        section = _section_apart(node, places, faults)
        if section != node.value:
            content = _with(content, place, section)
    return Apart(content, places, faults)


def sections_of(content: Content) -> Iterator[Place]:
    """Yield the places of the sections in which values may have sources."""
    top = ContentNode((), content)
    nodes = [*map(top.at, ("parameters", "plant", *PARTS)), *top.at("limiters").entries]
    for unit in top.at("further_units").entries:
        nodes += [unit, *map(unit.at, PARTS)]
    nodes += [node.at("load_controller") for node in nodes]
    for key in ("records", "validate", "tests"):
        nodes += [entry.at("plant") for entry in top.at(key).entries]
    return (node.place for node in nodes if node.is_section)


def _section_apart(node: ContentNode, places: dict[Place, Place], faults: list[Fault]) -> Content:
    section, stated = dict(node.content), {key: dict(node.at(key).content) for key in STATED}
    for key in (*GIVEN, FREE):
        values = dict(node.at(key).content)
        for symbol, entry in node.at(key).sections:
            if not entry.is_section or (key == FREE and "source" not in entry):
                continue
            _move(node, symbol, entry, stated, places, faults)
            std, value = entry.at("std_error"), entry.at("value")
            if key == FREE:
                values[symbol] = {k: v for k, v in entry.content.items() if k != "source"}
                continue
            values[symbol] = value.value
            faults += percentage_faults(std, value)
            if std.text is not None:
                stated[STD_ERRORS][symbol] = _in_unit(std.text, value.number)
        if values:
            section[key] = values
    return {**section, **{key: own for key, own in stated.items() if own}}


def _in_unit(std: str, value: float | None) -> float | str:
    percentage = value is not None and re.search(PERCENT, std)
    return spread_of(std, value) if percentage and value is not None else std


def _move(
    node: ContentNode,
    symbol: str,
    entry: ContentNode,
    stated: dict[str, Content],
    places: dict[Place, Place],
    faults: list[Fault],
) -> None:
    """Move what stands beside a value of a section to the section's own, by name."""
    for in_map, beside in STATED.items():
        own = (*node.place, in_map, symbol)
        if symbol in node.at(in_map):
            text = f"{dotted(entry.place)} states it as well: leave this one out"
            faults.append(Fault(own, text))
        elif beside in entry:
            stated[in_map][symbol] = entry.content[beside]
            places[own] = (*entry.place, beside)


def _with(content: Any, place: Place, value: Any) -> Any:
    """Return content with another value at a place; nothing else of it changes."""
    if not place:
        return value
    copy: Any = list(content) if isinstance(content, list) else dict(content)
    copy[place[0]] = _with(copy[place[0]], place[1:], value)
    return copy
