"""The clock of a record: the columns that hold the time, its unit, and its validity."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exfit.errors import RecordError
from exfit.records.epoch import EpochError, from_first, is_epoch, of_soc, soc_columns
from exfit.records.formats.table import Array, column_error
from exfit.records.units import SECONDS, alike, bare, usual
from exfit.util.magnitude import LARGEST
from exfit.util.sorting import median

TIMESTAMP_NAMES = frozenset(  # date and time of day in one column
    ("timestamp", "zeitstempel", "zeitpunkt", "datetime", "date_time", "date_&_time",
     "date_+_time", "date+time", "time_stamp", "time_date")
)  # fmt: skip
DATE_NAMES = frozenset(("date", "datum", "fecha"))
TIME_NAME = re.compile(
    r"t|time|tout|zeit|uhrzeit|tiempo|hora|temps|tempo|tijd|tid|utc|x_value|time_of_day"
    r"|(?:rel|abs|elapsed)[a-z]*_?(?:time|zeit)"
)
SHORTEST_STEP = 1e-12  # s, between most samples: no recorder is as fast
WORD_SEPARATOR = re.compile(r"[\s\-/.]+")


class Clock(NamedTuple):
    """The column with the time, or those of date and time of day; the unit where it is numbers."""

    columns: tuple[str, ...]
    unit: str | None = None

    @property
    def label(self) -> str:
        """The columns as messages name them."""
        kind = "column" if len(self.columns) == 1 else "columns"
        return f"{kind} {' and '.join(map(repr, self.columns))}"


def find_clock(
    names: Sequence[str], stamps: Sequence[str], increases: Callable[[Sequence[str]], bool]
) -> tuple[str, ...]:
    """Return the column that seems to hold the time, or those of date and time of day, or none.

    The names decide, else what follows the last dot in them, as in s.time; else it is what
    ``increases`` throughout, of the columns that hold ``stamps`` or of all the first.
    """
    for endings in (names, [name.rpartition(".")[2] for name in names]):
        words = [WORD_SEPARATOR.sub("_", bare(ending).casefold()) for ending in endings]
        named = _by_name(dict(zip(names, words, strict=True)))
        if named:
            return named
    candidates = (tuple(columns) for columns in (stamps[:2], stamps[:1], names[:1]))
    return next((columns for columns in candidates if columns and increases(columns)), ())


def _by_name(words: dict[str, str]) -> tuple[str, ...]:
    """Return the columns of the time, given the plain words of each name."""
    soc = soc_columns(words)
    if soc:
        return soc
    stamps = [name for name, word in words.items() if word in TIMESTAMP_NAMES]
    dates = [name for name, word in words.items() if word in DATE_NAMES]
    times = [name for name, word in words.items() if TIME_NAME.fullmatch(word)]
    return tuple(stamps[:1] or dates[:1] + times[:1])


def in_seconds(
    path: Path, column: str, numbers: Array, stated: str | None, requested: str | None
) -> Array:
    """Return the numbers (M,) of a time column in s.

    ``stated`` is the unit that the file itself gives, ``requested`` the one that the caller gives;
    without either it is s, or an epoch. Epochs count from the first sample. Raises RecordError for
    a unit that is none of time, and where the two contradict each other.
    """
    units = [unit for unit in (stated, requested) if unit is not None]
    for unit in units:
        if usual(unit) not in SECONDS:
            raise column_error(path, column, f"{unit} is not a unit of time: {', '.join(SECONDS)}")
    if stated is not None and requested is not None and not alike(stated, requested):
        raise column_error(path, column, f"in {stated} as the file says, not in {requested}")
    if not units:
        return from_first(numbers)
    factor = SECONDS[usual(units[0])]
    # the reciprocal is a whole number: no digit of 5 ms is lost
    seconds = numbers / round(1.0 / factor) if factor < 1.0 else numbers * factor
    return seconds - seconds[0] if is_epoch(seconds) else seconds


def soc_in_seconds(path: Path, columns: Sequence[str], numbers: Mapping[str, Array]) -> Array:
    """Return the time (M,) in s since the first sample, of the columns SOC and FRACSEC.

    Raises RecordError where they are no such counts.
    """
    second, fraction = columns
    try:
        return of_soc(numbers[second], numbers[fraction])
    except EpochError as fault:
        raise column_error(path, columns[fault.column], str(fault)) from None


def check_finite(time: Array, label: str, place: Callable[[int], str]) -> None:
    """Raise a RecordError where time is no number to compute with; ``place`` names a sample."""
    lost = np.flatnonzero(~(np.abs(time) <= LARGEST))
    if lost.size:
        number = time[lost[0]]
        raise RecordError(f"{place(int(lost[0]))}: {label}: {number} {why_unusable(number)}")


def why_unusable(number: float) -> str:
    """Return why a number of a record is none to compute with."""
    return f"exceeds {LARGEST:g}" if np.isfinite(number) else "is not a finite number"


def check_steps(time: Array, label: str, place: Callable[[int], str]) -> None:
    """Raise a RecordError where most samples (M,) follow each other closer than a recorder's."""
    steps = np.diff(time)
    if steps.min(initial=np.inf) >= SHORTEST_STEP:
        return
    forward = steps[steps > 0.0]
    if forward.size and (step := float(median(forward))) < SHORTEST_STEP:
        at = int(np.argmax((steps > 0.0) & (steps <= step))) + 1
        raise RecordError(
            f"{place(at)}: {label}: {step:g} s after the sample before, as most are: closer than "
            f"{SHORTEST_STEP:g} s"
        )


def check_increasing(
    time: Array, label: str, place: Callable[[int], str], may_repeat: bool = False
) -> None:
    """Raise a RecordError where time does not increase; ``place`` names a sample, from 0."""
    steps = np.diff(time)
    back = np.flatnonzero(steps < 0.0 if may_repeat else steps <= 0.0)
    if back.size:
        before, now = time[back[0]], time[back[0] + 1]
        fault = f"{now} s repeats" if now == before else f"goes back from {before} s to {now} s"
        raise RecordError(f"{place(int(back[0]) + 1)}: {label}: time {fault}")
