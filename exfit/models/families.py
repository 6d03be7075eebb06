"""The types of exciters of IEEE Std 421.5-2005: clause 5 DC, clause 6 AC, clause 7 ST."""

import re
from collections.abc import Iterable
from typing import Literal

Family = Literal["DC", "AC", "ST"]

TYPE_IN_NAME = re.compile(r"(DC|AC|ST)\d")  # as in AC8B, ESAC8B, EXDC2
SIMPLIFIED: dict[str, Family] = {
    "IEEET1": "DC",
    "IEEET2": "AC",
    "IEEET3": "ST",
    "IEEEX1": "DC",
    "SCRX": "ST",
    "SEXS": "ST",
}


def family_of(name: str) -> str | None:
    """Return the type of an exciter of the catalogue, None where its name does not say it."""
    letters = TYPE_IN_NAME.search(name)
    return letters[1] if letters else SIMPLIFIED.get(name)


def relatives(name: str, catalogue: Iterable[str]) -> tuple[str, ...]:
    """Return the names of a catalogue of the same type as ``name``, which is the first."""
    family = family_of(name)
    others = (other for other in catalogue if other != name)
    return (name, *(other for other in others if family and family_of(other) == family))
