"""AC4C: alternator with a controlled rectifier (IEEE Std 421.5-2016).

           vsum  VIMAX            UEL OEL  VRMAX - KC IFD
             ▼
vref + vs ─►(+)─►[clip]─►[1 + sTC]─►[gates]─►[  KA  ]─► efd
           -▲    VIMIN   [1 + sTB]           [1+sTA]
            │                                VRMIN
vc1 ►[  1  ]┘
     [1+sTR]

The limits of the lag are non-windup, and only the upper one falls with the
field current. The alternator's own regulator is left out, as in the standard.
Without limiters it is AC4A.

The limiters act at the summing point (vsum) or at the gates. The sources are
the drawing of 2005 and the program InterPSS, which adds the gate of the OEL and
where the limit of the lag winds up.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited_lag
from exfit.models.exciters import ac4a
from exfit.models.sheet import OF_TWO_PROGRAMS, ONE_GATE, record

ALIASES = ("ESAC4C",)

SHEET = ac4a.SHEET

RECORDS = (
    record(
        "AC4C",
        "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES, rest = ac4a.STATES, ac4a.rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    gated = clip(vl, u.vuel, u.voel)
    ceiling = p.VRMAX - p.KC * u.ifd
    efd, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, ceiling)
    return efd
