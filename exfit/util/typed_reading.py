"""Data classes from plain data, as JSON has it: their annotations describe what is read."""

from collections.abc import Mapping
from math import nan
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import numpy as np

from exfit.errors import ExfitError
from exfit.util.text import Place, dotted, show_value
from exfit.util.typed import entries, has_entries, is_named_values

LARGEST = float(np.finfo(float).max)  # a whole number beyond has no double
LARGEST_SAMPLE = 1e150  # of those in arrays: the square of a larger one is infinite
LARGEST_INTEGER = 2**53  # a larger one is no count
FORMS: Mapping[type, str] = {
    **{int: "a whole number", bool: "true or false", str: "a text"},
    **{list: "a list", dict: "a mapping"},
}


class FormError(ExfitError):
    """Data that is not of the form that a class describes: its place, and what is wrong."""

    @classmethod
    def at(cls, place: Place, fault: str) -> "FormError":
        """Make the error of a place."""
        return cls(f"{dotted(place)}: {fault}")


def read(kind: Any, data: Any, place: Place = ()) -> Any:
    """Read plain data as a type describes it; nothing that the type has may be missing.

    Raises FormError, which begins with the place, where data has another form.
    """
    kind = _without_alias(kind)
    origin, args = get_origin(kind), get_args(kind)
    if origin is Annotated:
        if get_origin(_without_alias(args[0])) is np.ndarray:
            return _array(data, place, args[1])
        return args[1] if data is None else read(args[0], data, place)
    if origin in (Union, UnionType):
        return _one_of(args, data, place)
    if origin is np.ndarray:
        is_complex = args[1] == np.dtype[np.complex128]
        return _complex_array(data, place) if is_complex else _array(data, place)
    if is_named_values(kind):
        content, each = _of_type(dict, data, place), get_args(args[0])[1]
        return tuple((key, read(each, value, (*place, key))) for key, value in content.items())
    if origin is tuple:
        return _tuple(args, data, place)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        content = _of_type(dict, data, place)
        return {key: read(args[1], value, (*place, key)) for key, value in content.items()}
    if has_entries(kind):
        return _entries(kind, data, place)
    return _scalar(kind, data, place)


def _without_alias(kind: Any) -> Any:
    """Return what an alias with parameters stands for, such as the NDArray of NumPy 2.5."""
    stands_for = getattr(get_origin(kind), "__value__", None)
    return kind if stands_for is None else stands_for[get_args(kind)]


def _tuple(kinds: tuple[Any, ...], data: Any, place: Place) -> tuple[Any, ...]:
    items = _of_type(list, data, place)
    if kinds[1:] == (...,):
        kinds = (kinds[0],) * len(items)
    if len(kinds) != len(items):
        raise FormError.at(place, f"{len(items)} values, not {len(kinds)}")
    pairs = enumerate(zip(kinds, items, strict=True))
    return tuple(read(kind, value, (*place, k)) for k, (kind, value) in pairs)


def _entries(kind: Any, data: Any, place: Place) -> Any:
    content, values = _of_type(dict, data, place), {}
    for entry in entries(kind):
        if entry.key not in content:
            raise FormError.at((*place, entry.key), "missing")
        values[entry.name] = read(entry.kind, content[entry.key], (*place, entry.key))
    return kind(**values)


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


def _of_type(kind: type, data: Any, place: Place, form: str = "") -> Any:
    if not isinstance(data, kind):
        raise FormError.at(place, f"{show_value(data)} is not {form or FORMS[kind]}")
    return data


def _scalar(kind: Any, data: Any, place: Place) -> Any:
    if get_origin(kind) is Literal:
        if data not in get_args(kind):
            choices = ", ".join(map(str, get_args(kind)))
            raise FormError.at(place, f"{show_value(data)} is none of {choices}")
        return data
    if kind is float:
        return _number(data, place)
    if kind is complex:
        pair = _array(data, place)
        if pair.shape != (2,):
            raise FormError.at(place, "not a pair of real and imaginary part")
        return complex(pair[0], pair[1])
    if kind is Path:
        return Path(_of_type(str, data, place))
    is_count = not isinstance(data, bool) and isinstance(data, int) and abs(data) <= LARGEST_INTEGER
    if kind is int and not is_count:
        raise FormError.at(place, f"{show_value(data)} is not {FORMS[int]}")
    return _of_type(kind, data, place)


def _number(data: Any, place: Place) -> float:
    if isinstance(data, int | float) and not isinstance(data, bool) and abs(data) <= LARGEST:
        return float(data)
    raise FormError.at(place, f"{show_value(data)} is not a number")


def _complex_array(data: Any, place: Place) -> Any:
    parts = _of_type(dict, data, place, "a mapping with real and imag")
    real, imag = (_array(parts.get(part), (*place, part)) for part in ("real", "imag"))
    if real.shape != imag.shape:
        raise FormError.at(place, "real and imag differ in length")
    return np.asarray(real + 1j * imag)


def _array(data: Any, place: Place, null: float = nan) -> Any:
    """Return lists of numbers, or lists of such lists, as an array."""
    items = _of_type(list, data, place, "a list of numbers")
    if items and isinstance(items[0], list):
        rows = [_array(row, (*place, k), null) for k, row in enumerate(items)]
        if any(row.shape != rows[0].shape for row in rows):
            raise FormError.at(place, "its rows differ in length")
        return np.stack(rows)
    if {*map(type, items)} <= {float, NoneType}:  # quickly: there are many
        samples = np.array(items, dtype=np.float64)
    else:
        each = enumerate(items)
        samples = np.array([nan if x is None else _number(x, (*place, k)) for k, x in each])
    beyond = np.abs(samples) > LARGEST_SAMPLE
    if beyond.any():
        at = int(np.argmax(beyond))
        raise FormError.at((*place, at), f"{show_value(items[at])} is beyond {LARGEST_SAMPLE:g}")
    return np.where(np.isnan(samples), null, samples)
