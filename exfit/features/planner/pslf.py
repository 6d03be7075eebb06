"""The dynamics files of PSLF (.dyd): their records, and the values of these."""

import re
import textwrap
from collections.abc import Iterator, Mapping
from itertools import zip_longest
from typing import NamedTuple

from exfit.features.planner.fields import DynamicsFault, Field, lines_of, number
from exfit.features.planner.file_format import WIDTH, FileFormat, Head, Heads, wrong_bus, wrong_id
from exfit.features.planner.records import PSLF, Definition, definition_of, record_fields
from exfit.util.text import near, show_value

Arranged = tuple[tuple[Field, ...], list[DynamicsFault]]


def arranged(definition: Definition, line: int, fields: tuple[Field, ...]) -> Arranged:
    """Return one field for each name of a record, and what is wrong with them.

    Values may stand behind their names in quotes. What does nothing may be missing: behind names
    anywhere, else at the end, before which files of older releases end.
    """
    if any(field.quoted for field in fields):
        return _named(definition, line, fields)
    idle = _idle(definition, line)
    behind = definition.names[len(fields) :]
    if all(name in idle for name in behind):
        fields += tuple(idle[name] for name in behind)
    return fields, []


def _named(definition: Definition, line: int, fields: tuple[Field, ...]) -> Arranged:
    """Return the values of fields "name" value "name" value in the order of the record."""
    name = definition.record.name
    symbols = {_name_in_file(definition, symbol): symbol for symbol in definition.names}
    given: dict[str, Field] = {}
    faults: list[DynamicsFault] = []
    for label, value in zip_longest(fields[::2], fields[1::2]):
        if not label.quoted or value is None or value.quoted:
            text = f"{name}: {show_value(label.text)}: not a name in quotes and its value"
            return (), [DynamicsFault(label.line, text)]
        symbol = symbols.get(_bare(label.text), "")
        fault = _label_fault(label.text, symbol, symbols, given)
        if fault:
            faults.append(DynamicsFault(label.line, f"{name}: {fault}"))
        given[symbol] = value
    faults = faults or [*_missing(definition, line, symbols, given)]
    ordered = {**_idle(definition, line), **given}
    return tuple(ordered[symbol] for symbol in definition.names if symbol in ordered), faults


def _missing(
    definition: Definition, line: int, symbols: dict[str, str], given: dict[str, Field]
) -> Iterator[DynamicsFault]:
    """Yield a fault where values that do something are missing."""
    idle = _idle(definition, line)
    missing = [name for name, symbol in symbols.items() if symbol not in given.keys() | idle]
    if missing:
        yield DynamicsFault(line, f"{definition.record.name}: missing: {', '.join(missing)}")


def _label_fault(label: str, symbol: str, symbols: dict[str, str], given: dict[str, Field]) -> str:
    """Find fault with a name that the record has not, or has already; "" where it is right."""
    if not symbol:
        return f"no value is named {show_value(label)}; {near(_bare(label), symbols)}"
    return f"{label}: given twice" if symbol in given else ""


def _idle(definition: Definition, line: int) -> dict[str, Field]:
    """Return fields for what a record need not have, by symbol, with what the model stands for."""
    idle = {**dict.fromkeys(definition.record.ignored, 0.0), **dict(definition.record.absent)}
    return {symbol: Field(repr(value), line) for symbol, value in idle.items()}


def _name_in_file(definition: Definition, symbol: str) -> str:
    return dict(definition.record.spelled).get(symbol, symbol).lower()


def _bare(label: str) -> str:
    """Return a name without capitals and blanks: of "Ang p" angp."""
    return "".join(label.lower().split())


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
    """Split a line into fields; ``start`` is its place in the text of the file."""
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
    """Find fault with the fields before the ':' of a record, "" where they are right.

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
