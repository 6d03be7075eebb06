"""ST1C: potential-source controlled rectifier (IEEE Std 421.5-2016).

                         VIMAX    UEL OEL                             VAMAX
vref + vs + vsum ──►(+)─►[clip]─►[gates]─►[1 + sTC]─►[1 + sTC1]─►[  KA  ]─┐ VA
                  -▲   ▲-VIMIN            [1 + sTB]  [1 + sTB1]  [1+sTA]  │
                   │   │                                          VAMIN   │
       vc1 ►[  1  ]┘   └──[  sKF  ]◄──────────────┐                       │
            [1+sTR]       [1 + sTF]               │                       │
                          VT VRMAX - KC IFD       │   UEL OEL             ▼
                  efd ◄────────[clip]◄────────────┴──[gates]◄────────────(+)◄ vs
                              VT VRMIN                                   -▲
                                                                          │
                                        KLR (IFD - ILR), where positive ──┘

ST1A with further places for limiters and stabiliser. The limiters act at the
summing point (vsum), at the gates behind VIMAX, or at those of the regulator's
output; the stabiliser is added to the voltage error (VOS = 1) or to VA (VOS =
2). The limits of the lag are non-windup; the two clamps are not. Gates are the
higher of the signal and UEL, then the lower of that and OEL.

Dynawo and InterPSS draw this. Both take the rate feedback before the last
clamp, as ST1A here does. PowerWorld lists the places in another order than
InterPSS's record of PSS/E: OEL, UEL, VOS. Typical data are those of ST1A.
"""

from exfit.models.blocks import Signal, lag, where
from exfit.models.exciters import st1a
from exfit.models.sheet import TWO_GATES, record, sheet

ALIASES = ("ESST1C",)

SHEET = (
    *st1a.SHEET,
    *sheet(
        ("VOS", 1.0, "1", (1.0, 2.0), "place of the stabiliser, on load: 1 error, 2 VA"),
    ),
)

RECORDS = (
    record(
        "ST1C",
        "TR VIMAX VIMIN TC TB TC1 TB1 KA TA VAMAX VAMIN VRMAX VRMIN KC KF TF KLR ILR",
        icons={"UEL": 1, "VOS": 1, "OEL": 1},
        ignored="UEL OEL",
        places=TWO_GATES,
    ),
)

STATES = st1a.STATES


def stabiliser_at_error(u: Signal, p: Signal) -> Signal:
    """Compute the stabiliser's part in the voltage error; the rest it adds to VA."""
    return where(p.VOS < 1.5, u.vs, 0.0)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vs = stabiliser_at_error(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    taken = st1a.excess(u, p) - (u.vs - vs)
    gates = (u.vuel, u.voel), (u.vuel_out, u.voel_out)
    return st1a.regulated(u.vref + vs + u.vsum - vc, taken, gates, s, u, p, d)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vs = stabiliser_at_error(u, p)
    return st1a.at_rest(efd, st1a.excess(u, p) - (u.vs - vs), u, p, x) - vs
