"""Controlled rectifiers with a field voltage loop: ST3A, ST3C and EXST3."""

from exfit.models.blocks import (
    Signal,
    clip,
    compound_source,
    inf,
    lag,
    larger,
    lead_lag,
    limited_lag,
    pi_rest,
    pid,
    rectifier,
    smaller,
    source_voltage,
)
from exfit.models.exciter_parts import PID, supply
from exfit.models.sheet import (
    AS_IN_PSSE,
    FREE,
    GAIN,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    documented,
    limits,
    not_searched,
    record,
    shared,
    sheet,
)


def field_loop(vr: Signal, vb: Signal, s: Signal, p: Signal, d: Signal) -> Signal:
    """Return efd: VB times VM, which the loop of the field voltage makes of VR."""
    vg = smaller(p.KG * vb * s.VM, p.VGMAX)
    vm, d.VM = limited_lag(vr - vg, s.VM, p.KM, p.TM, p.VMMIN, p.VMMAX)
    return vm * vb


def field_loop_rest(efd: Signal, vb: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states that hold efd into x but those of a PID."""
    x.VC, x.VM = u.vc1, efd / vb
    x.VR = x.VM / p.KM + smaller(p.KG * efd, p.VGMAX)
    x.VL = x.VR / p.KA


def st3a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST3A: controlled rectifier with a field voltage loop (IEEE Std 421.5-2005, 7.3).

                  VIMAX                        VRMAX            VMMAX
    vref + vs ►(+)►[clip]►[larger]►[1 + sTC]►[  KA  ]─►(+)─►[  KM  ]─►(x)─┬─► efd
               -▲  VIMIN     ▲     [1 + sTB] [1+sTA]   -▲   [1+sTM]    ▲  │
                │           vuel               VRMIN    │       VMMIN  VB │
    vc1 ►[  1  ]┘                                       │                 │
         [1+sTR]                                        └[smaller]◄─[KG]◄─┘
                                                             ▲
                                                           VGMAX

    VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
    VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees. The limits of
    both lags are non-windup. The current IT, and so KI, XL and THETAP, act on load
    only. The standard has no OEL gate here.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = larger(clip(u.vref + u.vs - vc, p.VIMIN, p.VIMAX), u.vuel)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    return field_loop(vr, source_voltage(u, p), s, p, d)


def st3a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    field_loop_rest(efd, source_voltage(u, p), u, p, x)
    return u.vc1 + x.VL - u.vs


ST3A = documented(
    st3a,
    st3a_rest,
    sheet(
        *shared(TR=0.0, VIMAX=0.2, VIMIN=-0.2),
        ("KM", 7.93, *GAIN, "gain of the field voltage loop", FREE),
        *shared(TC_FREE=1.0, TB_FREE=10.0, KA=200.0, TA_FIXED=0.0, VRMAX=10.0, VRMIN=-10.0, KG=1.0),
        *shared(KP=6.15, KI=0.0, VBMAX=6.9, KC=0.2, XL=0.081, VGMAX=5.8, THETAP=0.0),
        ("TM", 0.4, "s", (0.001, 10.0), "time constant of the field voltage loop", FREE),
        *shared(VMMAX=1.0, VMMIN=0.0),
    ),
    "VC VL VR VM",
    aliases="ESST3A",
    records=record(
        "ESST3A",
        "TR VIMAX VIMIN KM TC TB KA TA VRMAX VRMIN KG KP KI VBMAX KC XL VGMAX THETAP TM VMMAX "
        "VMMIN",
    ),
    pslf_records=record(
        "esst3a",
        "TR VIMAX VIMIN KM TC TB KA TA VRMAX VRMIN KG KP KI VBMAX KC XL VGMAX THETAP TM VMMAX "
        "VMMIN",
        spelled={"THETAP": "angp"},
        doubt=AS_IN_PSSE,
    )
    + record(
        "exst3a",
        "TR VIMAX VIMIN KA TC TB KM TM VMMAX VMMIN KG KP KI VBMAX KC XL VGMAX THETAP",
        held={"TA": 0.0, "VRMAX": 9999.0, "VRMIN": -9999.0},
        spelled=(
            {"KA": "kj", "KM": "ka", "TM": "ta", "VMMAX": "vrmax", "VMMIN": "vrmin"}
            | {"THETAP": "angp"}
        ),
        doubt=OF_A_LIST,
    ),
)


def st3c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST3C: controlled rectifier with a field voltage loop (IEEE Std 421.5-2016).

              vsum  VIMAX   UEL OEL      VPIDMAX                   VRMAX
                ▼
    vref + vs ►(+)─►[clip]─►[gates]─►[KPR + KIR/s   ]─►[1 + sTC]─►[  KA  ]─┐ VR
               -▲   VIMIN            [+ sKDR/(1+sTDR)] [1 + sTB]  [1+sTA]  │
                │                      VPIDMIN                     VRMIN   │
    vc1 ►[  1  ]┘                                          VMMAX           ▼
         [1+sTR]                      efd ◄─┬─(x)◄───────[  KM  ]◄────────(+)
                                            │  ▲         [1+sTM]          -▲
                                            │  VB         VMMIN            │
                                            └──[KG]──►[smaller]────────────┘
                                                          ▲
                                                        VGMAX

    VB = VE FEX(KC IFD / VE), at most VBMAX. It comes from the terminals (SW1 = 1,
    position A of the drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with
    THETAP in degrees, or does not depend on them (SW1 = 2, B), VE = KP. The current
    IT, and so KI, XL and THETAP, act on load only. The limits of both lags are
    non-windup; the integral is frozen while the PID is at its limit. With KPR = 1,
    no integral and no derivative it is ST3A.

    The limiters act at the summing point (vsum) or at the gates behind VIMAX.
    InterPSS writes this; the parameters and limits that PowerWorld lists agree, but
    for the derivative, which the standard does not have and the record of PSS/E
    has. PSS/E and PowerWorld 24 read TA and do without it (with 0 vt is that of
    PowerWorld within 1e-6 pu over a fault, with 0.4 within 4e-3): here it acts, as
    in ST3A, and a unit of a .dyr file has 0. Typical data are those of ST3A, which
    are the first set of the standard's sample data in GridKit; the PID is not that
    of a sample: GridKit lists none.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX), u.vuel, u.voel)
    vpid, d.VI, d.VD = pid(vi, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vl, d.VL = lead_lag(vpid, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    return field_loop(vr, supply(p.KC * u.ifd, u, p), s, p, d)


def st3c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    field_loop_rest(efd, supply(p.KC * u.ifd, u, p), u, p, x)
    x.VD, x.VI = pi_rest(x.VL, p.KPR, p.KIR)
    return u.vc1 + x.VD - u.vs


ST3C = documented(
    st3c,
    st3c_rest,
    (*not_searched(ST3A.sheet, "KA"), *PID, *shared(SW1=1.0)),
    "VC VI VD VL VR VM",
    aliases="ESST3C",
    records=record(
        "ST3C",
        "TR VIMAX VIMIN KPR KIR KDR TDR VPIDMAX VPIDMIN TC TB KA TA VRMAX VRMIN KM TM VMMAX VMMIN "
        "KG VGMAX KP KI XL THETAP KC VBMAX",
        icons={"OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
        doubt=OF_TWO_PROGRAMS,
        unused={"TA": ""},
    ),
)


def source(u: Signal, p: Signal) -> Signal:
    """Return VB, what the source gives behind its rectifier."""
    ve = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    return rectifier(ve, p.KC * u.ifd)


def exst3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXST3: controlled rectifier with a field voltage loop (IEEE type ST3 of 1981).

              vsum   VIMAX                        VRMAX           EFDMAX
                ▼
    vref + vs ►(+)──►[clip]►[ KJ ]►[1 + sTC]─►(+)─►[  KA  ]─►(x)─►[clip]─┬─► efd
               -▲    VIMIN         [1 + sTB]  -▲   [1+sTA]    ▲          │
                │                              │    VRMIN    VB          │
                │                              │                         │
    vc1 ►[  1  ]┘                              └─[smaller]◄────────[ KG ]┘
         [1+sTR]                                    ▲
                                                  VGMAX

    VB = VE FEX(KC IFD / VE) with VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|,
    THETAP in degrees (OPAL-RT's model takes radians). The limits of the lag are
    non-windup. The current IT, and so KI, XL and THETAP, act on load only. Two open
    models written after PSS/E's EXST3 agree otherwise. ST3A is this with a lag TA
    of its regulator (KJ there is KA, and KA is KM), a ceiling of VB in place of
    that of efd, and a gate of the UEL, which is added to the error here.
    """
    efd = clip(clip(s.VR, p.VRMIN, p.VRMAX) * source(u, p), -inf, p.EFDMAX)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(p.KJ * vi, s.VL, p.TC, p.TB)
    vg = smaller(p.KG * efd, p.VGMAX)
    _, d.VR = limited_lag(vl - vg, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    return efd


def exst3_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = efd / source(u, p)
    vl = vr / p.KA + smaller(p.KG * efd, p.VGMAX)
    x.VC, x.VL, x.VR = u.vc1, vl, vr
    return u.vc1 + vl / p.KJ - u.vs


EXST3 = documented(
    exst3,
    exst3_rest,
    sheet(
        *shared(TR=0.0, VIMAX=0.2, VIMIN=-0.2),
        ("KJ", 200.0, *GAIN, "regulator gain", FREE),
        *shared(TC_FREE=1.0, TB_FREE=10.0),
        ("KA", 7.93, *GAIN, "gain of the field voltage loop", FREE),
        ("TA", 0.4, "s", (0.001, 10.0), "time constant of the field voltage loop", FREE),
        *limits("VRMAX", 1.0, 0.0, "the field voltage loop"),
        *shared(KG=1.0, KP=6.15, KI=0.0, EFDMAX=6.9, KC=0.2, XL=0.081, VGMAX=5.8, THETAP=0.0),
    ),
    "VC VL VR",
    records=record(
        "EXST3", "TR VIMAX VIMIN KJ TC TB KA TA VRMAX VRMIN KG KP KI EFDMAX KC XL VGMAX THETAP"
    ),
)
