"""AC2C: alternator exciter with high initial response (IEEE Std 421.5-2016).

          vsum              VAMAX              UEL OEL   EFEMAX
            ▼
vref + vs ►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[KB]─►[gates]─►[clip]─┐
          -▲ ▲- [1 + sTB]  [1+sTA]  -▲                   EFEMIN │ EFE
           │ │              VAMIN    └─[KH]◄──┐                 │
vc1►[  1  ]┘ │                                │   VE <= VEMAX   ▼
    [1+sTR]  │          efd ◄─(x)◄─ VE ──┬────┼─────[  1  ]◄───(+)
             │                 ▲         │    │     [ sTE ]    -▲
             │                FEX        │    │      VEMIN      │
             │                 ▲         └────┼─────► VFE ──────┤
             │            KC IFD / VE         │                 │
             │  [  sKF  ]                     │                 │
             └──[1 + sTF]◄────────────────────┴─────────────────┘

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
limits of the lag and of VE are non-windup; the clamp behind the gates is not.
KH closes a loop that shortens the exciter's time constant, so at rest
VA = VFE / KB + KH VFE. With VEMIN = 0 it is AC2A, whose VRMAX and VRMIN are
EFEMAX and EFEMIN here.

The limiters act at the summing point (vsum) or at the gates. The sources are
the drawing of 2005, which differs in nothing else, the program InterPSS and the
parameters that PowerWorld lists.
"""

from exfit.models.alternators import FLOOR, alternator
from exfit.models.blocks import Signal, clip, field_demand, lag, lead_lag, limited_lag, washout
from exfit.models.exciters import ac2a
from exfit.models.sheet import OF_TWO_PROGRAMS, record, renamed

ALIASES = ("ESAC2C",)

SHEET = (*renamed(ac2a.SHEET, VRMAX="EFEMAX", VRMIN="EFEMIN"), *FLOOR)

RECORDS = (
    record(
        "AC2C",
        "TR TB TC KA TA VAMAX VAMIN KB EFEMAX EFEMIN TE VFEMAX KH KF TF KC KD KE E1 SE1 E2 SE2 "
        "VEMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES, rest = ac2a.STATES, ac2a.rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    gated = clip(p.KB * (va - p.KH * vfe), u.vuel, u.voel)
    efd, d.VE = alternator(clip(gated, p.EFEMIN, p.EFEMAX), vfe, s, u, p)
    return efd
