"""ST2C: compound-source rectifier exciter with a PID (IEEE Std 421.5-2016).

           vsum        VPIDMAX     UEL OEL    VRMAX             EFDMAX
             ▼
vref + vs ─►(+)─►[KPR + KIR/s   ]─►[gates]─►[  KA  ]─►(x)─►(+)─►[  1  ]─┬─►efd
           -▲ ▲- [+ sKDR/(1+sTDR)]          [1+sTA]    ▲   -▲   [ sTE ] │
            │ │        VPIDMIN               VRMIN     VB   │      0    │
            │ │                                             └───[ KE ]◄─┤
            │ │                                                         │
vc1 ►[  1  ]┘ └──────────────────[  sKF  ]◄─────────────────────────────┘
     [1+sTR]                     [1 + sTF]

VB = VE FEX(KC IFD / VE), at most VBMAX, with the source
VE = |KP∠THETAP VT + j (KI + KP∠THETAP XL) IT|, THETAP in degrees; VE FEX is 1
where KP = KI = 0, as in PSS/E. The current IT, and so KI, XL and THETAP, act on
load only. The limits of the regulator and of efd are non-windup; the integral
is frozen while the PID is at its limit. With KPR = 1, no integral and no
derivative, XL = 0 and VBMAX out of reach it is ST2A.

The limiters act at the summing point (vsum) or at the gates behind the PID.
InterPSS writes this; the parameters and limits that PowerWorld lists agree, but
for the derivative, which the standard does not have and the record of PSS/E
has. vt is that of PowerWorld 24 (1e-6 pu over a fault, with KI = KC = 0); the
gates rest on InterPSS alone. The model of this name in Dynawo is a form of
ST2A. Typical data are those of ST2A; the sample of 2016, as GridKit has it, has
KI = XL = 0, KC = 0.1, VBMAX = 5.2 and EFDMAX = 4.4. PID, VBMAX and XL are not
those of a sample.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    limited_integrator,
    limited_lag,
    pi_rest,
    pid,
    smaller,
    source_voltage,
    washout,
    where,
)
from exfit.models.exciters import st2a
from exfit.models.sheet import OF_TWO_PROGRAMS, not_searched, record, shared
from exfit.models.static import PID

ALIASES = ("ESST2C",)

SHEET = (
    *not_searched(st2a.SHEET, "KA"),
    *PID,
    *shared(XL=0.081, THETAP=0.0, VBMAX=9.0),
)

RECORDS = (
    record(
        "ST2C",
        "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KA TA VRMAX VRMIN TE EFDMAX KE KF TF KP KI XL "
        "THETAP KC VBMAX",
        icons={"OEL": 1, "UEL": 1, "SCL": 1},
        ignored="OEL UEL SCL",
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES = "VC VI VD VR EFD VF"


def source(u: Signal, p: Signal) -> Signal:
    """Return VB, the voltage behind the rectifier."""
    unfed = (p.KP <= 0.0) & (p.KI <= 0.0)
    return where(unfed, smaller(1.0, p.VBMAX), source_voltage(u, p))


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs + u.vsum - vc - vf
    vpid, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    gated = clip(vpid, u.vuel, u.voel)
    vr, d.VR = limited_lag(gated, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    driven = vr * source(u, p) - p.KE * s.EFD
    efd, d.EFD = limited_integrator(driven, s.EFD, p.TE, 0.0, p.EFDMAX)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VR = p.KE * efd / source(u, p)
    x.VD, x.VI = pi_rest(x.VR / p.KA, p.KPR, p.KIR)
    x.VC, x.EFD, x.VF = u.vc1, efd, efd
    return u.vc1 + x.VD - u.vs
