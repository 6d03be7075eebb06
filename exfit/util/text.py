"""Words and numbers as messages and files have them."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, repeat
from math import floor, inf, isfinite, isnan, log10
from types import NoneType
from typing import Any

Place = tuple[str | int, ...]  # the keys and indices that lead to a value in nested data
PLAIN = 1e4  # below it a number is printed without an exponent


def to_json(content: Mapping[str, Any], ascii_only: bool = False) -> str:
    """Return JSON that every reader takes: numbers that are not finite become null.

    A list of numbers is written in one line.
    """
    encoder = json.JSONEncoder(ensure_ascii=ascii_only, allow_nan=False)
    return "".join(chain(_json(content, encoder.encode, "\n"), "\n"))


NUMBERS = {int, float, NoneType, bool}
# what a terminal obeys, or turns text around by: C0 but newline and tab, C1, bidirectional controls
CONTROLS = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


def _json(content: Any, encode: Callable[[Any], str], line: str) -> Iterator[str]:
    """Yield the parts of a text of JSON; ``line`` begins one at this depth."""
    inner = line + "  "
    if isinstance(content, Mapping) and content:
        for mark, (key, value) in zip(chain("{", repeat(",")), content.items(), strict=False):
            yield f"{mark}{inner}{encode(str(key))}: "
            yield from _json(value, encode, inner)
        yield f"{line}}}"
    elif isinstance(content, list | tuple) and not {*map(type, content)} <= NUMBERS:
        for mark, value in zip(chain("[", repeat(",")), content, strict=False):
            yield f"{mark}{inner}"
            yield from _json(value, encode, inner)
        yield f"{line}]"
    elif isinstance(content, float):
        yield repr(float(content)) if isfinite(content) else "null"
    else:
        try:
            yield encode(content)
        except ValueError:  # a list with numbers that are not finite
            yield encode([None if isinstance(x, float) and not isfinite(x) else x for x in content])


def yaml_number(value: float) -> str:
    """Return a number that gives the same float back to every reader of YAML."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    # YAML 1.1 takes 1e-05 for text, 1.0e-05 for a number
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}"


LARGEST = 1e100  # of numbers to compute with: its squares and cubes are numbers still
SMALLEST = 1e-100  # but 0: of a smaller one the square loses its digits
DIGITS = 5  # of a number without an error
DIGITS_OF_ERROR = 2  # that a number is printed to
LEAST_DIGITS = 3  # of a number, however large its error
ERRORS_IN_INTERVAL = 3.92  # standard errors in a 95 % interval
MOST_DIGITS = 7  # of a number whose error is as good as none
MOST_DECIMALS = 7  # of a number: a smaller one has an exponent
MOST_PERCENT = 1e6  # with two decimals: a larger one has an exponent
MOST_TEXTS = 20  # faults or warnings that are listed
LONGEST_TEXT = 1000  # characters of one of them
MOST_NAMES = 30  # that are listed
MOST_COMPARED = 1000  # names among which the nearest is looked for: each word takes a millisecond
LONGEST_VALUE = 60  # characters of a wrong value


def first_texts(texts: Sequence[str]) -> list[str]:
    """Return the first texts, long ones cut off, and how many more there are."""
    first = [
        text if len(text) <= LONGEST_TEXT else f"{text[:LONGEST_TEXT]}..."
        for text in texts[:MOST_TEXTS]
    ]
    more = len(texts) - MOST_TEXTS
    return first if more <= 0 else [*first, f"... and {more:,} more"]


def near(word: str, names: Iterable[str]) -> str:
    """Return a hint at the name that is meant by a word, or at all names."""
    all_names = list(names)
    if len(all_names) <= MOST_COMPARED:
        if meant := closest(word, all_names):
            return f"did you mean {meant}?"
        all_names = list({name.casefold(): name for name in all_names}.values())
    more = len(all_names) - MOST_NAMES
    return f"known: {', '.join(all_names[:MOST_NAMES])}{f' ... and {more:,} more' * (more > 0)}"


def closest(word: str, names: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Return the name that is nearly a word, None where none is by a share of ``cutoff``."""
    import difflib

    known = list(names)
    folded = [name.casefold() for name in known]
    close = difflib.get_close_matches(word.casefold(), folded, n=1, cutoff=cutoff)
    alike = [name for name, one in zip(known, folded, strict=True) if one in close]
    return max(alike, key=lambda name: sum(letter in word for letter in name), default=None)


def printable(text: str) -> str:
    """Return a text with codes, as \\x1b, in place of what would control a terminal."""
    return CONTROLS.sub(lambda control: control[0].encode("unicode_escape").decode(), text)


def dotted(place: Place) -> str:
    """Return a place as ``test.vref[0].at``."""
    keys = (f"[{key}]" if isinstance(key, int) else f".{key}" for key in place)
    return "".join(keys).removeprefix(".")


def show(value: float) -> str:
    """Return a number in as few digits as identify it."""
    return f"{value:.12g}"


def rounded(value: float | None, error: float | None = None, least: int | None = None) -> str:
    """Return a number in the digits that its standard error allows, a dash for None.

    They are those of the error's first two, ``least`` of the number at least; without an error they
    are five, or ``least``.
    """
    if value is None:
        return "-"
    if error is None or not isfinite(error) or error <= 0.0 or not isfinite(value):
        return f"{value:.{max(DIGITS, least or 0)}g}"
    decimals = DIGITS_OF_ERROR - 1 - floor(log10(error))
    if value != 0.0:
        first = floor(log10(abs(value)))
        decimals = min(decimals, MOST_DIGITS - 1 - first)
        decimals = decimals if least is None else max(decimals, least - 1 - first)
    if decimals < -MOST_DECIMALS:
        return f"{value:.{max(DIGITS, least or 0)}g}"
    if decimals > MOST_DECIMALS:
        digits = max(decimals + floor(log10(abs(value))), 0) if value else 0
        return f"{value:.{digits}e}"
    return f"{round(value, decimals) + 0.0:.{max(decimals, 0)}f}"


def rounded_value(
    value: float | None, error: float | None = None, low: float = -inf, high: float = inf
) -> str:
    """Return the value of a parameter as `rounded`, but in three digits at least.

    It has as many more as keep it between its bounds ``low`` and ``high``.
    """
    text, least = rounded(value, error, LEAST_DIGITS), LEAST_DIGITS
    while value is not None and low <= value <= high and not low <= float(text) <= high:
        least += 1
        text = rounded(value, error, least)
    return text


def error_of_interval(low: float | None, high: float | None) -> float | None:
    """Return the standard error that a 95 % interval says, None where a side is open."""
    return None if low is None or high is None else (high - low) / ERRORS_IN_INTERVAL


def percentage(value: float) -> str:
    """Return a percentage with two decimals, a huge one in few characters, a dash for nan."""
    return "-" if isnan(value) else format(value, ".2e" if abs(value) >= MOST_PERCENT else ".2f")


def show_value(value: Any) -> str:
    """Return a value as a message shows it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return show(value)
    if isinstance(value, list | dict):
        return "a list" if isinstance(value, list) else "a mapping"
    text = repr(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[:LONGEST_VALUE]}..."


def magnitude_fault(value: float) -> str | None:
    """Give the fault of a number that is too large or too near 0, None where it has none."""
    if not isfinite(value):
        return f"{value:g} is not a finite number"
    if abs(value) > LARGEST:
        return f"{value:g} exceeds {LARGEST:g}"
    if 0.0 < abs(value) < SMALLEST:
        return f"{value:g} is not 0, but below {SMALLEST:g}"
    return None


def listed(names: Sequence[str]) -> str:
    """Return names as "A, B and C"."""
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)


def digits(number: float) -> str:
    """Return a number with two digits."""
    text = f"{number:.2g}"
    if "e" in text and 1.0 <= abs(number) < PLAIN:
        return f"{float(text):.0f}"
    return text.replace("e-0", "e-").replace("e+0", "e")
