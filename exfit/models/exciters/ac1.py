"""Alternator exciters with rate feedback: AC1A, AC1C, EXAC1 and EXAC1A."""

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_lag,
    rectifier,
    washout,
)
from exfit.models.exciter_parts import alternator, alternator_rest, limited_alternator, regulated
from exfit.models.sheet import (
    AS_IN_PSSE,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    ONE_GATE,
    documented,
    record,
    record_of_2016,
    renamed,
    shared,
    sheet,
)


def ac1a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC1A: alternator exciter with rate feedback (IEEE Std 421.5-2005, 6.1).

                                 VAMAX   VRMAX         VE >= 0
    vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►[clip]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
               -▲   ▲-[1 + sTB]  [1+sTA]          -▲    [ sTE ] │        ▲
                │   │            VAMIN   VRMIN     │            │       FEX
    vc1 ►[  1  ]┘   │  [  sKF  ]                   │            │        ▲
         [1+sTR]    └──[1 + sTF]◄──────────────────┴─── VFE ◄───┘   KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD. The limits of the lag are non-windup; the clamp
    behind it is not: VA may exceed VRMAX. The gates of UEL and OEL, not drawn, are
    between the two.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va = regulated(vfe, s, u, p, d)
    vr = clip(clip(va, u.vuel, u.voel), p.VRMIN, p.VRMAX)
    efd, d.VE = alternator(vr, vfe, s, u, p)
    return efd


def ac1a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve, vfe = alternator_rest(efd, u, p)
    error = vfe / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, vfe, ve, vfe
    return u.vc1 + error - u.vs


AC1A = documented(
    ac1a,
    ac1a_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VAMAX=14.5, VAMIN=-14.5),
        *shared(VRMAX_OF_EXCITER=6.03, VRMIN_OF_EXCITER=-5.43, TE=0.8, KF=0.03, TF=1.0),
        *shared(KC_FREE=0.2, KD=0.38, KE=1.0, E1=4.18, SE1=0.10, E2=3.14, SE2=0.03),
    ),
    "VC VL VA VE VF",
    aliases="ESAC1A",
    records=record(
        "ESAC1A", "TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 VRMAX VRMIN"
    ),
    pslf_records=record(
        "esac1a",
        "TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 VRMAX VRMIN SPDMLT",
        ignored="SPDMLT",
        doubt=AS_IN_PSSE,
    ),
)


def ac1c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC1C: alternator exciter with rate feedback (IEEE Std 421.5-2016).

              vsum              VAMAX    UEL OEL   EFEMAX   VE <= VEMAX
                ▼
    vref + vs ►(+)─►[1 + sTC]─►[  KA  ]─►[gates]─►[clip]►(+)►[  1  ]─┬ VE ─►(x)► efd
              -▲ ▲- [1 + sTB]  [1+sTA]                   -▲  [ sTE ] │       ▲
               │ │              VAMIN              EFEMIN │    VEMIN │      FEX
    vc1►[  1  ]┘ │  [  sKF  ]                             │          │       ▲
        [1+sTR]  └──[1 + sTF]◄────────────────────────────┴── VFE ◄──┘  KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    limits of the lag and of VE are non-windup; the clamp behind the gates is not.
    With VFEMAX out of reach and VEMIN = 0 it is AC1A, whose VRMAX and VRMIN are
    EFEMAX and EFEMIN here.

    The limiters act at the summing point (vsum) or at the gates. Dynawo and
    InterPSS draw the same.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va = regulated(vfe, s, u, p, d, u.vsum)
    efe = clip(clip(va, u.vuel, u.voel), p.EFEMIN, p.EFEMAX)
    efd, d.VE = limited_alternator(efe, vfe, s, u, p)
    return efd


AC1C = documented(
    ac1c,
    ac1a_rest,
    (*renamed(AC1A.sheet, VRMAX="EFEMAX", VRMIN="EFEMIN"), *shared(VFEMAX=99.0, VEMIN=0.0)),
    "VC VL VA VE VF",
    aliases="ESAC1C",
    records=record_of_2016(
        "AC1C",
        "TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 EFEMAX EFEMIN VFEMAX VEMIN",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)


def exciter_of_1981(vf: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of all states but that of the feedback VF into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = alternator(vr, vfe, s, u, p)
    return efd


def exac1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXAC1: alternator exciter with rate feedback (IEEE type AC1 of 1981).

                vsum             VRMAX          VE >= 0
                  ▼
    vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
               -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [ sTE ] │        ▲
                │   │            VRMIN     │            │       FEX
    vc1 ►[  1  ]┘   │  [  sKF  ]           │            │        ▲
         [1+sTR]    └──[1 + sTF]◄──────────┴─── VFE ◄───┘   KC IFD / VE

    VFE = KE VE + VX(VE) + KD IFD. The limits of the lag and of VE are non-windup.
    AC1A is this with limits VAMAX and VAMIN of its own at the lag and a clamp to
    VRMAX and VRMIN behind it.
    """
    vf, d.VF = washout(field_demand(s.VE, u.ifd, p), s.VF, p.KF, p.TF)
    return exciter_of_1981(vf, s, u, p, d)


def exac1_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve, vfe = alternator_rest(efd, u, p)
    error = vfe / p.KA
    x.VC, x.VL, x.VR, x.VE, x.VF = u.vc1, error, vfe, ve, vfe
    return u.vc1 + error - u.vs


EXAC1 = documented(
    exac1,
    exac1_rest,
    sheet(
        *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VRMAX=6.03, VRMIN=-5.43, TE=0.8),
        *shared(KF=0.03, TF=1.0, KC_FREE=0.2, KD=0.38, KE=1.0, E1=4.18, SE1=0.10, E2=3.14),
        *shared(SE2=0.03),
    ),
    "VC VL VR VE VF",
    records=record("EXAC1", "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2"),
    pslf_records=record(
        "exac1",
        "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)


def exac1a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """EXAC1A: alternator exciter with feedback of its field voltage (PSS/E EXAC1A).

                                 VRMAX          VE >= 0
    vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─┬─► efd
               -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [ sTE ] │        ▲  │
                │   │            VRMIN     │            │       FEX │
    vc1 ►[  1  ]┘   │                      └─── VFE ◄───┘        ▲  │
         [1+sTR]    │                                  KC IFD / VE  │
                    └────────────[  sKF  ]◄─────────────────────────┘
                                 [1 + sTF]

    EXAC1 with the rate feedback of efd, not of VFE = KE VE + VX(VE) + KD IFD. The
    limits of the lag and of VE are non-windup. Two open models written after
    PSS/E's EXAC1A agree, but one of them takes the saturation SE at efd instead of
    VE. Typical data are those of EXAC1.
    """
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vf, d.VF = washout(efd, s.VF, p.KF, p.TF)
    return exciter_of_1981(vf, s, u, p, d)


def exac1a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = exac1_rest(efd, u, p, x)
    x.VF = efd
    return vref


EXAC1A = documented(
    exac1a,
    exac1a_rest,
    EXAC1.sheet,
    "VC VL VR VE VF",
    records=record("EXAC1A", "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2"),
)
