"""GENROU and GENROE: two windings on each axis, saturation by the air-gap flux on both."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Literal

from exfit.models.blocks import Signal, lag, where
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
    not_rising,
    of_machine,
    power_curve,
    power_order,
    pslf_record,
    quadrature,
    saturation_order,
    subtransient_flux,
    unsaturated_field,
)
from exfit.models.sheet import TIME, record, sheet

SHEET = sheet(
    *of_machine(Tpd0=6.35, Tppd0=0.06),
    ("Tpq0", 0.5, *TIME, "q-axis transient time constant, on load"),
    *of_machine(Tppq0=0.077, H=3.25, D=0.0, Xd=1.8, Xq=1.7, Xpd=0.3),
    ("Xpq", 0.55, "pu", (0.001, 10.0), "q-axis transient reactance, on load"),
    *of_machine(Xppd=0.25, Xl=0.2, S10=0.0, S12=0.0),
)

DRAWING = f"""\
{D_AXIS_DRAWING}
       ┌──►[  -1   ]─┬─ EDP ─┬──────────────────►[Xppd - Xl]──►(+)─►(+)─► vd
       │   [ sTpq0 ] │       │                   [Xpq - Xl ]    ▲    ▲
       │             │       └►(+)─►[    1     ]─┬►[Xpq - Xppd]─┘    │
       │             │          ▲   [1 + sTppq0] │ [ Xpq - Xl ]   Xppd iq
       └─── i1q ◄────┘          │                │
             ▲           (Xpq - Xl) iq           │
             └──────────── PSIQ ─────────────────┘

{FIELD_CURRENT} Saturation is a function of the air-gap
flux, with a share of each axis. i1q is the same of the q axis, where nothing
excites. On open circuit id and iq are 0, and the q axis rests."""

AS_IN_PSSE = """

In PSS/E 36.7 S10 = 0 is a machine without saturation, whatever S12 is, and so
is a GENROU of a .dyr file. In a case the curve then begins at 1 pu."""

LEAST_TIME = 0.01  # s; 0 is written where there is no winding
CONS = "Tpd0 Tppd0 Tpq0 Tppq0 H D Xd Xq Xpd Xpq Xppd Xl S10 S12"


def source(s: Signal, p: Signal) -> Source:
    """Both axes behind X''."""
    share = (p.Xppd - p.Xl) / (p.Xpq - p.Xl)
    along_d = share * s.EDP + (1.0 - share) * s.PSIQ
    return Source(Axes(along_d, subtransient_flux(s, p)), p.Xppd, p.Xppd)


def field(form: Callable[..., Signal], s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current."""
    return unsaturated_field(s, i, p) + along_axes(form, source(s, p).voltage, p).q


def q_slopes(form: Callable[..., Signal], s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """T'q0 dE'd/dt and T''q0 dpsiq/dt: the d axis mirrored, with nothing that excites it."""
    current = unsaturated_q_current(s, i.q, p.Xppd, p)
    d.EDP = -(current + along_axes(form, source(s, p).voltage, p).d) / transient_time(p)
    _, d.PSIQ = lag(s.EDP + (p.Xpq - p.Xl) * i.q, s.PSIQ, 1.0, p.Tppq0)


def unsaturated_q_current(s: Signal, i_q: Signal, Xppq: Signal, p: Signal) -> Signal:
    """Return i1q, of the transient winding of a q axis without saturation."""
    inner = p.Xpq - p.Xl
    coupling = (p.Xpq - Xppq) / (inner * inner)
    return s.EDP + (p.Xq - p.Xpq) * (coupling * (s.EDP + inner * i_q - s.PSIQ) - i_q)


def transient_time(p: Signal) -> Signal:
    """Return T'q0, or T''q0 where there is no such winding: then only saturation is left to it."""
    return where(p.Tpq0 < LEAST_TIME, p.Tppq0, p.Tpq0)


def rest(form: Callable[..., Signal], v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the fluxes that hold a voltage at a current."""
    d_rest(v, i, p, x)
    flux = Axes(v.d - p.Xppd * i.q, v.q + p.Xppd * i.d)
    x.EDP = (p.Xq - p.Xpq) * i.q - along_axes(form, flux, p).d
    x.PSIQ = x.EDP + (p.Xpq - p.Xl) * i.q


def faults(order: Callable[..., Faults], values: Mapping[str, float]) -> Faults:
    """Find contradictions in a data sheet of a round-rotor machine."""
    yield from d_axis_order(values)
    yield from not_rising(values, "Xq", "Xpq")
    if values["Tpq0"] < LEAST_TIME and values["Xq"] > values["Xpq"]:  # Xq = X'q is no winding
        text = f"{values['Tpq0']:g} is below {LEAST_TIME:g} s; without a winding Xq equals Xpq"
        yield "Tpq0", text
    yield from not_rising(values, "Xpq", "Xppd")
    yield from descending(values, "Xpq", "Xl")
    yield from order(values)


def machine(
    name: str,
    shape: Literal["quadratic", "exponential"],
    form: Callable[..., Signal],
    order: Callable[..., Faults],
) -> Machine:
    """Return a round-rotor machine with one form of saturation."""
    of_psse = name == "GENROU"
    return Machine(
        name=name,
        title=f"round rotor, {shape} saturation by the air-gap flux",
        drawing=DRAWING + AS_IN_PSSE if of_psse else DRAWING,
        sheet=SHEET,
        d_axis=D_AXIS,
        q_axis=("EDP", "PSIQ"),
        source=source,
        field=partial(field, form),
        slopes=d_slopes,
        q_slopes=partial(q_slopes, form),
        rest=partial(rest, form),
        quadrature=partial(quadrature, form),
        faults=partial(faults, order),
        records=record(name, CONS, unused={"S12": "S10"} if of_psse else {}),
        pslf_records=pslf_record("genrou", CONS) if of_psse else (),
        saturation=shape,
    )


GENROU = machine("GENROU", "quadratic", curve, saturation_order)
GENROE = machine("GENROE", "exponential", power_curve, power_order)
