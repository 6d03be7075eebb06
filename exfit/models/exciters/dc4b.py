"""DC4B: commutator exciter, PID regulator (IEEE Std 421.5-2005, 5.4).

                  VRMAX/KA           VUEL  VOEL
vref + vs ─►(+)─►[KP + KI/s      ]───►HV───►LV──────┐
           -▲ ▲- [+ sKD/(1 + sTD)]                  │
vc1 ►[  1  ]┘ │   VRMIN/KA                          │
     [1+sTR]  │                                     │
              │      VT VRMAX                       │
              │   ┌─[   KA   ]◄─────(x)◄────────────┘
              │   │ [1 + sTA ]       ▲
              │   │  VT VRMIN       VT
              │   └►(+)─►[  1  ]─┬──────────────────► efd
              │     -▲   [ sTE ] │
              │      │    VEMIN  │
              │      └── VFE ◄───┤
              └──────[   sKF  ]◄─┘
                     [1 + sTF ]

VFE = KE EFD + VX(EFD). The limits of the lag and of EFD are non-windup;
the integral is frozen while the PID is at its limit. The regulator is fed
from the terminals: gain and limits are proportional to VT, as in the
standard's drawing, OpenIPSL and InterPSS. The standard's sample data have
KF = 0: the rate feedback is an alternative to the derivative.
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
(SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
setpoints KE0, VRMAX0, VRMIN0.
(For DC4B that is OpenIPSL's KE and InterPSS's KE and VRMAX; the standard
computes neither.) Not modelled: UEL or OEL at the summing point.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    commutator_start,
    exciter,
    lag,
    limited_lag,
    pi_rest,
    pid,
    washout,
)
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KP_OF_PID=80.0, KI_OF_PID=20.0, KD_OF_PID=20.0, TD=0.01, VRMAX_AT_VT_OR_0=2.7),
    *shared(VRMIN_AT_VT=0.0, KA_FIXED=1.0, TA=0.2, KE_OR_0=1.0, TE=0.8, KF_FIXED=0.0, TF=1.0),
    *shared(VEMIN=0.0, E1=2.33, SE1=0.27, E2=1.75, SE2=0.08),
)

RECORDS = (
    record(
        "DC4B",
        "TR KP KI KD TD VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2",
        icons={"OEL": 2, "UEL": 2},
        places={2: "takeover"},
    ),
)

STATES = "VC VI VD VR EFD VF"
SETPOINTS = "KE0 VRMAX0 VRMIN0"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs - vc - vf
    low, high = s.VRMIN0 / p.KA, s.VRMAX0 / p.KA
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KP, p.KI, p.KD, p.TD, low, high)
    fed = u.vt * clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(fed, s.VR, p.KA, p.TA, u.vt * s.VRMIN0, u.vt * s.VRMAX0)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p, p.VEMIN)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    start = commutator_start(efd, p)
    x.KE0, x.VRMAX0, x.VRMIN0 = start.KE, start.VRMAX, start.VRMIN
    error, x.VI = pi_rest(start.vr / (p.KA * u.vt), p.KP, p.KI)
    x.VC, x.VD, x.VR, x.EFD, x.VF = u.vc1, error, start.vr, efd, efd
    return u.vc1 + error - u.vs
