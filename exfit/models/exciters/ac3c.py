"""AC3C: alternator exciter, its own supply, with a PID (IEEE Std 421.5-2016).

          vsum     VPIDMAX                   UEL OEL      VAMAX
            ▼
vref + vs ►(+)─►[KPR + KIR/s   ]─►[1 + sTC]─►[gates]►(+)─►[  KA  ]─┐
          -▲    [+ sKDR/(1+sTDR)] [1 + sTB]         -▲    [1+sTA]  │ VA
           │     VPIDMIN                             │     VAMIN   ▼
vc1►[  1  ]┘                                         │   KR efd ─►(x)
    [1+sTR]                                          │             │
            ┌────────────────────────────────────────┘ VE <= VEMAX ▼
            │                        efd ◄──(x)◄─ VE ─┬─[  1  ]◄──(+)
            │                                ▲        │ [ sTE ]   -▲
            │                               FEX       │   VEMIN    │
            │  [   s   ]                     ▲        └───► VFE ───┘
            └──[1 + sTF]◄─ VN         KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. VN is
efd through a gain KF up to EFDN and KN beyond it. The exciter supplies its
regulator, so the gain of both grows with efd. The limits of the lag and of VE
are non-windup; the integral is frozen while the PID is at its limit. With a
PID of 1 (KPR = 1, KIR = KDR = 0) it is AC3A, whose sample data it has. The PID
is not that of a sample: GridKit, with the standard's sample data, has it at 1.

The limiters act at the summing point (vsum) or at the gates. The sources are
the drawing of 2005, the program InterPSS, which adds the PID and the gates, and
the parameters that PowerWorld lists. The PID is that of PowerWorld 24 (vt 1e-6
pu over a fault, KC = KD = 0); the gates rest on InterPSS alone. VEMIN is 0.1
here; with 0 VE stays at 0 once it is there, since the regulator then has no
supply.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_ceiling,
    field_demand,
    lag,
    lead_lag,
    limited_integrator,
    limited_lag,
    pi_rest,
    pid,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.exciters import ac3a
from exfit.models.sheet import OF_TWO_PROGRAMS, ONE_GATE, PID_GAIN, record, shared, sheet

ALIASES = ("ESAC3C",)

SHEET = (
    *ac3a.SHEET,
    *sheet(
        ("KPR", 1.0, *PID_GAIN, "proportional gain"),
        *shared(KIR=0.5),
        ("KDR", 0.0, "pu s", (0.0, 100000.0), "derivative gain"),
        *shared(TDR=0.1, VPIDMAX=1.0, VPIDMIN=-1.0),
    ),
)

RECORDS = (
    record(
        "AC3C",
        "TR TB TC KA TA VAMAX VAMIN TE VEMIN KR KF TF KN EFDN KC KD KE VFEMAX E1 SE1 E2 SE2 "
        "KPR KIR KDR TDR VPIDMAX VPIDMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        places=ONE_GATE,
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES = f"{ac3a.STATES} VI VD"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    # before the integrator that makes it: the exciter feeds its own regulator
    efd = rectifier(clip(s.VE, p.VEMIN, vemax), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(ac3a.feedback(efd, p), s.VF, 1.0, p.TF)
    error = u.vref + u.vs + u.vsum - vc
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vl, d.VL = lead_lag(vpid, s.VL, p.TC, p.TB)
    gated = clip(vl, u.vuel, u.voel)
    va, d.VA = limited_lag(gated - vf, s.VA, p.KA, p.TA, p.VAMIN, p.VAMAX)
    _, d.VE = limited_integrator(p.KR * efd * va - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE = rectifier_supply(efd, p.KC * u.ifd)
    x.VA = field_demand(x.VE, u.ifd, p) / (p.KR * efd)
    x.VL = x.VA / p.KA
    x.VD, x.VI = pi_rest(x.VL, p.KPR, p.KIR)
    x.VC, x.VF = u.vc1, ac3a.feedback(efd, p)
    return u.vc1 + x.VD - u.vs
