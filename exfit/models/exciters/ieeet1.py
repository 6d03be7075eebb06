"""IEEET1: commutator exciter, IEEE type 1 of 1968 (PSS/E IEEET1).

                 VRMAX
vref + vs ─►(+)─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
           -▲ ▲- [1+sTA]   -▲   [ sTE ] │
            │ │  VRMIN      │           │
vc1 ►[  1  ]┘ │             └── VFE ◄───┤
     [1+sTR]  └──[  sKF ]◄──────────────┘
                 [1+sTF]

VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
(SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
setpoints KE0, VRMAX0, VRMIN0.
Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
"""

from exfit.models.blocks import Signal, commutator_start, exciter, lag, limited_lag, washout
from exfit.models.sheet import record, shared, sheet

SHEET = sheet(
    *shared(TR=0.02, KA=50.0, TA=0.06, VRMAX_OR_0=7.3, VRMIN=-7.3, KE_OR_0=1.0, TE=0.5, KF=0.08),
    *shared(TF=1.0, E1=3.1, SE1=0.33, E2=2.3, SE2=0.1),
)

RECORDS = (
    record(
        "IEEET1",
        "TR KA TA VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2",
        absent={"Switch": 0.0},
    ),
)

STATES = "VC VR EFD VF"
SETPOINTS = "KE0 VRMAX0 VRMIN0"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vc, d.VC = lag(u.vc1, s.VC, 1.0, p.TR)
    vf, d.VF = washout(s.EFD, s.VF, p.KF, p.TF)
    error = u.vref + u.vs - vc - vf
    vr, d.VR = limited_lag(error, s.VR, p.KA, p.TA, s.VRMIN0, s.VRMAX0)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    start = commutator_start(efd, p)
    x.KE0, x.VRMAX0, x.VRMIN0 = start.KE, start.VRMAX, start.VRMIN
    error = start.vr / p.KA
    x.VC, x.VR, x.EFD, x.VF = u.vc1, start.vr, efd, efd
    return u.vc1 + error - u.vs
