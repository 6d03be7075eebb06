"""The dynamics files of PSS/E (.dyr): their free format, their records."""

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from exfit.case.case_draft import in_comment
from exfit.features.planner.buses import NO_BUSES, Buses, numbers_of
from exfit.features.planner.fields import WHOLE, DynamicsFault, Field, UnreadRecord, lines_of
from exfit.features.planner.records import (
    PSSE,
    WIDTH,
    Definition,
    FileFormat,
    Head,
    Heads,
    definition_of,
    record_fields,
    wrong_place,
)
from exfit.util.text import show_value

COMMENTS = ("//", "@!")
ENDLESS = "the record that begins here has no '/'"
USER = "USRMDL"  # the record of a model that is not one of PSS/E's own
FIELD = re.compile(
    r"""(?P<comma>,) | (?P<end>/) | '(?P<single>[^']*)' | "(?P<double>[^"]*)"
    | (?P<open>['"]) | (?P<plain>[^\s,/'"]+)""",
    re.VERBOSE,
)
# a bus, a model and a machine id: no line within a record looks like that
HEAD = re.compile(
    r"""\s*\d+[\s,]+['"]?\s*[A-Za-z]\w*\s*['"]?[\s,]+['"]?\s*\w{1,2}\s*['"]?([\s,]|$)"""
)


class Fields(NamedTuple):
    """One record: its fields, the first of which is on ``line``."""

    line: int
    fields: tuple[Field, ...]


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
            fault = f"{ENDLESS} before the next one on line {number}"
            faults.append(_unread(open_[0].line, fault, open_))
            open_, unclosed = (), False
        read = read_line(line, number, start, after_comma)
        open_, unclosed = open_ + read.fields, unclosed or read.unclosed
        if read.unclosed:
            fault = "a quote is opened and not closed on the line"
            faults.append(_unread(number, fault, open_))
        after_comma = read.after_comma
        if read.ended:
            records += [Fields(open_[0].line, open_)] if open_ and not unclosed else []
            open_, after_comma, unclosed = (), True, False
    if open_:
        fault = f"{ENDLESS} before the end of the file"
        faults.append(_unread(open_[0].line, fault, open_))
    return FileRecords(records, faults)


def _unread(line: int, text: str, fields: Sequence[Field]) -> DynamicsFault:
    """Return the fault of a record: of its bus, of none, or of any if that cannot be read."""
    first = fields[0] if fields else Field("", line, quoted=True)
    if WHOLE.fullmatch(first.text):
        return UnreadRecord.at(line, text, int(first.text))
    may_be = first.quoted or first.text[:1].isdecimal()
    return DynamicsFault(line, text) if may_be else UnreadRecord.at(line, text, 0)


def read_line(line: str, number: int, start: int, after_comma: bool) -> _Line:
    """Split a line up to the '/', with an empty field for each comma after a comma.

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


def heads(text: str, buses: Buses = NO_BUSES) -> Heads:
    """Return the records of a file that belong to a unit."""
    records, faults = sound_records(text)
    found: list[Head] = []
    for line, fields in records:
        if len(fields) < 3 or not fields[1].text[:1].isalpha():
            if len(fields) < 3 or any(definition_of(field.text) for field in fields[:2]):
                begin = " ".join(field.text for field in fields[:3])
                what = f"{show_value(begin)} is not bus, 'model' and id"
                faults.append(_unread(line, what, fields))
            continue  # of a line or a device: their records begin otherwise
        place = _by_number(fields[0], buses)
        bus, name, machine_id = place.text, fields[1].text, fields[2].text
        wrong, definition, data = [*wrong_place(place, machine_id)], definition_of(name), fields[3:]
        if name.upper() == USER and data:  # a user's model has its own name
            name, definition, data = _of_user(name, data)
        if not wrong:
            label = in_comment(name).upper()
            known = buses[int(bus)].name.strip() if int(bus) in buses else ""
            if definition is None:
                faults += _swallowed(label, data)
            head = Head(int(bus), label, machine_id, line, data, definition)
            found.append(head._replace(bus_name=known))
        elif definition is not None:
            faults += [DynamicsFault(line, f"{name.upper()}: {what}") for what in wrong]
    return Heads(found, faults)


def _of_user(
    name: str, data: tuple[Field, ...]
) -> tuple[str, Definition | None, tuple[Field, ...]]:
    """Return the name, the definition and the data of a user's model; None if it is not known."""
    known = definition_of(data[0].text)
    user = () if known is None else known.record.user
    behind = 1 + len(user)
    if user and tuple(field.text for field in data[1:behind]) == user:
        return data[0].text, known, data[behind:]
    return f"{name} {data[0].text}", None, data


def _swallowed(name: str, data: tuple[Field, ...]) -> Iterator[DynamicsFault]:
    """Find a record within another, whose '/' is missing; it may stand on the same line."""
    for before, field in pairwise(data):
        if field.text[:1].isalpha() and definition_of(field.text):
            what = f"{name}: {show_value(field.text)} among its values: is a '/' missing before?"
            yield _unread(field.line, what, (before,))


def _by_number(field: Field, buses: Buses) -> Field:
    """Return the field of a bus with its number, if it is the name of one alone."""
    numbers = numbers_of(field.text, buses) if field.quoted else []
    return field._replace(text=str(numbers[0]), quoted=False) if len(numbers) == 1 else field


def record_text(
    definition: Definition, values: Mapping[str, float], bus: int, machine_id: str
) -> str:
    """Return a record as a dynamics file has it."""
    name, user = f"'{definition.record.name}'", definition.record.user
    fields = [
        str(bus),
        f"'{USER}'" if user else name,
        machine_id if machine_id.isalnum() else f"'{machine_id}'",
        *((name, *user) if user else ()),
        *record_fields(definition, values),
        "/",
    ]
    return textwrap.fill("  ".join(fields), WIDTH, subsequent_indent="    ", break_on_hyphens=False)


PSSE_FILES = FileFormat(PSSE, ".dyr", "// ", "bus, 'model', id, values and '/'", heads, record_text)
