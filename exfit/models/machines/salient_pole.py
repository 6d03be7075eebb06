"""GENSAL and GENSAE: no field-like winding on the q axis.

GENSAL saturates by E'q, on the d axis alone; GENSAE by the air-gap flux on both axes.
"""

from collections.abc import Mapping
from functools import partial

from exfit.models.blocks import Signal, lag
from exfit.models.machines.machine import (
    D_AXIS,
    D_AXIS_DRAWING,
    FIELD_CURRENT,
    Axes,
    Faults,
    Machine,
    Source,
    along_axes,
    curve,
    d_axis_order,
    d_rest,
    d_slopes,
    descending,
    of_machine,
    power_curve,
    power_order,
    pslf_record,
    quadrature,
    saturation_order,
    subtransient_flux,
    unsaturated_field,
    unsaturated_quadrature,
)
from exfit.models.sheet import record, sheet

SHEET = sheet(
    *of_machine(Tpd0=6.35, Tppd0=0.06, Tppq0=0.077, H=3.25, D=0.0, Xd=1.071, Xq=0.704),
    *of_machine(Xpd=0.351, Xppd=0.296, Xl=0.154, S10=0.0, S12=0.0),
)

GENSAL_DRAWING = f"""\
{D_AXIS_DRAWING}
iq ─┬─►[ Xq - Xppd ]─ PSIQ ─►(+)─► vd
    │  [1 + sTppq0 ]          ▲
    └─►[ Xppd ]───────────────┘

{FIELD_CURRENT} Saturation is a function of E'q. On
open circuit id and iq are 0, and the q axis rests."""
GENSAE_DRAWING = f"""\
{D_AXIS_DRAWING}
                    VXQ
                    -▼
iq ─┬─►[Xq - Xppd]─►(+)─►[    1     ]─ PSIQ ─►(+)─► vd
    │                    [1 + sTppq0]          ▲
    └─►[ Xppd ]────────────────────────────────┘

{FIELD_CURRENT} Saturation is a function of the air-gap
flux, with a share of each axis; VXQ is that of the q axis. On open circuit id
and iq are 0, and the q axis rests."""

CONS = "Tpd0 Tppd0 Tppq0 H D Xd Xq Xpd Xppd Xl S10 S12"


def source(s: Signal, p: Signal) -> Source:
    """Both axes behind X''."""
    return Source(Axes(s.PSIQ, subtransient_flux(s, p)), p.Xppd, p.Xppd)


def gensal_field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current: E'q saturates."""
    return unsaturated_field(s, i, p) + curve(s.EQP, p)


def gensae_field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current: the air-gap flux saturates."""
    return unsaturated_field(s, i, p) + along_axes(power_curve, source(s, p).voltage, p).q


def gensal_q_slopes(s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """T''q0 dpsiq/dt = (Xq - X'') iq - psiq."""
    _, d.PSIQ = lag((p.Xq - p.Xppd) * i.q, s.PSIQ, 1.0, p.Tppq0)


def gensae_q_slopes(s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """T''q0 dpsiq/dt = (Xq - X'') iq - psiq, less what saturation takes."""
    taken = along_axes(power_curve, source(s, p).voltage, p).d
    _, d.PSIQ = lag((p.Xq - p.Xppd) * i.q - taken, s.PSIQ, 1.0, p.Tppq0)


def rest(v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the fluxes that hold a voltage at a current."""
    d_rest(v, i, p, x)
    x.PSIQ = v.d - p.Xppd * i.q


def faults(values: Mapping[str, float]) -> Faults:
    """Find contradictions in a data sheet of a salient-pole machine."""
    yield from d_axis_order(values)
    yield from descending(values, "Xq", "Xppd")


def gensal_faults(values: Mapping[str, float]) -> Faults:
    """Yield them, and what contradicts itself in a quadratic saturation."""
    yield from (*faults(values), *saturation_order(values))


def gensae_faults(values: Mapping[str, float]) -> Faults:
    """Yield them, and what contradicts itself in an exponential saturation."""
    yield from (*faults(values), *power_order(values))


salient = partial(
    Machine,
    sheet=SHEET,
    d_axis=D_AXIS,
    q_axis=("PSIQ",),
    source=source,
    slopes=d_slopes,
    rest=rest,
)

GENSAL = salient(
    name="GENSAL",
    title="salient poles, quadratic saturation by E'q",
    drawing=GENSAL_DRAWING,
    field=gensal_field,
    q_slopes=gensal_q_slopes,
    quadrature=unsaturated_quadrature,
    faults=gensal_faults,
    records=record("GENSAL", CONS),
    pslf_records=pslf_record("gensal", CONS),
)

GENSAE = salient(
    name="GENSAE",
    title="salient poles, exponential saturation by the air-gap flux",
    drawing=GENSAE_DRAWING,
    field=gensae_field,
    q_slopes=gensae_q_slopes,
    quadrature=partial(quadrature, power_curve),
    faults=gensae_faults,
    records=record("GENSAE", CONS),
    saturation="exponential",
)
