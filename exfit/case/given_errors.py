"""Standard errors of given values that nobody measured, by what they are and where they come from.

docs/uncertainty.md has the sources of the table.
"""

from collections.abc import Iterator
from typing import NamedTuple

from exfit.case.case import Case
from exfit.case.parts import Part
from exfit.models.sheet import Parameter
from exfit.util.vocabulary import EXACT_SOURCES, TYPICAL


class RelativeError(NamedTuple):
    """Standard errors of values of one kind, of their size, by where they come from."""

    maker: float
    other: float  # a planner's file, an earlier fit, or not stated
    typical: float


FIELD_TIME = RelativeError(0.10, 0.15, 0.30)
ROTOR_TIME = RelativeError(0.20, 0.30, 0.50)
REACTANCE = RelativeError(0.08, 0.12, 0.25)
INERTIA = RelativeError(0.05, 0.10, 0.30)
SATURATION = RelativeError(0.20, 0.30, 0.50)
TRANSFORMER = RelativeError(0.04, 0.05, 0.15)
EXCITER_MACHINE = RelativeError(0.10, 0.20, 0.50)
CEILING = RelativeError(0.05, 0.10, 0.30)
SETTING = RelativeError(0.03, 0.10, 0.50)

CURVE = ("S10", "S12", "SE1", "SE2")
OF_EXCITER_MACHINE = ("TE", "KE", "KC", "KD", "KC1", "KC2", "XL", "XE")
EXACT = ("E1", "E2", "THETAP")  # voltages at which a curve is given, an angle
IMPEDANCES = ("R", "X", "Rs", "Xs", "Ra")
LIMITS = ("MAX", "MIN", "LIM")
SWITCHES = "1"  # the unit of switches, orders and exponents


def given_std_errors(case: Case) -> dict[str, float]:
    """Return the standard error of each given value that has one, as the system names them.

    That of the case, or else by the kind of the value and its source. Exact are zeros, switches,
    exponents, orders, KE = 1, points of a curve, what was measured or read off a certificate, and
    what the case says is exact; with ``given: exact`` every value without an error of its own.
    """
    own = case.std_errors()
    if case.given == "exact":
        return own
    sources, values = case.sources(), case.values()
    others = {*case.ties.by_name, *case.free(), *case.exact(), *own}
    by_kind = {
        name: abs(values[name]) * error
        for name, part, row in _rows(case)
        if name not in others and sources[name] not in EXACT_SOURCES
        if values[name] and not (row.symbol == "KE" and values[name] == 1.0)  # by its base
        if (error := relative_error(part, row, sources[name]))
    }
    return own | by_kind


def _rows(case: Case) -> Iterator[tuple[str, Part, Parameter]]:
    for part in case.parts.all:
        for row in part.sheet:
            yield part.prefix + row.symbol, part, row


def relative_error(part: Part, row: Parameter, source: str) -> float:
    """Return the standard error of a value of its size; 0 for what is exact."""
    kind = kind_of(part, row)
    if kind is None:
        return 0.0
    return {TYPICAL: kind.typical, "maker": kind.maker}.get(source, kind.other)


def kind_of(part: Part, row: Parameter) -> RelativeError | None:
    """Return the standard errors of values of a kind; None for what is exact."""
    symbol = row.symbol
    if row.unit == SWITCHES or symbol in EXACT:
        return None
    if symbol in CURVE:
        return SATURATION
    if part.kind.endswith("network"):
        return TRANSFORMER if symbol in IMPEDANCES else None
    if part.kind.endswith("machine"):
        own = {"H": INERTIA, "Tpd0": FIELD_TIME}.get(symbol)
        return own or (ROTOR_TIME if row.is_time else REACTANCE)
    if any(limit in symbol.upper() for limit in LIMITS):
        return CEILING
    return EXCITER_MACHINE if symbol in OF_EXCITER_MACHINE else SETTING
