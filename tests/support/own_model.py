"""OWN: alternator exciter with rate feedback (IEEE Std 421.5-2005, 6.1).

                             VAMAX   VRMAX         VE >= 0
vref + vs ──►(+)─►[1 + sTC]─►[  KA  ]─►[clip]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
           -▲   ▲-[1 + sTB]  [1+sTA]          -▲    [ sTE ] │        ▲
            │   │            VAMIN   VRMIN     │            │       FEX
vc1 ►[  1  ]┘   │  [  sKF  ]                   │            │        ▲
     [1+sTR]    └──[1 + sTF]◄──────────────────┴─── VFE ◄───┘   KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD. The limits of the lag are non-windup; the clamp
behind it is not: VA may exceed VRMAX. The gates of UEL and OEL, not drawn, are
between the two.
"""

from exfit.engine.trace import Signal
from exfit.models.blocks import (
    clip,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.sheet import LOADING, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, TB=0.0, TC=0.0, KA=400.0, TA=0.02, VAMAX=14.5, VAMIN=-14.5),
    ("VRMAX", 6.03, "pu", (-9999.0, 9999.0), "ceiling of the exciter's field voltage"),
    ("VRMIN", -5.43, "pu", (-9999.0, 9999.0), "floor of the exciter's field voltage"),
    *shared(TE=0.8, KF=0.03, TF=1.0),
    ("KC", 0.2, "pu", (0.0, 100.0), "rectifier loading factor", LOADING),
    *shared(KD=0.38, KE=1.0, E1=4.18, SE1=0.10, E2=3.14, SE2=0.03),
)

STATES = "VC VL VA VE VF"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF, p.TF)
    vl, d.VL = lead_lag(u.vref + u.vs - vc - vf, s.VL, p.TC, p.TB)
    va, d.VA = limited_lag(vl, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    vr = clip(clip(va, u.vuel, u.voel), p.VRMIN, p.VRMAX)
    ve, d.VE = limited_integrator(vr - vfe, s.VE, p.TE, low=0.0)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    error = vfe / p.KA
    x.VC, x.VL, x.VA, x.VE, x.VF = u.vc1, error, vfe, ve, vfe
    return u.vc1 + error - u.vs
