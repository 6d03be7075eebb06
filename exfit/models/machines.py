"""Synchronous machines on open circuit: breaker open, rated speed, no stator current.

Per unit as excitation studies have it: 1 pu of efd and of ifd gives 1 pu of terminal voltage on the
air-gap line.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

from exfit.engine.trace import Signal
from exfit.models.blocks import lag, quadratic
from exfit.models.sheet import Record, Sheet, record, sheet

Faults = Iterable[tuple[str, str]]


class Terminals(NamedTuple):
    """What an exciter sees of its machine, per unit."""

    vt: Signal
    ifd: Signal


@dataclass(frozen=True)
class Machine:
    """A machine: its data sheet, its states and its functions.

    ``terminals(s, p)`` are the signals that the states alone determine; ``slopes(s, efd, ifd, p,
    d)`` writes the slopes into ``d``; ``rest(vt, p, x)`` writes the states that hold ``vt`` into
    ``x``; ``faults(values)`` yields (symbol, text) for data that contradict each other.
    """

    name: str
    title: str
    sheet: Sheet
    states: tuple[str, ...]
    terminals: Callable[..., Terminals]
    slopes: Callable[..., None]
    rest: Callable[..., None]
    faults: Callable[[Mapping[str, float]], Faults]
    records: tuple[Record, ...] = ()


def descending(values: Mapping[str, float], *symbols: str) -> Faults:
    """Yield a fault for each reactance that does not exceed the next one of the row."""
    for larger, smaller in pairwise(symbols):
        if values[larger] <= values[smaller]:
            yield larger, f"{values[larger]:g} is not above {smaller} = {values[smaller]:g}"


def saturation_order(values: Mapping[str, float]) -> Faults:
    """Yield a fault where the saturation at 1.2 pu is not above that at 1.0 pu."""
    s10, s12 = values["S10"], values["S12"]
    if s12 <= s10 and (s10, s12) != (0.0, 0.0):
        yield "S12", f"{s12:g} at 1.2 pu is not above S10 = {s10:g} at 1.0 pu"


def saturation(psi: Signal, p: Signal) -> Signal:
    """Return the field current that saturation adds, from its values at 1.0 and 1.2 pu."""
    return quadratic(psi, 1.0, p.S10, 1.2, p.S12).vx


def genrou_terminals(s: Signal, p: Signal) -> Terminals:
    """GENROU, d axis: the voltage is psi'', and the field current feeds it and the saturation."""
    psi, _ = lag(s.EQP, s.PSID, 1.0, p.Tppd0)
    inner = p.Xpd - p.Xl
    share = (p.Xppd - p.Xl) / inner
    vt = share * s.EQP + (1.0 - share) * psi
    coupling = (p.Xd - p.Xpd) * (p.Xpd - p.Xppd) / (inner * inner)
    return Terminals(vt, s.EQP + coupling * (s.EQP - psi) + saturation(vt, p))


def genrou_slopes(s: Signal, efd: Signal, ifd: Signal, p: Signal, d: Signal) -> None:
    """T'd0 dE'q/dt = efd - ifd, T''d0 dpsi/dt = E'q - psi."""
    d.EQP = (efd - ifd) / p.Tpd0
    _, d.PSID = lag(s.EQP, s.PSID, 1.0, p.Tppd0)


def genrou_rest(vt: Signal, p: Signal, x: Signal) -> None:
    """At rest both fluxes are the terminal voltage, whatever the saturation."""
    x.EQP = x.PSID = vt


def genrou_faults(values: Mapping[str, float]) -> Faults:
    """Yield what contradicts itself in a data sheet of a round-rotor machine."""
    yield from descending(values, "Xd", "Xpd", "Xppd", "Xl")
    yield from descending(values, "Tpd0", "Tppd0")
    yield from saturation_order(values)


def one_axis_terminals(s: Signal, p: Signal) -> Terminals:
    """The voltage is E'q."""
    return Terminals(s.EQP, s.EQP + saturation(s.EQP, p))


def one_axis_slopes(s: Signal, efd: Signal, ifd: Signal, p: Signal, d: Signal) -> None:
    """T'd0 dE'q/dt = efd - ifd."""
    d.EQP = (efd - ifd) / p.Tpd0


def one_axis_rest(vt: Signal, p: Signal, x: Signal) -> None:
    """At rest E'q is the terminal voltage."""
    x.EQP = vt


GENROU = Machine(
    name="GENROU",
    title="round rotor, quadratic saturation on psi''",
    sheet=sheet(
        ("Tpd0", 6.35, "s", (0.01, 100.0), "d-axis transient time constant"),
        ("Tppd0", 0.06, "s", (0.0, 1.0), "d-axis subtransient time constant"),
        ("Tpq0", 0.5, "s", (0.0, 100.0), "q-axis transient time constant, on load"),
        ("Tppq0", 0.077, "s", (0.0, 1.0), "q-axis subtransient time constant, on load"),
        ("H", 3.25, "s", (0.01, 100.0), "inertia constant, on load"),
        ("D", 0.0, "pu", (0.0, 100.0), "damping, on load"),
        ("Xd", 1.8, "pu", (0.01, 10.0), "d-axis synchronous reactance"),
        ("Xq", 1.7, "pu", (0.01, 10.0), "q-axis synchronous reactance, on load"),
        ("Xpd", 0.3, "pu", (0.001, 10.0), "d-axis transient reactance"),
        ("Xpq", 0.55, "pu", (0.001, 10.0), "q-axis transient reactance, on load"),
        ("Xppd", 0.25, "pu", (0.001, 10.0), "subtransient reactance"),
        ("Xl", 0.2, "pu", (0.0, 10.0), "leakage reactance"),
        ("S10", 0.0, "pu", (0.0, 10.0), "saturation at 1.0 pu"),
        ("S12", 0.0, "pu", (0.0, 10.0), "saturation at 1.2 pu"),
    ),
    states=("EQP", "PSID"),
    terminals=genrou_terminals,
    slopes=genrou_slopes,
    rest=genrou_rest,
    faults=genrou_faults,
    records=(record("GENROU", "Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xl S10 S12"),),
)

ONE_AXIS = Machine(
    name="ONE_AXIS",
    title="field winding alone, quadratic saturation",
    sheet=sheet(
        ("Tpd0", 6.35, "s", (0.01, 100.0), "d-axis transient time constant"),
        ("S10", 0.0, "pu", (0.0, 10.0), "saturation at 1.0 pu"),
        ("S12", 0.0, "pu", (0.0, 10.0), "saturation at 1.2 pu"),
    ),
    states=("EQP",),
    terminals=one_axis_terminals,
    slopes=one_axis_slopes,
    rest=one_axis_rest,
    faults=saturation_order,
)

MACHINES: dict[str, Machine] = {machine.name: machine for machine in (GENROU, ONE_AXIS)}
