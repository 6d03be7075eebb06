"""What a case leaves to be filled in: a "?" in place of a value."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from exfit.case.yaml import YamlNode, read_yaml
from exfit.util.text import Place, dotted

QUESTION = "?"  # no number, so that a case that holds it is refused
FILL_IN = f'"{QUESTION}"'  # as a case has it
TO_BE_FILLED_IN = f"'{QUESTION}' is to be filled in"


class OpenValue(NamedTuple):
    """A value to be filled in: its line, which of those of its line, its place, what to know."""

    line: int
    turn: int
    place: str
    hint: str


def open_values(text: str) -> tuple[OpenValue, ...]:
    """Return the values of a case's text that are to be filled in; each of them once."""
    root, _ = read_yaml(text, Path())
    lines, places = text.splitlines(), dict[tuple[int, str], str]()
    for place, line in _open(root, ()):
        places.setdefault((line, str(place[-1])), dotted(place))
    values: list[OpenValue] = []
    for (line, _), where in places.items():
        turn = sum(value.line == line for value in values)
        values.append(OpenValue(line, turn, where, _hint(lines, line)))
    return tuple(values)


def filled(text: str, given: Mapping[OpenValue, str]) -> str:
    """Return the text of a case with what was given for open values, as the case has it."""
    lines = text.splitlines(keepends=True)
    for value in sorted(given, reverse=True):  # from the end of a line, so that the turns stay
        parts = lines[value.line - 1].split(FILL_IN)
        before, after = parts[: value.turn + 1], parts[value.turn + 1 :]
        lines[value.line - 1] = FILL_IN.join(before) + given[value] + FILL_IN.join(after)
    return "".join(lines)


def open_places(content: Any) -> list[Place]:
    """Return the places of the content of a case that are to be filled in.

    What an alias repeats counts where it stands first.
    """
    visited: set[int] = set()
    return [*_open_places(content, (), visited)]


def _open_places(content: Any, place: Place, visited: set[int]) -> Iterator[Place]:
    if content == QUESTION:
        yield place
    if not isinstance(content, dict | list) or id(content) in visited:
        return
    visited.add(id(content))
    entries = content.items() if isinstance(content, dict) else enumerate(content)
    for key, entry in entries:
        yield from _open_places(entry, (*place, key), visited)


def _open(node: YamlNode, place: Place) -> Iterator[tuple[Place, int]]:
    for key, entry in node.entries.items():
        yield from _open(entry, (*place, key))
    if node.value == QUESTION:
        yield place, node.line


def _hint(lines: list[str], line: int) -> str:
    """Return what a case says of a line: the comment behind it, else the one above."""
    behind = re.search(r"#\s*(.*)", lines[line - 1])
    above = lines[line - 2].strip() if line > 1 else ""
    if behind is not None:
        return behind[1]
    return above.lstrip("# ") if above.startswith("#") else ""
