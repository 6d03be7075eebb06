"""Timestamps: cells such as 2015-09-20T10:51:42.8589222Z or 20-Sep-2015 10:51:42 AM, to seconds.

Every cell of one form is read by the same slices of its characters, so that millions take NumPy
a second. Seconds and their fraction stay whole numbers until the first instant is taken off:
no digit of the file is lost.
"""

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from exfit.records.formats.cells import CELL_SHOWN, MONTHS, timestamp_form
from exfit.util.arrays import Array, Mask

Whole = NDArray[np.int64]
Cells = NDArray[np.bytes_]

MOST_DIGITS = 12  # of a second's fraction
CELLS_AT_A_TIME = 1 << 16
DAY = 86_400  # s
HOURS_NEEDED = ", hours and minutes; minutes and seconds need their hours"
CENTURY = 2000  # of a year in two digits
EITHER = "dmy or mdy"  # order of a date whose first two parts may be either
TO_ZERO = np.array([ord("0") if chr(at).isdigit() and at < 128 else at for at in range(256)], "u1")
MONTHS_A_YEAR, A_MONTH = 12, np.timedelta64(1, "M")


class StampError(ValueError):
    """A fault of the timestamps in a row, counted from 0."""

    def __init__(self, row: int, column: int, text: str) -> None:
        super().__init__(text)
        self.row, self.column = row, column


@dataclass(frozen=True)
class _Stamps:
    """Cells of one kind, each part (M,): a date as three numbers, seconds of the day, fraction."""

    date: NDArray[np.int32] | None  # (M, 3)
    order: str  # ymd, dmy, or EITHER
    second: Whole | None
    fraction: Whole  # in units of the last of MOST_DIGITS digits
    digits: int


def seconds_since_first(cells: Cells) -> Array:
    """Return the instants (M,) in s since the first, of cells (M, 1), or (M, 2) of date and time.

    Raises StampError for a cell that is not a timestamp, has another form than the first, or could
    be two instants.
    """
    stamps = [_read(cells, column) for column in range(cells.shape[1])]
    dates, times = stamps[0], stamps[-1]
    if len(stamps) > 1 and (dates.date is None or dates.second is not None):
        raise StampError(0, 0, f"{_quoted(cells[0, 0])} is not a date alone")
    if len(stamps) > 1 and (times.second is None or times.date is not None):
        raise StampError(0, 1, f"{_quoted(cells[0, 1])} is not a time of day alone")
    second = np.zeros(len(cells), np.int64) if times.second is None else times.second
    second = second - second[0]
    if dates.date is not None:
        days = _days(dates.date, dates.order)
        second += (days - days[0]) * DAY
    elif (back := np.flatnonzero(np.diff(second) < -DAY // 2)).size:
        what = "the time of day passes midnight, and there is no date beside it"
        raise StampError(int(back[0]) + 1, 0, what)
    unit = 10**times.digits
    fraction = times.fraction // 10 ** (MOST_DIGITS - times.digits)
    if np.abs(second).max() > np.iinfo(np.int64).max // (2 * unit):
        row = int(np.abs(second).argmax())
        what = f"{second[row] / DAY:.0f} days from the first timestamp are too many"
        raise StampError(row, 0, what)
    instants: Array = (second * unit + (fraction - fraction[0])) / unit
    return instants


def _read(all_cells: Cells, column: int) -> _Stamps:
    cells = all_cells[:, column]
    first = _form(column, 0, bytes(cells[0]))
    kind = _kind(first)
    date = np.zeros((len(cells), 3), np.int32) if kind[0] else None
    second = np.zeros(len(cells), np.int64) if kind[2] else None
    fraction = np.zeros(len(cells), np.int64)
    digits = 0
    width = cells.itemsize
    letters = all_cells.view(np.uint8)[:, column * width : (column + 1) * width]
    for start in range(0, len(cells), CELLS_AT_A_TIME):
        part = letters[start : start + CELLS_AT_A_TIME]
        shapes = TO_ZERO[part]
        todo = np.ones(len(part), bool)
        while todo.any():
            at = int(todo.argmax())
            form = _form(column, start + at, bytes(cells[start + at]))
            if _kind(form) != kind:
                what = f"{_quoted(cells[start + at])} has another form than {_quoted(cells[0])}"
                raise StampError(start + at, column, f"{what}, the first")
            same = np.flatnonzero(todo & (shapes == shapes[at]).all(axis=1))
            todo[same] = False
            rows, values = start + same, part[same] - ord("0")
            if date is not None:
                date[rows] = _date(values, form)
            if second is not None:
                seconds, wrong = _second(values, form)
                if wrong.any():
                    row = int(rows[wrong.argmax()])
                    what = f"{_quoted(cells[row])} is not a time of day"
                    raise StampError(row, column, what + ("" if form["second"] else HOURS_NEEDED))
                second[rows] = seconds
                own = len(form["fraction"] or "")
                fraction[rows] = _number(values, form, "fraction") * 10 ** (MOST_DIGITS - own)
                digits = max(digits, own)
    return _Stamps(date, kind[1], second, fraction, digits)


def _form(column: int, row: int, cell: bytes) -> re.Match[str]:
    form = timestamp_form().fullmatch(cell.decode("latin-1")) if cell.strip() else None
    if form is None:
        what = f"{_quoted(cell)} is not a timestamp" if cell.strip() else "an empty cell"
        raise StampError(row, column, what)
    return form


def _kind(form: re.Match[str]) -> tuple[bool, str, bool, bool, bool]:
    """Find the form that all timestamps of a column have in common."""
    dated = any(form[part] is not None for part in ("year", "left", "named"))
    # a month in letters fixes the order, and is the second of the three
    ordered = form["mark"] == "." or form["named"] is not None
    order = "ymd" if form["year"] else "dmy" if ordered else EITHER if dated else ""
    return dated, order, form["hour"] is not None, form["half"] is not None, bool(form["zone"])


def _number(values: NDArray[np.uint8], form: re.Match[str], part: str) -> Whole:
    """Return the whole numbers (M,) in a part of the form, 0 where it has none."""
    start, end = form.span(part)
    powers = 10 ** np.arange(end - start - 1, -1, -1, dtype=np.int64)
    return values[:, max(start, 0) : max(end, 0)].astype(np.int64) @ powers


def _date(values: NDArray[np.uint8], form: re.Match[str]) -> Whole:
    """Return year, then the two others in the order of the file."""
    if form["year"]:
        parts = [_number(values, form, part) for part in ("year", "month", "day")]
    elif form["named"]:
        year, day = (_number(values, form, part) for part in ("full", "named"))
        month = MONTHS.index(form["name"].capitalize()) + 1
        parts = [year, day, np.full_like(day, month)]
    else:
        parts = [_number(values, form, part) for part in ("last", "left", "middle")]
    if len(form["last"] or form["full"] or "") == 2:
        parts[0] += CENTURY
    return np.stack(parts, axis=1)


def _second(values: NDArray[np.uint8], form: re.Match[str]) -> tuple[Whole, Mask]:
    """Return the seconds of the day, in UTC where a zone is given, and which are none."""
    hour, minute, second = (_number(values, form, part) for part in ("hour", "minute", "second"))
    wrong = (minute > 59) | (second > 59)
    if form["half"]:
        wrong |= (hour < 1) | (hour > 12)
        hour = hour % 12 + (12 if form["half"] in "pP" else 0)
    wrong |= hour > 23
    zone = _number(values, form, "zonehour") * 60 + _number(values, form, "zoneminute")
    zone *= -1 if form["sign"] == "-" else 1
    return hour * 3600 + minute * 60 + second - zone * 60, wrong


def _days(date: NDArray[np.int32], order: str) -> Whole:
    """Return the days (M,) since 1970 of dates (M, 3).

    Where the first two parts may be day and month or month and day, it is the order in which every
    change is to the next day. Raises StampError where that holds for both, or for none.
    """
    year, left, middle = (part.astype(np.int64) for part in date.T)
    if order == "dmy" or (order == EITHER and (left > MONTHS_A_YEAR).any()):
        return _valid_days(year, middle, left)
    if order != EITHER or (middle > MONTHS_A_YEAR).any():
        return _valid_days(year, left, middle)
    readings = [_valid_days(year, middle, left), _valid_days(year, left, middle)]
    changes = np.flatnonzero(np.any(np.diff(date, axis=0) != 0, axis=1))
    if not changes.size:
        return readings[0]
    daily = [days for days in readings if (np.diff(days)[changes] == 1).all()]
    if len(daily) == 1:
        return daily[0]
    row = int(changes[0]) + 1
    either = f"{left[row]}, {middle[row]} could be day and month, or month and day"
    raise StampError(row, 0, f"{either}; write ISO dates")


def _valid_days(year: Whole, month: Whole, day: Whole) -> Whole:
    wrong = (month < 1) | (month > 12) | (day < 1)
    months = ((year - 1970) * 12 + np.where(wrong, 1, month) - 1).astype("datetime64[M]")
    first = months.astype("datetime64[D]").astype(np.int64)
    length = (months + A_MONTH).astype("datetime64[D]").astype(np.int64) - first
    wrong |= day > length
    if wrong.any():
        row = int(wrong.argmax())
        what = f"year {year[row]}, month {month[row]}, day {day[row]} is not a date"
        raise StampError(row, 0, what)
    return first + day - 1


def _quoted(cell: bytes) -> str:
    return repr(cell.decode("latin-1")[:CELL_SHOWN].strip())
