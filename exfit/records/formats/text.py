"""Delimited text: what recorders, spreadsheets and simulators write as .csv, .txt, .tsv, .dat."""

import codecs
import hashlib
import io
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.clock import are_soc, find_clock, in_seconds, soc_in_seconds
from exfit.records.formats.cells import is_missing, is_number, is_timestamp, quoted, why_not
from exfit.records.formats.dialect import (
    SEPARATORS,
    Dialect,
    find_dialect,
    has_comma,
    is_comment,
    split_rows,
)
from exfit.records.formats.table import (
    NONE,
    MemoryLimit,
    column_error,
    increases,
    memory_limit,
    positions,
    positions_of_each,
    read_bytes,
)
from exfit.util.arrays import Array

SCANNED_BYTES = 1 << 22  # looked at together
DECODED_BYTES = 1 << 20  # at a time, to see whether they are UTF-8
STAMP_BYTES = 120  # of a row, while timestamps become numbers
WIDEST = (40, 28)  # characters of a timestamp with all digits and a zone; of a time or a date alone
HEAD_LINES = 300  # within which the first row of numbers must be
HEAD_BYTES = 1 << 20  # of very long lines the head has no more, but
FEWEST_HEAD_LINES = 8  # so many
CELL_BYTES = 600  # that a cell of the head takes while the dialect is found
BYTE_ORDER_MARKS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF16_LE, "utf-16-le"),
    (codecs.BOM_UTF16_BE, "utf-16-be"),
)
TEXT_BYTES = bytes({*b"\t\n\x0c\r", *range(0x20, 0x100)} - {0x7F, 0x81, 0x8D, 0x8F, 0x90, 0x9D})


class Text(NamedTuple):
    r"""The bytes of a text in an encoding that keeps ASCII, with lines that end in \n."""

    data: bytes
    encoding: str

    def lines(self, start: int = 0, end: int | None = None) -> Iterator[str]:
        """Yield the lines from a byte on, one by one."""
        stream = io.BytesIO(self.data[:end])
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


@dataclass(frozen=True, eq=False)
class TextTable:
    """A delimited text as a RecordTable, whose columns are read when they are requested."""

    path: Path
    sha256: str
    text: Text
    dialect: Dialect
    limit: MemoryLimit

    @property
    def names(self) -> tuple[str, ...]:
        """The columns, as the file has them without spaces around; 1, 2 ... where it has none."""
        return self.dialect.names

    @property
    def units(self) -> Mapping[str, str]:
        """The units in the names or in a row below them, by column."""
        return self.dialect.units

    @cached_property
    def clock(self) -> tuple[str, ...]:
        """The column that holds the time, or those of date and time; empty where none seems to."""
        _, first = next(self.rows())
        stamps = [name for name, cell in zip(self.names, first, strict=False) if is_timestamp(cell)]
        return find_clock(self.names, stamps, partial(increases, self))

    def numbers(self, names: Iterable[str], gappy: frozenset[str] = NONE) -> dict[str, Array]:
        """Return columns (M,), nan for samples that a ``gappy`` one lacks; see RecordTable."""
        names = [*names]
        self.limit.check_columns([self._count] * len(names), len(self.text.data))
        return self._numbers(positions(self.path, self.names, names), gappy)

    def each(self, names: Sequence[str]) -> Iterator[tuple[str, Array | RecordError]]:
        """Yield columns (M,) with their faults, read all at once; see RecordTable."""
        self.limit.check_columns([self._count] * len(names), len(self.text.data))
        places, refused = positions_of_each(self.path, self.names, names)
        gappy = frozenset(places)
        try:
            columns = self._numbers(places, gappy)
        except RecordError:
            try:
                for name, error in self._faults(places, partial(self._fault, gappy)):
                    refused.setdefault(name, error)
            except RecordError as ragged:
                refused |= dict.fromkeys(places, ragged)
            sound = {name: at for name, at in places.items() if name not in refused}
            columns = self._numbers(sound, gappy) if sound else {}
        for name in names:
            yield name, refused[name] if name in refused else columns[name]

    def _numbers(self, places: Mapping[str, int], gappy: frozenset[str]) -> dict[str, Array]:
        if not self._even:
            self._refuse_first(places, partial(self._fault, gappy))
        try:
            data = self._loaded(self._numeric_lines(), places.values(), float)
        except ValueError:
            self._refuse_first(places, partial(self._fault, gappy))
            one_by_one: dict[int | str, Callable[[str], float]] = {
                places[name]: lambda cell: np.nan if is_missing(cell) else float(cell)
                for name in gappy & places.keys()
            }
            try:
                data = self._loaded(self._numeric_lines(), places.values(), float, one_by_one)
            except ValueError as error:
                raise RecordError(f"{self.path}: {error}") from None
        return {name: data[:, at] for at, name in enumerate(places)}

    def _fault(self, gappy: frozenset[str], name: str, cell: str) -> str:
        known = is_number(cell, self.dialect.comma) or (name in gappy and is_missing(cell))
        return "" if known else why_not(cell, self.dialect.comma)

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s, of numbers in ``unit`` or of timestamps; see RecordTable."""
        places = positions(self.path, self.names, columns)
        if are_soc(columns):
            return soc_in_seconds(self.path, columns, self.numbers(columns))
        _, row = next(self.rows())
        first = "".join(row[places[columns[0]] :][:1])
        if len(columns) == 1 and not is_timestamp(first):
            (name,) = columns
            numbers = self.numbers([name])[name]
            return in_seconds(self.path, name, numbers, self.units.get(name), unit)
        if unit is not None:
            what = f"{quoted(first)} is a timestamp, not a number of {unit}"
            raise column_error(self.path, columns[0], what)
        return self._stamps(places)

    def place(self, row: int) -> str:
        """Return the place of a sample, counted from 0: file and line."""
        line, _ = next(islice(self.rows(), row, None))
        return f"{self.path}:{line}"

    def rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield line number and cells of each row, one by one: slow, for the place of a fault."""
        dialect = self.dialect
        for line, cells in split_rows(
            self.path, self.text.lines(self._start), dialect.separator, dialect.first_line
        ):
            if len(cells) == dialect.cells or not is_comment(cells[0], dialect.separator):
                yield line, cells

    @cached_property
    def _start(self) -> int:
        return self.text.start_of(self.dialect.first_line)

    @cached_property
    def _count(self) -> int:
        """How many rows there are at most."""
        return self.text.data.count(b"\n", self._start) + 1

    @cached_property
    def _even(self) -> bool:
        """Whether every line surely has as many cells as the first; if not, some may have."""
        separator, cells = self.dialect.separator, self.dialect.cells
        data = self.text.data
        end = len(data)
        while data[end - 1] == ord("\n"):
            end -= 1
        if separator is not None and len(self.names) < cells:
            ends = data.count(f"{separator}\n".encode(), self._start, end)
            if ends < data.count(b"\n", self._start, end):
                return False
        period = cells if separator is not None else cells + 1
        phase, blank = 0, True
        for start in range(self._start, end, SCANNED_BYTES):
            letters = np.frombuffer(data, np.uint8, min(SCANNED_BYTES, end - start), start)
            ends_line = letters == ord("\n")
            if separator is not None:
                marks = ends_line[ends_line | (letters == ord(separator))]
            else:
                gap = (letters == ord(" ")) | (letters == ord("\t")) | ends_line
                begins = ~gap & np.concatenate(([blank], gap[:-1]))
                blank = bool(gap[-1])
                marks = ends_line[begins | ends_line]
            due = marks[period - 1 - phase :: period]
            if not due.all() or np.count_nonzero(marks) != due.size:
                return False
            phase = (phase + marks.size) % period
        return phase == period - 1

    def _lines(self) -> Iterator[str]:
        """Return the lines of the rows, as NumPy reads them."""
        lines = self.text.lines(self._start)
        return lines if self._even else filter(self._is_row, lines)

    def _is_row(self, line: str) -> bool:
        """Check for no comment; a row too may begin with the mark of one."""
        separator = self.dialect.separator
        if not is_comment(line, separator):
            return True
        _, cells = next(split_rows(self.path, [line], separator, 1))
        return len(cells) == self.dialect.cells

    def _numeric_lines(self) -> Iterator[str]:
        """Return the lines of the rows with decimal points; what had one before is no number."""
        lines = self._lines()
        if not self.dialect.comma:
            return lines
        if self.dialect.separator == ",":
            quoted_number = re.compile(r'"([^",\n]*),([^",\n]*)"')
            return (quoted_number.sub(r"\1.\2", line.replace(".", ":")) for line in lines)
        if self.text.data.find(b".", self._start) >= 0:
            return (line.replace(".", ":").replace(",", ".") for line in lines)
        return (line.replace(",", ".") for line in lines)

    def _loaded(
        self,
        lines: Iterable[str],
        places: Iterable[int],
        kind: Any,
        converters: Mapping[int | str, Callable[[str], float]] | None = None,
    ) -> NDArray[Any]:
        """Return columns as NumPy's C reader reads them; raises ValueError where it fails."""
        return np.loadtxt(
            lines,
            dtype=kind,
            delimiter=self.dialect.separator,
            quotechar='"',
            comments=(),
            usecols=tuple(places),
            ndmin=2,
            converters=converters,
        )

    def _refuse_first(self, places: Mapping[str, int], fault: Callable[[str, str], str]) -> None:
        """Raise a RecordError for the first row that is ragged or has a cell with a ``fault``."""
        for _, error in self._faults(places, fault):
            raise error

    def _faults(
        self, places: Mapping[str, int], fault: Callable[[str, str], str]
    ) -> Iterator[tuple[str, RecordError]]:
        """Yield the first ``fault`` of each column; raises RecordError for a row that is ragged."""
        named = len(self.names)
        for line, row in self.rows():
            if len(row) != self.dialect.cells or any(cell.strip() for cell in row[named:]):
                cells = len(row) - (named < self.dialect.cells and not row[-1].strip())
                raise RecordError(
                    f"{self.path}:{line}: cells in this row: {cells}, columns: {named}"
                )
            for name, place in places.items():
                what = fault(name, row[place].strip())
                if what:
                    yield name, column_error(f"{self.path}:{line}", name, what)
                    places = {other: at for other, at in places.items() if other != name}

    def _stamps(self, places: Mapping[str, int]) -> Array:
        """Return timestamps of one column, or of two, in s since the first."""
        from exfit.records.formats.timestamps import StampError, seconds_since_first

        needed = len(self.text.data) + STAMP_BYTES * self._count * len(places)
        self.limit.check(needed, f"{self._count} timestamps")

        def fault(_: str, cell: str) -> str:
            return "" if is_timestamp(cell) else f"{quoted(cell)} is not a timestamp"

        if not self._even:
            self._refuse_first({}, fault)
        try:
            width = WIDEST[len(places) - 1]
            cells = self._loaded(self._lines(), places.values(), f"S{width}")
        except ValueError as error:
            self._refuse_first(places, fault)  # quoted cells may hold separators
            raise RecordError(f"{self.path}: {error}") from None
        try:
            return seconds_since_first(cells)
        except StampError as error:
            name = [*places][error.column]
            raise column_error(self.place(error.row), name, str(error)) from None


def read_text_table(path: Path, memory: float | None = None) -> TextTable:
    """Return the table of a delimited text file, whose dialect is found in its first lines.

    ``memory`` (GB) is what reading may take. Raises RecordError for a file that cannot be read or
    needs more, is no text, has no rows of numbers, or could be read in two ways.
    """
    limit = memory_limit(path, memory)
    data = read_bytes(path)
    text = _decoded(path, data)
    if not text.data or text.data.isspace():
        raise RecordError(f"{path}: the file is empty")
    end = text.start_of(HEAD_LINES + 1)
    if end > HEAD_BYTES:
        end = max(text.data.rfind(b"\n", 0, HEAD_BYTES) + 1, text.start_of(FEWEST_HEAD_LINES + 1))
    cells = max(text.data.count((mark or " ").encode(), 0, end) for mark in SEPARATORS) + 1
    limit.check(len(text.data) + end + CELL_BYTES * cells, f"{cells} cells in its first lines")
    dialect = find_dialect(path, [*text.lines(end=end)])
    table = TextTable(path, hashlib.sha256(data).hexdigest(), text, dialect, limit)
    if next(table.rows(), None) is None:
        raise RecordError(f"{path}: no samples below the column names")
    if dialect.comma is None and b"," in text.data:
        comma = has_comma(cells for _, cells in table.rows())
        return replace(table, dialect=dialect._replace(comma=comma))
    return table


def _decoded(path: Path, data: bytes) -> Text:
    """Return the text of a file: UTF-8, UTF-16 with its mark, else Windows-1252 (with latin-1).

    Raises RecordError for bytes that are none of these, and for a null character.
    """

    def no_text(at: int, what: str) -> RecordError:
        line = data.count(b"\n", 0, at) + 1
        return RecordError(f"{path}:{line}: {what}: byte 0x{data[at]:02x}")

    mark, encoding = next(
        (known for known in BYTE_ORDER_MARKS if data.startswith(known[0])), (b"", "utf-8")
    )
    data = data[len(mark) :]
    if encoding == "utf-8" and _is_utf8(data):
        pass
    elif mark:
        try:
            data, encoding = data.decode(encoding).encode(), "utf-8"
        except UnicodeDecodeError as error:
            what = f"not {encoding[:6].rstrip('-').upper()} text"
            raise no_text(error.start, what) from None
    else:
        encoding = "cp1252"
        strange = data.translate(None, TEXT_BYTES)
        if strange:
            raise no_text(data.index(strange[:1]), "neither UTF-8 nor Windows-1252 text")
    if b"\0" in data:
        raise no_text(data.index(b"\0"), "not text")
    if b"\r" in data:
        data = data.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return Text(data, encoding)


def _is_utf8(data: bytes) -> bool:
    if data.isascii():
        return True
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        for at in range(0, len(data), DECODED_BYTES):
            decoder.decode(data[at : at + DECODED_BYTES])
        decoder.decode(b"", final=True)
    except UnicodeDecodeError:
        return False
    return True
