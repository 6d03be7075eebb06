"""Data classes as plain data for JSON: their annotations are the description of both.

A number that is not finite is null: `Annotated[float, nan]` says what null stands for. A tuple of
named values, `tuple[tuple[str, X], ...]`, is a mapping. Fields with the metadata IN_FILE are in a
file, not among the figures that are printed; what a class has in DERIVED, properties by their key,
is written and never read.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np

STORED = "stored"
IN_FILE: Mapping[str, bool] = {STORED: True}  # metadata of a field that is only in a file
KEY = "key"  # in the metadata of a field: its name in the data


class Entry(NamedTuple):
    """An entry of a class: its key in the data, its name, its type, whether only a file has it."""

    key: str
    name: str
    kind: Any
    stored: bool


@cache
def entries(kind: type) -> tuple[Entry, ...]:
    """Return the entries of a data class or a NamedTuple."""
    hints = get_type_hints(kind, include_extras=True)
    if not is_dataclass(kind):
        return tuple(Entry(n, n, hints[n], False) for n in getattr(kind, "_fields", ()))
    return tuple(
        Entry(
            each.metadata.get(KEY, each.name),
            each.name,
            hints[each.name],
            each.metadata.get(STORED, False),
        )
        for each in fields(kind)
    )


def has_entries(value: Any) -> bool:
    """Check for a data class or a NamedTuple, a value or a type."""
    return is_dataclass(value) or hasattr(value, "_fields")


def is_named_values(kind: Any) -> bool:
    """Check for a tuple of pairs of a name and a value."""
    args = get_args(kind)
    return get_origin(kind) is tuple and args[1:] == (...,) and get_args(args[0])[:1] == (str,)


def plain(content: Any, whole: bool = False) -> Any:
    """Return the plain data of a data class and of all in it; ``whole``: what is stored, too."""
    if isinstance(content, float):
        return content if isfinite(content) else None
    if isinstance(content, str | int | None):
        return content
    if has_entries(content):
        return _plain_entries(content, whole)
    if isinstance(content, Mapping):
        return {key: plain(value, whole) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [plain(value, whole) for value in content]
    if isinstance(content, np.ndarray):
        return _plain_array(content)
    if isinstance(content, complex):
        return [content.real, content.imag]
    if isinstance(content, Path):
        return str(content)
    return content


def _plain_entries(content: Any, whole: bool) -> dict[str, Any]:
    kind: Any = type(content)
    data = {}
    for entry in entries(kind):
        if whole or not entry.stored:
            value = getattr(content, entry.name)
            data[entry.key] = plain(dict(value) if is_named_values(entry.kind) else value, whole)
    derived: Mapping[str, str] = getattr(content, "DERIVED", {})
    return data | {key: plain(getattr(content, name)) for key, name in derived.items()}


def _plain_array(samples: Any) -> Any:
    if np.iscomplexobj(samples):
        return {"real": _plain_array(samples.real), "imag": _plain_array(samples.imag)}
    if np.isfinite(samples).all():
        return samples.tolist()
    if samples.ndim > 1:
        return [_plain_array(row) for row in samples]
    return [x if isfinite(x) else None for x in samples.tolist()]
