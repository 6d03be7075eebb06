"""DC2A: commutator exciter, bus-fed regulator (IEEE Std 421.5-2005, 5.2).

                                  VT VRMAX       EFD >= 0
vref + vs ─►(+)─►[1 + sTC]─►HV───►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
           -▲ ▲- [1 + sTB]  ▲     [1+sTA]   -▲   [ sTE ] │
            │ │             │     VT VRMIN   │           │
vc1 ►[  1  ]┘ │            VUEL              └── VFE ◄───┤
     [1+sTR]  └─────────[  sKF  ]◄───────────────────────┘
                        [1 + sTF]

VFE = KE EFD + VX(EFD). As DC1A, but the regulator's limits are
proportional to the terminal voltage VT. They are non-windup; EFD >= 0 is
PSS/E's (ANDES has no such limit, and ignores TR).
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0; ANDES takes 0 as it is).
VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of E1, E2
(SE(E) E where KE < 0), VRMIN = -VRMAX (ANDES: 999). The values in use are the
setpoints KE0, VRMAX0, VRMIN0.
Not modelled: UEL or OEL at the summing point, SWITCH (unused in PSS/E).
"""

from exfit.models.blocks import Signal, larger
from exfit.models.commutators import (
    COMMUTATOR_SETPOINTS,
    COMMUTATOR_STATES,
    commutator_rest,
    excited,
    regulator_input,
)
from exfit.models.sheet import OF_A_LIST, record, shared, sheet

ALIASES = ("ESDC2A",)

SHEET = sheet(
    *shared(TR=0.0, KA=300.0, TA=0.01, TB=0.0, TC=0.0, VRMAX_AT_VT_OR_0=4.95, VRMIN_AT_VT=-4.9),
    *shared(KE_OR_0=1.0, TE=1.33, KF=0.02, TF=0.675, E1=3.05, SE1=0.279, E2=2.29, SE2=0.117),
)

RECORDS = (
    record(
        "ESDC2A",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF Switch E1 SE1 E2 SE2",
        absent={"Switch": 0.0},
    ),
)

PSLF_RECORDS = (
    record(
        "esdc2a",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF SPDMLT E1 SE1 E2 SE2 UELIN EXCLIM",
        ignored="SPDMLT UELIN",
        absent={"EXCLIM": 1.0},
        spelled={"TF": "tf1"},
        doubt=OF_A_LIST,
    ),
)

STATES = COMMUTATOR_STATES
SETPOINTS = COMMUTATOR_SETPOINTS
rest = commutator_rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vl = regulator_input(s, u, p, d)
    return excited(larger(vl, u.vuel), u.vt, s, p, d)
