"""How large the sheets of a workbook become, counted in its XML before a package reads it.

A sheet is held as a rectangle from its first cell to its farthest, blank cells and all.
"""

import re
from collections.abc import Iterator, Mapping
from itertools import chain
from typing import NamedTuple

from exfit.records.formats.memory import MemoryLimit

CELL_BYTES = 130  # that a cell takes as a package and then Python hold it
SHEET = b"sheetData"
SHORT = 1_000_000  # bytes of a sheet whose cells are looked at one by one in a moment
LETTERS = 26

# a tag of a cell that does not say first that it lies in A1 ... Z99999
NOT_NEAR = re.compile(rb'<c(?! r="[A-Z][0-9]{1,5}"|[A-Za-z])')
PREFIXED = re.compile(rb":(?=c)")
ATTRIBUTES = rb"""((?:[^>"']|"[^"]*"|'[^']*')*)>"""
ROW_OR_CELL = re.compile(rb"<(?:[\w.-]+:)?(row|c)(?=[\s/>])" + ATTRIBUTES)
PLACE = re.compile(rb"""(?<![\w:.-])r\s*=\s*["']([A-Za-z]*)([0-9]*)["']""")
SHARED_TEXT = re.compile(rb"si>")
SHOWS_TEXT = re.compile(rb"""t\s*=\s*["']s["']""")
OPEN_ROW_OR_CELL = re.compile(rb"<(?:[\w.-]+:)?(table-row|(?:covered-)?table-cell)" + ATTRIBUTES)
REPEATED = re.compile(rb"""repeated\s*=\s*["']([0-9]+)["']""")


class SheetSize(NamedTuple):
    """The rectangle that holds all cells of a sheet, from its first row and column on."""

    rows: int
    columns: int

    @property
    def bytes(self) -> int:
        """What its cells take."""
        return CELL_BYTES * self.rows * self.columns


NEAR = SheetSize(99_999, 26)  # up to Z99999: the cells of most records lie in it


def check_sheets(entries: Mapping[str, bytes], limit: MemoryLimit) -> None:
    """Raise TooLargeError where the sheets of a workbook, its entries by name, need too much."""
    others = (data for data in entries.values() if SHEET not in data)
    longest = max(map(_longest_text, others), default=0)
    needed = 0
    for name, data in entries.items():
        if SHEET in data:
            needed += longest * sum(1 for _ in SHOWS_TEXT.finditer(data)) if longest else 0
            room = limit.most - needed
            size = NEAR if NEAR.bytes < room / 2 and _is_near(data) else _size_of_sheet(data)
        elif b"table-row" in data:
            size = _size_of_open_sheets(data)
        else:
            continue
        needed += len(data) + size.bytes
        what = f"{name}: {size.rows} rows of {size.columns} columns, up to its farthest cell"
        limit.check(needed, what)


def _longest_text(data: bytes) -> int:
    """Return the length of the longest of the texts that cells share, or a little more."""
    longest = start = 0
    for end in SHARED_TEXT.finditer(data):
        longest, start = max(longest, end.start() - start), end.end()
    return longest


def _is_near(data: bytes) -> bool:
    """Return whether a sheet of Excel is long, and surely none of its cells beyond Z99999."""
    return len(data) > SHORT and PREFIXED.search(data) is None and NOT_NEAR.search(data) is None


def _size_of_sheet(data: bytes) -> SheetSize:
    """Return the size of a sheet of Excel; blank cells do not count."""
    rows = columns = column = 0
    row = -1
    for kind, blank, letters, number in _places(data):
        if number:
            row = int(number) - 1
        elif kind == b"row":
            row += 1
        if kind == b"row":
            column = 0
            continue
        column = (_number_of(letters) if letters else column) + 1
        if not blank:
            rows, columns = max(rows, row + 1), max(columns, column)
    return SheetSize(rows, columns)


def _places(data: bytes) -> Iterator[tuple[bytes, bool, bytes, bytes]]:
    """Yield of each row and cell its kind, whether it is blank, and the two parts of its place."""
    for tag in ROW_OR_CELL.finditer(data):
        place = PLACE.search(tag[2])
        yield tag[1], tag[2].endswith(b"/"), *((place[1], place[2]) if place else (b"", b""))


def _number_of(letters: bytes) -> int:
    """Return the number of a column, counted from 0, by its letters."""
    number = 0
    for letter in letters.upper():
        number = LETTERS * number + letter - ord("A") + 1
    return number - 1


def _size_of_open_sheets(data: bytes) -> SheetSize:
    """Return the size of the sheets of an OpenDocument, one below the other.

    Blank cells and rows count only where others follow.
    """
    rows = columns = 0
    blank_rows = repeated_rows = width = blank_cells = 0
    for tag in chain(OPEN_ROW_OR_CELL.finditer(data), [None]):
        if tag is None or tag[1] == b"table-row":
            blank_rows += repeated_rows
            if width:
                rows, blank_rows, columns = rows + blank_rows, 0, max(columns, width)
            width = blank_cells = 0
        if tag is None:
            break
        number = REPEATED.search(tag[2])
        repeated = int(number[1]) if number else 1
        if tag[1] == b"table-row":
            repeated_rows = repeated
        else:
            blank_cells += repeated
            if not tag[2].endswith(b"/") or b"value" in tag[2]:
                width, blank_cells = width + blank_cells, 0
    return SheetSize(rows, columns)
