"""The free format of a dynamics file: fields between blanks or commas, records that end with '/'.

What follows the '/' on its line is comment, and so are lines that begin with // or @!.
"""

import re
from collections.abc import Iterable
from math import isfinite
from typing import NamedTuple

from exfit.errors import DynamicsError
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
NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][-+]?[0-9]+)?")
WHOLE = re.compile(r"[-+]?[0-9]{1,9}")
REPEATED = re.compile(r"[0-9]+\*.*")
BYTE_ORDER = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
END_OF_FILE = "\x1a"  # as DOS wrote it


class DynamicsFault(NamedTuple):
    """What is wrong, or must be known, on a line of the file."""

    line: int
    text: str


class Field(NamedTuple):
    """One field: its text without quotes and blanks around it, and its line."""

    text: str
    line: int
    quoted: bool = False


class Fields(NamedTuple):
    """One record: its fields, the first of which is on ``line``."""

    line: int
    fields: tuple[Field, ...]


class _Line(NamedTuple):
    """What one line adds to a record."""

    fields: tuple[Field, ...]
    after_comma: bool
    ended: bool = False
    unclosed: bool = False


def text_of(data: bytes, file: str) -> str:
    """Return the text of a file: UTF-8, or else Latin-1; raises DynamicsError where it is none."""
    try:
        text = data.decode(BYTE_ORDER.get(data[:2], BYTE_ORDER.get(data[:3], "utf-8")))
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    text = text.replace("\r\n", "\n").replace("\r", "\n").rstrip(END_OF_FILE)
    if "\0" in text:
        line = text.count("\n", 0, text.index("\0")) + 1
        raise DynamicsError([f"{file}:{line}: not a text file: it holds a byte 0x00"])
    return text


def read_records(text: str, file: str) -> list[Fields]:
    """Return the records of a text; raises DynamicsError where one has no end."""
    records: list[Fields] = []
    open_: tuple[Field, ...] = ()
    faults: list[DynamicsFault] = []
    after_comma = True  # a comma here has nothing before it
    for number, line in enumerate(text.split("\n"), start=1):
        if line.lstrip().startswith(COMMENTS):
            continue
        if open_ and HEAD.match(line):
            faults.append(_endless(open_, f"before the next one on line {number}"))
            open_ = ()
        read = _line(line, number, after_comma)
        if read.unclosed:
            faults.append(DynamicsFault(number, "a quote is opened and not closed on the line"))
        open_ += read.fields
        after_comma = read.after_comma
        if read.ended:
            records += [Fields(open_[0].line, open_)] if open_ else []
            open_, after_comma = (), True
    if open_:
        faults.append(_endless(open_, "before the end of the file"))
    refuse(faults, file)
    return records


def refuse(faults: list[DynamicsFault], file: str) -> None:
    """Raise DynamicsError with all faults in the order of their lines, where there is any."""
    if faults:
        raise DynamicsError(located(faults, file))


def located(faults: Iterable[DynamicsFault], file: str) -> list[str]:
    """Return faults as ``file:line: what``, in the order of their lines."""
    return [f"{file}:{line}: {text}" for line, text in sorted(faults, key=lambda fault: fault.line)]


def number(field: Field) -> float:
    """Return the number of a field, as Fortran writes it; raises ValueError where it is none."""
    if not field.text and not field.quoted:
        raise ValueError("empty, between two commas; write the value")
    if REPEATED.fullmatch(field.text):
        raise ValueError(f"{show_value(field.text)} repeats a value; write each one out")
    if field.quoted or not NUMBER.fullmatch(field.text):
        raise ValueError(f"{show_value(field.text)} is not a number")
    value = float(field.text.upper().replace("D", "E"))
    if not isfinite(value):
        raise ValueError(f"{show_value(field.text)} is too large for a number")
    return value


def whole(field: Field) -> int:
    """Return the whole number of a field; raises ValueError where it is none."""
    if field.quoted or not WHOLE.fullmatch(field.text):
        raise ValueError(f"{show_value(field.text)} is not a whole number")
    return int(field.text)


def _line(line: str, number: int, after_comma: bool) -> _Line:
    """Return what a line holds up to the '/', an empty field for each comma after a comma."""
    fields: list[Field] = []
    for match in FIELD.finditer(line):
        kind, text = match.lastgroup, match[match.lastgroup or 0]
        if kind in ("end", "open"):
            return _Line(tuple(fields), after_comma, ended=kind == "end", unclosed=kind == "open")
        if kind != "comma":
            fields.append(Field(text.strip(), number, quoted=kind != "plain"))
        elif after_comma:
            fields.append(Field("", number))
        after_comma = kind == "comma"
    return _Line(tuple(fields), after_comma)


def _endless(record: tuple[Field, ...], where: str) -> DynamicsFault:
    return DynamicsFault(record[0].line, f"the record that begins here has no '/' {where}")
