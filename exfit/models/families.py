"""The types of exciters of IEEE Std 421.5: DC, AC and ST, and the edition that a model is of.

A model of the standard is named after its type and the edition that changed it last: AC8B of 2005
became AC8C in 2016. The later form contains the earlier one, with more inputs and limits.
"""

import re
from collections.abc import Collection
from typing import Literal, get_args

Family = Literal["DC", "AC", "ST"]

FAMILIES: tuple[Family, ...] = get_args(Family)
TYPE_IN_NAME = re.compile(r"(DC|AC|ST)\d")  # as in AC8B, ESAC8B, EXDC2
OF_THE_STANDARD = re.compile(r"((?:DC|AC|ST)\d+)([ABC])")
EDITIONS = {"A": 2005, "B": 2005, "C": 2016}  # A and B: what the edition of 2005 contains
SIMPLIFIED: dict[str, Family] = {
    "BBSEX1": "ST",
    "ESURRY": "AC",
    "EXELI": "ST",
    "EXPIC1": "ST",
    "IEEET1": "DC",
    "IEEET2": "AC",
    "IEEET3": "ST",
    "IEEET4": "DC",
    "IEEEX1": "DC",
    "REXS": "AC",
    "SCRX": "ST",
    "SEXS": "ST",
}


def family_of(name: str) -> str | None:
    """Return the type of an exciter of the catalogue, None where its name does not say it."""
    letters = TYPE_IN_NAME.search(name)
    return letters[1] if letters else SIMPLIFIED.get(name)


def edition_of(name: str) -> int | None:
    """Return the edition of IEEE Std 421.5 that an exciter is of, None where it is of neither.

    DC3A is of 2005, and part of the edition of 2016 as it is.
    """
    parts = OF_THE_STANDARD.fullmatch(name)
    return EDITIONS[parts[2]] if parts else None


def without_doubles(name: str, catalogue: Collection[str]) -> tuple[str, ...]:
    """Return a catalogue with one form of each type: that of the edition of ``name``, or of 2005.

    A type that this edition does not have stays in that of the other one.
    """
    own = edition_of(name) or 2005
    types = {_type(other) for other in catalogue if edition_of(other) == own}
    return tuple(
        other
        for other in catalogue
        if edition_of(other) in (None, own) or _type(other) not in types
    )


def relatives(name: str, catalogue: Collection[str]) -> tuple[str, ...]:
    """Return the names of a catalogue of the same type as ``name``, which is the first.

    Those of 2016 are among them only where it is one of them.
    """
    later = edition_of(name) == 2016
    others = (other for other in members(family_of(name), name, catalogue) if other != name)
    return (name, *(other for other in others if later or edition_of(other) != 2016))


def members(family: str | None, name: str, catalogue: Collection[str]) -> tuple[str, ...]:
    """Return the names of a catalogue of a type, one form of each, of the edition of ``name``."""
    single = without_doubles(name, catalogue)
    return tuple(other for other in single if family and family_of(other) == family)


def _type(name: str) -> str:
    """Return the type of an exciter of the standard, without the letter of the edition."""
    return name[:-1]
