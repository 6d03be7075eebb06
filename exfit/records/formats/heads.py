"""The head of a table: a row of names, and perhaps a row of units below it.

Names stay as the file has them, without spaces around them: ``Ut [kV]``, not ``Ut``. A column
without a name is called by its number in the row, counted from 1; names that occur twice are
refused only where they are requested.
"""

from collections.abc import Mapping, Sequence

from exfit.records.units import unit_in, unit_of

# the types of channels in the second row of a JSIS file (WECC, 2013)
CHANNEL_TYPES = frozenset(
    ("T", "VMP", "VAP", "VMA", "VAA", "VMB", "VAB", "VMC", "VAC", "VMN", "VAN", "VP", "IMP", "IAP",
     "IMA", "IAA", "IMB", "IAB", "IMC", "IAC", "IMN", "IAN", "IP", "F", "R", "P", "Q", "S", "Z",
     "CP", "CQ", "D", "SC", "OTHER")
)  # fmt: skip
FEWEST_TYPES = 3
NO_UNIT = ("", "-", "1", "[-]", "[1]")


def names_of(cells: Sequence[str]) -> tuple[str, ...]:
    """Return the names of columns by the cells of their row."""
    return tuple(cell.strip() or str(at + 1) for at, cell in enumerate(cells))


def is_units(cells: Sequence[str]) -> bool:
    """Return whether a row is one of units: each cell is a unit, or the mark that there is none."""
    return all(cell.strip() in NO_UNIT or unit_of(cell) for cell in cells)


def are_channel_types(cells: Sequence[str]) -> bool:
    """Return whether a row is that of the types of channels in a JSIS file."""
    filled = [cell.strip().upper() for cell in cells if cell.strip()]
    return len(filled) >= FEWEST_TYPES and CHANNEL_TYPES.issuperset(filled)


def units_of(names: Sequence[str], row: Sequence[str] = ()) -> dict[str, str]:
    """Return the units by column: from a row or fields of their own, else out of the names."""
    own = dict(zip(names, map(unit_of, row), strict=False))
    return stated({name: own.get(name) or unit_in(name) for name in names})


def stated(units: Mapping[str, str | None]) -> dict[str, str]:
    """Return the units of those columns that have one."""
    return {name: unit for name, unit in units.items() if unit and unit not in NO_UNIT}
