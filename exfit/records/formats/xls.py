"""The sheets of .xls files, Excel 97 to 2003: how large they become is counted first.

The stream Workbook of a compound file has records ([MS-XLS]). A package holds each sheet as a
rectangle up to its farthest cell.
"""

import struct
from collections.abc import Iterator

from exfit.records.formats.compound import streams
from exfit.records.formats.memory import MemoryLimit
from exfit.records.formats.sheet_size import SheetSize

BOOKS = ("Workbook", "Book")
SHEET, END, DIMENSIONS, TEXTS, CONTINUED, TEXT_CELL, SEVERAL_CELLS = (
    0x85, 0x0A, 0x200, 0xFC, 0x3C, 0xFD, 0xBD
)  # fmt: skip
CELLS = frozenset((0x06, 0x203, 0x204, 0x205, 0x27E, TEXT_CELL, SEVERAL_CELLS))
RESERVED_BYTES = 40  # of each cell that a sheet declares, whether it has it or not


def check(data: bytes, limit: MemoryLimit) -> None:
    """Raise TooLargeError where its sheets need too much, CompoundError where it is damaged."""
    needed = 3 * len(data)
    for name, book in streams(data):
        if name not in BOOKS:
            continue
        kinds = [*_records(book, 0)]
        texts = sum(size for kind, _, size in kinds if kind in (TEXTS, CONTINUED))
        for kind, at, size in kinds:
            if kind == SHEET and size >= 4:
                needed += _memory_of_sheet(book, struct.unpack_from("<I", book, at)[0], texts)
                limit.check(needed, "its sheets")


def _records(book: bytes, start: int) -> Iterator[tuple[int, int, int]]:
    """Yield kind, place and size of each record up to the end of a part."""
    at, kind = start, -1
    while at + 4 <= len(book) and kind != END:
        kind, size = struct.unpack_from("<HH", book, at)
        yield kind, at + 4, min(size, len(book) - at - 4)
        at += 4 + size


def _memory_of_sheet(book: bytes, start: int, texts: int) -> int:
    """Return the bytes that a sheet takes, with all ``texts`` in each cell that shows one."""
    rows = columns = shown = reserved = 0
    for kind, at, size in _records(book, start):
        if kind in CELLS and size >= 6:
            row, column = struct.unpack_from("<HH", book, at)
            if kind == SEVERAL_CELLS:
                (column,) = struct.unpack_from("<H", book, at + size - 2)
            rows, columns = max(rows, row + 1), max(columns, column + 1)
            shown += kind == TEXT_CELL
        elif kind == DIMENSIONS:
            reserved = RESERVED_BYTES * _declared(book[at : at + size])
    return SheetSize(rows, columns).bytes + reserved + shown * texts


def _declared(content: bytes) -> int:
    """Return how many cells a sheet declares; the numbers of its rows are longer since Excel 97."""
    form = {14: "<2I2H2x", 10: "<4H2x"}.get(len(content))
    if form is None:
        return 0
    first, last, left, right = struct.unpack(form, content)
    return int(max(last - first + 1, 0) * max(right - left + 1, 0))
