"""The free format of a dynamics file: fields between blanks or commas, records that end with '/'.

What follows the '/' on its line is comment, and so are lines that begin with // or @!.
"""

import re
from typing import NamedTuple

from exfit.features.planner.fields import DynamicsFault, Field, Fields, lines_of

COMMENTS = ("//", "@!")
FIELD = re.compile(
    r"""(?P<comma>,) | (?P<end>/) | '(?P<single>[^']*)' | "(?P<double>[^"]*)"
    | (?P<open>['"]) | (?P<plain>[^\s,/'"]+)""",
    re.VERBOSE,
)
# a bus, a model and a machine id: no line within a record looks like that
HEAD = re.compile(
    r"""\s*\d+[\s,]+['"]?\s*[A-Za-z]\w*\s*['"]?[\s,]+['"]?\s*\w{1,2}\s*['"]?([\s,]|$)"""
)


class FileRecords(NamedTuple):
    """The records of a file that have an end, and what is wrong with the others."""

    records: list[Fields]
    faults: list[DynamicsFault]


class _Line(NamedTuple):
    """What one line adds to a record."""

    fields: tuple[Field, ...]
    after_comma: bool
    ended: bool = False
    unclosed: bool = False


def sound_records(text: str) -> FileRecords:
    """Return the records of a text that have an end and closed quotes, and the other's faults."""
    records: list[Fields] = []
    open_: tuple[Field, ...] = ()
    faults: list[DynamicsFault] = []
    after_comma = True  # a comma here has nothing before it
    unclosed = False
    for number, (start, line) in enumerate(lines_of(text), start=1):
        if line.lstrip().startswith(COMMENTS):
            continue
        if open_ and HEAD.match(line):
            faults.append(_endless(open_, f"before the next one on line {number}"))
            open_, unclosed = (), False
        read = _line(line, number, start, after_comma)
        if read.unclosed:
            faults.append(DynamicsFault(number, "a quote is opened and not closed on the line"))
        open_, unclosed = open_ + read.fields, unclosed or read.unclosed
        after_comma = read.after_comma
        if read.ended:
            records += [Fields(open_[0].line, open_)] if open_ and not unclosed else []
            open_, after_comma, unclosed = (), True, False
    if open_:
        faults.append(_endless(open_, "before the end of the file"))
    return FileRecords(records, faults)


def _line(line: str, number: int, start: int, after_comma: bool) -> _Line:
    """Return what a line holds up to the '/', an empty field for each comma after a comma.

    ``start`` is where it starts in the text of the file.
    """
    fields: list[Field] = []
    for match in FIELD.finditer(line):
        kind, text = match.lastgroup, match[match.lastgroup or 0]
        if kind in ("end", "open"):
            return _Line(tuple(fields), after_comma, ended=kind == "end", unclosed=kind == "open")
        if kind != "comma":
            begin, end = (start + place for place in match.span())
            fields.append(Field(text.strip(), number, kind != "plain", begin, end))
        elif after_comma:
            fields.append(Field("", number, False, start + match.start(), start + match.start()))
        after_comma = kind == "comma"
    return _Line(tuple(fields), after_comma)


def _endless(record: tuple[Field, ...], where: str) -> DynamicsFault:
    return DynamicsFault(record[0].line, f"the record that begins here has no '/' {where}")
