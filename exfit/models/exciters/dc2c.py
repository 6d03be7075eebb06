"""DC2C: commutator exciter, bus-fed regulator (IEEE Std 421.5-2016).

                                 UEL   OEL    VT VRMAX         VEMAX
vref + vs + vsum ─►(+)─►[1 + sTC]─►HV───►LV──►[  KA  ]─►(+)─►[  1  ]─┬─► efd
                  -▲ ▲- [1 + sTB]             [1+sTA]   -▲   [ sTE ] │
                   │ │                        VT VRMIN   │    VEMIN  │
       vc1 ►[  1  ]┘ │                                   └── VFE ◄───┤
            [1+sTR]  └────────────[  sKF  ]◄─────────────────────────┘
                                  [1 + sTF]

VFE = KE EFD + VX(EFD). As DC1C, but the regulator's limits are proportional to
the terminal voltage VT. It is DC2A with the places of the limiters of 2016:
they act at the summing point (vsum) or at the gates. The limits are non-windup.
EFD is limited as in PSS/E, with VEMAX and VEMIN. KE = 0 is self-excited: KE is
computed at the start so that VR starts at VRMAX / 10, as in PSS/E (IEEE 421.5:
at VR = 0). VRMAX = 0 is computed too: VRMAX = (KE + SE(E)) E at the higher of
E1, E2 (SE(E) E where KE < 0), VRMIN = -VRMAX. The values in use are the
setpoints KE0, VRMAX0, VRMIN0. Typical data are the standard's, as GridKit has
them.
"""

from exfit.models.blocks import Signal, clip
from exfit.models.commutators import (
    COMMUTATOR_SETPOINTS,
    COMMUTATOR_STATES,
    commutator_rest,
    excited,
    regulator_input,
)
from exfit.models.exciters import dc2a
from exfit.models.sheet import OF_TWO_PROGRAMS, record, shared

ALIASES = ("ESDC2C",)

SHEET = (
    *dc2a.SHEET,
    *shared(VEMAX=99.0, VEMIN=0.0),
)

RECORDS = (
    record(
        "DC2C",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF E1 SE1 E2 SE2 VEMAX VEMIN",
        icons={"OEL": 1, "UEL": 1},
        ignored="OEL UEL",
        doubt=OF_TWO_PROGRAMS,
    ),
)

STATES = COMMUTATOR_STATES
SETPOINTS = COMMUTATOR_SETPOINTS
rest = commutator_rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vl = regulator_input(s, u, p, d, u.vsum)
    gated = clip(vl, u.vuel, u.voel)
    return excited(gated, u.vt, s, p, d, p.VEMIN, p.VEMAX)
