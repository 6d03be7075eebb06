"""EXAC1: alternator exciter with rate feedback (IEEE type AC1 of 1981).

            vsum             VRMAX          VE >= 0
              ▼
vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
           -▲   ▲-[1 + sTB]  [1+sTA]  -▲    [ sTE ] │        ▲
            │   │            VRMIN     │            │       FEX
vc1 ►[  1  ]┘   │  [  sKF  ]           │            │        ▲
     [1+sTR]    └──[1 + sTF]◄──────────┴─── VFE ◄───┘   KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD. The limits of the lag and of VE are non-windup.
AC1A is this with limits VAMAX and VAMIN of its own at the lag and a clamp to
VRMAX and VRMIN behind it.
"""

from exfit.models.blocks import (
    Signal,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.sheet import OF_A_LIST, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VRMAX=6.03, VRMIN=-5.43, TE=0.8, KF=0.03),
    *shared(TF=1.0, KC_FREE=0.2, KD=0.38, KE=1.0, E1=4.18, SE1=0.10, E2=3.14, SE2=0.03),
)

RECORDS = (record("EXAC1", "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2"),)

PSLF_RECORDS = (
    record(
        "exac1",
        "TR TB TC KA TA VRMAX VRMIN TE KF TF KC KD KE E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VL VR VE VF"


def regulated(vf: Signal, s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of all states but that of the feedback VF into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vl, d.VL = lead_lag(u.vref + u.vs + u.vsum - vc - vf, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, low=0.0)
    return rectifier(ve, p.KC * u.ifd)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vf, d.VF = washout(field_demand(s.VE, u.ifd, p), s.VF, p.KF, p.TF)
    return regulated(vf, s, u, p, d)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    error = vfe / p.KA
    x.VC, x.VL, x.VR, x.VE, x.VF = u.vc1, error, vfe, ve, vfe
    return u.vc1 + error - u.vs
