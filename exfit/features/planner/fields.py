"""The fields of a planner's file of any program: where they stand, and what they say."""

import re
from collections.abc import Iterable, Iterator
from math import isfinite
from typing import NamedTuple

from exfit.errors import DynamicsError
from exfit.util.text import show_value

NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eEdD][-+]?[0-9]+)?")
WHOLE = re.compile(r"[-+]?[0-9]{1,9}")
REPEATED = re.compile(r"[0-9]+\*.*")
BYTE_ORDER = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
WITHOUT_MARK = {b"\xff\xfe": "utf-16-le", b"\xfe\xff": "utf-16-be"}
END_OF_LINE = re.compile(r"\r\n|\r|\n")
END_OF_FILE = "\x1a"  # as DOS wrote it


class DynamicsFault(NamedTuple):
    """A fault or a warning on a line of the file."""

    line: int
    text: str


class UnreadRecord(DynamicsFault):
    """The fault of a record that cannot be read, of a ``bus``; 0 where its line is no record."""

    bus = 0

    @classmethod
    def at(cls, line: int, text: str, bus: int) -> "UnreadRecord":
        """Return the fault of a record at a bus."""
        fault = cls(line, text)
        fault.bus = bus
        return fault


class Field(NamedTuple):
    """One field: its text without quotes and blanks around it, its line, and where it stands.

    ``start`` and ``end`` bound its letters, quotes among them, in the text of the file.
    """

    text: str
    line: int
    quoted: bool = False
    start: int = 0
    end: int = 0


def text_of(data: bytes, file: str) -> str:
    """Return the text of a file, its ends of line as they are: UTF-8, or else Latin-1.

    Raises DynamicsError where it is none.
    """
    text = data.decode(encoding_of(data))
    if "\0" in text:
        line = len(END_OF_LINE.findall(text, 0, text.index("\0"))) + 1
        raise DynamicsError(f"{file}:{line}: not a text file: it holds a byte 0x00")
    return text


def encoding_of(data: bytes) -> str:
    """Find the encoding of the text of a file."""
    encoding = BYTE_ORDER.get(data[:2], BYTE_ORDER.get(data[:3], "utf-8"))
    try:
        data.decode(encoding)
    except UnicodeDecodeError:
        return "latin-1"
    return encoding


def encoded(text: str, like: bytes) -> bytes:
    """Return a text in the encoding of another file, with its byte order mark if it has one."""
    encoding = encoding_of(like)
    if encoding == "utf-16":
        return like[:2] + text.encode(WITHOUT_MARK[like[:2]])
    return text.encode(encoding)


def lines_of(text: str) -> Iterator[tuple[int, str]]:
    """Yield each line of a text behind where it starts, without its end."""
    start, whole = 0, len(text.rstrip(END_OF_FILE))
    for end in END_OF_LINE.finditer(text, 0, whole):
        yield start, text[start : end.start()]
        start = end.end()
    yield start, text[start:whole]


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
