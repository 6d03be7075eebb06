"""DC4C: commutator exciter, PID regulator, own supply (IEEE Std 421.5-2016).

                         VRMAX/KA             UEL   OEL
vref + vs + vsum ─►(+)─►[KPR + KIR/s      ]───►HV───►LV────┐
                  -▲ ▲- [+ sKDR/(1 + sTDR)]                │
       vc1 ►[  1  ]┘ │   VRMIN/KA                          │
            [1+sTR]  │                                     │
                     │         VRMAX                       │
                     │   ┌─[   KA   ]◄─────────────────────┘
                     │   │ [1 + sTA ]
                     │   │     VRMIN
                     │   └►(x)─►(+)─►[  1  ]─┬─────────────► efd
                     │      ▲   -▲   [ sTE ] │
                     │      VB   │    VEMIN  │
                     │           └── VFE ◄───┤
                     └──────[   sKF  ]◄──────┘
                            [1 + sTF ]

VFE = KE EFD + VX(EFD). VB = VE FEX(KC1 VFE / VE), at most VBMAX, is the supply
of the regulator. It comes from the terminals (SW1 = 1, position A of the
drawing), VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with THETAP in degrees,
or does not depend on them (SW1 = 2, B), VE = KP. The current IT, and so KI, XL
and THETAP, act on load only. The limiters act at the summing point (vsum) or at
the gates. The limits of the lag and of EFD are non-windup; the integral is
frozen while the PID is at its limit. DC4B multiplies with VT before the lag TA:
with TA = 0 and VB = VT they are one model. KE and VRMAX are used as given, also
0. The drawing is PowerWorld's and InterPSS's, and vt that of PowerWorld 24
(1e-6 pu over a fault, without KC1 and saturation); VFE as the current of the
rectifier is InterPSS's. Typical data are the standard's, as GridKit has them,
but for saturation (DC4B's; the SE of 1.54 at 4.8 lets no EFD pass 1.5) and KC1.
"""

from exfit.models.alternators import SUPPLY, supply
from exfit.models.blocks import (
    Signal,
    clip,
    exciter,
    exciter_demand,
    lag,
    limited_lag,
    pi_rest,
    pid,
    washout,
)
from exfit.models.sheet import record, shared, sheet

DOUBT = "rests on one public diagram for the load of its supply (KC1), that of InterPSS"
SHEET = (
    *sheet(
        *shared(TR=0.0, KPR=80.0, KIR=20.0, KDR=20.0, TDR=0.01, VRMAX=2.7, VRMIN=-2.7),
        *shared(KA_FIXED=1.0, TA=0.02, KE_SIGNED=1.0, TE=0.8, KF_FIXED=0.0, TF=1.0, VEMIN=0.0),
        *shared(E1=2.33, SE1=0.27, E2=1.75, SE2=0.08),
    ),
    *SUPPLY,
)

RECORDS = (
    record(
        "DC4C",
        "TR KPR KIR KDR TDR VRMAX VRMIN KA TA KE TE KF TF VEMIN E1 SE1 E2 SE2 "
        "KP KI XL THETAP KC1 VBMAX",
        icons={"OEL": 1, "UEL": 1, "SCL": 1, "SW1": 1},
        ignored="OEL UEL SCL",
        doubt="PSS/E 36 reads constants in this order as DC4CU1, a user's model",
    ),
)

STATES = "VC VI VD VR EFD VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs + u.vsum - vc - vf
    low, high = p.VRMIN / p.KA, p.VRMAX / p.KA
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, low, high)
    gated = clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    vb = supply(u, exciter_demand(s.EFD, p.KE, p), p)
    efd, d.EFD = exciter(vr * vb, s.EFD, p.KE, p, p.VEMIN)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vfe = exciter_demand(efd, p.KE, p)
    x.VR = vfe / supply(u, vfe, p)
    error, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    x.VC, x.VD, x.EFD, x.VF = u.vc1, error, efd, efd
    return u.vc1 + error - u.vs
