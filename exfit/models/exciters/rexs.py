"""REXS: general purpose rotating exciter (PSS/E REXSYS, PSLF rexs).

          vsum   VIMAX                                  F VRMAX
            ▼
vref + vs ►(+)──►[clip]►[KVP + KVI/s]►[1+sTC1]►[1+sTC2]►[  1  ]─► VR
          -▲ ▲-  -VIMAX               [1+sTB1] [1+sTB2] [1+sTA]
           │ │                                          F VRMIN
           │ └───[1 + sTF1]◄─[  sKF  ]◄─ VR, VFE or efd for FBF = 0, 1 or 2
vc1►[  1  ]┘     [1 + sTF2]  [1 + sTF]
    [1+sTR]

           F VFMAX        F VFMAX      VE >= 0
VR ─►(+)─►[KIP + KII/s]─►[  1  ]─►(+)─►[  1  ]─┬─ VE ─►(x)─► efd
     -▲    F VFMIN       [1+sTP] -▲    [ sTE ] │        ▲
      │                   F VFMIN │            │       FEX
      └──[ KH ]◄──────────────────┴─── VFE ◄───┘        ▲
                                                   KC IFD / VE

VFE = KE VE + VX(VE) + KD IFD. The limits of the lags and of VE are non-windup.
TF2 = 0 bypasses TF1 with it.

Three open models written after PSS/E's REXSYS differ beyond small signals.
VIMAX limits the input of the PI, as its name says and two of them have it (one:
its output). An integral stops while its PI is beyond VRMAX or VFMAX, as CIM has
all limited integrators and one of them that of the field current (else they run
on, and limits are behind the lags). F = 1 + FLIMF (VT - 1): for FLIMF = 1 it is
VT as in one, for 0 it is 1 as in two; one multiplies the limits by KE + KD + SE
of the start, too. Not modelled: the V/Hz limiter and kefd of PSLF's rexs, VCMAX
and XC of REXSY1. Typical data are those of two PI regulators; in CIM's ExcREXS
there are only gains (KVP 2800, KVI 0, KIP 1, KII 0, KH 0, VR 47/-20, KF .05,
TF 3, TE 1.2, KC .05, KD 2).
"""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    closed,
    field_demand,
    lag,
    larger,
    lead_lag,
    limited_integrator,
    limited_lag,
    pi,
    pi_rest,
    rectifier,
    rectifier_supply,
    washout,
    where,
)
from exfit.models.sheet import (
    FREE,
    INTEGRAL_GAIN,
    PID_GAIN,
    SHORT_TIME,
    TIME,
    UP_TO_100,
    UP_TO_1000,
    limits,
    record,
    shared,
    sheet,
)

ALIASES = "REXSYS"

SHEET = sheet(
    *shared(TR=0.01),
    ("KVP", 30.0, *PID_GAIN, "proportional gain", FREE),
    ("KVI", 25.0, *INTEGRAL_GAIN, "integral gain", FREE),
    ("VIMAX", 0.5, "pu", (0.0, 9999.0), "limit of the voltage error, of both signs"),
    *shared(TA=0.01),
    ("TB1", 0.0, *TIME, "regulator lag"),
    ("TC1", 0.0, *TIME, "regulator lead"),
    ("TB2", 0.0, *TIME, "second regulator lag"),
    ("TC2", 0.0, *TIME, "second regulator lead"),
    *shared(VRMAX=15.4, VRMIN=-12.3, KF=0.02, TF=0.7),
    ("TF1", 0.0, *TIME, "stabilising feedback lead"),
    *shared(TF2=0.0),
    ("FBF", 1.0, "1", (0.0, 2.0), "fed back: 0 VR, 1 VFE, 2 efd"),
    ("KIP", 5.0, *UP_TO_1000, "proportional gain of the field current regulator"),
    ("KII", 5.0, "pu/s", (0.0, 1000.0), "integral gain of the field current regulator"),
    ("TP", 0.02, *SHORT_TIME, "time constant of the field current regulator"),
    *limits("VFMAX", 15.4, -12.3, "the exciter's field voltage"),
    ("KH", 1.0, *UP_TO_100, "feedback gain of the exciter's field current"),
    *shared(KE=0.5, TE=0.7, KC_FREE=0.1, KD=0.5, E1=2.525, SE1=0.1, E2=3.367, SE2=0.23),
    ("FLIMF", 0.0, "1", (0.0, 1.0), "share of the limits that follows VT"),
)

RECORDS = record(
    "REXSYS",
    "TR KVP KVI VIMAX TA TB1 TC1 TB2 TC2 VRMAX VRMIN KF TF TF1 TF2 FBF KIP KII TP VFMAX VFMIN KH "
    "KE TE KC KD E1 SE1 E2 SE2 FLIMF",
    spelled={"FLIMF": "F1IMF"},
)

PSLF_RECORDS = record(
    "rexs",
    "TR KVP KVI VIMAX TA TB1 TC1 TB2 TC2 VRMAX VRMIN KF TF TF1 TF2 FBF KIP KII TP VFMAX VFMIN KH "
    "KE TE KC KD E1 SE1 E2 SE2 RCOMP XCOMP NVPHZ KVPHZ FLIMF XC VCMAX KEFD LIMFLG",
    absent={"KVPHZ": 0.0, "XC": 0.0, "KEFD": 0.0, "LIMFLG": 0.0},
    ignored="RCOMP XCOMP NVPHZ VCMAX",
)

STATES = "VC VI VL1 VL2 VR VF VFL IFI VP VE"


def led(vi: Signal, integral: Signal, first: Signal, second: Signal, p: Signal) -> Signal:
    """Pass the error through the PI and both lead-lags, whose states are given."""
    vl1, _ = lead_lag(p.KVP * vi + integral, first, p.TC1, p.TB1)
    return lead_lag(vl1, second, p.TC2, p.TB2)[0]


def stabilised(
    signal: Signal, washed: Signal, lagged: Signal, p: Signal
) -> tuple[Signal, Signal, Signal]:
    """Return the stabilising feedback of a signal, and the slopes of its two states."""
    steep, slope = washout(signal, washed, p.KF, p.TF)
    vf, bend = lead_lag(steep, lagged, p.TF1, p.TF2)
    return vf, slope, bend


def fed_back(vr: Signal, vfe: Signal, efd: Signal, p: Signal) -> Signal:
    """Return the signal that FBF chooses for the stabilising feedback."""
    return where(p.FBF < 0.5, vr, where(p.FBF < 1.5, vfe, efd))


def regulator_now(error: Signal, s: Signal, p: Signal, vfe: Signal, efd: Signal) -> Signal:
    """Return VR before its limits; with TA = 0 and FBF = 0 it waits for its own feedback."""
    vf, _, _ = stabilised(fed_back(0.0, vfe, efd, p), s.VF, s.VFL, p)
    back = fed_back(stabilised(1.0, 0.0, 0.0, p)[0], 0.0, 0.0, p)
    gain, held = led(1.0, 0.0, 0.0, 0.0, p), led(0.0, s.VI, s.VL1, s.VL2, p)
    vi = clip(closed(error - vf, gain, held, back), -p.VIMAX, p.VIMAX)
    return where(p.TA < SHORTEST, gain * vi + held, s.VR)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    share = 1.0 + p.FLIMF * (u.vt - 1.0)
    low, high = share * p.VRMIN, share * p.VRMAX
    vfe = field_demand(s.VE, u.ifd, p)
    efd = rectifier(larger(s.VE, 0.0), p.KC * u.ifd)
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs + u.vsum - vc
    vr = clip(regulator_now(error, s, p, vfe, efd), low, high)
    vf, d.VF, d.VFL = stabilised(fed_back(vr, vfe, efd, p), s.VF, s.VFL, p)
    vi = clip(error - vf, -p.VIMAX, p.VIMAX)
    _, d.VI = pi(vi, s.VI, p.KVP, p.KVI, low, high)
    vl1, d.VL1 = lead_lag(p.KVP * vi + s.VI, s.VL1, p.TC1, p.TB1)
    vl2, d.VL2 = lead_lag(vl1, s.VL2, p.TC2, p.TB2)
    _, d.VR = limited_lag(vl2, s.VR, 1.0, p.TA, low, high)
    floor, ceiling = share * p.VFMIN, share * p.VFMAX
    ip, d.IFI = pi(vr - p.KH * vfe, s.IFI, p.KIP, p.KII, floor, ceiling)
    vp, d.VP = limited_lag(ip, s.VP, 1.0, p.TP, floor, ceiling)
    _, d.VE = limited_integrator(vp - vfe, s.VE, p.TE, low=0.0)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    ve = rectifier_supply(efd, p.KC * u.ifd)
    vfe = field_demand(ve, u.ifd, p)
    current, x.IFI = pi_rest(vfe, p.KIP, p.KII)
    vr = p.KH * vfe + current
    error, x.VI = pi_rest(vr, p.KVP, p.KVI)
    x.VC, x.VL1, x.VL2, x.VR, x.VP, x.VE = u.vc1, vr, vr, vr, vfe, ve
    x.VF, x.VFL = fed_back(vr, vfe, efd, p), 0.0
    return u.vc1 + error - u.vs
