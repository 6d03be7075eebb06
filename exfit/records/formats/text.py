"""Delimited text: what recorders, spreadsheets and simulators write as .csv, .txt, .tsv, .dat."""

import hashlib
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.clock import are_soc, find_clock, in_seconds, soc_in_seconds
from exfit.records.formats.cells import is_missing, is_number, quoted, why_not
from exfit.records.formats.decoding import Text, decoded
from exfit.records.formats.dialect import (
    Dialect,
    find_dialect,
    has_comma,
    head_of,
    is_comment,
    split_rows,
)
from exfit.records.formats.memory import MemoryLimit, memory_limit
from exfit.records.formats.table import (
    NONE,
    Array,
    column_error,
    increases,
    position,
    positions,
    read_bytes,
)
from exfit.records.formats.timestamps import (
    WIDEST,
    WIDEST_OF_TWO,
    StampError,
    is_timestamp,
    seconds_since_first,
)

SCANNED_BYTES = 1 << 22  # looked at together
STAMP_BYTES = 120  # of a row, while timestamps become numbers


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
        """Return columns (M,) unconverted, nan where a sample is missing in a ``gappy`` one.

        Raises RecordError for a column that is not there, and a cell that is no number.
        """
        names = [*names]
        self.limit.check_columns([self._count] * len(names), len(self.text.data))
        places = positions(self.path, self.names, names)
        if not self._even:
            self._find_fault(places, gappy)
        data = self._load(places, gappy)
        return {name: data[:, at] for at, name in enumerate(places)}

    def instants(self, columns: Sequence[str], unit: str | None = None) -> Array:
        """Return the time (M,) in s; of timestamps and epochs, since the first of them.

        ``unit`` is that of the numbers: s, ms, us or min; None: as the file says, else s. Raises
        RecordError where it contradicts the file, or a cell is neither number nor timestamp.
        """
        places = [position(self.path, self.names, name) for name in columns]
        if are_soc(columns):
            return soc_in_seconds(self.path, columns, self.numbers(columns))
        _, first = next(self.rows())
        stamped = len(places) > 1 or (places[0] < len(first) and is_timestamp(first[places[0]]))
        if not stamped:
            (name,) = columns
            numbers = self.numbers([name])[name]
            return in_seconds(self.path, name, numbers, self.units.get(name), unit)
        if unit is not None:
            what = f"{quoted(first[places[0]])} is a timestamp, not a number of {unit}"
            raise column_error(self.path, columns[0], what)
        return self._stamps(columns, places)

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
        """The byte at which the rows begin."""
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
        if self._even:
            return lines
        return (line for line in lines if not self._is_skipped(line))

    def _is_skipped(self, line: str) -> bool:
        """Check for a comment, which is no row that begins with its mark."""
        separator = self.dialect.separator
        if not is_comment(line, separator):
            return False
        _, cells = next(split_rows(self.path, [line], separator, 1))
        return len(cells) != self.dialect.cells

    def _numeric_lines(self) -> Iterator[str]:
        """Return the lines of the rows with decimal points; what had one before is no number."""
        lines = self._lines()
        if not self.dialect.comma:
            return lines
        if self.dialect.separator == ",":
            quoted = re.compile(r'"([^",\n]*),([^",\n]*)"')
            return (quoted.sub(r"\1.\2", line.replace(".", ":")) for line in lines)
        if self.text.data.find(b".", self._start) >= 0:
            return (line.replace(".", ":").replace(",", ".") for line in lines)
        return (line.replace(",", ".") for line in lines)

    def _load(
        self, places: Mapping[str, int], gappy: frozenset[str], cell_by_cell: frozenset[str] = NONE
    ) -> Array:
        """Return the columns as NumPy's C reader reads them; where it fails, say where and why.

        Where only missing cells of the ``gappy`` columns stopped it, these are read one by one.
        """
        converters: dict[int | str, Callable[[str], float]] = {
            places[name]: _number_or_nan for name in cell_by_cell if name in places
        }
        try:
            return self._loaded(
                self._numeric_lines(), tuple(places.values()), float, converters=converters
            )
        except ValueError as error:
            self._find_fault(places, gappy)
            if cell_by_cell != gappy:
                return self._load(places, gappy, gappy)
            raise RecordError(f"{self.path}: {error}") from None

    def _loaded(
        self,
        lines: Iterable[str],
        places: Sequence[int],
        kind: Any,
        converters: Mapping[int | str, Callable[[str], float]] | None = None,
    ) -> NDArray[Any]:
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

    def _find_fault(self, places: Mapping[str, int], gappy: frozenset[str]) -> None:
        """Raise a RecordError for the first row that is ragged or holds text in a number."""
        comma = self.dialect.comma
        for line, row in self.rows():
            self._check_width(line, row)
            for name, place in places.items():
                cell = row[place].strip()
                if is_number(cell, comma) or (name in gappy and is_missing(cell)):
                    continue
                raise column_error(f"{self.path}:{line}", name, why_not(cell, comma))

    def _check_width(self, line: int, row: Sequence[str]) -> None:
        """Raise a RecordError for a row of more or fewer cells than there are columns."""
        named = len(self.names)
        if len(row) == self.dialect.cells and not any(cell.strip() for cell in row[named:]):
            return
        cells = len(row) - (named < self.dialect.cells and not row[-1].strip())
        raise RecordError(f"{self.path}:{line}: cells in this row: {cells}, columns: {named}")

    def _stamps(self, columns: Sequence[str], places: Sequence[int]) -> Array:
        """Return timestamps of one column, or of two, in s since the first."""
        needed = len(self.text.data) + STAMP_BYTES * self._count * len(places)
        self.limit.check(needed, f"{self._count} timestamps")
        if not self._even:
            for line, row in self.rows():
                self._check_width(line, row)
        try:
            width = WIDEST if len(places) == 1 else WIDEST_OF_TWO
            cells = self._loaded(self._lines(), places, f"S{width}")
        except ValueError as error:
            for line, row in self.rows():
                self._check_width(line, row)  # quoted cells may hold separators
                for name, place in zip(columns, places, strict=True):
                    if not is_timestamp(row[place]):
                        what = f"{quoted(row[place])} is not a timestamp"
                        raise column_error(f"{self.path}:{line}", name, what) from None
            raise RecordError(f"{self.path}: {error}") from None
        try:
            return seconds_since_first(cells)
        except StampError as error:
            raise column_error(self.place(error.row), columns[error.column], str(error)) from None


def read_text_table(path: Path, memory: float | None = None) -> TextTable:
    """Return the table of a delimited text file, whose dialect is found in its first lines.

    ``memory`` (GB) is what reading may take. Raises RecordError for a file that cannot be read or
    needs more, is no text, has no rows of numbers, or could be read in two ways.
    """
    limit = memory_limit(path, memory)
    data = read_bytes(path)
    text = decoded(path, data)
    if not text.data or text.data.isspace():
        raise RecordError(f"{path}: the file is empty")
    dialect = find_dialect(path, head_of(text, limit))
    table = TextTable(path, hashlib.sha256(data).hexdigest(), text, dialect, limit)
    if next(table.rows(), None) is None:
        raise RecordError(f"{path}: no samples below the column names")
    if dialect.comma is None and b"," in text.data:
        comma = has_comma(cells for _, cells in table.rows())
        return replace(table, dialect=replace(dialect, comma=comma))
    return table


def _number_or_nan(cell: str) -> float:
    return np.nan if is_missing(cell) else float(cell)
