"""GENQEC and GENQEJ: all inductances saturate alike, by the air-gap flux and the stator's current.

Of Q. Wang's specification of GENQEC (BC Hydro, 2019) and J. Weber's equations (PowerWorld, 2022).
GENQEC compensates the field current by Kw id; in GENQEJ, with Kis instead, the saturation is at
the flux plus Kis it. A reactance over 1 + S times a current is the unsaturated one times the
current over 1 + S, so that the equations are those of a machine without saturation.
"""

from collections.abc import Callable, Mapping
from functools import partial

from exfit.models.blocks import Signal, clip, lag, modulus, quadratic, where
from exfit.models.machines import gentpj
from exfit.models.machines.machine import (
    D_AXIS,
    Axes,
    Faults,
    Machine,
    Source,
    descending,
    factor,
    of_machine,
    power_curve,
    pslf_record,
    subtransient_flux,
    unsaturated_field,
)
from exfit.models.machines.round_rotor import transient_time, unsaturated_q_current
from exfit.models.sheet import OF_A_LIST, Parameter, record

DRAWING = """\
efd ─►(+)─►[   1   ]─┬─ EQP ─┬──────────────────►[Xppd - Xl]──►(+)─►(+)─► vq
      -▲   [ sTpd0 ] │       │                   [Xpd - Xl ]    ▲   -▲
       │             │       └►(+)─►[ 1 + S  ]─┬─►[Xpd - Xppd]──┘    │
       │             │         -▲   [ sTppd0 ] │  [Xpd - Xl  ]    Xds id
       └─── ifd ◄────┘          ├──────────────┘
                 (Xpd - Xl) id / (1 + S) and PSID

ifd (1 - Kw id) = (1 + S) EQP + (Xd - Xpd) (id + k (1 + S) u), u the input of
PSID's integrator, k = (Xpd - Xppd) / (Xpd - Xl)^2, and
Xds = (Xppd - Xl) / (1 + S) + Xl. S is the saturation at the air-gap flux, of
GENQEJ plus Kis it: with SATFLG = 0 a power of the flux, 1 a quadratic over
the flux, 2 a quadratic. The q axis mirrors the d axis without an excitation.
On open circuit id and iq are 0, and the q axis rests."""

MOST = 0.25  # of Kw id, up and down
DOUBT = "limits Kw id to 0.25 as PowerWorld's equations do; InterPSS has 0.4"
KW = Parameter("Kw", 0.0, "1", 0.0, 0.99, "compensation of the field current, on load")
SATFLG = Parameter(
    "SATFLG",
    1.0,
    "1",
    0.0,
    2.0,
    "saturation: 0 power of the flux, 1 quadratic over it, 2 quadratic",
)
*COMMON, KIS = gentpj.SHEET
LEAKAGE = of_machine(Xl=0.154)  # of which the damper's flux has a share on open circuit, too
CONS = gentpj.CONS.removesuffix(" Kis")


def by_flux(flux: Signal, it: Signal, p: Signal) -> Signal:
    """Saturation at an air-gap flux, whatever the current of the stator.

    Source: the forms of the flag as NREL's PowerSystems.jl has them, from the same specification.
    """
    squared = quadratic(flux, 1.0, p.S10, 1.2, p.S12 / 1.2).vx
    of_square = where(p.SATFLG > 1.5, squared, factor(flux, p))
    return where(p.SATFLG < 0.5, power_curve(flux, p) / flux, of_square)


def by_flux_and_current(flux: Signal, it: Signal, p: Signal) -> Signal:
    """Saturation at an air-gap flux and a current of the stator."""
    return by_flux(flux + p.Kis * it, it, p)


def unsaturated(s: Signal, i: Axes) -> Axes:
    """Return the current that meets the unsaturated reactances."""
    return Axes(i.d / (1.0 + s.SAT), i.q / (1.0 + s.SAT))


def source(s: Signal, p: Signal) -> Source:
    """Both axes behind their saturated X''."""
    share = (p.Xppq - p.Xl) / (p.Xpq - p.Xl)
    along_d = share * s.EDP + (1.0 - share) * s.PSIQ
    by = Axes(1.0 + s.SAT, 1.0 + s.SAT)
    return gentpj.behind(Axes(along_d, subtransient_flux(s, p)), by, p)


def field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current, without a compensation."""
    return (1.0 + s.SAT) * unsaturated_field(s, unsaturated(s, i), p)


def compensated_field(s: Signal, i: Axes, p: Signal) -> Signal:
    """Return the field current of GENQEC."""
    return field(s, i, p) / (1.0 - clip(p.Kw * i.d, -MOST, MOST))


def slopes(s: Signal, efd: Signal, ifd: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write the slopes of field and damper."""
    d.EQP = (efd - ifd) / p.Tpd0
    flux = s.EQP - (p.Xpd - p.Xl) * unsaturated(s, i).d
    _, d.PSID = lag(flux, s.PSID, 1.0, p.Tppd0 / (1.0 + s.SAT))


def q_slopes(s: Signal, i: Axes, p: Signal, d: Signal) -> None:
    """Write those of the q axis, on which nothing excites."""
    by, i_q = 1.0 + s.SAT, unsaturated(s, i).q
    d.EDP = -by * unsaturated_q_current(s, i_q, p.Xppq, p) / transient_time(p)
    _, d.PSIQ = lag(s.EDP + (p.Xpq - p.Xl) * i_q, s.PSIQ, 1.0, p.Tppq0 / by)


def rest(saturated: Callable[..., Signal], v: Axes, i: Axes, p: Signal, x: Signal) -> None:
    """Write the fluxes that hold a voltage at a current, and their saturation."""
    x.PSID, x.PSIQ = v.q + p.Xl * i.d, v.d - p.Xl * i.q
    x.SAT = saturated(modulus(x.PSID, x.PSIQ), modulus(i.q, i.d), p)
    behind = unsaturated(x, i)
    x.EQP = x.PSID + (p.Xpd - p.Xl) * behind.d
    x.EDP = x.PSIQ - (p.Xpq - p.Xl) * behind.q


def quadrature(
    saturated: Callable[..., Signal], vt: Signal, i_p: Signal, i_q: Signal, p: Signal
) -> Signal:
    """Return the saturated Xq."""
    s = saturated(modulus(vt + p.Xl * i_q, p.Xl * i_p), modulus(i_p, i_q), p)
    return (p.Xq - p.Xl) / (1.0 + s) + p.Xl


def faults(values: Mapping[str, float]) -> Faults:
    """Find contradictions in the data sheet."""
    yield from gentpj.faults(values)
    yield from descending(values, "Xpq", "Xl")
    flag = values.get("SATFLG", 1.0)
    if not float(flag).is_integer():
        yield "SATFLG", f"{flag:g} is none of 0, 1, 2"
    elif flag == 0.0 and values["S10"] == 0.0 < values["S12"]:
        yield "S10", "0 lies on no power of the flux; give S12 as 0, too, or another SATFLG"


def machine(name: str, own: Parameter, saturated: Callable[..., Signal], title: str) -> Machine:
    """Return the machine with Kw, or that with Kis."""
    compensates = own is KW
    return Machine(
        name=name,
        title=f"all inductances saturate alike by the air-gap flux{title}",
        drawing=DRAWING,
        sheet=(*(LEAKAGE[0] if row.symbol == "Xl" else row for row in COMMON), own, SATFLG),
        d_axis=D_AXIS,
        q_axis=("EDP", "PSIQ"),
        source=source,
        field=compensated_field if compensates else field,
        slopes=slopes,
        q_slopes=q_slopes,
        rest=partial(rest, saturated),
        quadrature=partial(quadrature, saturated),
        faults=faults,
        saturated=saturated,
        speed="voltage",
        doubt=DOUBT if compensates else "",
        records=record(
            f"{name}U", f"{CONS} {own.symbol}", icons={"SATFLG": 1}, user="1 1 1 16 6 1"
        ),
        pslf_records=pslf_record(
            name.lower(), CONS, f"{own.symbol} SATFLG", icons={"SATFLG": 1}, doubt=OF_A_LIST
        ),
    )


GENQEC = machine("GENQEC", KW, by_flux, "")
GENQEJ = machine("GENQEJ", KIS, by_flux_and_current, " and the current")
