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

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lead_lag,
    rectifier,
    rectifier_supply,
)
from exfit.models.sheet import (
    FREE,
    LAG_OF_TC,
    LEAD_OF_TB,
    LIMIT,
    OF_A_LIST,
    TIME,
    UP_TO_10000,
    record,
    shared,
    sheet,
)

ALIASES = ("ESAC6A",)

SHEET = sheet(
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
)

RECORDS = (
    record(
        "ESAC6A",
        "TR KA TA TK TB TC VAMAX VAMIN VRMAX VRMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 SE1 E2 SE2",
    ),
)

PSLF_RECORDS = (
    record(
        "esac6a",
        "TR KA TA TK TB TC VAMAX VAMIN VRMAX VRMIN TE VFELIM KH VHMAX TH TJ KC KD KE E1 "
        "SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VK VA VE VH"


def limiter(vfe: Signal, p: Signal) -> Signal:
    """Return VH, the output of the limiter where the field current is above VFELIM."""
    return clip(p.KH * (vfe - p.VFELIM), 0.0, p.VHMAX)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vk, d.VK = lead_lag(p.KA * (u.vref + u.vs + u.vsum - vc), s.VK, p.TK, p.TA)
    va, d.VA = limited_lead_lag(vk, s.VA, p.TC, p.TB, p.VAMIN, p.VAMAX)
    vf, d.VH = lead_lag(limiter(vfe, p), s.VH, p.TJ, p.TH)
    vr = clip(va - vf, u.vt * p.VRMIN, u.vt * p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, low=0.0)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    vh = limiter(vfe, p)
    va = vfe + vh
    x.VC, x.VK, x.VA, x.VE, x.VH = u.vc1, va, va, ve, vh
    return u.vc1 + va / p.KA - u.vs
