"""Data classes as plain data for JSON, and back: their annotations are the description of both.

A number that is not finite is null: `Annotated[float, nan]` says what null stands for. A tuple of
named values, `tuple[tuple[str, X], ...]`, is a mapping. Fields with the metadata IN_FILE are in a
file, not among the figures that are printed; what a class has in DERIVED, properties by their key,
is written and never read.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from math import inf, isfinite
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, NamedTuple, Union, get_args, get_origin, get_type_hints

import numpy as np

from exfit.errors import ExfitError
from exfit.util.text import show_value

Place = tuple[str | int, ...]

STORED = "stored"
IN_FILE: Mapping[str, bool] = {STORED: True}  # metadata of a field that is only in a file
KEY = "key"  # in the metadata of a field: its name in the data


class FormError(ExfitError):
    """Data that is not of the form that a class describes: its place, and what is wrong."""


class Entry(NamedTuple):
    """An entry of a class: its key in the data, its name, its type, what it is where missing."""

    key: str
    name: str
    kind: Any
    stored: bool
    default: Any


def plain(content: Any, whole: bool = False) -> Any:
    """Return the plain data of a data class and of all in it; ``whole``: what is stored, too."""
    if is_dataclass(content) or hasattr(content, "_fields"):
        data = {
            entry.key: _entry_of(getattr(content, entry.name), entry.kind, whole)
            for entry in entries(_class_of(content))
            if whole or not entry.stored
        }
        derived: Mapping[str, str] = getattr(content, "DERIVED", {})
        return data | {key: plain(getattr(content, name)) for key, name in derived.items()}
    if isinstance(content, Mapping):
        return {key: plain(value, whole) for key, value in content.items()}
    if isinstance(content, np.ndarray):
        return _plain_array(content)
    return _plain_value(content, whole)


def _class_of(content: Any) -> Any:
    return type(content)


def _plain_value(content: Any, whole: bool) -> Any:
    if isinstance(content, list | tuple):
        return [plain(value, whole) for value in content]
    if isinstance(content, complex):
        return [content.real, content.imag]
    if isinstance(content, Path):
        return str(content)
    return None if isinstance(content, float) and not isfinite(content) else content


def _entry_of(value: Any, kind: Any, whole: bool) -> Any:
    return plain(dict(value) if _named_values(kind) else value, whole)


def _plain_array(samples: Any) -> Any:
    if np.iscomplexobj(samples):
        return {"real": _plain_array(samples.real), "imag": _plain_array(samples.imag)}
    if np.isfinite(samples).all():
        return samples.tolist()
    return (
        [_plain_array(row) for row in samples]
        if samples.ndim > 1
        else [x if isfinite(x) else None for x in samples.tolist()]
    )


def _named_values(kind: Any) -> bool:
    """Whether a type is a tuple of pairs of a name and a value."""
    args = get_args(kind)
    return get_origin(kind) is tuple and args[1:] == (...,) and get_args(args[0])[:1] == (str,)


@cache
def entries(kind: type) -> tuple[Entry, ...]:
    """Return the entries of a data class or a NamedTuple."""
    hints = get_type_hints(kind, include_extras=True)
    if not is_dataclass(kind):
        defaults = getattr(kind, "_field_defaults", {})
        names = getattr(kind, "_fields", ())
        return tuple(Entry(n, n, hints[n], False, defaults.get(n, MISSING)) for n in names)
    described = []
    for attribute in fields(kind):
        made = attribute.default_factory
        default = attribute.default if made is MISSING else made()
        key, only_stored = (
            attribute.metadata.get(KEY, attribute.name),
            attribute.metadata.get(STORED, False),
        )
        described.append(Entry(key, attribute.name, hints[attribute.name], only_stored, default))
    return tuple(described)


class Reader(NamedTuple):
    """Reads plain data as types describe it; ``complete``: nothing that has a default is missing.

    Every method raises FormError, which begins with the place, where data has another form.
    """

    complete: bool = True

    def read(self, kind: Any, data: Any, place: Place = ()) -> Any:
        """Return data as a type describes it."""
        origin, args = get_origin(kind), get_args(kind)
        if origin is Annotated:
            return self._nullable(args[0], args[1], data, place)
        if origin in (Union, UnionType):
            return self._one_of(args, data, place)
        if origin is np.ndarray:
            return _array(data, place, complex_=args[1] == np.dtype[np.complex128])
        if origin is tuple or (isinstance(origin, type) and issubclass(origin, Mapping)):
            return self._collection(kind, data, place)
        if is_dataclass(kind) or hasattr(kind, "_fields"):
            return self._record(kind, data, place)
        return _scalar(kind, data, place)

    def _nullable(self, kind: Any, null: Any, data: Any, place: Place) -> Any:
        if get_origin(kind) is np.ndarray:
            return _array(data, place, null)
        return null if data is None else self.read(kind, data, place)

    def _one_of(self, kinds: tuple[Any, ...], data: Any, place: Place) -> Any:
        if data is None and NoneType in kinds:
            return None
        others = [kind for kind in kinds if kind is not NoneType]
        for kind in others[:-1]:
            try:
                return self.read(kind, data, place)
            except FormError:
                continue
        return self.read(others[-1], data, place)

    def _collection(self, kind: Any, data: Any, place: Place) -> Any:
        args = get_args(kind)
        if get_origin(kind) is not tuple or _named_values(kind):
            item = get_args(args[0])[1] if _named_values(kind) else args[1]
            values = {
                key: self.read(item, value, (*place, key))
                for key, value in _of_type(dict, data, place, "a mapping").items()
            }
            return tuple(values.items()) if _named_values(kind) else values
        items = _of_type(list, data, place, "a list")
        kinds = [args[0]] * len(items) if args[1:] == (...,) else args
        if len(kinds) != len(items):
            raise FormError(f"{dotted(place)}: {len(items)} values, not {len(kinds)}")
        return tuple(
            self.read(each, value, (*place, k))
            for k, (each, value) in enumerate(zip(kinds, items, strict=True))
        )

    def _record(self, kind: Any, data: Any, place: Place) -> Any:
        content, values = _of_type(dict, data, place, "a mapping"), {}
        for entry in entries(kind):
            if entry.key in content:
                values[entry.name] = self.read(entry.kind, content[entry.key], (*place, entry.key))
            elif entry.default is MISSING or self.complete:
                raise FormError(f"{dotted((*place, entry.key))}: missing")
            else:
                values[entry.name] = entry.default
        return kind(**values)


def dotted(place: Place) -> str:
    """Return a place as ``records[0].channels.vt``."""
    return "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in place).lstrip(".")


def _of_type(kind: type, data: Any, place: Place, name: str) -> Any:
    if not isinstance(data, kind):
        raise FormError(f"{dotted(place)}: {show_value(data)} is not {name}")
    return data


def _scalar(kind: Any, data: Any, place: Place) -> Any:
    if kind is float:
        return _number(data, place)
    if kind is complex:
        pair = _array(data, place)
        if pair.shape != (2,):
            raise FormError(f"{dotted(place)}: not a pair of real and imaginary part")
        return complex(pair[0], pair[1])
    if get_origin(kind) is Literal:
        if data not in get_args(kind):
            choices = ", ".join(map(str, get_args(kind)))
            raise FormError(f"{dotted(place)}: {show_value(data)} is none of {choices}")
        return data
    if kind is int and isinstance(data, bool):
        raise FormError(f"{dotted(place)}: {show_value(data)} is not a whole number")
    names = {int: "a whole number", bool: "true or false", str: "a text", Path: "a text"}
    text = _of_type(str if kind is Path else kind, data, place, names[kind])
    return Path(text) if kind is Path else text


def _number(data: Any, place: Place) -> float:
    if isinstance(data, int | float) and not isinstance(data, bool) and -MOST <= data <= MOST:
        return float(data)
    raise FormError(f"{dotted(place)}: {show_value(data)} is not a number")


MOST = float(np.finfo(float).max)  # a whole number beyond has no double


def _complex_array(data: Any, place: Place) -> Any:
    parts = _of_type(dict, data, place, "a mapping with real and imag")
    real, imag = (_array(parts.get(part), (*place, part)) for part in ("real", "imag"))
    if real.shape != imag.shape:
        raise FormError(f"{dotted(place)}: real and imag differ in length")
    return np.asarray(real + 1j * imag)


def _array(data: Any, place: Place, null: float = np.nan, complex_: bool = False) -> Any:
    """Return lists of numbers, or lists of such lists, as an array."""
    if complex_:
        return _complex_array(data, place)
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
    if np.isinf(samples).any():
        _number(inf, (*place, int(np.argmax(np.isinf(samples)))))
    return np.where(np.isnan(samples), null, samples)
