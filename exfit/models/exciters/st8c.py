"""ST8C: static exciter with a field current loop (IEEE Std 421.5-2016).

          vsum      VPIMAX         UEL OEL    VAMAX        VRMAX
            ▼
vref + vs ►(+)►[KPR + KIR/s]─►(+)►[gates]─►[KPA + KIA/s]─►[  KA  ]─►(x)─►(+)►efd
           -▲       VPIMIN    -▲              VAMIN       [1+sTA]    ▲    ▲
            │                  │                           VRMIN    VB1  VB2
vc1 ►[  1  ]┘    ifd ►[  KF  ]─┘
     [1+sTR]          [1+sTF]

VB1 = VE1 FEX(KC1 IFD / VE1), at most VB1MAX. It comes from the terminals
(SW1 = 1, position A of the drawing), VE1 = |KP∠THETAP VT + j (KI1 + KP∠THETAP
XL) IT| with THETAP in degrees, or does not depend on them (SW1 = 2, B),
VE1 = KP. VB2 = VE2 FEX(KC2 IFD / VE2), at most VB2MAX, with VE2 = KI2 IT, is
added uncontrolled. The current IT, and so KI1, XL, THETAP and all of VB2, act
on load only. An integral is frozen while its PI is at its limit; the limit of
the lag is non-windup.

The limiters act at the summing point (vsum) or at the gates of the field
current regulator. That regulator sees KF IFD / (1 + sTF), as in
PowerSimulationsDynamics and in PSS/E 36.7, with whose curve it agrees (vt 1e-6
pu over a pulse of the reference); InterPSS draws IFD beside it. OEL is
subtracted at the summing point by PowerWorld and InterPSS; here a limiter has
the sign of what it adds. PowerSimulationsDynamics has VB1 for SW1 = 2 only, and
no VB2. Typical data are not those of a sample: that of the standard, as GridKit
has it, has no KIA and no second source (KPR 6.6, KIR 30, KPA 2.38, KA 4.295, TA
0.0017, KC1 0.062, KP 1, KC2 and KI2 0, TR and TF 0.0226).
"""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    limited_lag,
    modulus,
    pi,
    pi_rest,
)
from exfit.models.exciter_parts import bridge, first_source
from exfit.models.sheet import (
    FREE,
    GAIN,
    INTEGRAL_GAIN,
    ONE_GATE,
    PID_GAIN,
    SHORT_TIME,
    UP_TO_100,
    limits,
    record_of_2016,
    shared,
    sheet,
)

ALIASES = "ESST8C"

SHEET = sheet(
    *shared(TR=0.012, KPR_OF_REGULATOR=20.0, KIR_OF_REGULATOR=10.0),
    *limits("VPIMAX", 4.5, -1.0, "the field current reference"),
    ("KPA", 1.0, *PID_GAIN, "proportional gain of the field current loop", FREE),
    ("KIA", 10.0, *INTEGRAL_GAIN, "integral gain of the field current loop", FREE),
    *limits("VAMAX", 1.2, -1.0, "the field current loop"),
    ("KA", 1.0, *GAIN, "regulator gain"),
    ("TA", 0.01, *SHORT_TIME, "regulator time constant", FREE),
    *shared(VRMAX=1.0, VRMIN=-0.87),
    ("KF", 1.0, *UP_TO_100, "feedback gain of the field current"),
    ("TF", 0.02, *SHORT_TIME, "feedback lag of the field current", FREE),
    ("KC1", 0.05, *UP_TO_100, "rectifier loading factor"),
    *shared(KP=6.0),
    ("KI1", 0.0, *UP_TO_100, "current source gain, on load"),
    *shared(XL=0.0, THETAP=0.0),
    ("VB1MAX", 8.0, "pu", (0.01, 9999.0), "ceiling of the source voltage"),
    ("KC2", 0.05, *UP_TO_100, "loading factor of the second rectifier, on load"),
    ("KI2", 0.5, *UP_TO_100, "gain of the second source, on load"),
    ("VB2MAX", 0.5, "pu", (0.01, 9999.0), "ceiling of the second source, on load"),
    *shared(SW1=1.0),
)

RECORDS = record_of_2016(
    "ST8C",
    "TR KPR KIR VPIMAX VPIMIN KPA KIA VAMAX VAMIN KA TA VRMAX VRMIN KF TF KC1 KP KI1 XL THETAP "
    "VB1MAX KC2 KI2 VB2MAX",
    flags="OEL UEL SCL",
    switches="SW1",
    places=ONE_GATE,
)

STATES = "VC VI VA VR VF"


def sources(u: Signal, p: Signal) -> tuple[Signal, Signal]:
    """Return VB1 and VB2, what the sources give behind their rectifiers."""
    vb1 = bridge(first_source(p.KI1, u, p), p.KC1 * u.ifd, p.VB1MAX)
    ve2 = p.KI2 * modulus(u.p / u.vt, u.q / u.vt)
    return vb1, bridge(ve2, p.KC2 * u.ifd, p.VB2MAX)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vb1, vb2 = sources(u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs + u.vsum - vc
    wanted, d.VI = pi(error, s.VI, p.KPR, p.KIR, p.VPIMIN, p.VPIMAX)
    vf, d.VF = lag(u.ifd, s.VF, p.KF, p.TF)
    gated = clip(wanted - vf, u.vuel, u.voel)
    va, d.VA = pi(gated, s.VA, p.KPA, p.KIA, p.VAMIN, p.VAMAX)
    vr, d.VR = limited_lag(va, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    return vr * vb1 + vb2


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vb1, vb2 = sources(u, p)
    x.VR, x.VF = (efd - vb2) / vb1, p.KF * u.ifd
    difference, x.VA = pi_rest(x.VR / p.KA, p.KPA, p.KIA)
    error, x.VI = pi_rest(difference + x.VF, p.KPR, p.KIR)
    x.VC = u.vc1
    return u.vc1 + error - u.vs
