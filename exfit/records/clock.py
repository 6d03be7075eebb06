"""The clock of a record: the columns that hold the time, its unit, epochs, and its validity."""

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exfit.errors import RecordError
from exfit.records.formats.table import column_error
from exfit.records.units import SECONDS, alike, bare, usual
from exfit.util.arrays import Array, median
from exfit.util.text import LARGEST

TIMESTAMP_NAME = re.compile(  # date and time of day in one column
    r"zeitstempel|zeitpunkt|time_?stamp|datetime|date(?:_|_?\+_?|_&_)time|time_date"
)
DATE_NAME = re.compile(r"date|datum|fecha")
TIME_NAME = re.compile(
    r"t|time|tout|zeit|uhrzeit|tiempo|hora|temps|tempo|tijd|tid|utc|x_value|time_of_day"
    r"|(?:rel|abs|elapsed)[a-z]*_?(?:time|zeit)"
)
SHORTEST_STEP = 1e-12  # s, between most samples: no recorder is as fast
WORD_SEPARATOR = re.compile(r"[\s\-/.]+")
SOC_NAME = re.compile(r"soc|sec(?:ond)?s?_of_(?:the_)?century")
FRACTION_NAME = re.compile(r"frac_?sec(?:onds?)?|fraction(?:_of_(?:a_)?second)?|sec_?frac")
EPOCHS = (6.3e8, 4.2e9)  # s since 1970: from 1990 to 2103
TICKS = (1.0, 1e3, 1e6, 1e9)  # a second: epochs count s, ms, us or ns
COUNT_BITS = 1 << 24  # of a FRACSEC; the byte above is the quality of the time
TIME_BASES = (1e3, 1e4, 1e5, 1e6, 1e7, float((1 << 24) - 1), float(1 << 24))
MOST_UNEVEN = 0.05  # of a step: with another time base the steps at full seconds differ by more


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
        whole, dates, times, seconds, fractions = (
            [name for name, word in zip(names, words, strict=True) if kind.fullmatch(word)]
            for kind in (TIMESTAMP_NAME, DATE_NAME, TIME_NAME, SOC_NAME, FRACTION_NAME)
        )
        if seconds and fractions:
            return seconds[0], fractions[0]
        named = tuple(whole[:1] or dates[:1] + times[:1])
        if named:
            return named
    candidates = (tuple(columns) for columns in (stamps[:2], stamps[:1], names[:1]))
    return next((columns for columns in candidates if columns and increases(columns)), ())


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

    A FRACSEC is a fraction of a second or counts of a time base, which is the one with which the
    clock runs evenly. Raises RecordError where none does.
    """
    seconds, fractions = (numbers[name] for name in columns)
    if np.any(seconds != np.floor(seconds)):
        raise column_error(path, columns[0], "SOC must be whole seconds")
    whole = seconds - seconds[0]
    if np.all((fractions >= 0.0) & (fractions < 1.0)):
        time = whole + fractions
        return np.asarray(time - time[0])
    if np.any(fractions < 0.0) or np.any(fractions != np.floor(fractions)):
        what = "FRACSEC must be below 1 s, or whole counts of a time base"
        raise column_error(path, columns[1], what)
    counts = fractions % COUNT_BITS
    for base in TIME_BASES:
        if np.max(counts) < base and _runs_evenly(time := whole + counts / base):
            return np.asarray(time - time[0])
    bases = ", ".join(f"{base:.0f}" for base in TIME_BASES)
    what = f"with none of the time bases {bases} does the clock run evenly"
    raise column_error(path, columns[1], what)


def _runs_evenly(time: Array) -> bool:
    """Check whether most steps over a full second are like those within one."""
    steps = np.diff(time)
    step = float(np.median(steps))
    over = steps[np.flatnonzero(np.diff(np.floor(time)) > 0.0)]
    return step > 0.0 and (
        not len(over) or bool(np.median(np.abs(over - step)) <= MOST_UNEVEN * step)
    )


def check_finite(time: Array, label: str, place: Callable[[int], str]) -> None:
    """Raise a RecordError where time is no number to compute with; ``place`` names a sample."""
    lost = np.flatnonzero(~(np.abs(time) <= LARGEST))
    if lost.size:
        number = time[lost[0]]
        raise RecordError(f"{place(int(lost[0]))}: {label}: {number} {why_unusable(number)}")


def why_unusable(number: float) -> str:
    """Describe the fault of a number of a record that cannot be computed with."""
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


def are_soc(columns: Sequence[str]) -> bool:
    """Check two columns for the names SOC and FRACSEC."""
    words = [re.sub(r"[\W_]+", "_", name.strip().casefold()) for name in columns]
    return (
        len(words) == 2
        and SOC_NAME.fullmatch(words[0]) is not None
        and FRACTION_NAME.fullmatch(words[1]) is not None
    )


def is_epoch(seconds: Array) -> bool:
    """Check whether times (M,) in s count from 1970."""
    return bool(len(seconds) and EPOCHS[0] <= seconds[0] < EPOCHS[1])


def from_first(numbers: Array) -> Array:
    """Return the time (M,) of a column without a unit: s since the first where it is an epoch.

    Its first number shows what an epoch counts: s, ms, us or ns.
    """
    for ticks in TICKS:
        if is_epoch(numbers[:1] / ticks):
            return np.asarray((numbers - numbers[0]) / ticks)
    return numbers
