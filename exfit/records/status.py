"""Flags of a PMU's frames: which rows of a file are no measurements."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.cells import quoted
from exfit.records.formats.table import RecordTable, column_error, listed
from exfit.records.formats.text import TextTable

Mask = NDArray[np.bool_]

# bits of the word STAT of a frame (IEEE Std C37.118.2-2011, table 7)
BITS: Mapping[int, str] = {
    0x8000: "data error", 0x4000: "data error or test mode", 0x2000: "not in synchronism with UTC",
    0x1000: "sorted by arrival, not by time",
}  # fmt: skip
BAD_BITS = sum(BITS)
WORD = 1 << 16  # a word is smaller
GOOD_WORDS = frozenset(("good", "ok", "valid", "g", "normal"))


class Status(NamedTuple):
    """The column of the flags, and its entries that are good; () for those of C37.118."""

    column: str
    accept: tuple[str, ...] = ()


class BadRow(NamedTuple):
    """A row that is no measurement, and its flag."""

    row: int
    flag: str
    why: str


def bad_rows(table: RecordTable, status: Status) -> tuple[BadRow, ...]:
    """Return the rows of a file that its flags call bad.

    Numbers, also hexadecimal as 0x2000, are the word STAT of C37.118: bad are those with a data
    error, without synchronism or sorted by arrival. Of other words those are good that say so.
    Raises RecordError for a column that is not there, and for flags 0 and 1, which may mean either,
    without ``accept``.
    """
    flags = _flags(table, status.column)
    if status.accept:
        good = {_plain(entry) for entry in status.accept}
        return tuple(
            BadRow(row, flag, f"accepted: {listed(status.accept)}")
            for row, flag in enumerate(flags)
            if _plain(flag) not in good
        )
    _refuse_ambiguous(table, status, flags)
    why = {flag: _fault(flag) for flag in set(flags)}
    return tuple(BadRow(row, flag, why[flag]) for row, flag in enumerate(flags) if why[flag])


def _refuse_ambiguous(table: RecordTable, status: Status, flags: Sequence[str]) -> None:
    """Raise a RecordError where all flags are 0 or 1 and both occur, or all are 1."""
    if {_plain(flag) for flag in flags} in ({"0", "1"}, {"1"}):
        what = "holds 0 and 1, of which either may be good: record.status.accept says which"
        raise column_error(table.path, status.column, what)


def _fault(flag: str) -> str:
    """Describe the fault of a row by its flag, "" where there is none."""
    word = _word(flag)
    if word is None:
        return "" if flag.strip().casefold() in GOOD_WORDS else "not one of good, ok, valid"
    if not 0 <= word < WORD:
        return f"no word of 16 bits: 0 ... {WORD - 1}"
    return " and ".join(text for bit, text in BITS.items() if word & bit)


def _word(flag: str) -> int | None:
    """Return the number that a flag is, in decimal or hexadecimal digits; None for words."""
    text = flag.strip().casefold()
    try:
        if text.startswith("0x"):
            return int(text, 16)
        if text.endswith("h"):
            return int(text[:-1], 16)
        return int(float(text))
    except (ValueError, OverflowError):
        return None


def _plain(flag: str) -> str:
    word = _word(flag)
    return flag.strip().casefold() if word is None else str(word)


def _flags(table: RecordTable, column: str) -> list[str]:
    """Return the entries of a column as texts."""
    try:
        return [f"{flag:.0f}" for flag in table.numbers([column])[column]]
    except RecordError:
        if column not in table.names or not isinstance(table, TextTable):
            raise
    at = table.names.index(column)
    return [cells[at] for _, cells in table.rows() if at < len(cells)]


def status_error(table: RecordTable, status: Status, rows: Sequence[BadRow]) -> RecordError:
    """Return the error of a file with bad rows: the first of them, how many, what to do."""
    first = rows[0]
    return column_error(
        table.place(first.row),
        status.column,
        f"status {quoted(first.flag)}: {first.why} ({len(rows)} rows are not valid); "
        "gaps: skip leaves them out, record.window begins or ends beside them",
    )
