"""EXAC4: alternator with a controlled rectifier (IEEE type AC4 of 1981).

                 VIMAX                       VRMAX - KC IFD
vref + vs ─►(+)─►[clip]─►[1 + sTC]─►[  KA  ]─►[clip]─► efd
           -▲    VIMIN   [1 + sTB]  [1+sTA]  VRMIN - KC IFD
            │
vc1 ►[  1  ]┘
     [1+sTR]

AC4A with other limits: the clamp is behind the lag, which can run beyond it
(windup), and the field current lowers both of its limits. Two models written
after PSS/E's EXAC4 agree; a third has the same limits, but non-windup. Not
modelled: UEL and OEL, which are added to vs.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, VIMAX=10.0, VIMIN=-10.0, TC_FREE=1.0, TB_FREE=10.0, KA=200.0, TA=0.015),
    *shared(VRMAX_OF_EFD=5.64, VRMIN_OF_EFD=-4.53, KC=0.0),
)

RECORDS = (record("EXAC4", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC"),)

PSLF_RECORDS = (
    record(
        "exac4",
        "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC",
    ),
)

STATES = "VC VL VR"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vi = clip(u.vref + u.vs - vc, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    vr, d.VR = lag(vl, s.VR, p.KA, p.TA)
    drop = p.KC * u.ifd
    return clip(vr, p.VRMIN - drop, p.VRMAX - drop)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.KA
    x.VC, x.VL, x.VR = u.vc1, error, efd
    return u.vc1 + error - u.vs
