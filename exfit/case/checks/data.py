"""The plain data of a case file, of which any part may have the wrong form: read with care."""

from collections.abc import Mapping
from math import isfinite
from typing import Any, TypeGuard

Data = Mapping[str, Any]


def is_number(value: Any) -> bool:
    """Tell whether a value is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def numbers_in(entries: Any) -> dict[str, float]:
    """Return those entries of a mapping that are numbers, none where it is no mapping."""
    if not isinstance(entries, dict):
        return {}
    return {key: float(value) for key, value in entries.items() if is_number(value)}


def starts_in(entries: Any) -> dict[str, float]:
    """Return those entries that are numbers, or are found by the fit from a start that is one."""
    if not isinstance(entries, dict):
        return {}
    known = {
        key: value.get("start") if isinstance(value, dict) else value
        for key, value in entries.items()
    }
    return numbers_in(known)


def is_pair(value: Any) -> TypeGuard[list[float]]:
    """Tell whether a value is a list of two numbers."""
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))


def section_of(data: Any, *place: str | int) -> dict[str, Any]:
    """Return the mapping at a place, an empty one where there is none."""
    for key in place:
        if isinstance(data, list) and isinstance(key, int) and key < len(data):
            data = data[key]
        else:
            data = data.get(key) if isinstance(data, dict) else None
    return data if isinstance(data, dict) else {}


def list_of(data: Any, key: str) -> list[Any]:
    """Return the list under a key, an empty one where there is none."""
    found = data.get(key) if isinstance(data, dict) else None
    return found if isinstance(found, list) else []
