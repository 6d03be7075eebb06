"""Controlled rectifiers with two PIs: ST4B and ST4C."""

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
    source_voltage,
    where,
)
from exfit.models.exciter_parts import supply
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    PID_GAIN,
    SHORT_TIME,
    TWO_GATES,
    Records,
    documented,
    limits,
    record,
    shared,
    sheet,
    with_typical,
)


def st4b(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST4B: PI regulator with a field voltage loop (IEEE Std 421.5-2005, 7.4).

                  VRMAX                           VMMAX
    vref + vs ►(+)►[KPR + KIR/s]►[  1  ]─►(+)►[KPM + KIM/s]►[smaller]─►(x)─┬─► efd
               -▲      VRMIN     [1+sTA]  -▲      VMMIN         ▲       ▲  │
                │                          │                   voel     VB │
    vc1 ►[  1  ]┘                          └─────────────[ KG ]◄───────────┘
         [1+sTR]

    VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
    VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees. An integral
    is frozen while its PI is at its limit. KPM and KG close a loop without any lag;
    the equations solve it. The current IT, and so KI, XL and THETAP, act on load
    only. Not modelled: UEL at the summing point, and VGMAX of later editions.
    """
    vb = source_voltage(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vr, d.VR = pi(u.vref + u.vs - vc, s.VR, p.KPR, p.KIR, p.VRMIN, p.VRMAX)
    va, d.VA = lag(vr, s.VA, 1.0, p.TA)
    # VM = KPM (VA - KG VB VM) + integral, solved for VM; its limits cut the solution
    vm = clip((p.KPM * va + s.VM) / (1.0 + p.KPM * p.KG * vb), p.VMMIN, p.VMMAX)
    efd = vb * smaller(vm, u.voel)
    _, d.VM = pi(va - p.KG * efd, s.VM, p.KPM, p.KIM, p.VMMIN, p.VMMAX)
    return efd


def st4b_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    inner, x.VM = pi_rest(efd / source_voltage(u, p), p.KPM, p.KIM)
    x.VA = inner + p.KG * efd
    error, x.VR = pi_rest(x.VA, p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + error - u.vs


ST4B = documented(
    st4b,
    st4b_rest,
    sheet(
        *shared(TR=0.0, KPR_OF_REGULATOR=2.97, KIR_OF_REGULATOR=2.97, VRMAX=1.0, VRMIN=-0.87),
        *shared(TA=0.02),
        ("KPM", 1.0, *PID_GAIN, "proportional gain of the field voltage loop", FREE),
        ("KIM", 0.2, *INTEGRAL_GAIN, "integral gain of the field voltage loop", FREE),
        *shared(VMMAX=1.0, VMMIN=-0.87, KG=0.1, KP=6.73, KI=0.1, VBMAX=8.41, KC=0.1, XL=0.0),
        *shared(THETAP=0.0),
    ),
    "VC VR VA VM",
    aliases="ESST4B",
    records=record(
        "ESST4B", "TR KPR KIR VRMAX VRMIN TA KPM KIM VMMAX VMMIN KG KP KI VBMAX KC XL THETAP"
    ),
    pslf_records=(
        record(
            "esst4b",
            "TR KPR KIR TA VRMAX VRMIN KPM KIM VMMAX VMMIN KG KP THETAP KI KC XL VBMAX VGMAX",
            absent={"VGMAX": 999.0},
            spelled={"THETAP": "angp"},
        )
        + record(
            "exst4b",
            "TR KPR KIR TA VRMAX VRMIN KPM KIM VMMAX VMMIN KG KP THETAP KI KC XL VBMAX",
            spelled={"THETAP": "angp"},
        )
    ),
)


def inner_output(vr: Signal, vb: Signal, s: Signal, p: Signal) -> Signal:
    """Return VM before its limits, whose loop is solved where neither TA nor TG is in it."""
    driven = p.KPM * vr + s.VM
    # VM = driven - KPM min(KG VB VM, VGMAX); what cuts VM behind it cuts the solution
    at_once = larger(driven / (1.0 + p.KPM * p.KG * vb), driven - p.KPM * p.VGMAX)
    lagged = driven - p.KPM * smaller(s.VG, p.VGMAX)
    return where(p.TG < SHORTEST, at_once, lagged)


def st4c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    vb = supply(p.KC * u.ifd, u, p)
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


def st4c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VA = efd / supply(p.KC * u.ifd, u, p)
    inner, x.VM = pi_rest(x.VA, p.KPM, p.KIM)
    x.VG = p.KG * efd
    error, x.VR = pi_rest(inner + smaller(x.VG, p.VGMAX), p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + error - u.vs


def record_of_st4c(name: str, user: str = "") -> Records:
    """Return a record of ST4C, with the integers behind the name of a user's model."""
    return record(
        name,
        "TR KPR KIR VRMAX VRMIN KPM KIM VMMAX VMMIN TA VAMAX VAMIN KG TG VGMAX KP KI XL THETAP KC "
        "VBMAX",
        icons={"VOS": 1, "OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
        places=TWO_GATES,
        user=user,
    )


ST4C = documented(
    st4c,
    st4c_rest,
    sheet(
        *(
            row._replace(meaning="firing circuit time constant") if row.symbol == "TA" else row
            for row in with_typical(ST4B.sheet, VRMAX=2.0, VRMIN=-1.74)
        ),
        *limits("VAMAX", 0.95, -0.82, "the lag before the rectifier"),
        ("TG", 0.02, *SHORT_TIME, "feedback lag of the field voltage loop", FREE),
        *shared(VGMAX=5.8, SW1=1.0),
    ),
    "VC VR VM VA VG",
    aliases="ESST4C ST4CU1",
    records=(*record_of_st4c("ST4C"), *record_of_st4c("ST4CU1", user="4 0 5 21 5 0")),
)
