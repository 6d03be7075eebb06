"""The dynamics files of PSS/E (.dyr): their free format, their records."""

import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from exfit.features.planner.fields import DynamicsFault, Field, Fields, lines_of
from exfit.features.planner.file_format import WIDTH, FileFormat, Head, Heads, wrong_bus, wrong_id
from exfit.features.planner.records import PSSE, Definition, definition_of, record_fields
from exfit.util.text import show_value

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


def _endless(record: tuple[Field, ...], where: str) -> DynamicsFault:
    return DynamicsFault(record[0].line, f"the record that begins here has no '/' {where}")


def heads(text: str) -> Heads:
    """Return the records of a file that belong to a unit."""
    records, faults = sound_records(text)
    return Heads([head for record in records for head in _heads_of(record, faults)], faults)


def record_text(
    definition: Definition, values: Mapping[str, float], bus: int, machine_id: str
) -> str:
    """Return a record as a dynamics file has it."""
    fields = [
        str(bus),
        f"'{definition.record.name}'",
        machine_id if machine_id.isalnum() else f"'{machine_id}'",
        *record_fields(definition, values),
        "/",
    ]
    return textwrap.fill("  ".join(fields), WIDTH, subsequent_indent="    ", break_on_hyphens=False)


def _heads_of(record: Fields, faults: list[DynamicsFault]) -> Iterator[Head]:
    """Yield the head of a record that belongs to a unit; add a fault where it has none."""
    line, fields = record
    if len(fields) < 3 or not fields[1].text[:1].isalpha():
        if len(fields) < 3 or any(definition_of(field.text) for field in fields[:2]):
            begin = " ".join(field.text for field in fields[:3])
            faults.append(DynamicsFault(line, f"{show_value(begin)} is not bus, 'model' and id"))
        return  # of a line or a device: their records begin otherwise
    bus, name, machine_id = (field.text for field in fields[:3])
    wrong = [*wrong_bus(fields[0]), *wrong_id(machine_id)]
    if not wrong:
        yield Head(int(bus), _label(fields), machine_id, line, fields[3:], definition_of(name))
    elif definition_of(name) is not None:
        faults += [DynamicsFault(line, f"{name.upper()}: {text}") for text in wrong]


def _label(fields: Sequence[Field]) -> str:
    """Return the name of a record's model; of a user's model with its own name."""
    name = fields[1].text
    label = f"{name} {fields[3].text}" if name.upper() == "USRMDL" and fields[3:] else name
    return "".join(letter if letter.isprintable() else "?" for letter in label).upper()


PSSE_FILES = FileFormat(PSSE, ".dyr", "// ", "bus, 'model', id, values and '/'", heads, record_text)
