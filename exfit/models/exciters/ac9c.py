"""AC9C: alternator exciter with a field current loop and two sources (IEEE Std 421.5-2016).

         vsum   VPIDMAX           UEL OEL   VAMAX       UEL OEL  VRMAX
           ▼
vref + vs►(+)►[KPR + KIR/s  ]──►(+)►[gates]►[KPA + KIA/s]►[gates]►[  KA  ]► VR
          -▲  [+sKDR/(1+sTDR)]  -▲            VAMIN               [1+sTA]
           │    VPIDMIN          │                                 VRMIN
vc1►[  1  ]┘       VFE ►[  KF  ]─┘
    [1+sTR]             [1+sTF]

                    VE <= VEMAX
VR ─►(x)─►(+)─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
      ▲    ▲   -▲   [ sTE ] │        ▲
     VB1  VCT   │    VEMIN  │       FEX
                └─── VFE ◄──┘        ▲
                                KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD, and VEMAX is the VE at which VFE = VFEMAX. VB1 =
VE1 FEX(KC1 VFE / VE1), at most VBMAX1. It comes from the terminals (SW1 = 1,
position A of the drawing), VE1 = |KP∠THETAP VT + j (KI1 + KP∠THETAP XL) IT|
with THETAP in degrees, or does not depend on them (SW1 = 2, B), VE1 = KP. VCT =
VE2 FEX(KC2 VFE / VE2), at most VBMAX2, with VE2 = KI2 IT, is added. The current
IT, and so KI1, XL, THETAP and all of VCT, act on load only. With a chopper (SCT
= 0) in place of thyristors (SCT = 1) VCT is added only where VAVR, the output
of the PI, is above VLIM1. Down to VLIM2 nothing is, and below it -VFW, which is
KFW VFE between VFWMIN and VFWMAX. The limits of the lag and of VE are
non-windup; an integral is frozen while its regulator is at its limit.

The limiters act at the summing point (vsum), at the gates before the PI or at
those behind it. The path of the signal, with VR VB1 + VCT, is that of
PowerWorld 24 (vt 2e-6 pu over a fault, thyristors). InterPSS draws the same,
but adds all of VB1 + VCT to VR. The gates and the chopper rest on it alone. A
chopper has no rest where VAVR is above VLIM1 without VCT, and below it with
VCT. Typical data are not those of a sample.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    field_demand,
    lag,
    limited_lag,
    modulus,
    pi,
    pi_rest,
    pid,
    where,
)
from exfit.models.exciter_parts import alternator_rest, bridge, first_source, limited_alternator
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    LIMIT,
    OF_TWO_PROGRAMS,
    PID_GAIN,
    SHORT_TIME,
    TWO_GATES,
    UP_TO_100,
    limits,
    record_of_2016,
    shared,
    sheet,
)

ALIASES = "ESAC9C"

SHEET = sheet(
    *shared(TR=0.01, KPR_OF_REGULATOR=20.0, KIR_OF_REGULATOR=10.0, KDR=1.0, TDR=0.1),
    *shared(VPIDMAX=8.0, VPIDMIN=-8.0),
    ("KPA", 1.0, *PID_GAIN, "proportional gain of the field current loop", FREE),
    ("KIA", 5.0, *INTEGRAL_GAIN, "integral gain of the field current loop", FREE),
    *limits("VAMAX", 1.0, -1.0, "the field current loop"),
    *shared(KA_FIXED=10.0),
    ("TA", 0.01, *SHORT_TIME, "regulator time constant", FREE),
    *shared(VRMAX=10.0, VRMIN=-10.0),
    ("KF", 1.0, *UP_TO_100, "feedback gain of the exciter's field current"),
    ("TF", 0.02, *SHORT_TIME, "feedback lag of the exciter's field current", FREE),
    ("KFW", 0.1, *UP_TO_100, "free-wheeling gain of a chopper"),
    *limits("VFWMAX", 1.0, 0.0, "the free-wheeling voltage"),
    ("SCT", 1.0, "1", (0.0, 1.0), "power stage: 0 chopper, 1 thyristors"),
    *shared(KC_FREE=0.2, KD=0.4, KE=1.0, TE=1.0, VFEMAX=8.0, VEMIN=0.0),
    *shared(E1=9.0, SE1=3.0, E2=6.5, SE2=0.3, SW1=1.0, KP=1.0),
    ("KI1", 0.0, *UP_TO_100, "current source gain, on load"),
    ("KI2", 0.2, *UP_TO_100, "gain of the second source, on load"),
    *shared(KC1=0.05),
    ("KC2", 0.01, *UP_TO_100, "loading factor of the second rectifier, on load"),
    *shared(XL=0.0, THETAP=0.0, VBMAX1=1.5),
    ("VBMAX2", 0.2, "pu", (0.01, 9999.0), "ceiling of the second source, on load"),
    ("VLIM1", 0.05, *LIMIT, "output of the loop above which a chopper adds VCT"),
    ("VLIM2", -0.05, *LIMIT, "output of the loop below which a chopper gives -VFW"),
)

RECORDS = record_of_2016(
    "AC9C",
    "TR KPR KIR KDR TDR VPIDMAX VPIDMIN KPA KIA VAMAX VAMIN KA TA VRMAX VRMIN KF TF KFW VFWMAX "
    "VFWMIN SCT KC KD KE TE VFEMAX VEMIN E1 SE1 E2 SE2 KP KI1 KI2 KC1 KC2 XL THETAP VBMAX1 VBMAX2 "
    "VLIM1 VLIM2",
    switches="SW1 SCT",
    places=TWO_GATES,
    doubt=OF_TWO_PROGRAMS,
)

STATES = "VC VI VD VF VA VR VE"


def sources(vfe: Signal, u: Signal, p: Signal) -> tuple[Signal, Signal, Signal]:
    """Return VB1, VCT and VFW, what the power stage gives the field winding."""
    vb1 = bridge(first_source(p.KI1, u, p), p.KC1 * vfe, p.VBMAX1)
    vct = bridge(p.KI2 * modulus(u.p / u.vt, u.q / u.vt), p.KC2 * vfe, p.VBMAX2)
    return vb1, vct, clip(p.KFW * vfe, p.VFWMIN, p.VFWMAX)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vfe = field_demand(s.VE, u.ifd, p)
    vb1, vct, vfw = sources(vfe, u, p)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs + u.vsum - vc
    wanted, d.VI, d.VD = pid(error, s.VI, s.VD, p.KPR, p.KIR, p.KDR, p.TDR, p.VPIDMIN, p.VPIDMAX)
    vf, d.VF = lag(vfe, s.VF, p.KF, p.TF)
    gated = clip(wanted - vf, u.vuel, u.voel)
    vavr, d.VA = pi(gated, s.VA, p.KPA, p.KIA, p.VAMIN, p.VAMAX)
    fired = clip(vavr, u.vuel_out, u.voel_out)
    vr, d.VR = limited_lag(fired, s.VR, p.KA, p.TA, p.VRMIN, p.VRMAX)
    conducts = (p.SCT > 0.5) | (vavr > p.VLIM1)
    added = where(conducts, vct, where(vavr > p.VLIM2, 0.0, -vfw))
    efd, d.VE = limited_alternator(vr * vb1 + added, vfe, s, u, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    x.VE, vfe = alternator_rest(efd, u, p)
    vb1, vct, vfw = sources(vfe, u, p)
    conducting, blocked, reversed_ = ((vfe - added) / (p.KA * vb1) for added in (vct, 0.0, -vfw))
    conducts = (p.SCT > 0.5) | (conducting > p.VLIM1)
    vavr = where(conducts, conducting, where(blocked > p.VLIM2, blocked, reversed_))
    difference, x.VA = pi_rest(vavr, p.KPA, p.KIA)
    x.VC, x.VF, x.VR = u.vc1, p.KF * vfe, p.KA * vavr
    x.VD, x.VI = pi_rest(difference + x.VF, p.KPR, p.KIR)
    return u.vc1 + x.VD - u.vs
