"""ONE_AXIS: the field winding alone, saturation by E'q."""

from collections.abc import Mapping

from exfit.engine.trace import Signal
from exfit.models.machines.machine import (
    Axes,
    Faults,
    Machine,
    Source,
    curve,
    descending,
    of_machine,
    saturation_order,
    unsaturated_quadrature,
)
from exfit.models.sheet import record, sheet

SHEET = sheet(
    *of_machine(Tpd0=6.35, H=3.25, D=0.0),
    ("Xd", 1.8, "pu", (0.01, 10.0), "d-axis synchronous reactance, on load"),
    *of_machine(Xq=1.7),
    ("Xpd", 0.3, "pu", (0.001, 10.0), "d-axis transient reactance, on load"),
    *of_machine(S10=0.0, S12=0.0),
)

DRAWING = """\
efd ─►(+)─►[   1   ]─┬─ EQP ─►(+)─► vq
      -▲   [ sTpd0 ] │        -▲
       └─── ifd ◄────┘      Xpd id
             ▲
             id

iq ─►[Xq]─► vd

ifd = EQP + (Xd - Xpd) id and saturation, which is a function of E'q. On open
circuit id and iq are 0."""


def source(s: Signal, p: Signal) -> Source:
    """E'q behind X'd, nothing behind Xq."""
    return Source(Axes(0.0, s.EQP), p.Xpd, p.Xq)


def field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current."""
    return s.EQP + (p.Xd - p.Xpd) * i.d + curve(s.EQP, p)


def slopes(s: Signal, efd: Signal, ifd: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """T'd0 dE'q/dt = efd - ifd."""
    d.EQP = (efd - ifd) / p.Tpd0


def q_slopes(s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Nothing moves on this axis."""


def rest(v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the flux that holds a voltage at a current."""
    x.EQP = v.q + p.Xpd * i.d


def faults(values: Mapping[str, float]) -> Faults:
    """Find contradictions in the data sheet."""
    yield from descending(values, "Xd", "Xpd")
    yield from saturation_order(values)


ONE_AXIS = Machine(
    name="ONE_AXIS",
    title="field winding alone, quadratic saturation by E'q",
    drawing=DRAWING,
    sheet=SHEET,
    d_axis=("EQP",),
    q_axis=(),
    source=source,
    field=field,
    slopes=slopes,
    q_slopes=q_slopes,
    rest=rest,
    quadrature=unsaturated_quadrature,
    faults=faults,
    records=record("GENTRA", "Tpd0 H D Xd Xq Xpd S10 S12 AF", ignored="AF"),
)
