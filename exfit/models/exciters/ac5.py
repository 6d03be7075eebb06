"""Simplified alternator exciters: AC5A and AC5C."""

from exfit.models.blocks import (
    Signal,
    clip,
    exciter,
    exciter_demand,
    field_demand,
    lag,
    lead_lag,
    limited_lag,
    washout,
)
from exfit.models.exciter_parts import alternator_rest, limited_alternator
from exfit.models.sheet import (
    LAG_OF_KF,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    ONE_GATE,
    REGULATOR_LAG,
    TIME,
    documented,
    record,
    record_of_2016,
    renamed,
    shared,
    sheet,
)


def ac5a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC5A: simplified brushless exciter (IEEE Std 421.5-2005, 6.5).

                vsum       VRMAX                            VE >= 0
                  ▼
    vref + vs ──►(+)─►(+)─►[  KA  ]────────────┬─ VR ─►(+)─►[  1  ]─┬─► VE = efd
               -▲    -▲    [1+sTA]             │       -▲   [ sTE ] │
                │     │    VRMIN               │        └─── VFE ◄──┘
    vc1 ►[  1  ]┘     │                        │
         [1+sTR]      └─[  sKF   ]◄─[1 + sTF3]◄┘
                        [1 + sTF1]  [1 + sTF2]

    VFE = KE VE + VX(VE): the curve is that of the loaded exciter; there is neither
    a rectifier nor a field current. The limits of the lag and of VE are non-windup.
    The feedback is taken from VR, as the models written after PSS/E's ESAC5A do:
    efd of a brushless machine cannot be measured, and 1/(1 + sTF2) stands for the
    exciter. TF2 = 0 bypasses TF3 with it. TA > 0: the loop needs a lag.

    UEL and OEL are added to vs. Not modelled: PSS/E's own choice of KE or VRMAX
    where a record says 0. Copies of the sample data differ in TF2, TF3: 0.8
    and 0 here, 1 and 1 (which cancel) elsewhere.
    """
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(s.VR, s.VL, p.TF3, p.TF2)
    vf, d.VF = washout(vl, s.VF, p.KF, p.TF1)
    vr, d.VR = limited_lag(u.vref + u.vs + u.vsum - vc - vf, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = exciter(vr, s.VE, p.KE, p, low=0.0)
    return efd


def ac5a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vfe = exciter_demand(efd, p.KE, p)
    x.VC, x.VR, x.VE, x.VL, x.VF = u.vc1, vfe, efd, vfe, vfe
    return u.vc1 + vfe / p.KA - u.vs


AC5A = documented(
    ac5a,
    ac5a_rest,
    sheet(
        *shared(TR=0.0, KA=400.0),
        ("TA", 0.02, "s", (0.001, 10.0), "regulator time constant", REGULATOR_LAG),
        *shared(VRMAX=7.3, VRMIN=-7.3),
        ("KE", 1.0, "pu", (0.001, 10.0), "exciter constant"),
        *shared(TE=0.8, KF=0.03, TF1=1.0),
        ("TF2", 0.8, *TIME, "stabilising feedback lag", LAG_OF_KF),
        ("TF3", 0.0, *TIME, "stabilising feedback lead"),
        *shared(E1=5.6, SE1=0.86, E2=4.2, SE2=0.5),
    ),
    "VC VR VE VL VF",
    aliases="ESAC5A",
    records=record("ESAC5A", "TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2"),
    pslf_records=record(
        "esac5a",
        "TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)


def ac5c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC5C: simplified brushless exciter with a rectifier (IEEE Std 421.5-2016).

              vsum        VAMAX               UEL OEL      VE <= VEMAX
                ▼
    vref + vs ►(+)─►(+)─►[  KA  ]─────┬─ VA ─►[gates]►(+)─►[  1  ]─┬ VE ─►(x)─► efd
              -▲    -▲   [1+sTA]      │               -▲   [ sTE ] │       ▲
               │     │    VAMIN       │                │    VEMIN  │      FEX
    vc1►[  1  ]┘     │                │                └── VFE ◄───┘       ▲
        [1+sTR]      └─[  sKF   ]◄─[1 + sTF3]                        KC IFD / VE
                       [1 + sTF1]  [1 + sTF2]

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    limits of the lag and of VE are non-windup. The feedback is taken from VA:
    efd of a brushless machine cannot be measured, and 1/(1 + sTF2) stands for the
    exciter. TF2 = 0 bypasses TF3 with it. TA > 0: the loop needs a lag. Without a
    rectifier (KC = KD = 0), with VFEMAX out of reach and VEMIN = 0 it is AC5A,
    whose VRMAX and VRMIN are VAMAX and VAMIN here; its saturation is that of the
    loaded exciter. KC and KD are those of the sample of AC1A here.

    The limiters act at the summing point (vsum) or at the gates. The sources are
    the drawing of 2005, the program InterPSS, which adds rectifier and gates, and
    the parameters that PowerWorld lists. The rectifier is that of PowerWorld 24 (vt
    1e-6 pu over a fault); the gates rest on InterPSS alone.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(s.VA, s.VL, p.TF3, p.TF2)
    vf, d.VF = washout(vl, s.VF, p.KF, p.TF1)
    error = u.vref + u.vs + u.vsum - vc - vf
    va, d.VA = limited_lag(error, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    efe = clip(va, u.vuel, u.voel)
    efd, d.VE = limited_alternator(efe, vfe, s, u, p)
    return efd


def ac5c_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE, vfe = alternator_rest(efd, u, p)
    x.VC, x.VA, x.VL, x.VF = u.vc1, vfe, vfe, vfe
    return u.vc1 + vfe / p.KA - u.vs


AC5C = documented(
    ac5c,
    ac5c_rest,
    (
        *renamed(AC5A.sheet, VRMAX="VAMAX", VRMIN="VAMIN"),
        *shared(KC_FREE=0.2, KD=0.38, VFEMAX=99.0, VEMIN=0.0),
    ),
    "VC VA VE VL VF",
    aliases="ESAC5C",
    records=record_of_2016(
        "AC5C",
        "TR KA TA VAMAX VAMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2 KC KD VFEMAX VEMIN",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)
