"""EXDC2: commutator exciter, bus-fed regulator, DC2 of 1981 (PSS/E EXDC2).

                            VT VRMAX
vref + vs ─►(+)─►[1 + sTC]─►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
           -▲ ▲- [1 + sTB]  [1+sTA]   -▲   [ sTE ] │
            │ │             VT VRMIN   │           │
vc1 ►[  1  ]┘ │                        └── VFE ◄───┤
     [1+sTR]  └──────[  sKF  ]◄────────────────────┘
                     [1 + sTF1]

VFE = KE EFD + VX(EFD). The limits are non-windup; EFD may be negative.
The limits are proportional to VT, as in the DC2 of 1981, Opal-RT and InterPSS
(ANDES and GridPACK hold them constant). InterPSS and ANDES multiply efd by the
speed, Opal-RT does not; import takes it as multiplied (efd_times_speed).
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
    *shared(TR=0.0, KA=300.0, TA=0.01, TB=0.0, TC=0.0, VRMAX_AT_VT_OR_0=4.95, VRMIN_AT_VT=-4.9),
    *shared(KE_OR_0=1.0, TE=1.33, KF=0.02, TF1=0.675, E1=3.05, SE1=0.279, E2=2.29, SE2=0.117),
)

RECORDS = (
    record(
        "EXDC2",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 Switch E1 SE1 E2 SE2",
        absent={"Switch": 0.0},
        times_speed=True,
    ),
)

PSLF_RECORDS = (
    record(
        "exdc2",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF1 TF2 E1 SE1 E2 SE2",
        absent={"TF2": 0.0},
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
    low, high = u.vt * s.VRMIN0, u.vt * s.VRMAX0
    vr, d.VR = limited_lag(vl, s.VR, p.KA, p.TA, low, high)
    efd, d.EFD = exciter(vr, s.EFD, s.KE0, p)
    return efd


def rest(efd: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states that hold efd into x and return vref."""
    start = commutator_start(efd, p)
    x.KE0, x.VRMAX0, x.VRMIN0 = start.KE, start.VRMAX, start.VRMIN
    error = start.vr / p.KA
    x.VC, x.VL, x.VR, x.EFD, x.VF = u.vc1, error, start.vr, efd, efd
    return u.vc1 + error - u.vs
