"""Alternator exciters with a field current limiter: AC6A and AC6C."""

from exfit.models.blocks import Signal, clip, field_demand, lag, lead_lag, limited_lead_lag
from exfit.models.exciter_parts import alternator, alternator_rest, limited_alternator
from exfit.models.sheet import (
    FREE,
    LAG_OF_TC,
    LEAD_OF_TB,
    LIMIT,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    ONE_GATE,
    TIME,
    UP_TO_10000,
    documented,
    record,
    record_of_2016,
    renamed,
    shared,
    sheet,
)


def limiter(vfe: Signal, p: Signal) -> Signal:
    """Return VH, the output of the limiter where the field current is above VFELIM."""
    return clip(p.KH * (vfe - p.VFELIM), 0.0, p.VHMAX)


def amplified(vfe: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> tuple[Signal, Signal]:
    """Return VA, the error behind lag and lead, and VF, what the field current limiter takes."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vk, d.VK = lead_lag(p.KA * (u.vref + u.vs + u.vsum - vc), s.VK, p.TK, p.TA)
    va, d.VA = limited_lead_lag(vk, s.VA, p.TC, p.TB, p.VAMIN, p.VAMAX)
    vf, d.VH = lead_lag(limiter(vfe, p), s.VH, p.TJ, p.TH)
    return va, vf


def ac6a(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC6A: alternator exciter, field current limiter (IEEE Std 421.5-2005, 6.6).

               vsum               VAMAX          VT VRMAX      VE >= 0
                 ▼
    vref + vs ─►(+)─►[KA(1+sTK)]─►[1 + sTC]─►(+)─►[clip]─►(+)─►[  1  ]─┬─►(x)─► efd
               -▲    [ 1 + sTA ]  [1 + sTB] -▲           -▲    [ sTE ] │   ▲
                │                 VAMIN      │   VT VRMIN │            │  FEX
    vc1 ►[  1  ]┘                            │            │            │   ▲
         [1+sTR]                             │            ├─ VFE◄─ VE ─┘   │
                           ┌─────────────────┘            │          KC IFD / VE
                           │  [1 + sTJ]     VHMAX         ▼
                           └──[1 + sTH]◄────[ KH ]◄───────(+)
                                            0            -▲
                                                          └─── VFELIM

    VFE = KE VE + VX(VE) + KD IFD. The field current limiter acts above VFELIM; at
    rest VA = VFE + KH (VFE - VFELIM) there. The limit of the second lead-lag is
    non-windup as in annex E: at the limit its state follows the limited output with
    the lag TC. The limit of VE is non-windup; the clamps of VR and of the limiter
    are not. TB = 0 bypasses TC with it, TA = 0 TK, TH = 0 TJ. UEL and OEL are added
    to vs.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va, vf = amplified(vfe, s, u, p, d)
    vr = clip(va - vf, u.vt * p.VRMIN, u.vt * p.VRMAX)
    efd, d.VE = alternator(vr, vfe, s, u, p)
    return efd


def ac6a_rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve, vfe = alternator_rest(efd, u, p)
    vh = limiter(vfe, p)
    va = vfe + vh
    x.VC, x.VK, x.VA, x.VE, x.VH = u.vc1, va, va, ve, vh
    return u.vc1 + va / p.KA - u.vs


AC6A = documented(
    ac6a,
    ac6a_rest,
    sheet(
        *shared(TR=0.02, KA=536.0),
        ("TA", 0.086, *TIME, "regulator lag", FREE),
        ("TK", 0.18, *TIME, "regulator lead", FREE),
        ("TB", 9.0, *TIME, "second regulator lag", LAG_OF_TC),
        ("TC", 3.0, *TIME, "second regulator lead", LEAD_OF_TB),
        *shared(VAMAX=75.0, VAMIN=-75.0, VRMAX_OF_EXCITER=44.0, VRMIN_OF_EXCITER=-36.0, TE=1.0),
        ("VFELIM", 19.0, *LIMIT, "field current where the limiter begins"),
        ("KH", 92.0, *UP_TO_10000, "gain of the field current limiter"),
        ("VHMAX", 75.0, "pu", (0.0, 9999.0), "ceiling of the field current limiter"),
        ("TH", 0.08, *TIME, "field current limiter lag"),
        ("TJ", 0.02, *TIME, "field current limiter lead"),
        *shared(KC_FREE=0.173, KD=1.91, KE=1.6, E1=7.4, SE1=0.214, E2=5.55, SE2=0.044),
    ),
    "VC VK VA VE VH",
    aliases="ESAC6A",
    records=record(
        "ESAC6A",
        "TR KA TA TK TB TC VAMAX VAMIN VRMAX VRMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 E2 SE2",
    ),
    pslf_records=record(
        "esac6a",
        "TR KA TA TK TB TC VAMAX VAMIN VRMAX VRMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 E2 SE2 "
        "SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)


def ac6c(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """AC6C: alternator exciter, field current limiter (IEEE Std 421.5-2016).

              vsum                VAMAX   UEL OEL    VT EFEMAX     VE <= VEMAX
                ▼
    vref + vs ►(+)►[KA(1+sTK)]►[1 + sTC]►[gates]►(+)►[clip]►(+)►[  1  ]─┬─►(x)► efd
              -▲   [ 1 + sTA ] [1 + sTB]        -▲          -▲  [ sTE ] │   ▲
               │                  VAMIN          │ VT EFEMIN │   VEMIN  │  FEX
    vc1►[  1  ]┘                                 │           │          │   ▲
        [1+sTR]                                  │           ├─ VFE ◄VE─┘   │
                            ┌────────────────────┘           │        KC IFD / VE
                            │  [1 + sTJ]     VHMAX           ▼
                            └──[1 + sTH]◄────[ KH ]◄────────(+)
                                               0            -▲
                                                             └─── VFELIM

    VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
    field current limiter acts above VFELIM; at rest VA = VFE + KH (VFE - VFELIM)
    there. The limit of the second lead-lag is non-windup as in annex E of the
    edition of 2005: at the limit its state follows the limited output with the lag
    TC. The limits of VE are non-windup; the clamps of EFE and of the field current
    limiter are not. TB = 0 bypasses TC with it, TA = 0 TK, TH = 0 TJ. With VFEMAX
    out of reach and VEMIN = 0 it is AC6A, whose VRMAX and VRMIN are EFEMAX and
    EFEMIN here.

    The limiters act at the summing point (vsum) or at the gates. Dynawo and
    InterPSS draw the same; InterPSS clamps the output of the second lead-lag, whose
    state runs on.
    """
    vfe = field_demand(s.VE, u.ifd, p)
    va, vf = amplified(vfe, s, u, p, d)
    efe = clip(clip(va, u.vuel, u.voel) - vf, u.vt * p.EFEMIN, u.vt * p.EFEMAX)
    efd, d.VE = limited_alternator(efe, vfe, s, u, p)
    return efd


AC6C = documented(
    ac6c,
    ac6a_rest,
    (*renamed(AC6A.sheet, VRMAX="EFEMAX", VRMIN="EFEMIN"), *shared(VFEMAX=99.0, VEMIN=0.0)),
    "VC VK VA VE VH",
    aliases="ESAC6C",
    records=record_of_2016(
        "AC6C",
        "TR KA TA TK TB TC VAMAX VAMIN EFEMAX EFEMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 E2 "
        "SE2 VFEMAX VEMIN",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)
