"""Compound-source exciters: ST2A, ST2C, EXST2 and IEEET3."""

from exfit.models.blocks import (
    Signal,
    clip,
    compound_source,
    larger,
    limited_integrator,
    limited_lag,
    pi_rest,
    pid,
    smaller,
    source_voltage,
    sqrt,
    where,
)
from exfit.models.exciter_parts import PID, compound_supply, error_less_feedback
from exfit.models.sheet import (
    AS_IN_PSSE,
    OF_TWO_PROGRAMS,
    documented,
    not_searched,
    record,
    record_of_2016,
    shared,
    sheet,
)


def at_rest(vr: Signal, efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states of a regulator without a PID that holds efd by VR into x; return vref."""
    x.VC, x.VR, x.EFD, x.VF = u.vc1, vr, efd, efd
    return u.vc1 + vr / p.KA - u.vs


def st2a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST2A: compound-source rectifier exciter (IEEE Std 421.5-2005, 7.2).

                                     VRMAX              EFDMAX
    vref + vs ─►(+)─►[larger]─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─► efd
               -▲ ▲-     ▲     [1+sTA]    ▲    ▲-  [ sTE ] │
                │ │     vuel     VRMIN    VB   │      0    │
                │ │                            └───[ KE ]◄─┤
                │ │                                        │
    vc1 ►[  1  ]┘ └──────────[  sKF  ]◄────────────────────┘
         [1+sTR]             [1 + sTF]

    VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where KP = KI = 0 as
    in PSS/E. The limits of the regulator and of efd are non-windup. The current IT,
    and so KI, acts on load only. Not modelled: UEL and OEL at the summing point,
    where PSS/E's EXST2A has them and no gate.
    """
    error = larger(error_less_feedback(p.TF, s, u, p, d), u.vuel)
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = compound_supply(u, p)
    efd, d.EFD = limited_integrator(vr * vb - p.KE * s.EFD, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def st2a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(p.KE * efd / compound_supply(u, p), efd, u, p, x)


ST2A = documented(
    st2a,
    st2a_rest,
    sheet(
        *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=1.0, VRMIN=0.0, KE_ABOVE_0=1.0, TE=0.5, KF=0.05),
        *shared(TF=1.0, KP_OR_0=4.88, KI=8.0, KC=1.82, EFDMAX=4.5),
    ),
    "VC VR EFD VF",
    aliases="ESST2A EXST2A",
    records=(
        record("ESST2A", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX")
        + record("EXST2A", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX")
    ),
    pslf_records=record(
        "esst2a", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX", doubt=AS_IN_PSSE
    ),
)


def source(u: Signal, p: Signal) -> Signal:
    """Return VB, the voltage behind the rectifier."""
    unfed = (p.KP <= 0.0) & (p.KI <= 0.0)
    return where(unfed, smaller(1.0, p.VBMAX), source_voltage(u, p))


def st2c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """ST2C: compound-source rectifier exciter with a PID (IEEE Std 421.5-2016).

               vsum        VPIDMAX     UEL OEL    VRMAX             EFDMAX
                 ▼
    vref + vs ─►(+)─►[KPR + KIR/s   ]─►[gates]─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─►efd
               -▲ ▲- [+ sKDR/(1+sTDR)]          [1+sTA]    ▲   -▲   [ sTE ] │
                │ │        VPIDMIN               VRMIN     VB   │      0    │
                │ │                                             └───[ KE ]◄─┤
                │ │                                                         │
    vc1 ►[  1  ]┘ └──────────────────[  sKF  ]◄─────────────────────────────┘
         [1+sTR]                     [1 + sTF]

    VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
    VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees; VE FEX is 1
    where KP = KI = 0, as in PSS/E. The current IT, and so KI, XL and THETAP, act on
    load only. The limits of the regulator and of efd are non-windup; the integral
    is frozen while the PID is at its limit. With KPR = 1, no integral and no
    derivative, XL = 0 and VBMAX out of reach it is ST2A.

    The limiters act at the summing point (vsum) or at the gates behind the PID.
    InterPSS writes this; the parameters and limits that PowerWorld lists agree, but
    for the derivative, which the standard does not have and the record of PSS/E
    has. vt is that of PowerWorld 24 (1e-6 pu over a fault, with KI = KC = 0); the
    gates rest on InterPSS alone. The model of this name in Dynawo is a form of
    ST2A. Typical data are those of ST2A; the sample of 2016, as GridKit has it, has
    KI = XL = 0, KC = 0.1, VBMAX = 5.2 and EFDMAX = 4.4. PID, VBMAX and XL are not
    those of a sample.
    """
    error = error_less_feedback(p.TF, s, u, p, d, u.vsum)
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    gated = clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    driven = vr * source(u, p) - p.KE * s.EFD
    efd, d.EFD = limited_integrator(driven, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def st2c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VR = p.KE * efd / source(u, p)
    x.VD, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    x.VC, x.EFD, x.VF = u.vc1, efd, efd
    return u.vc1 + x.VD - u.vs


ST2C = documented(
    st2c,
    st2c_rest,
    (*not_searched(ST2A.sheet, "KA"), *PID, *shared(XL=0.081, THETAP=0.0, VBMAX=9.0)),
    "VC VI VD VR EFD VF",
    aliases="ESST2C",
    records=record_of_2016(
        "ST2C",
        "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN TE EFDMAX KE KF TF KP KI XL THETAP "
        "KC VBMAX",
        flags="OEL UEL SCL",
        doubt=OF_TWO_PROGRAMS,
    ),
)


def exst2(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXST2: compound-source exciter, its supply added (IEEE type ST2 of 1981).

               vsum    VRMAX               EFDMAX
                 ▼
    vref + vs ─►(+)─►[  KA  ]─►(+)─►(+)─►[  1  ]─┬─► efd
               -▲ ▲- [1+sTA]    ▲   -▲   [ sTE ] │
                │ │    VRMIN   VB    │      0    │
                │ │                  └───[ KE ]◄─┤
                │ │                              │
    vc1 ►[  1  ]┘ └────────[  sKF  ]◄────────────┘
         [1+sTR]           [1 + sTF]

    VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where KP = KI = 0 as
    in PSS/E. The limits of the regulator and of efd are non-windup. The current IT,
    and so KI, acts on load only. ST2A multiplies by VB instead, as EXST2A does.

    Two open models written after PSS/E's EXST2 agree. Typical data are those of
    IEEET3, whose source is added as well, but for KP and KC. Not modelled: UEL and
    OEL other than at the summing point.
    """
    error = error_less_feedback(p.TF, s, u, p, d, u.vsum)
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = compound_supply(u, p)
    efd, d.EFD = limited_integrator(vr + vb - p.KE * s.EFD, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def exst2_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(p.KE * efd - compound_supply(u, p), efd, u, p, x)


EXST2 = documented(
    exst2,
    exst2_rest,
    sheet(
        *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=2.0, VRMIN=-2.0, KE_ABOVE_0=1.0, TE=0.5, KF=0.02),
        *shared(TF=0.53, KP_OR_0=0.9, KI=1.86, KC=0.1, EFDMAX=2.8),
    ),
    "VC VR EFD VF",
    records=record("EXST2", "TR KA TA VRMAX VRMIN KE TE KF TF KP KI KC EFDMAX"),
)


LOADING = 0.78  # of IFD, in the report of 1968


UNLOADED = 1e-12  # pu2: less is a source whose rectifier takes all of it


def ieeet3_source(u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Compute V4 of the source, with whether it is above 0."""
    voltage, load = compound_source(u.vt, u.p, u.q, p.KP, p.KI), LOADING * u.ifd
    square = voltage * voltage - load * load
    return square > UNLOADED, sqrt(larger(square, UNLOADED))


def ieeet3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEET3: compound-source exciter, IEEE type 3 of 1968 (PSS/E IEEET3).

                     VRMAX         VBMAX
    vref + vs ─►(+)─►[  KA  ]─►(+)─►[clip]─►[   1    ]─┬─► efd
               -▲ ▲- [1+sTA]    ▲     0     [KE + sTE] │
                │ │  VRMIN      V4                     │
    vc1 ►[  1  ]┘ │                                    │
         [1+sTR]  └──────────[  sKF  ]◄────────────────┘
                             [1 + sTF]

    V4 = sqrt(VTHEV² - (0.78 IFD)²) with VTHEV = |KP VT + j KI IT|. Where 0.78 IFD
    is beyond VTHEV, what VBMAX limits is 0, as in OpenIPSL and Opal-RT (ANDES: only
    V4 is). The limits of VR are non-windup, as in ANDES and Opal-RT (OpenIPSL: a
    clamp). The current IT, and so KI, acts on load only.
    Not modelled: UEL or OEL at the summing point.
    """
    error = error_less_feedback(p.TF, s, u, p, d)
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    supplies, v4 = ieeet3_source(u, p)
    vb = where(supplies, clip(vr + v4, 0.0, p.VBMAX), 0.0)
    efd, d.EFD = s.EFD, (vb - p.KE * s.EFD) / p.TE
    return efd


def ieeet3_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    return at_rest(p.KE * efd - ieeet3_source(u, p)[1], efd, u, p, x)


IEEET3 = documented(
    ieeet3,
    ieeet3_rest,
    sheet(
        *shared(TR=0.0, KA=120.0, TA=0.15, VRMAX=2.0, VRMIN=-2.0, TE=0.5, KF=0.02, TF=0.53),
        *shared(KP_OR_0=1.19, KI=1.86),
        ("VBMAX", 2.82, "pu", (0.01, 9999.0), "ceiling of the exciter's supply"),
        *shared(KE_ABOVE_0=1.0),
    ),
    "VC VR EFD VF",
    records=record("IEEET3", "TR KA TA VRMAX VRMIN TE KF TF KP KI VBMAX KE"),
)
