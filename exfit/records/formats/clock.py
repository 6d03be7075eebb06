"""The time: which columns seem to hold it, and in which unit."""

import re
from collections.abc import Callable, Sequence
from pathlib import Path

from exfit.records.formats.table import Array, column_error
from exfit.records.units import SECONDS, alike, bare, usual

WHOLE = frozenset(  # date and time of day in one
    ("timestamp", "zeitstempel", "zeitpunkt", "datetime", "date_time", "date_&_time",
     "date_+_time", "date+time", "time_stamp", "time_date")
)  # fmt: skip
DATES = frozenset(("date", "datum", "fecha"))
TIMES = re.compile(
    r"t|time|tout|zeit|uhrzeit|tiempo|hora|temps|tempo|tijd|tid|utc|x_value|time_of_day"
    r"|(?:rel|abs|elapsed)[a-z]*_?(?:time|zeit)"
)
BETWEEN = re.compile(r"[\s\-/.]+")


def clock_of(
    names: Sequence[str], stamps: Sequence[str], increases: Callable[[Sequence[str]], bool]
) -> tuple[str, ...]:
    """Return the column that seems to hold the time, or those of date and time of day, or none.

    The names tell it, else what stands behind the last dot in them, as in s.time; else it is what
    ``increases`` throughout, of the columns that hold ``stamps`` or of all the first.
    """
    for ends in (names, [name.rpartition(".")[2] for name in names]):
        called = [BETWEEN.sub("_", bare(end).casefold()) for end in ends]
        named = _named(names, called)
        if named:
            return named
    seeming = (tuple(columns) for columns in (stamps[:2], stamps[:1], names[:1]))
    return next((columns for columns in seeming if columns and increases(columns)), ())


def _named(names: Sequence[str], called: Sequence[str]) -> tuple[str, ...]:
    pairs = [*zip(names, called, strict=True)]
    whole = [name for name, one in pairs if one in WHOLE]
    dates = [name for name, one in pairs if one in DATES]
    times = [name for name, one in pairs if TIMES.fullmatch(one)]
    return tuple(whole[:1] or dates[:1] + times[:1])


def in_seconds(
    path: Path, column: str, numbers: Array, said: str | None, asked: str | None
) -> Array:
    """Return the numbers (M,) of a time column in s.

    ``said`` is the unit that the file itself gives, ``asked`` the one that the reader is told;
    without either it is s. Raises RecordError for a unit that is none of time, and where the two
    contradict each other.
    """
    units = [unit for unit in (said, asked) if unit is not None]
    for unit in units:
        if usual(unit) not in SECONDS:
            raise column_error(path, column, f"{unit} is no unit of time: {', '.join(SECONDS)}")
    if said is not None and asked is not None and not alike(said, asked):
        raise column_error(path, column, f"in {said} as the file says, not in {asked}")
    factor = SECONDS[usual(units[0])] if units else 1.0
    # one over it is whole: no digit of 5 ms is lost
    return numbers / round(1.0 / factor) if factor < 1.0 else numbers * factor
