"""AC8C: alternator exciter, PID and supply of its own (IEEE Std 421.5-2016).

         vsum        VPIDMAX                   VRMAX         VE <= VEMAX
           ▼ UEL OEL                UEL OEL
vref + vs►(+)►[gates]►[KPR + KIR/s  ]►[gates]►[  KA  ]►(x)─►(+)►[  1  ]┬►(x)►efd
          -▲          [+sKDR/(1+sTDR)]        [1+sTA]   ▲   -▲  [ sTE ]│  ▲
           │           VPIDMIN                 VRMIN    │    │    VEMIN│ FEX
vc1►[  1  ]┘                                            VB   └── VFE ◄─┘  ▲
    [1+sTR]                                                          KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX.
VB = VE1 FEX(KC1 VFE / VE1), at most VBMAX, is the supply of the power stage. It
comes from the terminals (SW1 = 1, position A of the drawing),
VE1 = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT| with THETAP in degrees, or does
not depend on them (SW1 = 2, B), VE1 = KP. The current IT, and so KI, XL and
THETAP, act on load only. The limits of the lag and of VE are non-windup; the
integral is frozen while the PID is at its limit. With VB = 1 (SW1 = 2, KP = 1,
KC1 = 0) it is AC8B.

The limiters act at the summing point (vsum), at the gates before the PID or at
those behind it. Dynawo and InterPSS draw the same, with these differences:
Dynawo limits the PID by VRMAX and VRMIN, here it has its own limits, as in
InterPSS; both let the integral track the limited output. The stabiliser may
also be added behind the first gate (VOS = 2 in a PSS/E record): not modelled,
and the same where no limiter acts. The supply's data are not those of a sample.
"""

from exfit.models.alternators import SUPPLY, alternator, supply
from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    limited_lag,
    pi_rest,
    pid,
    rectifier_supply,
)
from exfit.models.exciters import ac8b
from exfit.models.sheet import TWO_GATES, record

ALIASES = ("ESAC8C",)

SHEET = (*ac8b.SHEET, *SUPPLY)

RECORDS = (
    record(
        "AC8C",
        "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN KC KD KE TE VFEMAX VEMIN "
        "E1 SE1 E2 SE2 KP KI XL THETAP KC1 VBMAX",
        icons={"OEL": 1, "UEL": 1, "VOS": 1, "SW1": 1},
        ignored="OEL UEL",
        places=TWO_GATES,
        doubt="PSS/E 36 reads constants in this order as AC8CU1, a user's model of five integers",
    ),
)

STATES = ac8b.STATES


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = clip(u.vref + u.vs + u.vsum - vc, u.vuel, u.voel)
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    gated = clip(vpid, u.vuel_out, u.voel_out)
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    efd, d.VE = alternator(vr * supply(u, vfe, p), vfe, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(x.VE, u.ifd, p)
    x.VC, x.VR = u.vc1, vfe / supply(u, vfe, p)
    x.VD, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    return u.vc1 + x.VD - u.vs
