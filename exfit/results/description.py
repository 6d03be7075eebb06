"""What was fitted to what: the tests, the models with their data sheets; what the fit does."""

import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from math import nan
from typing import Annotated, NamedTuple

from exfit import __version__
from exfit.plants import FURTHER
from exfit.simulation.limit_hits import LIMITER_PREFIXES, LimitHit
from exfit.simulation.small_signal import SmallSignal
from exfit.util.vocabulary import NOT_STATED, TYPICAL

LIBRARIES = ("numpy", "llvmlite", "pydantic")
# their parameters are named machine.Tpd0
PARTS = (
    *("machine", "network", "stabiliser", "governor"),
    *(prefix.removesuffix(".") for prefix in LIMITER_PREFIXES),
)

FURTHER_UNIT = re.compile(rf"{FURTHER}\d+\.")


class SheetRow(NamedTuple):
    """What a data sheet says of a parameter."""

    unit: str = ""
    meaning: str = ""


class GivenInPlace(NamedTuple):
    """A value that a fit had in place of one of its case; ``start`` where it is a start value.

    ``in_case`` is None for a start that would be taken from the record. ``source`` is a file of
    parameters, or an option.
    """

    value: float
    in_case: float | None
    start: bool
    source: str


class NetworkParameter(NamedTuple):
    """A parameter of the network of one record."""

    value: float
    unit: str
    meaning: str
    source: str = NOT_STATED


@dataclass(frozen=True)
class PartDescription:
    """A part of what was fitted: its kind, its model, how its parameters' names begin.

    ``sheet`` is by symbol; ``drawing`` is empty where there is none, ``doubt`` where its diagram is
    settled.
    """

    kind: str
    name: str
    prefix: str
    title: str = ""
    drawing: str = ""
    sheet: Mapping[str, SheetRow] = field(default_factory=dict)
    doubt: str = ""

    @property
    def heading(self) -> str:
        """Its kind and name, as a heading of a table has them."""
        of_unit, _, kind = self.kind.partition(".") if self.further else ("", "", self.kind)
        kind = "limiter" if self.prefix in LIMITER_PREFIXES else kind or "exciter"
        named = "Network" if kind == "network" else f"{kind.capitalize()} {self.name}"
        return f"{named} of {of_unit}" if of_unit else named

    @property
    def further(self) -> bool:
        """Flag of a part of a further unit."""
        return FURTHER_UNIT.match(self.prefix) is not None


@dataclass(frozen=True)
class UnitDescription:
    """The models of a unit, all values by their names in the system, and where these are from."""

    parts: tuple[PartDescription, ...] = ()
    values: Mapping[str, float] = field(default_factory=dict)
    sources: Mapping[str, str] = field(default_factory=dict)


class RecordedTest(NamedTuple):
    """A test and its record: what was done, in which condition of the unit, what was measured.

    ``first``, ``last`` and ``spacing`` of its samples are in s; ``network`` is by symbol, where the
    test has one of its own.
    """

    name: str
    role: str
    file: str
    plant: str
    done: str
    channels: str
    samples: int
    first: float
    last: float
    spacing: float
    network: Mapping[str, NetworkParameter]


class FlatRun(NamedTuple):
    """How far (pu) the signals of a test stray from rest without a step; nan without a rest."""

    test: str
    drift: Annotated[float, nan]
    rests: bool


class SmallSignalView(NamedTuple):
    """The small-signal view of tests whose system and state of rest are the same.

    ``view`` is None for the reason ``why``.
    """

    tests: tuple[str, ...]
    view: SmallSignal | None
    why: str = ""


@dataclass(frozen=True)
class OtherProgram:
    """What simulated the records in place of exfit: its command, or the file of an FMU.

    ``twin`` is the plant of exfit beside it, None where there is none; ``differences`` are the
    largest ones of both at the values, per unit, by record and signal.
    """

    command: str
    twin: str | None
    runs: int
    failed: int = 0
    differences: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


class HitLimits(NamedTuple):
    """The limits that the response of a test was on."""

    test: str
    hits: tuple[LimitHit, ...]


class Behaviour(NamedTuple):
    """What the fitted values do: without a step, near rest, at the limits."""

    flat_runs: tuple[FlatRun, ...]
    small_signal: tuple[SmallSignalView, ...]
    limits: tuple[HitLimits, ...]


def values_of_part(values: Mapping[str, float], prefix: str) -> dict[str, float]:
    """Return the values of one part by symbol; the prefix of an exciter is that of its unit."""
    own = {
        name.removeprefix(prefix): value
        for name, value in values.items()
        if name.startswith(prefix)
    }
    if prefix and not FURTHER_UNIT.fullmatch(prefix):
        return own
    others = tuple(f"{kind}." for kind in PARTS)
    return {
        name: value
        for name, value in own.items()
        if not (name.startswith(others) or FURTHER_UNIT.match(name))
    }


def source_in_words(name: str, sources: Mapping[str, str], ties: Mapping[str, str]) -> str:
    """Word the source of a parameter's value: fitted, typical, tied ..."""
    word = sources.get(name, NOT_STATED)
    if name not in ties:
        return word
    return f"tied {ties[name]}" + (f", {TYPICAL}" if word == TYPICAL else "")


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    return {
        "exfit": __version__,
        "python": ".".join(map(str, sys.version_info[:3])),
        **{name: import_module(name).__version__ for name in LIBRARIES},
    }
