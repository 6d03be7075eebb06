"""Buses by their names, as planners' files have them."""

from collections.abc import Mapping
from contextlib import suppress
from types import MappingProxyType
from typing import NamedTuple


class Bus(NamedTuple):
    """A bus by its name and its rated voltage, None where a file does not state it."""

    name: str
    kv: float | None = None


Buses = Mapping[int, Bus]
NO_BUSES: Buses = MappingProxyType({})


def numbers_of(wanted: str, buses: Buses) -> list[int]:
    """Return the numbers of the buses with a name, behind which their kV may stand."""
    text = _plain(wanted)
    return [number for number, bus in buses.items() if _is_named(text, bus)]


def _plain(name: str) -> str:
    return " ".join(name.casefold().split())


def _is_named(text: str, bus: Bus) -> bool:
    name = _plain(bus.name)
    before, _, kv = text.rpartition(" ")
    if before == name != "" and bus.kv is not None:
        with suppress(ValueError):
            return float(kv) == bus.kv
    return text == name != ""
