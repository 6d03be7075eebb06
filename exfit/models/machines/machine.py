"""A synchronous machine as data, and what the kinds of machine share.

Per unit as excitation studies have it: 1 pu of efd and of ifd gives 1 pu of terminal voltage on the
air-gap line; power, current and reactances are on the machine's own base. The rotor's q axis leads
its d axis. Neglected, as in PSS/E: armature resistance, the stator's own transients, and speed in
the stator's voltages, until a breaker opens (`plants.breaker`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Literal, NamedTuple

from exfit.engine.trace import Signal
from exfit.models.sheet import (
    LONG_TIME,
    POSITIVE_TIME,
    UP_TO_10,
    UP_TO_100,
    Records,
    Sheet,
    chosen,
    record,
    table,
)

Faults = Iterable[tuple[str, str]]


class Axes(NamedTuple):
    """A voltage or a current, by its components along d and q, per unit."""

    d: Signal
    q: Signal


class Source(NamedTuple):
    """A machine as its stator sees it: a voltage behind a reactance on each axis."""

    voltage: Axes
    xd: Signal
    xq: Signal


@dataclass(frozen=True)
class Machine:
    """A machine: its data sheet, its states and its functions.

    ``drawing`` is a text: the block diagram of its axes, then remarks. Of the states ``d_axis``
    move on open circuit too, ``q_axis`` on load only. ``source(s, p)`` is what the states alone
    determine; ``field(s, i, p)`` is ifd at the stator current i; the functions
    ``slopes(s, efd, ifd, i, p, d)`` and ``q_slopes(s, i, p, d)`` write slopes into ``d``;
    ``rest(v, i, p, x)`` writes the states that hold v and i; ``quadrature(vt, i_p, i_q, p)`` is the
    reactance behind which, at rest, the voltage lies on the q axis, where the current seen from vt
    is i_p - j i_q; ``faults(values)`` yields (symbol, text) for data that contradict each other;
    ``saturation`` is the form of the curve through S10 and S12.
    """

    name: str
    title: str
    drawing: str
    sheet: Sheet
    d_axis: tuple[str, ...]
    q_axis: tuple[str, ...]
    source: Callable[..., Source]
    field: Callable[..., Signal]
    slopes: Callable[..., None]
    q_slopes: Callable[..., None]
    rest: Callable[..., None]
    quadrature: Callable[..., Signal]
    faults: Callable[[Mapping[str, float]], Faults]
    records: Records = ()
    saturation: Literal["quadratic", "exponential"] = "quadratic"
    pslf_records: Records = ()
    doubt: str = ""

    @property
    def states(self) -> tuple[str, ...]:
        """All states, those that move on open circuit first."""
        return (*self.d_axis, *self.q_axis)


# rows that machines share by name
ROWS = table(
    ("Tpd0", *POSITIVE_TIME, "d-axis transient time constant"),
    ("Tppd0", *LONG_TIME, "d-axis subtransient time constant"),
    ("Tppq0", "s", (0.001, 1000.0), "q-axis subtransient time constant, on load"),
    ("H", *POSITIVE_TIME, "inertia constant, on load"),
    ("D", *UP_TO_100, "damping, on load"),
    ("Xd", "pu", (0.01, 10.0), "d-axis synchronous reactance"),
    ("Xq", "pu", (0.01, 10.0), "q-axis synchronous reactance, on load"),
    ("Xpd", "pu", (0.001, 10.0), "d-axis transient reactance"),
    ("Xppd", "pu", (0.001, 10.0), "subtransient reactance"),
    ("Xl", *UP_TO_10, "leakage reactance"),
    ("S10", *UP_TO_10, "saturation at 1.0 pu"),
    ("S12", *UP_TO_10, "saturation at 1.2 pu"),
)
of_machine = partial(chosen, ROWS)


def descending(values: Mapping[str, float], *symbols: str) -> Faults:
    """Yield a fault for each value that does not exceed the next one of the row."""
    for larger, smaller in pairwise(symbols):
        if values[larger] <= values[smaller]:
            yield larger, f"{values[larger]:g} is not above {smaller} = {values[smaller]:g}"


def not_rising(values: Mapping[str, float], *symbols: str) -> Faults:
    """Yield a fault for each value that is below the next one of the row; they may be equal."""
    for larger, smaller in pairwise(symbols):
        if values[larger] < values[smaller]:
            yield larger, f"{values[larger]:g} is below {smaller} = {values[smaller]:g}"


def d_axis_order(values: Mapping[str, float]) -> Faults:
    """Find contradictions on a d axis with a damper.

    X'd = X''d is a damper that is not seen: its time constant may be anything, such as 999.
    """
    yield from descending(values, "Xd", "Xpd")
    yield from not_rising(values, "Xpd", "Xppd")
    yield from descending(values, "Xpd", "Xl")
    yield from not_rising(values, "Xppd", "Xl")
    if values["Xpd"] > values["Xppd"]:
        yield from descending(values, "Tpd0", "Tppd0")


def saturation_order(values: Mapping[str, float]) -> Faults:
    """Yield a fault where the saturation at 1.2 pu is not above that at 1.0 pu."""
    s10, s12 = values["S10"], values["S12"]
    if s12 <= s10 and (s10, s12) != (0.0, 0.0):
        yield "S12", f"{s12:g} at 1.2 pu is not above S10 = {s10:g} at 1.0 pu"


def power_order(values: Mapping[str, float]) -> Faults:
    """Yield a fault where no power of the flux has the saturation at both points."""
    yield from saturation_order(values)
    if values["S10"] == 0.0 < values["S12"]:
        yield "S10", "0 lies on no exponential saturation curve; give both as 0, or neither"


# how PSLF names them, and its armature resistance and compensation, which no machine here has
PSLF_NAMES = {
    **{"Tpd0": "tpdo", "Tppd0": "tppdo", "Tpq0": "tpqo", "Tppq0": "tppqo"},
    **{"Xd": "ld", "Xq": "lq", "Xpd": "lpd", "Xpq": "lpq", "Xppd": "lppd", "Xl": "ll"},
    **{"S10": "s1", "S12": "s12"},
}


def pslf_record(name: str, cons: str) -> Records:
    """Return PSLF's record of a machine: what it has more is taken as none."""
    return record(
        name,
        f"{cons} RA RCOMP XCOMP ACCEL",
        absent={"RA": 0.0, "RCOMP": 0.0, "XCOMP": 0.0},
        ignored="ACCEL",
        spelled=PSLF_NAMES,
    )
