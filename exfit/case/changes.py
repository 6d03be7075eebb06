"""Changes of a case: texts of YAML by their places in its file, "" for what is left out."""

from collections.abc import Iterable, Mapping
from math import inf

from exfit.case.case import Case
from exfit.case.parts import Part
from exfit.util.text import dotted, yaml_number

Changes = Mapping[str, str]

DIGITS = 5  # of a number in a case
FACTOR = 4.0  # from the start of a freed value to its bounds


def number_text(value: float) -> str:
    """Write a number for a case."""
    return yaml_number(float(f"{value:.{DIGITS}g}"))


def between(start: float, low: float, high: float) -> str:
    """Write the entry in a case of a value that is fitted between bounds."""
    return "{{start: {}, min: {}, max: {}}}".format(*map(number_text, (start, low, high)))


def within(start: float, factor: float, limits: tuple[float, float] = (-inf, inf)) -> str:
    """Write the entry in a case of a value that is fitted within a factor of its start."""
    low, high = sorted((start / factor, start * factor))
    return between(start, max(low, limits[0]), min(high, limits[1]))


def place_in_record(case: Case, number: int, key: str) -> str:
    """Return the place of a key of a record or its test, as ``test.vt0``, in the file of a case."""
    return f"records[{number}].{key}" if case.records else key


def changes_to_averages(
    case: Case, number: int, signals: Iterable[str], window: float, delay: float | None
) -> Changes:
    """Return the changes by which a record holds averages (s), with a delay (s) that is fitted."""
    changes = {
        place_in_record(case, number, f"record.channels.{signal}.averaged"): f"{window:.3g}"
        for signal in signals
    }
    if delay is not None:
        found = between(delay, delay - window, delay + window)
        changes[place_in_record(case, number, "record.delay")] = found
    return changes


def part_of(case: Case, name: str) -> Part | None:
    """Return the part of a case that has a parameter; None where none has."""
    symbols = (part for part in reversed(case.parts.all) if name.startswith(part.prefix))
    return next((part for part in symbols if name.removeprefix(part.prefix) in part.symbols), None)


def freed(case: Case, starts: Mapping[str, float]) -> Changes:
    """Return the changes by which the fit finds given values, from these starts.

    Those of a network, which no fit finds, become the starts.
    """
    changes = dict[str, str]()
    for name, start in starts.items():
        part = part_of(case, name)
        if part is None:
            continue
        symbol = name.removeprefix(part.prefix)
        if part.free is None:
            changes[dotted((*part.fixed, symbol))] = number_text(start)
            continue
        domain = next(row.domain for row in part.sheet if row.symbol == symbol)
        found = within(start, FACTOR, domain)
        # below 0 there is no log scale
        changes[dotted((*part.free, symbol))] = (
            found if start > 0.0 else f"{found[:-1]}, scale: linear}}"
        )
        for key in (part.values, "std_errors"):
            changes[dotted((*part.section, key, symbol))] = ""
    return changes
