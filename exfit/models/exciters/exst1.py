"""EXST1: potential-source controlled rectifier (IEEE type ST1 of 1981).

                  VIMAX                         VT VRMAX - KC IFD
vref + vs ──►(+)─►[clip]─►[1 + sTC]─►[  KA  ]─┬─►[clip]─► efd
           -▲   ▲-VIMIN   [1 + sTB]  [1+sTA]  │ VT VRMIN - KC IFD
            │   │                             │
vc1 ►[  1  ]┘   └─────────[  sKF  ]◄── VA ────┘
     [1+sTR]              [1 + sTF]

No limit is non-windup: the output is clamped behind the lag, whose state VA
runs on, and the rate feedback is taken before that clamp. The floor falls with
KC IFD as the ceiling does, as in PSS/E according to OpenIPSL and ANDES (ANDES
leaves VT out); the floor of ST1A, VT VRMIN, is another. Not modelled: UEL and
OEL, which here are added to the error.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, regulator_output, washout
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.02, VIMAX=0.2, VIMIN=-0.2, TC=1.0, TB=1.0, KA=80.0, TA=0.05),
    *shared(VRMAX_OF_EFD_AT_VT=8.0, VRMIN_OF_EFD_AT_VT=-3.0, KC=0.2, KF=0.1, TF=1.0),
)

RECORDS = (record("EXST1", "TR VIMAX VIMIN TC TB KA TA VRMAX VRMIN KC KF TF"),)

STATES = "VC VL VA VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs - vc
    vl, gain = lead_lag(error, s.VL, p.TC, p.TB)[0], lead_lag(1.0, 0.0, p.TC, p.TB)[0]
    vf, _ = washout(regulator_output(s, p, vl, gain), s.VF, p.KF, p.TF)
    vi = clip(error - vf, p.VIMIN, p.VIMAX)
    vl, d.VL = lead_lag(vi, s.VL, p.TC, p.TB)
    va, d.VA = lag(vl, s.VA, p.KA, p.TA)
    _, d.VF = washout(va, s.VF, p.KF, p.TF)
    drop = p.KC * u.ifd
    return clip(va, u.vt * p.VRMIN - drop, u.vt * p.VRMAX - drop)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    error = efd / p.KA
    x.VC, x.VL, x.VA, x.VF = u.vc1, error, efd, efd
    return u.vc1 + error - u.vs
