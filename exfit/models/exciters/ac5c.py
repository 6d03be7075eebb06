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

from exfit.models.alternators import FIELD_LIMITS, alternator
from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    lead_lag,
    limited_lag,
    rectifier_supply,
    washout,
)
from exfit.models.exciters import ac1a, ac5a
from exfit.models.sheet import OF_TWO_PROGRAMS, ONE_GATE, record, renamed

ALIASES = ("ESAC5C",)

SHEET = (
    *renamed(ac5a.SHEET, VRMAX="VAMAX", VRMIN="VAMIN"),
    *(row for row in ac1a.SHEET if row.symbol in ("KC", "KD")),
    *FIELD_LIMITS,
)

RECORDS = (
    record(
        "AC5C",
        "TR KA TA VAMAX VAMIN KE TE KF TF1 TF2 TF3 E1 SE1 E2 SE2 KC KD VFEMAX VEMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES = "VC VA VE VL VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(s.VA, s.VL, p.TF3, p.TF2)
    vf, d.VF = washout(vl, s.VF, p.KF, p.TF1)
    error = u.vref + u.vs + u.vsum - vc - vf
    va, d.VA = limited_lag(error, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    efd, d.VE = alternator(clip(va, u.vuel, u.voel), vfe, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = rectifier_supply(efd, p.KC * u.ifd)
    x.VA = x.VL = x.VF = field_demand(x.VE, u.ifd, p)
    x.VC = u.vc1
    return u.vc1 + x.VA / p.KA - u.vs
