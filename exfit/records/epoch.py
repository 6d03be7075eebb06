"""Times that count from 1970: epoch seconds, and the SOC and FRACSEC of IEEE Std C37.118.2."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SOC_NAME = re.compile(r"soc|sec(?:ond)?s?_of_(?:the_)?century")
FRACTION_NAME = re.compile(r"frac_?sec(?:onds?)?|fraction(?:_of_(?:a_)?second)?|sec_?frac")
EPOCHS = (6.3e8, 4.2e9)  # s since 1970: from 1990 to 2103
TICKS = (1.0, 1e3, 1e6, 1e9)  # a second: epochs count s, ms, us or ns
COUNT_BITS = 1 << 24  # of a FRACSEC; the byte above is the quality of the time
TIME_BASES = (1e3, 1e4, 1e5, 1e6, 1e7, float((1 << 24) - 1), float(1 << 24))
MOST_UNEVEN = 0.05  # of a step: with another time base the steps at full seconds differ by more


class EpochError(ValueError):
    """A fault of a time that counts from 1970, in a column of several, counted from 0."""

    def __init__(self, column: int, text: str) -> None:
        super().__init__(text)
        self.column = column


def soc_columns(words: dict[str, str]) -> tuple[str, ...]:
    """Return the columns of SOC and FRACSEC, given the plain words of each name, or none."""
    seconds = [name for name, word in words.items() if SOC_NAME.fullmatch(word)]
    fractions = [name for name, word in words.items() if FRACTION_NAME.fullmatch(word)]
    return (seconds[0], fractions[0]) if seconds and fractions else ()


def are_soc(columns: Sequence[str]) -> bool:
    """Return whether two columns are SOC and FRACSEC by their names."""
    words = [re.sub(r"[\W_]+", "_", name.strip().casefold()) for name in columns]
    return (
        len(words) == 2
        and SOC_NAME.fullmatch(words[0]) is not None
        and FRACTION_NAME.fullmatch(words[1]) is not None
    )


def is_epoch(seconds: Array) -> bool:
    """Return whether times (M,) in s count from 1970."""
    return bool(len(seconds) and EPOCHS[0] <= seconds[0] < EPOCHS[1])


def from_first(numbers: Array) -> Array:
    """Return the time (M,) of a column without a unit: s since the first where it is an epoch.

    Its first number shows what an epoch counts: s, ms, us or ns.
    """
    for ticks in TICKS:
        if is_epoch(numbers[:1] / ticks):
            return np.asarray((numbers - numbers[0]) / ticks)
    return numbers


def of_soc(seconds: Array, fractions: Array) -> Array:
    """Return the time (M,) in s since the first sample, of SOC and FRACSEC.

    A FRACSEC is a fraction of a second or counts of a time base, which is the one with which the
    clock runs evenly. Raises EpochError where none does.
    """
    if np.any(seconds != np.floor(seconds)):
        raise EpochError(0, "SOC must be whole seconds")
    whole = seconds - seconds[0]
    if np.all((fractions >= 0.0) & (fractions < 1.0)):
        time = whole + fractions
        return np.asarray(time - time[0])
    if np.any(fractions < 0.0) or np.any(fractions != np.floor(fractions)):
        raise EpochError(1, "FRACSEC must be below 1 s, or whole counts of a time base")
    counts = fractions % COUNT_BITS
    for base in TIME_BASES:
        if np.max(counts) < base and _runs_evenly(time := whole + counts / base):
            return np.asarray(time - time[0])
    bases = ", ".join(f"{base:.0f}" for base in TIME_BASES)
    raise EpochError(1, f"with none of the time bases {bases} does the clock run evenly")


def _runs_evenly(time: Array) -> bool:
    """Return whether most steps over a full second are like those within one."""
    steps = np.diff(time)
    step = float(np.median(steps))
    over = steps[np.flatnonzero(np.diff(np.floor(time)) > 0.0)]
    return step > 0.0 and (
        not len(over) or bool(np.median(np.abs(over - step)) <= MOST_UNEVEN * step)
    )
