"""ESAC8B: Basler DECS, a PID regulator on a simple exciter (PSS/E).

                                     VRMAX
vref + vs ─►(+)─►[KP + KI/s    ]─►[  KA  ]─►(+)─►[  1  ]─┬─► efd
           -▲    [+ sKD/(1+sTD)]  [1+sTA]  -▲    [ sTE ] │
vc1 ►[  1  ]┘                        VRMIN  │            │
     [1+sTR]                                └──── VFE ◄──┘

VFE = KE efd + VX(efd). The limits of the lag are non-windup; the PID has none,
so that its integral runs on while the lag is at its limit. No rectifier and no
demagnetisation: efd is the exciter voltage itself, without limits of its own.
AC8B (2005) is another model, with KC, KD and limits of the PID and of VE.
"""

from exfit.models.blocks import Signal, exciter, exciter_demand, lag, limited_lag, pi_rest, pid
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KP_OF_PID=40.0, KI_OF_PID=10.0, KD_OF_PID=15.0, TD=0.02, KA_FIXED=1.0),
    *shared(TA_FIXED=0.0, VRMAX=35.0, VRMIN=0.0, TE=1.2, KE=1.0, E1=9.0, SE1=3.0, E2=6.5, SE2=0.3),
)

RECORDS = (record("ESAC8B", "TR KP KI KD TD KA TA VRMAX VRMIN TE KE E1 SE1 E2 SE2"),)

STATES = "VC VI VD VR VE"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs - vc
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KP, p.KI, p.KD, p.TD)
    vr, d.VR = limited_lag(vpid, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = exciter(vr, s.VE, p.KE, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = exciter_demand(efd, p.KE, p)
    error, x.VI = pi_rest(vr / p.KA, p.KP, p.KI)
    x.VC, x.VD, x.VR, x.VE = u.vc1, error, vr, efd
    return u.vc1 + error - u.vs
