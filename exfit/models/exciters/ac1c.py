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

from exfit.models.alternators import FIELD_LIMITS, alternator
from exfit.models.blocks import Signal, clip, field_demand, lag, lead_lag, limited_lag, washout
from exfit.models.exciters import ac1a
from exfit.models.sheet import OF_TWO_PROGRAMS, ONE_GATE, record, renamed

ALIASES = ("ESAC1C",)

SHEET = (*renamed(ac1a.SHEET, VRMAX="EFEMAX", VRMIN="EFEMIN"), *FIELD_LIMITS)

RECORDS = (
    record(
        "AC1C",
        "TR TB TC KA TA VAMAX VAMIN TE KF TF KC KD KE E1 SE1 E2 SE2 EFEMAX EFEMIN VFEMAX VEMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES, rest = ac1a.STATES, ac1a.rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    efe = clip(clip(va, u.vuel, u.voel), p.EFEMIN, p.EFEMAX)
    efd, d.VE = alternator(efe, vfe, s, u, p)
    return efd
