"""Decode the bytes of a text file: its encoding and its line ends."""

import codecs
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from exfit.errors import RecordError

CHECKED_BYTES = 1 << 20  # at a time
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
TEXT_BYTES = bytes({*b"\t\n\x0c\r", *range(0x20, 0x100)} - {0x7F, 0x81, 0x8D, 0x8F, 0x90, 0x9D})


@dataclass(frozen=True)
class Text:
    r"""The bytes of a text in an encoding that keeps ASCII, with lines that end in \n."""

    data: bytes
    encoding: str

    def lines(self, start: int = 0) -> Iterator[str]:
        """Yield the lines from a byte on, one by one."""
        stream = io.BytesIO(self.data)
        stream.seek(start)
        return io.TextIOWrapper(stream, self.encoding, newline="\n")

    def start_of(self, line: int) -> int:
        """Return the byte at which a line starts, counted from 1; the end where there is none."""
        at = 0
        for _ in range(line - 1):
            at = self.data.find(b"\n", at) + 1
            if at == 0:
                return len(self.data)
        return at


def decoded(path: Path, data: bytes) -> Text:
    """Return the text of a file: UTF-8, UTF-16 with its mark, else Windows-1252 (with latin-1).

    Raises RecordError for bytes that are none of these, and for a null character.
    """
    for mark, encoding in BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return _marked(path, data[len(mark) :], encoding)
    if _is_utf8(data):
        return _text(path, data, "utf-8")
    strange = data.translate(None, TEXT_BYTES)
    if strange:
        raise _no_text(path, data, data.index(strange[:1]), "neither UTF-8 nor Windows-1252 text")
    return _text(path, data, "cp1252")


def _marked(path: Path, data: bytes, encoding: str) -> Text:
    """Return the text after a byte order mark."""
    if encoding == "utf-8" and _is_utf8(data):
        return _text(path, data, encoding)
    try:
        return _text(path, data.decode(encoding).encode(), "utf-8")
    except UnicodeDecodeError as error:
        what = f"not {encoding[:6].rstrip('-').upper()} text"
        raise _no_text(path, data, error.start, what) from None


def _text(path: Path, data: bytes, encoding: str) -> Text:
    at = data.find(b"\0")
    if at >= 0:
        raise _no_text(path, data, at, "not text")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return Text(data, encoding)


def _is_utf8(data: bytes) -> bool:
    if data.isascii():
        return True
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for at in range(0, len(data), CHECKED_BYTES):
            decoder.decode(data[at : at + CHECKED_BYTES])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return False
    return True


def _no_text(path: Path, data: bytes, at: int, what: str) -> RecordError:
    line = data.count(b"\n", 0, at) + 1
    return RecordError(f"{path}:{line}: {what}: byte 0x{data[at]:02x}")
