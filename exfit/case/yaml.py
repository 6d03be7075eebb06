"""YAML with the place of every value: what is wrong with a file can be said with its line.

Plain scalars are read as YAML 1.2 does: 1e-8 is a number; 1:30, yes, on and 010 are text.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from exfit.errors import CaseError, ExfitError
from exfit.util.files import read_limited, utf8
from exfit.util.text import Place

LOADER: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)

LARGEST_FILE = 4_000_000  # bytes; a case has some thousand
MOST_VALUES = 50_000  # of a file, each as often as aliases repeat it
MOST_LEVELS = 20  # of nesting; a case file has five
WHOLE = re.compile(r"[-+]?(0|[1-9][0-9]*)")
LONGEST_WHOLE = 15  # digits: every whole number of so many is a double
DECIMAL = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
INFINITE = re.compile(r"([-+]?)\.(inf|Inf|INF)")
QUESTION = "?"  # in place of a value that is left to be filled in: a case that holds it is refused
TO_BE_FILLED_IN = f"'{QUESTION}' is to be filled in"
WORDS: dict[str, bool | float | None] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}


class Fault(NamedTuple):
    """What is wrong at a place of the file."""

    place: Place
    text: str
    line: int | None = None


@dataclass(frozen=True)
class YamlNode:
    """A value, the line on which it starts, and the nodes of its entries by key or index."""

    value: Any
    line: int
    entries: Mapping[str | int, "YamlNode"] = field(default_factory=dict)

    def line_of(self, place: Place) -> int:
        """Return the line of a place, or of what is nearest above it."""
        node = self
        for key in place:
            if key not in node.entries:
                break
            node = node.entries[key]
        return node.line


def read_text(path: Path) -> str:
    """Return the text of a file; raises CaseError where it cannot be read or is not UTF-8."""
    try:
        return utf8(read_limited(path, LARGEST_FILE), path)
    except ExfitError as error:
        raise CaseError(str(error)) from None


def decoded(data: bytes, path: Path) -> str:
    """Return the text that the bytes of a file are; raises CaseError where they are not UTF-8."""
    try:
        return utf8(data, path)
    except ExfitError as error:
        raise CaseError(str(error)) from None


def read_yaml(text: str, path: Path) -> tuple[YamlNode, list[Fault]]:
    """Return the mapping a YAML text holds, and the faults of single keys and values.

    Raises CaseError, which names the line, where the text is no YAML or its top is no mapping.
    """
    reader = _Reader(text)
    try:
        top = reader.document()
    except _NoYaml as error:
        raise CaseError(f"{path}:{error.line}: {error}") from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        tab = "indent with blanks, not with tabs" if mark and text[mark.index :][:1] == "\t" else ""
        what = ", ".join(part for part in (error.problem, error.context, tab) if part)
        raise CaseError(f"{path}:{mark.line + 1 if mark else 1}: not YAML: {what}") from None
    except yaml.YAMLError as error:
        line = text.count("\n", 0, getattr(error, "position", 0)) + 1
        what = str(error).partition("\n")[0]
        raise CaseError(f"{path}:{line}: not YAML: {what}") from None
    if top is None:
        raise CaseError(f"{path}: the file is empty")
    if not isinstance(top.value, dict):
        what = "a list" if isinstance(top.value, list) else repr(top.value)
        raise CaseError(f"{path}:{top.line}: {what}, not a mapping (key: value) at the top")
    return top, reader.faults


class _NoYaml(Exception):
    """A file that cannot be read any further, from a line on."""

    def __init__(self, line: int, text: str) -> None:
        super().__init__(text)
        self.line = line


class _Reader:
    """One pass over the parser's events; faults of single keys and values are collected."""

    def __init__(self, text: str) -> None:
        self.events: Iterator[Any] = yaml.parse(text, Loader=LOADER)
        self.faults: list[Fault] = []
        self.anchors: dict[str, tuple[YamlNode, int]] = {}  # with the number of its values
        self.values = 0

    def document(self) -> YamlNode | None:
        """Return the node of the only document, None where there is none."""
        next(self.events)
        if isinstance(next(self.events), yaml.StreamEndEvent):
            return None
        top = self.node(next(self.events), ())
        next(self.events)
        after = next(self.events)
        if not isinstance(after, yaml.StreamEndEvent):
            raise _NoYaml(_line(after), "a second document begins; one is allowed")
        return top

    def node(self, event: Any, place: Place) -> YamlNode:
        """Return the node that begins with an event."""
        if isinstance(event, yaml.AliasEvent):
            if event.anchor not in self.anchors:
                raise _NoYaml(_line(event), f"*{event.anchor}: no such anchor before it")
            node, count = self.anchors[event.anchor]
            self._count(count, event)
            return node
        if len(place) > MOST_LEVELS:
            raise _NoYaml(_line(event), f"nested more than {MOST_LEVELS} levels deep")
        if event.tag is not None:
            self.faults.append(Fault(place, f"tag {event.tag} is not used here", _line(event)))
        before = self.values
        self._count(1, event)
        if isinstance(event, yaml.MappingStartEvent):
            node = self._mapping(event, place)
        elif isinstance(event, yaml.SequenceStartEvent):
            node = self._sequence(event, place)
        else:
            plain = event.implicit[0]
            node = YamlNode(scalar(event.value) if plain else event.value, _line(event))
        if event.anchor is not None:
            self.anchors[event.anchor] = node, self.values - before
        return node

    def _count(self, values: int, event: Any) -> None:
        self.values += values
        if self.values > MOST_VALUES:
            raise _NoYaml(_line(event), f"more than {MOST_VALUES:,} values")

    def _mapping(self, start: Any, place: Place) -> YamlNode:
        entries: dict[str | int, YamlNode] = {}
        while not isinstance(event := next(self.events), yaml.MappingEndEvent):
            if not isinstance(event, yaml.ScalarEvent):
                raise _NoYaml(_line(event), "a key must be plain text")
            key, line = event.value, _line(event)
            here = (*place, key)
            node = self.node(next(self.events), here)
            if node.value is None:
                comma = "; a decimal comma? write a point" if key.isdigit() else ""
                self.faults.append(Fault(here, f"has no value{comma}", line))
            if key in entries:
                first = entries[key].line
                self.faults.append(Fault(here, f"duplicate key, first on line {first}", line))
            else:
                entries[key] = YamlNode(node.value, line, node.entries)
        return YamlNode({key: node.value for key, node in entries.items()}, _line(start), entries)

    def _sequence(self, start: Any, place: Place) -> YamlNode:
        items: list[YamlNode] = []
        while not isinstance(event := next(self.events), yaml.SequenceEndEvent):
            here = (*place, len(items))
            node = self.node(event, here)
            if node.value is None:
                self.faults.append(Fault(here, "has no value", _line(event)))
            items.append(YamlNode(node.value, _line(event), node.entries))
        return YamlNode([item.value for item in items], _line(start), dict(enumerate(items)))


def scalar(text: str) -> str | bool | int | float | None:
    """Return the value of a plain scalar; hexadecimal and octal forms, as 017, stay text."""
    if text in WORDS:
        return WORDS[text]
    if WHOLE.fullmatch(text):
        return int(text) if len(text) <= LONGEST_WHOLE else float(text)
    if DECIMAL.fullmatch(text):
        return float(text)
    if infinite := INFINITE.fullmatch(text):
        return float(infinite[1] + "inf")
    return text


def _line(event: Any) -> int:
    return int(event.start_mark.line) + 1


def open_places(content: Any) -> list[Place]:
    """Find the places of the content of a case that are to be filled in.

    What an alias repeats counts where it stands first.
    """
    visited: set[int] = set()

    def search(inner: Any, place: Place) -> Iterator[Place]:
        if inner == QUESTION:
            yield place
        if isinstance(inner, dict | list) and id(inner) not in visited:
            visited.add(id(inner))
            for key, entry in inner.items() if isinstance(inner, dict) else enumerate(inner):
                yield from search(entry, (*place, key))

    return [*search(content, ())]
