"""ST4C: PI regulator with a field voltage loop (IEEE Std 421.5-2016).

          vsum UEL OEL     VRMAX             VMMAX      UEL OEL  VAMAX
            ▼
vref + vs ►(+)►[gates]►[KPR + KIR/s]─►(+)►[KPM + KIM/s]►[gates]►[  1  ]►(x)┬►efd
           -▲              VRMIN      -▲     VMMIN              [1+sTA]  ▲ │
            │                          │                         VAMIN  VB │
vc1 ►[  1  ]┘                          └─[smaller]◄──[  KG  ]◄─────────────┘
     [1+sTR]                                 ▲       [1+sTG]
                                           VGMAX

VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
IT, and so KI, XL and THETAP, act on load only. An integral is frozen while its
PI is at its limit; the limit of the lag is non-windup. Without TA and TG, KPM
and KG close a loop without any lag; the equations solve it. With TA = 0 and
TG = 0, and VGMAX and VAMAX out of reach, it is ST4B, whose lag TA stands before
the field voltage loop.

The limiters act at the summing point (vsum), at the gates before the regulator
or at those behind the loop. Dynawo and InterPSS draw this, but for VGMAX: in
InterPSS it is a non-windup limit of the lag TG, here as in Dynawo the lower of
both, as in ST3A. The stabiliser may also be added between the gates of UEL and
OEL (VOS = 2 in a PSS/E record): not modelled, and the same where no limiter
acts. Typical data are those of ST4B with a wider limit of the regulator, and
VGMAX of ST3A; VAMAX and VAMIN lie within the limits of the loop, and so act.
"""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    lag,
    larger,
    limited_lag,
    pi,
    pi_rest,
    smaller,
    where,
)
from exfit.models.exciters import st4b
from exfit.models.sheet import (
    FREE,
    LIMIT,
    SHORT_TIME,
    TWO_GATES,
    record,
    shared,
    sheet,
    with_typical,
)
from exfit.models.static import SUPPLY_SWITCH, supply

ALIASES = ("ESST4C",)

SHEET = (
    *(
        row._replace(meaning="firing circuit time constant") if row.symbol == "TA" else row
        for row in with_typical(st4b.SHEET, VRMAX=2.0, VRMIN=-1.74)
    ),
    *sheet(
        ("VAMAX", 0.95, *LIMIT, "ceiling of the lag before the rectifier"),
        ("VAMIN", -0.82, *LIMIT, "floor of the lag before the rectifier"),
        ("TG", 0.02, *SHORT_TIME, "feedback lag of the field voltage loop", FREE),
        *shared(VGMAX=5.8),
    ),
    *SUPPLY_SWITCH,
)

RECORDS = (
    record(
        "ST4C",
        "TR KPR KIR VRMAX VRMIN KPM KIM VMMAX VMMIN TA VAMAX VAMIN KG TG VGMAX KP KI XL "
        "THETAP KC VBMAX",
        icons={"VOS": 1, "OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
        places=TWO_GATES,
    ),
)

STATES = "VC VR VM VA VG"


def inner_output(vr: Signal, vb: Signal, s: Signal, p: Signal) -> Signal:
    """Return VM before its limits, whose loop is solved where neither TA nor TG is in it."""
    driven = p.KPM * vr + s.VM
    # VM = driven - KPM min(KG VB VM, VGMAX); what cuts VM behind it cuts the solution
    at_once = larger(driven / (1.0 + p.KPM * p.KG * vb), driven - p.KPM * p.VGMAX)
    lagged = driven - p.KPM * smaller(s.VG, p.VGMAX)
    return where(p.TG < SHORTEST, at_once, lagged)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vb = supply(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vs + u.vsum - vc, u.vuel, u.voel)
    vr, d.VR = pi(error, s.VR, p.KPR, p.KIR, p.VRMIN, p.VRMAX)
    vm = clip(clip(inner_output(vr, vb, s, p), p.VMMIN, p.VMMAX), u.vuel_out, u.voel_out)
    efd = vb * clip(where(p.TA < SHORTEST, vm, s.VA), p.VAMIN, p.VAMAX)
    vg, d.VG = lag(efd, s.VG, p.KG, p.TG)
    vm, d.VM = pi(vr - smaller(vg, p.VGMAX), s.VM, p.KPM, p.KIM, p.VMMIN, p.VMMAX)
    gated = clip(vm, u.vuel_out, u.voel_out)
    _, d.VA = limited_lag(gated, s.VA, 1.0, p.TA, p.VAMIN, p.VAMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VA = efd / supply(u, p)
    inner, x.VM = pi_rest(x.VA, p.KPM, p.KIM)
    x.VG = p.KG * efd
    error, x.VR = pi_rest(inner + smaller(x.VG, p.VGMAX), p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + error - u.vs
