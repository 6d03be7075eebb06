"""EXPIC1: proportional and integral regulator, compound source (PSS/E EXPIC1).

          vsum    VR1                              VRMAX      EFDMAX
            ▼
vref + vs ►(+)►[KA (1 + sTA1)]►[    1 + sTA3    ]►[clip]┬►(x)►[clip]► E0
          -▲ ▲-[      s      ] [(1+sTA2)(1+sTA4)] VRMIN │  ▲  EFDMIN
           │ │    VR2                                   │  VB
vc1►[  1  ]┘ │                                          │
    [1+sTR]  └──────────[       sKF      ]◄─────────────┘
                        [(1+sTF1)(1+sTF2)]

E0 ─►(+)─►[  1  ]─┬─► efd
     -▲   [ sTE ] │
      └─── VFE ◄──┘

VFE = KE EFD + VX(EFD); with TE = 0 efd = E0, and neither KE nor the saturation
acts. VB = VE FEX(KC IFD / VE) with VE = |KP VT + j KI IT|, and 1 where
KP = KI = 0. The current IT, and so KI, acts on load only. The integral stops
while the PI is at its limits VR1, VR2; the two clamps have no state. With
TF1 = TF2 = 0 there is no feedback, with TA2 = TA4 = 0 no TA3.

OPAL-RT's model and GridKit's, after PowerWorld's drawing, agree; a third open
model feeds efd back and takes TA2 for a lead. Typical data are CIM's (ExcPIC)
but for TF1, KE and the saturation, which do nothing there. Not modelled: UEL
and OEL other than at the summing point.
"""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    closed,
    exciter_demand,
    lag,
    pi,
    pi_rest,
    rate,
    second_order,
    second_order_lead,
    where,
)
from exfit.models.exciter_parts import compound_supply
from exfit.models.sheet import FREE, LIMIT, OF_A_LIST, TIME, limits, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0),
    ("KA", 3.15, "pu/s", (0.001, 100000.0), "integral gain of the PI", FREE),
    ("TA1", 1.0, *TIME, "lead of the PI", FREE),
    ("VR1", 1.0, *LIMIT, "ceiling of the PI"),
    ("VR2", -0.87, *LIMIT, "floor of the PI"),
    ("TA2", 0.01, *TIME, "regulator lag"),
    ("TA3", 0.0, *TIME, "regulator lead"),
    ("TA4", 0.0, *TIME, "second regulator lag"),
    *shared(VRMAX=1.0, VRMIN=-0.87, KF_FIXED=0.0),
    ("TF1", 1.0, *TIME, "stabilising feedback time constant"),
    *shared(TF2=0.0),
    *limits("EFDMAX", 8.0, -0.87, "the field voltage"),
    *shared(KE=1.0),
    ("TE", 0.0, *TIME, "exciter time constant"),
    *shared(E1=2.8, SE1=0.08, E2=3.7, SE2=0.33, KP_OR_0=6.5, KI=0.0, KC=0.08),
)

RECORDS = record(
    "EXPIC1",
    "TR KA TA1 VR1 VR2 TA2 TA3 TA4 VRMAX VRMIN KF TF1 TF2 EFDMAX EFDMIN KE TE E1 SE1 E2 SE2 KP KI "
    "KC",
)

PSLF_RECORDS = record(
    "expic1",
    "TR KA TA1 VR1 VR2 TA2 TA3 TA4 VRMAX VRMIN KF TF1 TF2 EFDMAX EFDMIN KE TE E1 SE1 E2 SE2 KP KI "
    "KC",
    doubt=OF_A_LIST,
)

STATES = "VC VA VL DVL VF DVF EFD"


def both(T1: Signal, T2: Signal) -> tuple[Signal, Signal]:
    """Return the coefficients of (1 + sT1) (1 + sT2), where a lag beyond notice is none."""
    first, second = (where(T < SHORTEST, 0.0, T) for T in (T1, T2))
    return first + second, first * second


def filtered(va: Signal, x: Signal, v: Signal, p: Signal) -> tuple[Signal, Signal, Signal]:
    """Filter the PI's output by both lags and the lead; return the slopes of their states too."""
    return second_order_lead(va, x, v, p.TA3, 0.0, *both(p.TA2, p.TA4))


def stabilised(vr: Signal, x: Signal, v: Signal, p: Signal) -> tuple[Signal, Signal, Signal]:
    """Return the stabilising feedback of VR, and the slopes of its states."""
    _, slope, bend = second_order(vr, x, v, *both(p.TF1, p.TF2))
    return p.KF * slope, slope, bend


def fed_back(error: Signal, s: Signal, p: Signal) -> tuple[Signal, Signal, Signal]:
    """Return the stabilising feedback, which may wait for itself, and the slopes of its states."""
    proportional = p.KA * p.TA1
    unit, held = filtered(1.0, 0.0, 0.0, p)[0], filtered(0.0, s.VL, s.DVL, p)[0]
    vf, back = stabilised(0.0, s.VF, s.DVF, p)[0], stabilised(1.0, 0.0, 0.0, p)[0]
    left = closed(error - vf, unit * proportional, unit * s.VA + held, back)
    va = clip(proportional * left + s.VA, p.VR2, p.VR1)
    return stabilised(clip(unit * va + held, p.VRMIN, p.VRMAX), s.VF, s.DVF, p)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs + u.vsum - vc
    vf, d.VF, d.DVF = fed_back(error, s, p)
    va, d.VA = pi(error - vf, s.VA, p.KA * p.TA1, p.KA, p.VR2, p.VR1)
    vl, d.VL, d.DVL = filtered(va, s.VL, s.DVL, p)
    vr = clip(vl, p.VRMIN, p.VRMAX)
    e0 = clip(vr * compound_supply(u, p), p.EFDMIN, p.EFDMAX)
    d.EFD = (e0 - exciter_demand(s.EFD, p.KE, p)) * rate(p.TE)
    return where(p.TE < SHORTEST, e0, s.EFD)


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = where(p.TE < SHORTEST, efd, exciter_demand(efd, p.KE, p)) / compound_supply(u, p)
    error, x.VA = pi_rest(vr, p.KA * p.TA1, p.KA)
    x.VC, x.VL, x.VF, x.EFD = u.vc1, vr, vr, efd
    x.DVL, x.DVF = 0.0, 0.0
    return u.vc1 + error - u.vs
