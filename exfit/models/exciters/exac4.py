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

from exfit.engine.trace import Signal
from exfit.models.blocks import clip, lag, lead_lag
from exfit.models.rows import shared
from exfit.models.sheet import LAG_OF_TC, LEAD_OF_TB, record, sheet

SHEET = sheet(
    *shared(TR=0.0, VIMAX=10.0, VIMIN=-10.0),
    ("TC", 1.0, "s", (0.0, 100.0), "regulator lead", LEAD_OF_TB),
    ("TB", 10.0, "s", (0.0, 100.0), "regulator lag", LAG_OF_TC),
    *shared(KA=200.0, TA=0.015),
    ("VRMAX", 5.64, "pu", (-9999.0, 9999.0), "ceiling of the field voltage"),
    ("VRMIN", -4.53, "pu", (-9999.0, 9999.0), "floor of the field voltage"),
    *shared(KC=0.0),
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
