"""A case file with sources and standard errors by name, written anew with these beside the values.

Only the values and what is stated of them change: comments, order and all else stay.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import yaml

from exfit.case.case_draft import LONGEST
from exfit.case.stated_values import FREE, GIVEN, STATED, sections_of, taken_apart
from exfit.case.yaml import read_text, read_yaml
from exfit.errors import CaseError
from exfit.util.files import write
from exfit.util.text import Place, dotted

COMMENT = re.compile(r"(?:^|(?<=\s))#[^\r\n]*", re.MULTILINE)
OF_MAP = "# each is from: "  # how a comment begins that cases had above their sources
FAR = 40  # columns: text in braces that begins further right goes on below its key


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


def _end_of(key: Any, value: Any) -> int:
    """Return where a value ends: of a block its last value, of an alias its key."""
    ends: list[int] = [key.end_mark.index]
    if value.start_mark.index >= ends[0]:
        if isinstance(value, yaml.MappingNode) and not value.flow_style:
            ends += (_end_of(*pair) for pair in value.value)
        else:
            ends.append(value.end_mark.index)
    return max(ends)
