"""The cells of a table: numbers, missing samples, and the head of names and units above them."""

import re
from collections.abc import Mapping, Sequence
from functools import cache

from exfit.records.units import unit_in, unit_of

CELL_SHOWN = 40  # characters of a cell in a message
EMPTY = "an empty cell"
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*|,[0-9]+)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)
MISSING = re.compile(r"|[+-]?nan|-+|\*+", re.IGNORECASE)
MINUTES = re.compile(r"[0-9]{1,2}:[0-9]{2}[.,][0-9]+")
THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[., '][0-9]{3})+(?:[.,][0-9]*)?")
# the types of channels in the second row of a JSIS file (WECC, 2013)
CHANNEL_TYPES = """
    T VMP VAP VMA VAA VMB VAB VMC VAC VMN VAN VP IMP IAP IMA IAA IMB IAB IMC IAC IMN IAN IP
    F R P Q S Z CP CQ D SC OTHER"""
FEWEST_TYPES = 3
NO_UNIT = ("", "-", "1", "[-]", "[1]")
MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
# dates and times of day such as 2015-09-20T10:51:42.8589222Z or 20-Sep-2015 10:51:42 AM
TIMESTAMP = (
    r"[ \t]*"
    r"(?:(?P<year>\d{4})(?P<iso>[-/.])(?P<month>\d{1,2})(?P=iso)(?P<day>\d{1,2})"
    r"|(?P<left>\d{1,2})(?P<mark>[-/.])(?P<middle>\d{1,2})(?P=mark)(?P<last>\d{4}|\d{2})"
    rf"|(?P<named>\d{{1,2}})(?P<dash>[- ])(?P<name>(?i:{'|'.join(MONTHS)}))"
    r"(?P=dash)(?P<full>\d{4}|\d{2}))?"
    r"(?P<between>(?(year)(?:T|[ \t]+)|(?(left)[ \t]+|(?(named)[ \t]+|)))"
    r"(?P<hour>\d{1,2}):(?P<minute>\d{2})(?::(?P<second>\d{2})(?:[.,:](?P<fraction>\d{1,12}))?)?"
    r"(?:[ \t]*(?P<half>[AaPp])\.?[ \t]?[Mm]\.?)?"
    r"[ \t]*(?P<zone>Z|(?P<sign>[+-])(?P<zonehour>\d{2}):?(?P<zoneminute>\d{2}))?)?"
    r"[ \t]*"
)


def is_number(cell: str, comma: bool | None) -> bool:
    """Check for an ASCII number with that decimal mark; also nan, inf, not 1_000."""
    cell = cell.strip()
    if NUMBER.fullmatch(cell):
        return ("." if comma else ",") not in cell
    return bool(INFINITE.fullmatch(cell)) or cell.lstrip("+-").lower() == "nan"


def is_timestamp(cell: str) -> bool:
    """Check for the form of a date, a time of day, or both."""
    return cell.lstrip(" \t")[:1].isdigit() and timestamp_form().fullmatch(cell) is not None


@cache
def timestamp_form() -> re.Pattern[str]:
    """Compile the form of a timestamp where a cell may be one: it takes milliseconds."""
    return re.compile(TIMESTAMP, re.ASCII)


def is_missing(cell: str) -> bool:
    """Check for a cell that stands for no sample: empty, nan, dashes, stars."""
    return MISSING.fullmatch(cell.strip()) is not None


def quoted(cell: object) -> str:
    """Return a cell as messages quote it, text in quotes."""
    return repr(cell.strip()[:CELL_SHOWN]) if isinstance(cell, str) else str(cell)[:CELL_SHOWN]


def why_not(cell: str, comma: bool | None) -> str:
    """Describe the fault of a cell that is no number."""
    cell = cell.strip()
    if not cell:
        return EMPTY
    what = f"{quoted(cell)} is not a number"
    if THOUSANDS.fullmatch(cell):
        return f"{what}; thousands separators are not allowed"
    if MINUTES.fullmatch(cell):
        return f"{what}; minutes and seconds need their hours, as in 0:{cell}"
    if comma and NUMBER.fullmatch(cell):
        return f"{what} with a decimal comma, which other cells have"
    return what


def names_of(cells: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns by the cells of their row."""
    return tuple(cell.strip() or str(at + 1) for at, cell in enumerate(cells))


def is_units(cells: Sequence[str]) -> bool:
    """Check for a row of units: each cell is a unit, or the mark that there is none."""
    return all(cell.strip() in NO_UNIT or unit_of(cell) for cell in cells)


def are_channel_types(cells: Sequence[str]) -> bool:
    """Check for the row of types of channels of a JSIS file."""
    filled = [cell.strip().upper() for cell in cells if cell.strip()]
    return len(filled) >= FEWEST_TYPES and {*CHANNEL_TYPES.split()}.issuperset(filled)


def units_of(names: Sequence[str], row: Sequence[str] = ()) -> dict[str, str]:
    """Return the units by column: from a row or fields of their own, else out of the names."""
    own = dict(zip(names, map(unit_of, row), strict=False))
    return stated({name: own.get(name) or unit_in(name) for name in names})


def stated(units: Mapping[str, str | None]) -> dict[str, str]:
    """Return the units of those columns that have one."""
    return {name: unit for name, unit in units.items() if unit and unit not in NO_UNIT}
