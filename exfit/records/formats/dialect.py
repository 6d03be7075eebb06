"""How a delimited text is written: separator, decimal mark, where the names, units and rows stand.

Without a row of names the columns are called 1, 2, 3 ... What could be read in two ways is refused.
"""

import csv
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import NamedTuple

from exfit.errors import RecordError
from exfit.records.formats.cells import INFINITE, NUMBER, SHOWN, is_missing
from exfit.records.formats.heads import is_units, names_of, units_of
from exfit.records.formats.timestamps import is_timestamp

HEAD = 300  # lines in which the first row of numbers must stand
SEPARATORS: Mapping[str | None, str] = {
    ";": "semicolons", "\t": "tabs", ",": "commas", None: "blanks"
}  # fmt: skip
COMMENTS = ("//", "#", "%", "!", "'", ";")
OPTIONAL = ("", "comment")  # names of a last column that rows may leave out; LabVIEW's is Comment
TOKEN = re.compile(r'"[^"]*"|\S+')
TOKEN_WITH_UNIT = re.compile(r'"[^"]*"|\S+(?:[ \t]+(?:\[[^\[\]]*\]|\([^()]*\)))?')


class Row(NamedTuple):
    """A line of the file, its cells without blanks around them, and whether it is a comment."""

    line: int
    cells: tuple[str, ...]
    text: str = ""
    comment: bool = False


@dataclass(frozen=True)
class Dialect:
    """How a file is written: its rows, each of ``cells`` cells, begin at ``first_line``.

    ``comma`` tells whether it is the decimal mark, None where there is no such mark. A last cell
    that is empty in every row has no name.
    """

    separator: str | None
    comma: bool | None
    names: tuple[str, ...]
    units: Mapping[str, str]
    cells: int
    first_line: int


@dataclass(frozen=True)
class _Layout:
    """A reading of the head with one separator; ``share`` of its rows' cells are values."""

    dialect: Dialect
    share: float
    named: bool
    fault: str | None = None


def is_value(cell: str) -> bool:
    """Tell whether a cell is a number, with a point or a comma, or a timestamp."""
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
    """Tell whether a row, or its first cell, begins with the mark of a comment."""
    return text.lstrip().startswith(tuple(mark for mark in COMMENTS if mark != separator))


def find_dialect(path: Path, head: Sequence[str]) -> Dialect:
    """Return how a file is written, by its first lines.

    Raises RecordError where there are no rows of numbers, where their names do not go with them,
    and where two separators are possible.
    """
    layouts: list[_Layout] = []
    for separator in SEPARATORS:
        if separator is None and any(one.dialect.separator == "\t" for one in layouts):
            continue
        found = _layout(path, head, separator)
        if found is not None and (found.dialect.cells > 1 or separator is None):
            layouts.append(found)
    if not layouts:
        raise _nothing(path, head)
    best = max(layouts, key=_rank)
    like = [one for one in layouts if _rank(one) == _rank(best)]
    if len(like) > 1:
        one, other = (SEPARATORS[layout.dialect.separator] for layout in like[:2])
        line = best.dialect.first_line
        shown = head[line - 1].strip()[:SHOWN]
        raise RecordError(f"{path}:{line}: {one} or {other} could separate the columns: {shown!r}")
    if best.fault is not None:
        raise RecordError(f"{path}:{best.fault}")
    return best.dialect


def _rank(layout: _Layout) -> tuple[bool, bool, float, bool]:
    several = layout.dialect.cells > 1
    return several, layout.share == 1.0 and layout.named, layout.share, layout.named


def _nothing(path: Path, head: Sequence[str]) -> RecordError:
    full = [line for line in head if line.strip()]
    if not full:
        return RecordError(f"{path}: the file is empty: a row of column names belongs there")
    if len(full) == 1:
        list(split_rows(path, head, ",", 1))  # a name without end is told
        return RecordError(f"{path}: no samples below the column names")
    return RecordError(f"{path}: no row of numbers in its first {len(head)} lines")


def _layout(path: Path, head: Sequence[str], separator: str | None) -> _Layout | None:
    """Return the reading of the head with a separator, None where it has no row of numbers."""
    split = split_rows(path, head, separator, 1)
    rows = [_row(line, cells, head[line - 1], separator) for line, cells in split]
    rows = [row for row in rows if any(row.cells)]
    plain = [row for row in rows if not row.comment]
    if not plain:
        return None
    cells = _width(plain)
    own = [row for row in plain if len(row.cells) == cells]
    columns = _value_columns(own[len(own) // 2 :], cells)
    full = [at for at, row in enumerate(rows) if _is_full(row, cells, columns)]
    if not columns or not full:
        return None
    first = full[0]
    damaged = list(takewhile(lambda row: _is_partial(row, cells, columns), rows[:first][::-1]))
    body = damaged[-1] if damaged else rows[first]
    above = rows[: first - len(damaged)]
    ends_empty = not rows[first].cells[-1]
    names, units, fault = _heading(above, body, cells, columns, separator, ends_empty)
    if ends_empty and names[-1:] == ("",):
        names = names[:-1]
    below = [row for row in plain if row.line >= body.line]
    dialect = Dialect(
        separator,
        has_comma(row.cells for row in below),
        names_of(names or ("",) * cells),
        units_of(names, units),
        cells,
        body.line,
    )
    return _Layout(dialect, _share(below), bool(names), fault)


def _row(line: int, cells: list[str], text: str, separator: str | None) -> Row:
    """Return a line of the head, a comment without its mark."""
    comment = is_comment(cells[0], separator)
    if comment:
        mark = next(mark for mark in COMMENTS if cells[0].lstrip().startswith(mark))
        text = text.lstrip().removeprefix(mark)
        first = cells[0].lstrip().removeprefix(mark)
        cells = [first, *cells[1:]] if first or separator is not None else cells[1:]
    return Row(line, tuple(cell.strip() for cell in cells), text, comment)


def _width(rows: Sequence[Row]) -> int:
    """Return how many cells most rows of numbers have; there may be more rows of titles above."""
    shares = [_share_of_full(row) for row in rows]
    for least in (0.5, 0.0, -1.0):
        widths = [len(row.cells) for row, share in zip(rows, shares, strict=True) if share > least]
        if widths:
            break
    counts = Counter(widths)
    return max(counts, key=lambda width: (counts[width], width == len(rows[-1].cells)))


def _share_of_full(row: Row) -> float:
    """Return the share of values in those cells of a row that hold something."""
    full = [is_value(cell) for cell in row.cells if not is_missing(cell)]
    return sum(full) / len(full) if full else 0.0


def _value_columns(rows: Sequence[Row], cells: int) -> list[int]:
    """Return the columns in which at least half of the rows have a value."""
    counts = [sum(is_value(row.cells[at]) for row in rows) for at in range(cells)]
    return [at for at, found in enumerate(counts) if found and 2 * found >= len(rows)]


def _is_full(row: Row, cells: int, columns: Sequence[int]) -> bool:
    if row.comment or len(row.cells) != cells:
        return False
    values = [is_value(row.cells[at]) for at in columns]
    gaps = [is_missing(row.cells[at]) for at in columns]
    return any(values) and all(value or gap for value, gap in zip(values, gaps, strict=True))


def _is_partial(row: Row, cells: int, columns: Sequence[int]) -> bool:
    """Tell whether a row has some of the values that belong there, or too many or too few."""
    if row.comment:
        return False
    if len(row.cells) == cells:
        return any(is_value(row.cells[at]) for at in columns)
    return len(row.cells) > 1 and all(is_value(cell) or is_missing(cell) for cell in row.cells)


def _heading(
    above: Sequence[Row],
    body: Row,
    cells: int,
    columns: Sequence[int],
    separator: str | None,
    ends_empty: bool,
) -> tuple[tuple[str, ...], tuple[str, ...], str | None]:
    """Return names and units of the columns, empty where there are none, and what is wrong."""
    plain = [row for row in above if not row.comment]
    for rows in (plain, [row for row in above if row.comment]):
        fitted = _fitted(rows[-1], cells, separator, ends_empty) if rows else ()
        if not any(fitted) or any(is_value(fitted[at]) for at in columns):
            continue
        if len(rows) > 1 and is_units(fitted):
            names = _fitted(rows[-2], cells, separator, ends_empty)
            if any(name and not is_value(name) for name in names):
                return names, fitted, None
        return fitted, (), None
    last = plain[-1] if plain else body
    if len(last.cells) > 1 and not any(map(is_value, last.cells)):
        fault = f"cells in this row: {len(body.cells)}, columns: {len(last.cells)}"
        return (), (), f"{body.line}: {fault}"
    if (plain and len(last.cells) == cells > 1) or not _is_full(body, cells, columns):
        shown = ", ".join(map(repr, last.cells))[: 2 * SHOWN]
        fault = f"neither a row of names nor one of numbers: {shown}"
        return (), (), f"{last.line}: {fault}"
    return (), (), None


def _fitted(row: Row, cells: int, separator: str | None, ends_empty: bool) -> tuple[str, ...]:
    """Return the cells of a row as names for a row of numbers; none where they do not fit."""
    found = row.cells
    if separator is None and len(found) != cells:
        found = tuple(token.strip('"').strip() for token in TOKEN_WITH_UNIT.findall(row.text))
    if len(found) == cells + 1 and found[-1].casefold() in OPTIONAL:
        found = found[:-1]
    if len(found) == cells - 1 and ends_empty:
        found = (*found, "")
    return found if len(found) == cells else ()


def has_comma(rows: Iterable[Sequence[str]]) -> bool | None:
    """Tell whether the first number with a decimal mark has a comma; None where none has any."""
    for row in rows:
        for cell in map(str.strip, row):
            if NUMBER.fullmatch(cell) and ("," in cell or "." in cell):
                return "," in cell
    return None


def _share(rows: Sequence[Row]) -> float:
    """Return the share of cells that are values, or say that there is none."""
    cells = [cell for row in rows for cell in row.cells]
    return sum(is_value(cell) or is_missing(cell) for cell in cells) / len(cells)
