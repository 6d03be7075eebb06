"""The dialect of a delimited text: separator, decimal mark, rows of names, units and numbers.

Without a row of names the columns are called 1, 2, 3 ... What could be read in two ways is refused.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from exfit.errors import RecordError
from exfit.records.formats.cells import (
    CELL_SHOWN,
    INFINITE,
    NUMBER,
    are_channel_types,
    is_missing,
    is_timestamp,
    is_units,
    names_of,
    units_of,
)

SEPARATORS: Mapping[str | None, str] = {
    ";": "semicolons", "\t": "tabs", ",": "commas", None: "spaces"
}  # fmt: skip
COMMENT_MARKS = ("//", "#", "%", "!", "'", ";")
OPTIONAL_NAMES = ("", "comment")  # of a last column that rows may leave out; LabVIEW's is Comment
TOKEN = re.compile(r'"[^"]*"|\S+')
TOKEN_WITH_UNIT = re.compile(r'"[^"]*"|\S+(?:[ \t]+(?:\[[^\[\]]*\]|\([^()]*\)))?')


class TextRow(NamedTuple):
    """A line of the file: its cells without spaces around them, and which of them are values."""

    line: int
    cells: tuple[str, ...]
    values: tuple[bool, ...]
    text: str
    comment: bool

    @property
    def known(self) -> list[bool]:
        """Which cells are values, or say that there is none."""
        return [
            value or is_missing(cell) for cell, value in zip(self.cells, self.values, strict=True)
        ]


class Dialect(NamedTuple):
    """How a file is written: its rows, each of ``cells`` cells, begin at ``first_line``.

    ``comma`` is whether it is the decimal mark, None where there is no such mark. A last cell
    that is empty in every row has no name.
    """

    separator: str | None
    comma: bool | None
    names: tuple[str, ...]
    units: Mapping[str, str]
    cells: int
    first_line: int


class _Layout(NamedTuple):
    """A reading of the head with one separator; ``share`` of its rows' cells are values."""

    dialect: Dialect
    share: float
    named: bool
    fault: str | None

    @property
    def rank(self) -> tuple[bool, bool, float, bool]:
        """How plausible the reading is; the largest rank is the best."""
        several = self.dialect.cells > 1
        return several, self.share == 1.0 and self.named, self.share, self.named


class _Shape(NamedTuple):
    """What rows of numbers have in common: how many cells, and values in which columns."""

    separator: str | None
    cells: int
    columns: Sequence[int]
    ends_empty: bool


class _Heading(NamedTuple):
    """Names and units of the columns, empty where there are none, and what is wrong with them."""

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    fault: str | None = None


def is_value(cell: str) -> bool:
    """Check for a number, with a point or a comma, or a timestamp."""
    return bool(NUMBER.fullmatch(cell) or INFINITE.fullmatch(cell)) or is_timestamp(cell)


def split_rows(
    path: Path, lines: Iterable[str], separator: str | None, first_line: int
) -> Iterator[tuple[int, list[str]]]:
    """Yield line number and cells of each row that is not blank; raises RecordError."""
    if separator is None:
        for number, line in enumerate(lines, first_line):
            tokens = [token.strip('"') for token in TOKEN.findall(line)]
            if tokens:
                yield number, tokens
        return
    reader = csv.reader(lines, delimiter=separator)
    try:
        for row in reader:
            if row:
                yield first_line + reader.line_num - 1, row
    except csv.Error as error:
        at = first_line + reader.line_num - 1
        raise RecordError(f"{path}:{at}: cannot be read: {error}") from None


def is_comment(text: str, separator: str | None) -> bool:
    """Check whether a row, or its first cell, begins with the mark of a comment."""
    return text.lstrip().startswith(tuple(mark for mark in COMMENT_MARKS if mark != separator))


def has_comma(rows: Iterable[Sequence[str]]) -> bool | None:
    """Check the first number with a decimal mark for a comma; None where none has any."""
    for row in rows:
        for cell in map(str.strip, row):
            if NUMBER.fullmatch(cell) and ("," in cell or "." in cell):
                return "," in cell
    return None


def find_dialect(path: Path, head: Sequence[str]) -> Dialect:
    """Find the dialect of a file by its first lines.

    Raises RecordError where there are no rows of numbers, where their names do not fit them,
    and where two separators are possible.
    """
    layouts = _layouts(path, head)
    if not layouts:
        raise _no_numbers(path, head)
    best = max(layouts, key=lambda layout: layout.rank)
    equal = [layout for layout in layouts if layout.rank == best.rank]
    if len(equal) > 1:
        first, second = (SEPARATORS[layout.dialect.separator] for layout in equal[:2])
        line = best.dialect.first_line
        text = head[line - 1].strip()[:CELL_SHOWN]
        raise RecordError(
            f"{path}:{line}: {first} or {second} could separate the columns: {text!r}"
        )
    if best.fault is not None:
        raise RecordError(f"{path}:{best.fault}")
    return best.dialect


def _layouts(path: Path, head: Sequence[str]) -> list[_Layout]:
    """Return the readings of the head with each separator that it has; spaces only without tabs."""
    layouts: list[_Layout] = []
    for separator in SEPARATORS:
        if separator is not None and not any(separator in line for line in head):
            continue
        if separator is None and layouts:
            tabs = any(layout.dialect.separator == "\t" for layout in layouts)
            if tabs or not any(len(line.split(maxsplit=1)) > 1 or '"' in line for line in head):
                continue
        layout = _layout(path, head, separator)
        if layout is not None and (layout.dialect.cells > 1 or separator is None):
            layouts.append(layout)
    return layouts


def _no_numbers(path: Path, head: Sequence[str]) -> RecordError:
    filled = [line for line in head if line.strip()]
    if not filled:
        return RecordError(f"{path}: the file is empty")
    if len(filled) == 1:
        list(split_rows(path, head, ",", 1))  # raises for a name without end
        return RecordError(f"{path}: no samples below the column names")
    return RecordError(f"{path}: no row of numbers in its first {len(head)} lines")


def _layout(path: Path, head: Sequence[str], separator: str | None) -> _Layout | None:
    """Return the reading of the head with a separator, None where it has no row of numbers."""
    rows = _filled_rows(path, head, separator)
    plain = [row for row in rows if not row.comment]
    if not plain:
        return None
    cells = _width(plain)
    columns = _value_columns(plain, cells)
    first = next((at for at, row in enumerate(rows) if _is_full(row, cells, columns)), None)
    if first is None:
        return None
    shape = _Shape(separator, cells, columns, ends_empty=not rows[first].cells[-1])
    damaged = [*takewhile(lambda row: _is_partial(row, shape), reversed(rows[:first]))]
    start = first - len(damaged)
    heading = _heading(rows[:start], rows[start], shape)
    first_line = rows[start].line
    below = [row for row in plain if row.line >= first_line]
    known = [cell for row in below for cell in row.known]
    dialect = Dialect(
        separator,
        has_comma(row.cells for row in below),
        names_of(heading.names or ("",) * cells),
        units_of(heading.names, heading.units),
        cells,
        first_line,
    )
    return _Layout(dialect, sum(known) / len(known), bool(heading.names), heading.fault)


def _filled_rows(path: Path, head: Sequence[str], separator: str | None) -> list[TextRow]:
    split = split_rows(path, head, separator, 1)
    rows = [_row(line, cells, head[line - 1], separator) for line, cells in split]
    return [row for row in rows if any(row.cells)]


def _row(line: int, cells: list[str], text: str, separator: str | None) -> TextRow:
    """Return a line of the head, a comment without its mark."""
    comment = is_comment(cells[0], separator)
    if comment:
        mark = next(mark for mark in COMMENT_MARKS if cells[0].lstrip().startswith(mark))
        text = text.lstrip().removeprefix(mark)
        first = cells[0].lstrip().removeprefix(mark)
        cells = [first, *cells[1:]] if first or separator is not None else cells[1:]
    stripped = tuple(cell.strip() for cell in cells)
    return TextRow(line, stripped, tuple(map(is_value, stripped)), text, comment)


def _width(rows: Sequence[TextRow]) -> int:
    """Count the cells of most rows of numbers; there may be more rows of titles above."""
    shares = []
    for row in rows:  # the share of values in those cells that hold something
        values, missing = sum(row.values), row.known.count(True) - sum(row.values)
        shares.append(values / max(len(row.cells) - missing, 1))
    for least in (0.5, 0.0, -1.0):
        widths = [len(row.cells) for row, share in zip(rows, shares, strict=True) if share > least]
        if widths:
            break
    counts = Counter(widths)
    return max(counts, key=lambda width: (counts[width], width == len(rows[-1].cells)))


def _value_columns(rows: Sequence[TextRow], cells: int) -> list[int]:
    """Return the columns in which at least half of the later rows have a value."""
    complete = [row for row in rows if len(row.cells) == cells]
    later = complete[len(complete) // 2 :]
    counts = [sum(row.values[at] for row in later) for at in range(cells)]
    return [at for at, count in enumerate(counts) if count and 2 * count >= len(later)]


def _is_full(row: TextRow, cells: int, columns: Sequence[int]) -> bool:
    """Check for a row with the values that belong there, or signs that one is missing."""
    if row.comment or len(row.cells) != cells:
        return False
    known = row.known
    return any(row.values[at] for at in columns) and all(known[at] for at in columns)


def _is_partial(row: TextRow, shape: _Shape) -> bool:
    """Check for a row with some of the values that belong there, or too many or too few."""
    if row.comment:
        return False
    if len(row.cells) == shape.cells:
        return any(row.values[at] for at in shape.columns)
    return len(row.cells) > 1 and all(row.known)


def _heading(above: Sequence[TextRow], first: TextRow, shape: _Shape) -> _Heading:
    """Read the names of columns in the rows above the ``first`` row of numbers."""
    plain = [row for row in above if not row.comment]
    for rows in (plain, [row for row in above if row.comment]):
        fitted = [_fitted(row, shape) for row in rows]
        # a JSIS file has rows of names, types of channels, units and descriptions
        types = next((at for at, row in enumerate(rows) if are_channel_types(row.cells)), 0)
        if 0 < types < len(rows) - 1 and any(fitted[types - 1]) and is_units(fitted[types + 1]):
            return _Heading(fitted[types - 1], fitted[types + 1])
        heading = _named(fitted, shape)
        if heading is not None:
            return heading
    return _Heading(fault=_fault_of_names(plain, first, shape))


def _named(rows: Sequence[tuple[str, ...]], shape: _Shape) -> _Heading | None:
    """Return the names in the last row, or those above a row of units; None where it has none."""
    names = rows[-1] if rows else ()
    if not any(names) or any(is_value(names[at]) for at in shape.columns):
        return None
    above = rows[-2] if len(rows) > 1 and is_units(names) else ()
    if any(name and not is_value(name) for name in above):
        return _Heading(above[:-1] if shape.ends_empty and not above[-1] else above, names)
    return _Heading(names[:-1] if shape.ends_empty and not names[-1] else names)


def _fault_of_names(plain: Sequence[TextRow], first: TextRow, shape: _Shape) -> str | None:
    """Describe the fault of the row above the numbers, None where it may be a title."""
    last = plain[-1] if plain else first
    if len(last.cells) > 1 and not any(last.values):
        return f"{first.line}: cells in this row: {len(first.cells)}, columns: {len(last.cells)}"
    unfit = bool(plain) and len(last.cells) == shape.cells > 1
    if unfit or not _is_full(first, shape.cells, shape.columns):
        text = ", ".join(map(repr, last.cells))[: 2 * CELL_SHOWN]
        return f"{last.line}: neither a row of names nor one of numbers: {text}"
    return None


def _fitted(row: TextRow, shape: _Shape) -> tuple[str, ...]:
    """Return the cells of a row as names for a row of numbers; none where they do not fit."""
    cells = row.cells
    if shape.separator is None and len(cells) != shape.cells:
        cells = tuple(token.strip('"').strip() for token in TOKEN_WITH_UNIT.findall(row.text))
    if len(cells) == shape.cells + 1 and cells[-1].casefold() in OPTIONAL_NAMES:
        cells = cells[:-1]
    if len(cells) == shape.cells - 1 and shape.ends_empty:
        cells = (*cells, "")
    return cells if len(cells) == shape.cells else ()
