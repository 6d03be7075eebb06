"""IEEET2: rotating-rectifier exciter, IEEE type 2 of 1968 (PSS/E IEEET2, IEEEX2).

                             VRMAX
vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]─┬─────────────►(+)─►[  1  ]─┬─► efd
           -▲ ▲- [1 + sTB]  [1+sTA]  │              -▲   [ sTE ] │
            │ │              VRMIN   └──────┐        │           │
vc1 ►[  1  ]┘ │                             │        └── VFE ◄───┘
     [1+sTR]  └──────[  1   ]◄─[ sKF  ]◄────┘
                     [1+sTF2]  [1+sTF1]

VFE = KE EFD + VX(EFD). The feedback is taken from VR, since the field voltage
of a rotating rectifier cannot be measured. The limits are non-windup; EFD may
be negative. IEEEX2, type 2 of 1979, adds the lead-lag, which IEEET2 has not.
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E. VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at
the higher of E1, E2 (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use
are the setpoints KE0, VRMAX0, VRMIN0.
Not modelled: UEL or OEL at the summing point.
"""

from exfit.models.blocks import (
    Signal,
    commutator_start,
    exciter,
    lag,
    lead_lag,
    limited_lag,
    washout,
)
from exfit.models.sheet import LAG_OF_KF, POSITIVE_TIME, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KA=400.0, TA=0.02, TB=0.0, TC=0.0, VRMAX_OR_0=7.3, VRMIN=-7.3, KE_OR_0=1.0),
    *shared(TE=0.8, KF=0.03, TF1=1.0),
    ("TF2", 0.8, *POSITIVE_TIME, "second stabilising feedback time constant", LAG_OF_KF),
    *shared(E1=4.18, SE1=0.1, E2=3.14, SE2=0.03),
)

ALIASES = "IEEEX2"
RECORDS = (
    *record(
        "IEEET2",
        "TR KA TA VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2",
        held={"TB": 0.0, "TC": 0.0},
    ),
    *record("IEEEX2", "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2"),
)

STATES = "VC VL VR EFD VF1 VF2"
SETPOINTS = "KE0 VRMAX0 VRMIN0"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    error = u.vref + u.vs - vc - s.VF2
    vl, d.VL = lead_lag(error, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, s.VRMIN0, s.VRMAX0)
    vf, d.VF1 = washout(vr, s.VF1, p.KF, p.TF1)
    _, d.VF2 = lag(vf, s.VF2, 1.0, p.TF2)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    vr = commutator_start(efd, p, x)
    x.VC, x.VL, x.VR, x.EFD, x.VF1, x.VF2 = u.vc1, vr / p.KA, vr, efd, vr, 0.0
    return u.vc1 + vr / p.KA - u.vs
