"""IEEEX1: commutator exciter, type 1 of 1979, DC1 of 1981 (PSS/E IEEEX1).

                            VRMAX
vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
           -▲ ▲- [1 + sTB]  [1+sTA]   -▲   [ sTE ] │
            │ │             VRMIN      │           │
vc1 ►[  1  ]┘ │                        └── VFE ◄───┤
     [1+sTR]  └──────[  sKF  ]◄────────────────────┘
                     [1 + sTF1]

VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
The limits do not follow VT, as in OpenIPSL and the DC1 of 1981 (ANDES has them
proportional to VT here, and not in EXDC2: the two are interchanged).
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
(SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the setpoints
KE0, VRMAX0, VRMIN0.
Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
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
from exfit.models.sheet import OF_A_LIST, record, shared, sheet

SHEET = sheet(
    *shared(TR=0.0, KA=40.0, TA=0.04, TB=0.0, TC=0.0, VRMAX_OR_0=7.3, VRMIN=-7.3, KE_OR_0=1.0),
    *shared(TE=0.8, KF=0.03, TF1=1.0, E1=2.4, SE1=0.03, E2=5.0, SE2=0.5),
)

RECORDS = (
    record(
        "IEEEX1",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 Switch E1 SE1 E2 SE2",
        absent={"Switch": 0.0},
    ),
)

PSLF_RECORDS = (
    record(
        "exdc1",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 E1 SE1 E2 SE2",
        doubt=OF_A_LIST,
    ),
)

STATES = "VC VL VR EFD VF"
SETPOINTS = "KE0 VRMAX0 VRMIN0"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF1)
    vl, d.VL = lead_lag(u.vref + u.vs - vc - vf, s.VL, p.TC, p.TB)
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, s.VRMIN0, s.VRMAX0)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    start = commutator_start(efd, p)
    x.KE0, x.VRMAX0, x.VRMIN0 = start.KE, start.VRMAX, start.VRMIN
    error = start.vr / p.KA
    x.VC, x.VL, x.VR, x.EFD, x.VF = u.vc1, error, start.vr, efd, efd
    return u.vc1 + error - u.vs
