"""AC7B: alternator exciter with an inner field loop (IEEE Std 421.5-2005, 6.7).

           vsum       VRMAX              VAMAX
             ▼
vref + vs ─►(+)─►[KPR + KIR/s    ]─►(+)─►[KPA + KIA/s]─ VA ─►(x)─►[ HV ]─► VFD
           -▲ ▲- [+ sKDR/(1+sTDR)]  -▲       VAMIN            ▲   [gate]
            │ │       VRMIN          │                        │     ▲
            │ │           KF1 efd + KF2 VFE                 KP VT  -KL VFE
            │ │
            │ │  [  sKF3 ]                    VE <= VEMAX
            │ └──[1 + sTF]◄──┐   VFD ─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
            │                │         -▲   [ sTE ] │        ▲
vc1 ►[  1  ]┘                │          │    VEMIN  │       FEX
     [1+sTR]                 └──────────┴─── VFE ◄──┘        ▲
                                                        KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. The
limits of VE are non-windup; the integrals of the PID and of the PI are frozen
while they would drive their output further beyond its limit. KP VT is the
supply of the amplifier, with VT the terminal voltage itself. The exciter
integrates, 1/sTE: the 1/(1+sTE) in the figure of 2005 is a misprint. An UEL is
added at the first summing point.
"""

from exfit.models.blocks import (
    Signal,
    field_ceiling,
    field_demand,
    lag,
    larger,
    limited_integrator,
    pi,
    pi_rest,
    pid,
    rectifier,
    rectifier_supply,
    washout,
)
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    LIMIT,
    OF_A_LIST,
    PID_GAIN,
    POSITIVE_TIME,
    UP_TO_100,
    SearchRange,
    record,
    shared,
    sheet,
)

SHEET = sheet(
    *shared(TR=0.0, KPR_OF_REGULATOR=4.24, KIR_OF_REGULATOR=4.24),
    ("KDR", 0.0, "pu s", (0.0, 100000.0), "derivative gain of the regulator"),
    *shared(TDR=0.03, VRMAX=5.79, VRMIN=-5.79),
    ("KPA", 65.36, *PID_GAIN, "proportional gain of the amplifier", FREE),
    ("KIA", 59.69, *INTEGRAL_GAIN, "integral gain of the amplifier", FREE),
    ("VAMAX", 1.0, *LIMIT, "amplifier ceiling"),
    ("VAMIN", -0.95, *LIMIT, "amplifier floor"),
    *shared(KP=4.96),
    ("KL", 10.0, "pu", (0.0, 9999.0), "lower limit of the field voltage per field current"),
    ("KF1", 0.212, *UP_TO_100, "feedback gain of the generator field voltage", FREE),
    ("KF2", 0.0, *UP_TO_100, "feedback gain of the exciter field current"),
    ("KF3", 0.0, *UP_TO_100, "stabilising feedback gain"),
    ("TF", 1.0, *POSITIVE_TIME, "stabilising feedback time constant", SearchRange(needs="KF3")),
    *shared(KC_FREE=0.18, KD=0.02, KE=1.0, TE=1.1, VFEMAX=6.9, VEMIN=0.0, E1=6.3, SE1=0.44),
    *shared(E2=4.725, SE2=0.075),
)

RECORDS = (
    record(
        "AC7B",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL KF1 KF2 KF3 TF KC KD KE TE "
        "VFEMAX VEMIN E1 SE1 E2 SE2",
    ),
)

PSLF_RECORDS = (
    record(
        "esac7b",
        "TR KPR KIR KDR TDR VRMAX VRMIN KPA KIA VAMAX VAMIN KP KL TE VFEMAX VEMIN KE KC "
        "KD KF1 KF2 KF3 TF E1 SE1 E2 SE2 SPDMLT",
        ignored="SPDMLT",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VI VD VF VA VE"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vemax = field_ceiling(s.VE, vfe, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(vfe, s.VF, p.KF3, p.TF)
    error = u.vref + u.vs + u.vsum - vc - vf
    vr, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VRMIN, p.VRMAX)
    inner = vr - p.KF1 * rectifier(s.VE, p.KC * u.ifd) - p.KF2 * vfe
    va, d.VA = pi(inner, s.VA, p.KPA, p.KIA, p.VAMIN, p.VAMAX)
    vfd = larger(p.KP * u.vt * va, -p.KL * vfe)
    ve, d.VE = limited_integrator(vfd - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return rectifier(ve, p.KC * u.ifd)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    inner, x.VA = pi_rest(vfe / (p.KP * u.vt), p.KPA, p.KIA)
    error, x.VI = pi_rest(inner + p.KF1 * efd + p.KF2 * vfe, p.KPR, p.KIR)
    x.VC, x.VD, x.VF, x.VE = u.vc1, error, vfe, ve
    return u.vc1 + error - u.vs
