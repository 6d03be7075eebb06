"""AC4A: alternator with a controlled rectifier (IEEE Std 421.5-2005, 6.4).

           vsum  VIMAX             UEL  VRMAX - KC IFD
             ▼
vref + vs ─►(+)─►[clip]─►[1 + sTC]─►HV─►[  KA  ]─► efd
           -▲    VIMIN   [1 + sTB]      [1+sTA]
            │                           VRMIN
vc1 ►[  1  ]┘
     [1+sTR]

The limits of the lag are non-windup, and only the upper one falls with the
field current. An OEL is added to vs. The alternator's own regulator is left
out, as in the standard. PSS/E's older EXAC4 differs in its limits and is a
separate model.
"""

from exfit.models.blocks import Signal, clip, lag, larger, lead_lag, limited_lag
from exfit.models.sheet import AS_IN_PSSE, record, shared, sheet

ALIASES = ("ESAC4A",)

SHEET = sheet(
    *shared(TR=0.0, VIMAX=10.0, VIMIN=-10.0, TC_FREE=1.0, TB_FREE=10.0, KA=200.0, TA=0.015),
    *shared(VRMAX_OF_EFD=5.64, VRMIN_OF_EFD=-4.53, KC=0.0),
)

RECORDS = (record("ESAC4A", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC"),)

PSLF_RECORDS = (
    record(
        "esac4a",
        "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC",
        doubt=AS_IN_PSSE,
    ),
)

STATES = "VC VL VR"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs + u.vsum - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    ceiling = p.VRMAX - p.KC * u.ifd
    efd, d.VR = limited_lag(larger(vl, u.vuel), s.VR, p.KA, p.TA, p.VRMIN, ceiling)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.KA
    x.VC, x.VL, x.VR = u.vc1, error, efd
    return u.vc1 + error - u.vs
