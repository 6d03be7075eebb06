"""The dynamics files of PSLF (.dyd): their records, read and written.

    genrou 101 "NORTH G1" 15.75 "1 " : #9 mva=120.0  6.0 0.035 0.5 ... /
      0.25 0.2 0.12 0.4

A '/' at the end of a line continues the record on the next one. Values stand in their order, or
behind their names in quotes. Lines that begin with # are comments; ! stands for what is not given.
"""

import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from exfit.features.planner.fields import DynamicsFault, Field, lines_of, number
from exfit.features.planner.file_format import WIDTH, FileFormat, Head, Heads, wrong_bus, wrong_id
from exfit.features.planner.pslf.values import arranged
from exfit.features.planner.records import PSLF, Definition, definition_of, record_fields
from exfit.util.text import show_value

FIELD = re.compile(
    r"""(?P<end>/\s*$) | "(?P<double>[^"]*)" | (?P<open>") | (?P<colon>:)
    | (?P<comment>\#(?=\s|$)) | (?P<plain>[^\s,":/]+|/)""",
    re.VERBOSE,
)
WORD = re.compile(r"[A-Za-z]\w*")
HEAD = re.compile(r"""\s*[A-Za-z]\w*\s+-?\d+\s+("|!|\d)""")  # a model, a bus and what follows
LEVEL = re.compile(r"#\d+")  # of what a model reports
BASE = re.compile(r"(mva|mwcap|mvab?|tbase)=(.*)", re.IGNORECASE)
OPTION = re.compile(r"[A-Za-z]\w*=.*")
HEAD_FIELDS = 5  # model, bus, its name, its kV, id
UNKNOWN = "!"


class _LogicalLine(NamedTuple):
    """The fields of a line, how many stand before its ':', and how it ends."""

    number: int
    fields: tuple[Field, ...]
    before: int | None
    continued: bool
    unclosed: bool


def heads(text: str) -> Heads:
    """Return the records of a file that belong to a unit."""
    faults: list[DynamicsFault] = []
    found: list[Head] = []
    for record in _records(text, faults):
        found += _heads_of(record, faults)
    return Heads(found, faults)


def record_text(
    definition: Definition, values: Mapping[str, float], bus: int, machine_id: str
) -> str:
    """Return a record as a dynamics file has it; the name of the bus and its kV are not known."""
    begin = f'{definition.record.name} {bus} {UNKNOWN} {UNKNOWN} "{machine_id}" : #9'
    text = "  ".join([begin, *record_fields(definition, values)])
    lines = textwrap.wrap(
        text, WIDTH - 2, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False
    )
    return " /\n".join(lines)


def _records(text: str, faults: list[DynamicsFault]) -> Iterator[_LogicalLine]:
    """Yield each record as one line, whatever lines it stands on; add what is wrong with others."""
    open_: _LogicalLine | None = None
    for place, (start, line) in enumerate(lines_of(text), start=1):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        read = _line(line, place, start)
        if open_ is not None and not HEAD.match(line):
            read = _joined(open_, read)
        elif open_ is not None:
            yield open_
        open_ = None
        if read.unclosed:
            fault = "a quote is opened and not closed on the line"
            faults.append(DynamicsFault(place, fault))
        elif read.continued:
            open_ = read
        else:
            yield read
    if open_ is not None:
        yield open_


def _line(line: str, place: int, start: int) -> _LogicalLine:
    """Return what a line holds; ``start`` is where it starts in the text of the file."""
    fields: list[Field] = []
    before = None
    for match in FIELD.finditer(line):
        kind, text = match.lastgroup, match[match.lastgroup or 0]
        if kind == "open":
            return _LogicalLine(place, tuple(fields), before, continued=False, unclosed=True)
        if kind == "end":
            return _LogicalLine(place, tuple(fields), before, continued=True, unclosed=False)
        if kind == "comment":
            break
        if kind == "colon":
            before = len(fields) if before is None else before
            continue
        begin, end = (start + edge for edge in match.span())
        fields.append(Field(text.strip(), place, kind == "double", begin, end))
    return _LogicalLine(place, tuple(fields), before, continued=False, unclosed=False)


def _joined(first: _LogicalLine, second: _LogicalLine) -> _LogicalLine:
    """Return a record with the line that continues it."""
    before = first.before
    if before is None and second.before is not None:
        before = len(first.fields) + second.before
    fields = first.fields + second.fields
    return _LogicalLine(first.number, fields, before, second.continued, second.unclosed)


def _heads_of(record: _LogicalLine, faults: list[DynamicsFault]) -> Iterator[Head]:
    """Yield the head of a record that belongs to a unit; add a fault where it has none."""
    line, fields = record.number, record.fields
    name = fields[0].text if fields and not fields[0].quoted else ""
    definition = definition_of(name, PSLF)
    fault = _head_fault(record, name, definition)
    if fault:
        faults.append(DynamicsFault(line, fault))
    elif record.before == HEAD_FIELDS:
        bus, machine_id = fields[1], fields[4].text
        wrong = [*wrong_bus(bus), *wrong_id(machine_id)]
        if not wrong:
            yield _head(definition, record)
        elif definition is not None:
            faults += [DynamicsFault(line, f"{name}: {text}") for text in wrong]


def _head_fault(record: _LogicalLine, name: str, definition: Definition | None) -> str:
    """Return what is wrong with the fields before the ':' of a record, "" where nothing is.

    Other devices have other fields there; a line without a ':' is a word that begins a section.
    """
    fields, before = record.fields, record.before
    if not WORD.fullmatch(name):
        begin = " ".join(field.text for field in fields[:3])
        return f"{show_value(begin)} begins no record; does the line before lack its '/'?"
    if before is None and (definition is not None or (len(fields) > 1 and _is_bus(fields[1]))):
        return f"{name}: the record has no ':' behind its id"
    if definition is not None and before != HEAD_FIELDS:
        return f"{name}: {before} fields before ':', not model, bus, name, kV and id"
    return ""


def _head(definition: Definition | None, record: _LogicalLine) -> Head:
    """Return the head of a record with its values, in the order of its definition."""
    name, bus, _, _, machine_id = (field.text for field in record.fields[:HEAD_FIELDS])
    values, base, faults = _values(name, record.fields[HEAD_FIELDS:])
    if definition is not None:
        values, more = arranged(definition, record.number, values)
        faults += more
    return Head(
        int(bus),
        name.lower(),
        machine_id,
        record.number,
        values,
        definition,
        PSLF,
        base,
        tuple(faults),
    )


def _is_bus(field: Field) -> bool:
    return not field.quoted and field.text.lstrip("-").isdigit()


def _values(
    name: str, fields: tuple[Field, ...]
) -> tuple[tuple[Field, ...], float | None, list[DynamicsFault]]:
    """Return the values of a record, the base that they are on, and what is wrong with it."""
    base, values, faults = None, [], []
    for field in fields:
        if field.quoted:
            values.append(field)
        elif match := BASE.fullmatch(field.text):
            try:
                base = number(field._replace(text=match[2]))
            except ValueError as error:
                faults.append(DynamicsFault(field.line, f"{name}: {match[1]}: {error}"))
        elif not LEVEL.fullmatch(field.text) and not OPTION.fullmatch(field.text):
            values.append(field)
    return tuple(values), base, faults


PSLF_FILES = FileFormat(
    PSLF, ".dyd", "# ", "model, bus, name, kV, id, ':' and values", heads, record_text
)
