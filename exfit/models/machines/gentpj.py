"""GENTPJ: saturation by the air-gap flux and the stator's current on all reactances.

Of J. Undrill's specification (2007, 2012), after the WSCC's type F (GENTPF, where Kis is 0), and
J. Weber's description of it (PowerWorld, 2015). The d axis has the factor 1 + S, the q axis
1 + S Xq / Xd, with S of the open-circuit curve at the air-gap flux plus Kis it.
"""

from collections.abc import Mapping

from exfit.models.blocks import Signal, modulus
from exfit.models.machines.machine import (
    Axes,
    Faults,
    Machine,
    Source,
    descending,
    factor,
    of_machine,
    pslf_record,
    saturation_order,
)
from exfit.models.machines.round_rotor import transient_time
from exfit.models.sheet import TIME, UP_TO_10, record, sheet

SUBTRANSIENT_TIME = "s", (0.001, 1000.0)
SHEET = sheet(
    *of_machine(Tpd0=6.35),
    ("Tppd0", 0.06, *SUBTRANSIENT_TIME, "d-axis subtransient time constant"),
    ("Tpq0", 0.5, *TIME, "q-axis transient time constant, on load"),
    *of_machine(Tppq0=0.077, H=3.25, D=0.0, Xd=1.071, Xq=0.704, Xpd=0.351),
    ("Xpq", 0.5, "pu", (0.001, 10.0), "q-axis transient reactance, on load"),
    *of_machine(Xppd=0.25),
    ("Xppq", 0.25, "pu", (0.001, 10.0), "q-axis subtransient reactance, on load"),
    ("Xl", 0.154, *UP_TO_10, "leakage reactance, on load"),
    *of_machine(S10=0.0, S12=0.0),
    ("Kis", 0.0, *UP_TO_10, "share of the stator's current in the saturation, on load"),
)

DRAWING = """\
                                      (Xpd - Xppd) id
                                            -▼
efd ─►(+)─►[   1   ]─┬─ EQP ─►(+)─►[1 + S]─►(+)─►[   1    ]─┬─ EQ2 ──►(+)─► vq
      -▲   [ sTpd0 ] │        -▲                 [ sTppd0 ] │         -▲
       └─── ifd ◄────┘         └────────────────────────────┘        Xds id

ifd = (1 + S) (EQ2 + (EQP - EQ2) (Xd - Xppd) / (Xpd - Xppd)), Xds = Xl +
(Xppd - Xl) / (1 + S), and S is the saturation at the air-gap flux plus Kis it.
The q axis mirrors the d axis with S Xq / Xd and without an excitation. On open
circuit id and iq are 0, and the q axis rests."""

CONS = "Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xppq Xl S10 S12 Kis"


def saturated(flux: Signal, it: Signal, p: Signal) -> Signal:
    """Saturation at an air-gap flux and a current of the stator."""
    return factor(flux + p.Kis * it, p)


def factors(s: Signal, p: Signal) -> Axes:
    """Return by what the inductances of both axes are divided."""
    return Axes(1.0 + s.SAT, 1.0 + s.SAT * p.Xq / p.Xd)


def behind(voltage: Axes, by: Axes, p: Signal) -> Source:
    """Return a voltage behind X'' of both axes, which are saturated by factors."""
    xd, xq = (p.Xppd - p.Xl) / by.d + p.Xl, (p.Xppq - p.Xl) / by.q + p.Xl
    return Source(voltage, xd, xq)


def source(s: Signal, p: Signal) -> Source:
    """Both axes behind their saturated X''."""
    return behind(Axes(s.ED2, s.EQ2), factors(s, p), p)


def field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current."""
    transient = (s.EQP - s.EQ2) * (p.Xd - p.Xppd) / (p.Xpd - p.Xppd)
    return factors(s, p).d * (s.EQ2 + transient)


def slopes(s: Signal, efd: Signal, ifd: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write the slopes of the d axis."""
    d.EQP = (efd - ifd) / p.Tpd0
    d.EQ2 = (factors(s, p).d * (s.EQP - s.EQ2) - (p.Xpd - p.Xppd) * i.d) / p.Tppd0


def q_slopes(s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write those of the q axis, on which nothing excites; T'q0 = 0 is no transient winding."""
    by, time = factors(s, p).q, transient_time(p)
    transient = (s.EDP - s.ED2) * (p.Xq - p.Xppq) / (p.Xpq - p.Xppq)
    d.EDP = -by * (s.ED2 + transient) / time
    d.ED2 = (by * (s.EDP - s.ED2) + (p.Xpq - p.Xppq) * i.q) / p.Tppq0


def rest(v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the states that hold a voltage at a current, and their saturation."""
    flux = modulus(v.q + p.Xl * i.d, v.d - p.Xl * i.q)
    x.SAT = saturated(flux, modulus(i.q, i.d), p)
    by, at = factors(x, p), (p.Xppd - p.Xl, p.Xppq - p.Xl)
    x.EQ2 = v.q + (at[0] / by.d + p.Xl) * i.d
    x.ED2 = v.d - (at[1] / by.q + p.Xl) * i.q
    x.EQP = x.EQ2 + (p.Xpd - p.Xppd) / by.d * i.d
    x.EDP = x.ED2 - (p.Xpq - p.Xppq) / by.q * i.q


def quadrature(vt: Signal, i_p: Signal, i_q: Signal, p: Signal) -> Signal:
    """Return the saturated Xq."""
    s = saturated(modulus(vt + p.Xl * i_q, p.Xl * i_p), modulus(i_p, i_q), p)
    return (p.Xq - p.Xl) / (1.0 + s * p.Xq / p.Xd) + p.Xl


def faults(values: Mapping[str, float]) -> Faults:
    """Find contradictions in the data sheet."""
    yield from descending(values, "Xd", "Xpd", "Xppd")
    yield from descending(values, "Xppd", "Xl") if values["Xppd"] < values["Xl"] else ()
    yield from descending(values, "Tpd0", "Tppd0")
    yield from descending(values, "Xpq", "Xppq")
    if values["Xq"] < values["Xpq"]:
        yield "Xq", f"{values['Xq']:g} is below Xpq = {values['Xpq']:g}"
    yield from saturation_order(values)


GENTPJ = Machine(
    name="GENTPJ",
    title="all reactances saturate by the air-gap flux and the current",
    drawing=DRAWING,
    sheet=SHEET,
    d_axis=("EQP", "EQ2"),
    q_axis=("EDP", "ED2"),
    source=source,
    field=field,
    slopes=slopes,
    q_slopes=q_slopes,
    rest=rest,
    quadrature=quadrature,
    faults=faults,
    saturated=saturated,
    speed="torque",
    records=record("GENTPJ1", CONS),
    pslf_records=(
        *pslf_record("gentpj", CONS.removesuffix(" Kis"), "Kis"),
        *pslf_record("gentpf", CONS.removesuffix(" Kis"), held={"Kis": 0.0}),
    ),
)
