"""A case that is made for a user to edit: its values with comments, and its text in YAML."""

import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from textwrap import wrap
from types import MappingProxyType
from typing import Any, NamedTuple

import yaml

from exfit.case.stated_values import FREE, GIVEN
from exfit.case.yaml import QUESTION, read_yaml
from exfit.models.sheet import Parameter
from exfit.util.text import Place, yaml_number
from exfit.util.vocabulary import SOURCES

COMMENTS_AT = (24, 48)  # the columns of comments: the first that a line does not reach
WIDTH = 80  # columns of a case
LONGEST = 100  # with a comment behind a value
NO_BREAK = "\N{NO-BREAK SPACE}"  # within a pair of a name and a word

Section = dict[str, Any]  # values, sections and lists of these, each as it is or `Noted`


@dataclass(frozen=True)
class Noted:
    """A value of a case with comments: ``behind`` it in its line, and ``above`` it."""

    value: Any
    behind: str = ""
    above: str = ""


class Remark(str):
    """A key of a section that is a comment in lines of its own; its value is None."""


class OpenValue(NamedTuple):
    """A value of a draft that is to be filled in: its place and line, what to know of it."""

    place: Place
    line: int
    hint: str


@dataclass(frozen=True)
class CaseDraft:
    """A case to be edited: its sections, with comments, below the paragraphs of its heading."""

    sections: Section
    heading: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The text of the case; a section that stands in two places has an anchor."""
        return "".join(f"{line}\n" for line in self.lines())

    def lines(self) -> list[str]:
        """Write the lines of the case: sections in lines, what is short in braces."""
        heading = [line for text in self.heading for line in _comment(text, "", "")]
        return [*heading, *_Writer(self.sections).mapping(self.sections, "")]

    def open_values(self) -> tuple[OpenValue, ...]:
        """Find the values that are to be filled in; one that stands in two places counts once.

        Raises CaseError for a text that no command would read.
        """
        root, _ = read_yaml(self.text, Path())
        return tuple(
            OpenValue(place, root.line_of(place), hint)
            for place, hint in _open(self.sections, (), "", set())
        )

    @property
    def kind_of_plant(self) -> str:
        """The type of the plant, "" without one."""
        kind = self.sections.get("plant", {}).get("type", "")
        return str(kind.value if isinstance(kind, Noted) else kind)

    def filled(self, given: Mapping[OpenValue, str | float]) -> "CaseDraft":
        """Fill in open values."""
        values = {value.place: answer for value, answer in given.items()}
        return replace(self, sections=_filled(self.sections, values, (), {}))


def parameter(row: Parameter, value: float, remark: str = "") -> Noted:
    """Make the value of a parameter, with its unit and meaning behind it."""
    return Noted(value, f"{row.unit}, {row.meaning}{remark}")


def with_sources(
    section: Section,
    sources: Mapping[str, str],
    std_errors: Mapping[str, float] = MappingProxyType({}),
) -> Section:
    """Write beside the values of a section what is stated of them: sources, standard errors.

    A value that is to be filled in or follows others has neither.
    """

    def stating(given: Any, name: str) -> Any:
        if isinstance(given, Noted):
            return replace(given, value=stating(given.value, name))
        word = sources.get(name)
        stated: Section = {"source": word} if word in SOURCES else {}
        stated |= {"std_error": std_errors[name]} if name in std_errors else {}
        if not stated or isinstance(given, str):
            return given
        return {**(given if isinstance(given, Mapping) else {"value": given}), **stated}

    def of_values(given: Any) -> Any:
        if isinstance(given, Noted):
            return replace(given, value=of_values(given.value))
        return {name: stating(value, name) for name, value in given.items()}

    return {
        key: of_values(given) if key in (*GIVEN, FREE) else given for key, given in section.items()
    }


@cache
def plain_text(name: str) -> str:
    """Write a text in YAML, in quotes where it would be read as something else."""
    # three dots end a document of YAML
    plain = re.fullmatch(r"(?!\.{3})[A-Za-zäöüÄÖÜß./][\w./ -]*", name) and name == name.strip()
    if plain and yaml.safe_load(name) == name:
        return name
    letters = json.dumps(name, ensure_ascii=False)
    return "".join(x if x.isprintable() else f"\\U{ord(x):08x}" for x in letters)


def in_braces(value: Any) -> str:
    """Write a value in one line of YAML, without its comments."""
    if isinstance(value, Noted):
        return in_braces(value.value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(_pairs(value)) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(in_braces, value)) + "]"
    if isinstance(value, str):
        return plain_text(value)
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if isinstance(value, int) else yaml_number(value)


class _Writer:
    """Writes sections; a mapping that stands in several places has an anchor at the first."""

    def __init__(self, content: Section) -> None:
        self.times: dict[int, int] = {}
        self.anchors: dict[int, str] = {}
        self._count(content)

    def _count(self, content: Any) -> None:
        value = content.value if isinstance(content, Noted) else content
        if isinstance(value, Mapping):
            self.times[id(value)] = self.times.get(id(value), 0) + 1
            if self.times[id(value)] > 1:
                return
        for entry in _entries(value).values():
            self._count(entry)

    def mapping(self, content: Mapping[str, Any], indent: str) -> Iterator[str]:
        for key, given in content.items():
            if isinstance(key, Remark):
                for line in key.splitlines():
                    yield from _comment(line, indent)
            else:
                yield from self._entry(key, given, indent)

    def _entry(self, key: str, given: Any, indent: str) -> Iterator[str]:
        noted = given if isinstance(given, Noted) else Noted(given)
        value, head = noted.value, f"{indent}{plain_text(key)}:"
        yield from _comment(noted.above, indent)
        if id(value) in self.anchors:
            yield _commented(f"{head} *{self.anchors[id(value)]}", noted.behind)
            return
        if self.times.get(id(value), 0) > 1:
            self.anchors[id(value)] = f"{key}{len(self.anchors) + 1 if self.anchors else ''}"
            head += f" &{self.anchors[id(value)]}"
        entries = _entries(value)
        text = in_braces(value)
        short = len(head) + 1 + len(text) <= WIDTH
        if not entries or (short and indent and not _has_comments(value)):
            line = _commented(f"{head} {text}", noted.behind)
            if len(line) > LONGEST and not noted.above:
                yield from _comment(noted.behind, indent)
                line = f"{head} {text}"
            yield line
        else:
            yield _commented(head, noted.behind)
            yield from self._below(value, indent)

    def _below(self, value: Any, indent: str) -> Iterator[str]:
        """Write a section or list below its key: an entry a line where it is deep or top."""
        entries = _entries(value)
        deep = any(_entries(entry) for entry in entries.values())
        if isinstance(value, Mapping) and (not indent or deep or _has_comments(value)):
            yield from self.mapping(value, f"{indent}  ")
        elif deep:
            for entry in entries.values():
                yield from self._item(entry, indent)
        else:
            yield from _wrapped(value, f"{indent}  ")

    def _item(self, entry: Mapping[str, Any], indent: str) -> Iterator[str]:
        lines = [*self.mapping(entry, f"{indent}    ")]
        first = next(k for k, line in enumerate(lines) if not line.lstrip().startswith("#"))
        lines[first] = f"{indent}  - {lines[first].lstrip()}"
        yield from lines


def _entries(value: Any) -> Mapping[Any, Any]:
    """List the entries of a section or list by key or index; none of a number or text."""
    if isinstance(value, Noted):
        return _entries(value.value)
    if isinstance(value, Mapping):
        return {key: entry for key, entry in value.items() if not isinstance(key, Remark)}
    return dict(enumerate(value)) if isinstance(value, list | tuple) else {}


def _has_comments(value: Any) -> bool:
    if isinstance(value, Mapping) and any(isinstance(key, Remark) for key in value):
        return True
    return any(
        isinstance(entry, Noted) or _has_comments(entry) for entry in _entries(value).values()
    )


def _pairs(value: Mapping[str, Any]) -> list[str]:
    return [f"{plain_text(key)}: {in_braces(entry)}" for key, entry in _entries(value).items()]


def _wrapped(value: Mapping[str, Any] | Sequence[Any], indent: str) -> Iterator[str]:
    """Write a mapping or list in braces in several lines, none of its entries broken."""
    mapped = isinstance(value, Mapping)
    entries = _pairs(value) if isinstance(value, Mapping) else [*map(in_braces, value)]
    text = ", ".join(entry.replace(" ", NO_BREAK) for entry in entries)
    lines = wrap(
        f"{{{text}}}" if mapped else f"[{text}]",
        WIDTH,
        initial_indent=indent,
        subsequent_indent=f"{indent} ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    yield from (line.replace(NO_BREAK, " ") for line in lines)


def _comment(text: str, indent: str, hang: str = "  ") -> Iterator[str]:
    """Write a paragraph as lines of comment."""
    yield from wrap(
        in_comment(text),
        WIDTH,
        initial_indent=f"{indent}# ",
        subsequent_indent=f"{indent}# {hang}",
        break_long_words=False,
        break_on_hyphens=False,
    )


def _commented(text: str, comment: str) -> str:
    """Write a comment behind a line, at a column that many have where the line is short."""
    if not comment:
        return text
    width = next((at for at in COMMENTS_AT if len(text) < at), len(text) + 2)
    return f"{text:{width}}# {in_comment(comment)}"


def in_comment(text: str) -> str:
    """Replace the characters that a comment in YAML, or a line, does not hold."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def _open(content: Any, place: Place, hint: str, visited: set[int]) -> Iterator[tuple[Place, str]]:
    if isinstance(content, Noted):
        hint, content = content.behind or content.above, content.value
    if content == QUESTION:
        yield place, hint
    if id(content) in visited:
        return
    entries = _entries(content)
    if entries:
        visited.add(id(content))
    for key, entry in entries.items():
        yield from _open(entry, (*place, key), "" if _has_comments(content) else hint, visited)


def _filled(content: Any, given: Mapping[Place, Any], place: Place, done: dict[int, Any]) -> Any:
    if isinstance(content, Noted):
        return replace(content, value=_filled(content.value, given, place, done))
    if id(content) in done:
        return done[id(content)]
    if isinstance(content, Mapping):
        done[id(content)] = {
            key: _filled(entry, given, (*place, key), done) for key, entry in content.items()
        }
        return done[id(content)]
    if isinstance(content, list | tuple):
        return [_filled(entry, given, (*place, k), done) for k, entry in enumerate(content)]
    return given.get(place, content)
