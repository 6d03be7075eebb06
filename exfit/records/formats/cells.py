"""The cells of a text: what is a number, what a missing sample, and what is neither."""

import re

CELL_SHOWN = 40  # characters of a cell in a message
EMPTY = "an empty cell"
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*|,[0-9]+)?|[.,][0-9]+)(?:[eE][+-]?[0-9]+)?")
INFINITE = re.compile(r"[+-]?inf(?:inity)?", re.IGNORECASE)
MISSING = re.compile(r"|[+-]?nan|-+|\*+", re.IGNORECASE)
MINUTES = re.compile(r"[0-9]{1,2}:[0-9]{2}[.,][0-9]+")
THOUSANDS = re.compile(r"[+-]?[0-9]{1,3}(?:[., '][0-9]{3})+(?:[.,][0-9]*)?")


def is_number(cell: str, comma: bool | None) -> bool:
    """Return whether a cell is an ASCII number with that decimal mark; also nan, inf, not 1_000."""
    cell = cell.strip()
    if NUMBER.fullmatch(cell):
        return ("." if comma else ",") not in cell
    return bool(INFINITE.fullmatch(cell)) or cell.lstrip("+-").lower() == "nan"


def is_missing(cell: str) -> bool:
    """Return whether a cell says that there is no sample: empty, nan, dashes, stars."""
    return MISSING.fullmatch(cell.strip()) is not None


def quoted(cell: object) -> str:
    """Return a cell as messages quote it, text in quotes."""
    return repr(cell.strip()[:CELL_SHOWN]) if isinstance(cell, str) else str(cell)[:CELL_SHOWN]


def why_not(cell: str, comma: bool | None) -> str:
    """Return why a cell is no number."""
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
