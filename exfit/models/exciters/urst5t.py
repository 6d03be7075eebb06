"""URST5T: static exciter with two lead-lags in series (PSS/E URST5T).

      vsum    UEL OEL         VRMAX/KR    VRMAX/KR        VRMAX
        ▼
vref ─►(+)───►[gates]──►(+)─►[1 + sTC1]─►[1 + sTC2]─►[KR]─►[clip]─┐ VR
       -▲                ▲   [1 + sTB1]  [1 + sTB2]       VRMIN   │
        │                │    VRMIN/KR    VRMIN/KR                │
vc1 ►[  1  ]             vs             VT VRMAX                  │
     [1+sTR]              efd ◄──(+)◄──[  1  ]◄───────────────────┘
                                 -▲    [1+sT1]
                                  │    VT VRMIN
                               KC IFD

The proposal from which ST5B came: KC IFD is taken behind the lag T1 and its
limits, and there are no lead-lags of limiters. Otherwise it is ST5B; OpenIPSL's
and OPAL-RT's models, written after PSS/E's, agree. Typical data are ST5B's.
"""

from exfit.models.blocks import Signal, clip, lag, limited_lag
from exfit.models.exciters import st5b
from exfit.models.exciters.st5b import SHEET, STATES
from exfit.models.sheet import record

__all__ = ["RECORDS", "SHEET", "STATES", "equations", "rest"]

RECORDS = (record("URST5T", "TR TC1 TB1 TC2 TB2 KR VRMAX VRMIN T1 KC"),)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vsum - vc, u.vuel, u.voel) + u.vs
    times = p.TC1, p.TB1, p.TC2, p.TB2
    vl, d.VL1, d.VL2 = st5b.lead_lags(error, (s.VL1, s.VL2), times, p)
    vr = clip(p.KR * vl, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_lag(vr, s.VE, 1.0, p.T1, u.vt * p.VRMIN, u.vt * p.VRMAX)
    return ve - p.KC * u.ifd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vref = st5b.rest(efd, u, p, x)
    x.VE = efd + p.KC * u.ifd
    return vref
