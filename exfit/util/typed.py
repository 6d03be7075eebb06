"""Data classes as plain data for JSON, and back: their annotations are the description of both.

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
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np

from exfit.errors import ExfitError
from exfit.util.text import Place, dotted, show_value

STORED = "stored"
IN_FILE: Mapping[str, bool] = {STORED: True}  # metadata of a field that is only in a file
KEY = "key"  # in the metadata of a field: its name in the data
LARGEST = float(np.finfo(float).max)  # a whole number beyond has no double
LARGEST_SAMPLE = 1e150  # of those in arrays: the square of a larger one is infinite
LARGEST_INTEGER = 2**53  # a larger one is no count
FORMS = {int: "a whole number", bool: "true or false", str: "a text"}


class FormError(ExfitError):
    """Data that is not of the form that a class describes: its place, and what is wrong."""


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


def _has_entries(value: Any) -> bool:
    """Check for a data class or a NamedTuple, a value or a type."""
    return is_dataclass(value) or hasattr(value, "_fields")


def _named_values(kind: Any) -> bool:
    """Check for a tuple of pairs of a name and a value."""
    args = get_args(kind)
    return get_origin(kind) is tuple and args[1:] == (...,) and get_args(args[0])[:1] == (str,)


# ---- to plain data


def plain(content: Any, whole: bool = False) -> Any:
    """Return the plain data of a data class and of all in it; ``whole``: what is stored, too."""
    if _has_entries(content):
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
    return None if isinstance(content, float) and not isfinite(content) else content


def _plain_entries(content: Any, whole: bool) -> dict[str, Any]:
    kind: Any = type(content)
    data = {}
    for entry in entries(kind):
        if whole or not entry.stored:
            value = getattr(content, entry.name)
            data[entry.key] = plain(dict(value) if _named_values(entry.kind) else value, whole)
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


# ---- back from plain data


def read(kind: Any, data: Any, place: Place = ()) -> Any:
    """Read plain data as a type describes it; nothing that the type has may be missing.

    Raises FormError, which begins with the place, where data has another form.
    """
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _nullable(args[0], args[1], data, place)
    if origin in (Union, UnionType):
        return _one_of(args, data, place)
    if origin is np.ndarray:
        is_complex = args[1] == np.dtype[np.complex128]
        return _complex_array(data, place) if is_complex else _array(data, place)
    if _named_values(kind):
        return tuple(_mapping(get_args(args[0])[1], data, place).items())
    if origin is tuple:
        return _tuple(args, data, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _mapping(args[1], data, place)
    return _entries(kind, data, place) if _has_entries(kind) else _scalar(kind, data, place)


def _nullable(kind: Any, null: Any, data: Any, place: Place) -> Any:
    if get_origin(kind) is np.ndarray:
        return _array(data, place, null)
    return null if data is None else read(kind, data, place)


def _one_of(kinds: tuple[Any, ...], data: Any, place: Place) -> Any:
    if data is None and NoneType in kinds:
        return None
    *first, last = (kind for kind in kinds if kind is not NoneType)
    for kind in first:
        try:
            return read(kind, data, place)
        except FormError:
            continue
    return read(last, data, place)


def _mapping(kind: Any, data: Any, place: Place) -> dict[str, Any]:
    content = _of_type(dict, data, place, "a mapping")
    return {key: read(kind, value, (*place, key)) for key, value in content.items()}


def _tuple(kinds: tuple[Any, ...], data: Any, place: Place) -> tuple[Any, ...]:
    items = _of_type(list, data, place, "a list")
    if kinds[1:] == (...,):
        kinds = (kinds[0],) * len(items)
    if len(kinds) != len(items):
        raise FormError(f"{dotted(place)}: {len(items)} values, not {len(kinds)}")
    pairs = enumerate(zip(kinds, items, strict=True))
    return tuple(read(kind, value, (*place, k)) for k, (kind, value) in pairs)


def _entries(kind: Any, data: Any, place: Place) -> Any:
    content, values = _of_type(dict, data, place, "a mapping"), {}
    for entry in entries(kind):
        if entry.key not in content:
            raise FormError(f"{dotted((*place, entry.key))}: missing")
        values[entry.name] = read(entry.kind, content[entry.key], (*place, entry.key))
    return kind(**values)


def _of_type(kind: type, data: Any, place: Place, form: str) -> Any:
    if not isinstance(data, kind):
        raise FormError(f"{dotted(place)}: {show_value(data)} is not {form}")
    return data


def _scalar(kind: Any, data: Any, place: Place) -> Any:
    if get_origin(kind) is Literal:
        if data not in get_args(kind):
            choices = ", ".join(map(str, get_args(kind)))
            raise FormError(f"{dotted(place)}: {show_value(data)} is none of {choices}")
        return data
    if kind is float:
        return _number(data, place)
    if kind is complex:
        pair = _array(data, place)
        if pair.shape != (2,):
            raise FormError(f"{dotted(place)}: not a pair of real and imaginary part")
        return complex(pair[0], pair[1])
    if kind is Path:
        return Path(_scalar(str, data, place))
    if kind is int and (isinstance(data, bool) or _is_too_large(data)):
        raise FormError(f"{dotted(place)}: {show_value(data)} is not {FORMS[int]}")
    return _of_type(kind, data, place, FORMS[kind])


def _is_too_large(data: Any) -> bool:
    return isinstance(data, int) and abs(data) > LARGEST_INTEGER


def _number(data: Any, place: Place) -> float:
    if isinstance(data, int | float) and not isinstance(data, bool) and abs(data) <= LARGEST:
        return float(data)
    raise FormError(f"{dotted(place)}: {show_value(data)} is not a number")


def _complex_array(data: Any, place: Place) -> Any:
    parts = _of_type(dict, data, place, "a mapping with real and imag")
    real, imag = (_array(parts.get(part), (*place, part)) for part in ("real", "imag"))
    if real.shape != imag.shape:
        raise FormError(f"{dotted(place)}: real and imag differ in length")
    return np.asarray(real + 1j * imag)


def _array(data: Any, place: Place, null: float = np.nan) -> Any:
    """Return lists of numbers, or lists of such lists, as an array."""
    items = _of_type(list, data, place, "a list of numbers")
    if items and isinstance(items[0], list):
        rows = [_array(row, (*place, k), null) for k, row in enumerate(items)]
        if any(row.shape != rows[0].shape for row in rows):
            raise FormError(f"{dotted(place)}: its rows differ in length")
        return np.stack(rows)
    if {*map(type, items)} <= {float, NoneType}:  # quickly: there are many
        samples = np.array(items, dtype=np.float64)
    else:
        each = enumerate(items)
        samples = np.array([np.nan if x is None else _number(x, (*place, k)) for k, x in each])
    beyond = np.abs(samples) > LARGEST_SAMPLE
    if beyond.any():
        at = int(np.argmax(beyond))
        value = show_value(items[at])
        raise FormError(f"{dotted((*place, at))}: {value} is beyond {LARGEST_SAMPLE:g}")
    return np.where(np.isnan(samples), null, samples)
