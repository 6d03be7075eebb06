"""The dynamics files of PSLF (.dyd): their records, and the values of these."""

import re
import textwrap
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import zip_longest
from typing import NamedTuple

from exfit.features.planner.buses import NO_BUSES, Buses
from exfit.features.planner.fields import DynamicsFault, Field, lines_of, number
from exfit.features.planner.records import (
    PSLF,
    WIDTH,
    Definition,
    FileFormat,
    Head,
    Heads,
    definition_of,
    record_fields,
    wrong_place,
)
from exfit.util.text import near, show_value

Arranged = tuple[tuple[Field, ...], list[DynamicsFault]]

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
    continued: bool = False
    unclosed: bool = False


def heads(text: str, _: Buses = NO_BUSES) -> Heads:
    """Return the records of a file that belong to a unit."""
    faults: list[DynamicsFault] = []
    found: list[Head] = []
    for record in _records(text, faults):
        line, fields = record.number, record.fields
        name = fields[0].text if fields and not fields[0].quoted else ""
        definition = definition_of(name, PSLF)
        fault = _head_fault(record, name, definition)
        if fault:
            faults.append(DynamicsFault(line, fault))
        elif record.before == HEAD_FIELDS:
            wrong = [*wrong_place(fields[1], fields[4].text)]
            if not wrong:
                found.append(_head(definition, record))
            elif definition is not None:
                faults += [DynamicsFault(line, f"{name}: {what}") for what in wrong]
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
            before = open_.before
            if before is None and read.before is not None:
                before = len(open_.fields) + read.before
            fields = open_.fields + read.fields
            read = read._replace(number=open_.number, fields=fields, before=before)
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
    """Split a line into fields; ``start`` is its place in the text of the file."""
    fields: list[Field] = []
    before = None
    for match in FIELD.finditer(line):
        kind, text = match.lastgroup, match[match.lastgroup or 0]
        if kind in ("open", "end"):
            return _LogicalLine(place, tuple(fields), before, kind == "end", kind == "open")
        if kind == "comment":
            break
        if kind == "colon":
            before = len(fields) if before is None else before
            continue
        begin, end = (start + edge for edge in match.span())
        fields.append(Field(text.strip(), place, kind == "double", begin, end))
    return _LogicalLine(place, tuple(fields), before)


def _head_fault(record: _LogicalLine, name: str, definition: Definition | None) -> str:
    """Find fault with the fields before the ':' of a record, "" where they are right.

    Other devices have other fields there; a line without a ':' is a word that begins a section.
    """
    fields, before = record.fields, record.before
    if not WORD.fullmatch(name):
        begin = " ".join(field.text for field in fields[:3])
        return f"{show_value(begin)} does not begin a record; does the line before lack its '/'?"
    buses = [field for field in fields[1:2] if not field.quoted]
    has_bus = any(field.text.lstrip("-").isdigit() for field in buses)
    if before is None and (definition is not None or has_bus):
        return f"{name}: the record has no ':' behind its id"
    if definition is not None and before != HEAD_FIELDS:
        return f"{name}: {before} fields before ':', expected model, bus, name, kV and id"
    return ""


def _head(definition: Definition | None, record: _LogicalLine) -> Head:
    """Return the head of a record with its values, in the order of its definition."""
    name, bus, bus_name, _, machine_id = (field.text for field in record.fields[:HEAD_FIELDS])
    base, given, faults = None, list[Field](), list[DynamicsFault]()
    for field in record.fields[HEAD_FIELDS:]:
        if field.quoted:
            given.append(field)
        elif match := BASE.fullmatch(field.text):
            try:
                base = number(field._replace(text=match[2]))
            except ValueError as error:
                faults.append(DynamicsFault(field.line, f"{name}: {match[1]}: {error}"))
        elif not LEVEL.fullmatch(field.text) and not OPTION.fullmatch(field.text):
            given.append(field)
    values = tuple(given)
    if definition is not None:
        values, more = _arranged(definition, record.number, values)
        faults += more
    line, kv = record.number, None
    with suppress(ValueError):  # ! stands for what is not given
        kv = number(record.fields[HEAD_FIELDS - 2]) or None
    found, label = tuple(faults), "" if bus_name == UNKNOWN else bus_name
    return Head(
        int(bus), name.lower(), machine_id, line, values, definition, PSLF, base, found, kv, label
    )


def _arranged(definition: Definition, line: int, fields: tuple[Field, ...]) -> Arranged:
    """Return one field for each name of a record, and what is wrong with them.

    Values may stand behind their names in quotes. What does nothing may be missing: behind names
    anywhere, else at the end, before which files of older releases end.
    """
    record = definition.record
    without = {**dict.fromkeys(record.ignored, 0.0), **dict(record.absent)}
    idle = {symbol: Field(repr(value), line) for symbol, value in without.items()}
    if not any(field.quoted for field in fields):
        behind = definition.names[len(fields) :]
        if all(name in idle for name in behind):
            fields += tuple(idle[name] for name in behind)
        return fields, []
    return _named(definition, line, fields, idle)


def _named(
    definition: Definition, line: int, fields: tuple[Field, ...], idle: Mapping[str, Field]
) -> Arranged:
    """Return the values of fields "name" value "name" value in the order of the record."""
    record, spelled = definition.record, dict(definition.record.spelled)
    symbols = {spelled.get(symbol, symbol).lower(): symbol for symbol in definition.names}
    given: dict[str, Field] = {}
    faults: list[DynamicsFault] = []
    for label, value in zip_longest(fields[::2], fields[1::2]):
        if not label.quoted or value is None or value.quoted:
            text = f"{record.name}: {show_value(label.text)}: no name in quotes and its value"
            return (), [DynamicsFault(label.line, text)]
        bare = "".join(label.text.lower().split())  # of "Ang p" angp
        symbol, fault = symbols.get(bare, ""), ""
        if not symbol:
            fault = f"unknown value {show_value(label.text)}; {near(bare, symbols)}"
        elif symbol in given:
            fault = f"{label.text}: given twice"
        if fault:
            faults.append(DynamicsFault(label.line, f"{record.name}: {fault}"))
        given[symbol] = value
    ordered = {**idle, **given}
    missing = [name for name, symbol in symbols.items() if symbol not in ordered]
    if missing and not faults:
        text = f"{record.name}: missing: {', '.join(missing)}"
        faults.append(DynamicsFault(line, text))
    return tuple(ordered[symbol] for symbol in definition.names if symbol in ordered), faults


PSLF_FILES = FileFormat(
    PSLF, ".dyd", "# ", "model, bus, name, kV, id, ':' and values", heads, record_text
)
