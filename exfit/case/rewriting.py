"""A case file written anew: with other values, or with what is stated of values beside them.

Only these change: comments, order and all else stay.
"""

import re
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from exfit.case.case import Case
from exfit.case.case_draft import LONGEST
from exfit.case.changes import Changes, freed, part_of
from exfit.case.load import parse_case
from exfit.case.stated_values import FREE, GIVEN, STATED, sections_of, taken_apart
from exfit.case.yaml import read_text, read_yaml
from exfit.errors import CaseError
from exfit.util.files import write
from exfit.util.text import Place, dotted, near

COMMENT = re.compile(r"(?:^|(?<=\s))#[^\r\n]*", re.MULTILINE)
OF_MAP = "# each is from: "  # how a comment begins that cases had above their sources
FAR = 40  # columns: text in braces that begins further right goes on below its key
KEY = re.compile(r"[^.\[\]]+|\[\d+\]")  # of a place such as test.vref[0].at


class Replacement(NamedTuple):
    """A part of a text, from its first character to behind its last, and what replaces it."""

    start: int
    end: int
    text: str


def rewrite(path: Path) -> list[str]:
    """Write a case file with what is stated of its values beside them; say what was moved.

    Nothing is written where nothing is stated by name. Raises CaseError, with the file as it was,
    for one that cannot be read as YAML, or cannot be written so.
    """
    text = read_text(path)
    content, faults = read_yaml(text, path)
    apart = taken_apart(content.value)
    if faults or apart.faults:
        return []  # the check of the case reports them
    rewriting = _Rewriting(text)
    for place in sections_of(content.value):
        rewriting.section(place)
    if not rewriting.moved:
        return []
    new = rewriting.text()
    try:
        read, faults = read_yaml(new, path)
        same = not faults and taken_apart(read.value).content == apart.content
    except CaseError:
        same = False
    if not same:
        names = "; ".join(rewriting.moved)
        raise CaseError(
            f"{path}: not written: {names}: a name without a value, or one that an alias repeats; "
            "write these beside their values by hand"
        )
    write(path, new)
    return rewriting.moved


def with_changes(path: Path, changes: Changes) -> str:
    """Return the text of a case file with other values, comments and order kept.

    ``changes`` has a text of YAML for each place, such as ``test.vref[0].step``, "" where it is
    left out; what is not there is added. Beside the name of a column stands what is added to it.

    Raises CaseError for a file that cannot be read as YAML, or cannot be changed so.
    """
    text = read_text(path)
    top, _ = read_yaml(text, path)
    content = top.value
    for name, value in changes.items():
        place = tuple(int(k[1:-1]) if k[0] == "[" else k for k in KEY.findall(name))
        content = _changed(content, place, value)
        rewriting = _Rewriting(text)
        rewriting.change(place, value)
        text = rewriting.text()
    try:
        same = read_yaml(text, path)[0].value == content
    except CaseError:
        same = False
    if not same:
        lines = "; ".join(f"{name}: {value or 'left out'}" for name, value in changes.items())
        raise CaseError(f"{path}: not changed: an alias repeats it; change by hand: {lines}")
    return text


def with_freed(case: Case, names: Iterable[str]) -> Case:
    """Return a case of a file whose fit finds given values, too.

    Raises CaseError for names of no given value, and for a value of 0, of which no bounds follow.
    """
    values, faults, starts = case.values(), list[str](), dict[str, float]()
    for name in names:
        part = part_of(case, name)
        if part is None:
            faults.append(f"{name}: not a parameter; {near(name, case.rows())}")
        elif name in case.free():
            faults.append(f"{name}: is fitted already")
        elif name in case.ties.by_name:
            faults.append(f"{name}: follows {case.ties.by_name[name].text}; free what that uses")
        elif part.free is None:
            faults.append(f"{name}: belongs to the network, of which nothing is fitted")
        elif not values[name]:
            place = dotted((*part.free, name.removeprefix(part.prefix)))
            faults.append(f"{name}: is 0: no bounds follow from it; give {place} in the case")
        else:
            starts[name] = values[name]
    if faults:
        raise CaseError(f"--free: {fault}" for fault in faults)
    text = with_changes(case.path, freed(case, starts))
    return replace(parse_case(text, case.path), freed=(*starts,))


def _changed(content: Any, place: Place, value: str) -> Any:
    """Return content with the value that a text of YAML has at a place, without it for ""."""
    if not place:
        return read_yaml(f"value: {value}", Path("changes"))[0].value["value"]
    key, rest = place[0], place[1:]
    if isinstance(key, int):
        items = [] if content is None else [*content]
        return [*items[:key], _changed((*items, None)[key], rest, value), *items[key + 1 :]]
    if isinstance(content, str) and place == ("column",):
        return _changed(content, (), value)
    entries = {"column": content} if isinstance(content, str) else {**(content or {})}
    if value or (rest and key in entries):
        return {**entries, key: _changed(entries.get(key), rest, value)}
    return {name: entry for name, entry in entries.items() if name != key}


class _Rewriting:
    """The edits of a text, section by section."""

    def __init__(self, text: str) -> None:
        self.before = text
        self.top: Any = yaml.compose(text, Loader=yaml.BaseLoader)
        self.newline = "\r\n" if "\r\n" in text else "\n"
        self.edits = dict[int, Replacement]()  # by their start: what an alias repeats changes once
        self.moved = list[str]()

    def text(self) -> str:
        """Return the text with all edits."""
        new = self.before
        for edit in sorted(self.edits.values(), reverse=True):
            new = new[: edit.start] + edit.text + new[edit.end :]
        return new

    def section(self, place: Place) -> None:
        """Move what a section states by name beside its values."""
        node = self.top
        for key in place:
            node = node.value[key] if isinstance(key, int) else _pairs(node)[key][1]
        pairs, stated = _pairs(node), dict[str, list[str]]()
        for key, beside in STATED.items():
            if key in pairs:
                for name, (_, value) in _pairs(pairs[key][1]).items():
                    stated.setdefault(name, []).append(f"{beside}: {self._raw(value)}")
                names = ", ".join(_pairs(pairs[key][1])) or "none"
                self.moved.append(f"{dotted((*place, key))} ({names})")
                self._remove(node, key)
        for key in GIVEN:
            if key in pairs and isinstance(pairs[key][1], yaml.MappingNode):
                self._values(pairs[key][1], stated)
        for name, (_, value) in _pairs(pairs[FREE][1]).items() if FREE in pairs else ():
            if name in stated and isinstance(value, yaml.MappingNode):
                self._free(value, ", ".join(stated[name]))

    def change(self, place: Place, value: str) -> None:
        """Put a text in the place of a value; add it where there is none, remove it for ""."""
        node = above = self.top
        missing = [*place]
        while missing and (inner := _entry(node, missing[0])) is not None:
            above, node = node, inner
            del missing[0]
        if missing == ["column"] and isinstance(node, yaml.ScalarNode):
            missing = []  # the name of a column stands for the channel
        if value and missing:
            self._add(node, missing, value)
        elif value:
            self._edit(node.start_mark.index, _end(node), value)
        elif not missing and len(above.value) > 1:
            self._remove(above, str(place[-1]))
        elif not missing:
            self._edit(above.start_mark.index, _end(above), "{}")

    def _add(self, node: Any, place: list[str | int], value: str) -> None:
        """Add a value to a node, below which its place is missing."""
        key = place[0]
        for inner in reversed(place[1:]):
            value = f"[{value}]" if isinstance(inner, int) else f"{{{inner}: {value}}}"
        entry = f"{key}: {value}" if isinstance(key, str) else value
        if isinstance(node, yaml.ScalarNode):
            column = self._raw(node)
            self._edit(node.start_mark.index, _end(node), f"{{column: {column}, {entry}}}")
        elif not node.value:
            self._edit(node.start_mark.index + 1, node.start_mark.index + 1, entry)
        elif node.flow_style:
            last = _end(node.value[-1])
            self._edit(last, last, f", {entry}")
        else:
            mark = "" if isinstance(key, str) else "- "
            end = self._line_end(_end(node.value[-1]))
            before = "" if self.before[:end].endswith("\n") else self.newline
            indent = " " * node.start_mark.column
            self._edit(end, end, f"{before}{indent}{mark}{entry}{self.newline}")

    def _raw(self, node: Any) -> str:
        return self.before[node.start_mark.index : node.end_mark.index]

    def _edit(self, start: int, end: int, text: str) -> None:
        self.edits[start] = Replacement(start, end, text)

    def _values(self, values: Any, stated: dict[str, list[str]]) -> None:
        texts = {
            name: f"{{value: {self._raw(value)}, {', '.join(stated[name])}}}"
            for name, (_, value) in _pairs(values).items()
            if name in stated
        }
        begin = self.before.find("{", values.start_mark.index)
        inside = self.before[begin : values.end_mark.index]
        if not texts:
            return
        if values.flow_style and not COMMENT.search(inside):
            entries = [
                f"{self._raw(key)}: {texts.get(name) or self._raw(value)}"
                for name, (key, value) in _pairs(values).items()
            ]
            self._edit(begin, values.end_mark.index, self._in_braces(entries, begin))
            return
        for name, text in texts.items():
            value = _pairs(values)[name][1]
            start, end = value.start_mark.index, value.end_mark.index
            spaces = re.match(r" *(?=#)", self.before[end:])
            if spaces is not None:  # the comment stays in its column, if it can
                end += len(spaces[0])
                text = f"{text:{max(len(text) + 2, end - start)}}"
            self._edit(start, end, text)

    def _in_braces(self, entries: list[str], begin: int) -> str:
        line = self.before[self._line_start(begin) : begin]
        leading = len(line) - len(line.lstrip(" -"))
        indent = len(line) + 1 if len(line) <= FAR else leading + 4
        lines, width = ["{" + entries[0]], len(line) + 1 + len(entries[0])
        for entry in entries[1:]:
            if width + 2 + len(entry) + 2 > LONGEST:
                lines.append(" " * indent + entry)
                width = indent + len(entry)
            else:
                lines[-1] += f", {entry}"
                width += 2 + len(entry)
        return f",{self.newline}".join(lines) + "}"

    def _free(self, free: Any, stated: str) -> None:
        if free.flow_style:
            end = free.end_mark.index - 1
            self._edit(end, end, f", {stated}")
        else:
            key = free.value[0][0].start_mark
            start = key.index - key.column
            self._edit(start, start, f"{' ' * key.column}{stated}{self.newline}")

    def _line_start(self, index: int) -> int:
        return self.before.rfind("\n", 0, index) + 1

    def _line_end(self, index: int) -> int:
        return self.before.find("\n", index) + 1 or len(self.before)

    def _remove(self, section: Any, key: str) -> None:
        """Take a key with its value out of a section, but for its comments."""
        entry, value = _pairs(section)[key]
        start, end = entry.start_mark.index, _end_of(entry, value)
        if section.flow_style:
            comments = COMMENT.findall(self.before[start:end])
            comma = re.match(r"\s*,[ ]*", self.before[end:])
            if comma is not None:
                end += len(comma[0])
            else:
                start = self.before.rindex(",", 0, start)
            text = "".join(f"{self.newline}{comment}{self.newline}" for comment in comments)
            self._edit(start, end, text)
            return
        start, end = self._line_start(start), self._line_end(end)
        comments = COMMENT.findall(self.before[start:end])
        above = self._line_start(max(0, start - 1))
        if self.before[above:start].lstrip().startswith(OF_MAP):
            start = above
        indent = " " * entry.start_mark.column
        self._edit(start, end, "".join(f"{indent}{each}{self.newline}" for each in comments))


def _pairs(node: Any) -> dict[str, tuple[Any, Any]]:
    """Return the keys and values of a mapping by the text of the key."""
    if not isinstance(node, yaml.MappingNode):
        return {}
    return {key.value: (key, value) for key, value in node.value}


def _entry(node: Any, key: str | int) -> Any:
    """Return the value of a key, or of an index, of a node; None where it has none."""
    if isinstance(key, str):
        return _pairs(node).get(key, (None, None))[1]
    items = node.value if isinstance(node, yaml.SequenceNode) else []
    return items[key] if key < len(items) else None


def _end(node: Any) -> int:
    """Return where a node, or a pair of nodes, ends: in a block what follows is none of it."""
    if isinstance(node, tuple):
        return _end(node[1])
    in_block = not isinstance(node, yaml.ScalarNode) and not node.flow_style and node.value
    return _end(node.value[-1]) if in_block else int(node.end_mark.index)


def _end_of(key: Any, value: Any) -> int:
    """Return where a value ends: of a block its last value, of an alias its key."""
    ends: list[int] = [key.end_mark.index]
    if value.start_mark.index >= ends[0]:
        if isinstance(value, yaml.MappingNode) and not value.flow_style:
            ends += (_end_of(*pair) for pair in value.value)
        else:
            ends.append(value.end_mark.index)
    return max(ends)
