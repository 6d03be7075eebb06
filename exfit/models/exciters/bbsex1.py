"""BBSEX1: static exciter at the terminals, ABB's regulator (PSS/E BBSEX1).

           vsum             VRMAX         VT EFDMAX
             ▼
vref + vs ─►(+)─►[1 + sT3]─►[K (1+sT2)]─►[clip]─► efd
           -▲    [1 + sT4]  [  1+sT1  ]  VT EFDMIN
            │               VRMIN
vc1 ►[  1  ]┘
     [1+sTR]

The limits VRMAX, VRMIN are non-windup, as IEEE Std 421.5-2005, annex E, draws
those of a lead-lag: what they leave goes back through a lag T2, times
(T1 / T2 - 1) / K. Two open models written after PSS/E's BBSEX1 agree. The
limits of efd follow the terminal voltage itself. CIM's ExcBBC, whose data are
the typical ones, is this with a fall of VT by XE and without TR, which is not
that of a sample.

In a PSS/E record TR is TF, and SWITCH = 0: the stabiliser acts on the error.
Not modelled: SWITCH = 1, a stabiliser added behind VRMAX; UEL and OEL other
than at the summing point.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited_lead_lag
from exfit.models.sheet import TIME, SearchRange, limits, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.01, K=300.0),
    ("T1", 6.0, *TIME, "regulator lag", SearchRange(unlike="T2")),
    ("T2", 1.0, *TIME, "regulator lead", SearchRange(unlike="T1")),
    ("T3", 0.05, *TIME, "second regulator lead"),
    ("T4", 0.01, *TIME, "second regulator lag"),
    *shared(VRMAX=5.0, VRMIN=-5.0),
    *limits("EFDMAX", 5.0, -5.0, "the field voltage at rated voltage"),
)

ALIASES = "EXBBC"
RECORDS = record(
    "BBSEX1",
    "TR K T1 T2 T3 T4 VRMAX VRMIN EFDMAX EFDMIN SWITCH",
    absent={"SWITCH": 0.0},
    spelled={"TR": "TF"},
)

STATES = "VC VL VR"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc, s.VL, p.T3, p.T4)
    vr, d.VR = limited_lead_lag(p.K * vl, s.VR, p.T2, p.T1, p.VRMIN, p.VRMAX)
    return clip(vr, u.vt * p.EFDMIN, u.vt * p.EFDMAX)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.K
    x.VC, x.VL, x.VR = u.vc1, error, efd
    return u.vc1 + error - u.vs
