"""DC1C: commutator exciter, continuous regulator (IEEE Std 421.5-2016).

                          VUEL  VOEL     VRMAX          VEMAX
vref + vs ─►(+)─►[1 + sTC]─►HV───►LV───►[  KA  ]─►(+)─►[  1  ]─┬─────► efd
+ vsum     -▲ ▲- [1 + sTB]              [1+sTA]   -▲   [ sTE ] │
            │ │                          VRMIN     │    VEMIN  │
vc1 ►[  1  ]┘ │                                    └── VFE ◄───┤
     [1+sTR]  └─────────────[  sKF  ]◄─────────────────────────┘
                            [1 + sTF]

VFE = KE EFD + VX(EFD). DC1A with the places of the limiters of 2016: vsum is
what they add to the voltage error, VUEL and VOEL are takeover gates. The limits
are non-windup. EFD is limited as in PSS/E, with VEMAX and VEMIN; Dynawo has the
floor alone, and the sample data neither. Of the signs at the sum Dynawo adds
OEL and SCL, PowerWorld subtracts them: here vsum is what is added.
KE = 0 is self-excited: KE is computed at the start so that VR starts at
VRMAX / 10, as in PSS/E (IEEE 421.5: at VR = 0). VRMAX = 0 is computed too:
VRMAX = (KE + SE(E)) E at the higher of E1, E2 (SE(E) E where KE < 0), VRMIN =
-VRMAX. The values in use are the setpoints KE0, VRMAX0, VRMIN0. Typical data
are the standard's, as GridKit has them.
"""

from exfit.engine.trace import Signal
from exfit.models.blocks import larger, smaller
from exfit.models.commutators import (
    COMMUTATOR_SETPOINTS,
    COMMUTATOR_STATES,
    commutator_rest,
    excited,
    regulator_input,
)
from exfit.models.sheet import (
    EXCITER_LAG,
    FEEDBACK,
    FREE,
    LAG_OF_KF,
    REGULATOR_LAG,
    record,
    sheet,
)

ALIASES = ("ESDC1C",)

SHEET = sheet(
    ("TR", 0.0, "s", (0.0, 1.0), "voltage transducer lag"),
    ("KA", 46.0, "pu", (0.01, 100000.0), "regulator gain", FREE),
    ("TA", 0.06, "s", (0.0, 10.0), "regulator time constant", REGULATOR_LAG),
    ("TB", 0.0, "s", (0.0, 100.0), "regulator lag"),
    ("TC", 0.0, "s", (0.0, 100.0), "regulator lead"),
    ("VRMAX", 1.0, "pu", (-9999.0, 9999.0), "regulator ceiling, or 0"),
    ("VRMIN", -0.9, "pu", (-9999.0, 9999.0), "regulator floor"),
    ("KE", 0.0, "pu", (-10.0, 10.0), "exciter constant, or 0"),
    ("TE", 0.46, "s", (0.01, 100.0), "exciter time constant", EXCITER_LAG),
    ("KF", 0.1, "pu", (0.0, 10.0), "stabilising feedback gain", FEEDBACK),
    ("TF", 1.0, "s", (0.01, 100.0), "stabilising feedback time constant", LAG_OF_KF),
    ("E1", 3.1, "pu", (0.01, 100.0), "first voltage of the saturation curve"),
    ("SE1", 0.33, "pu", (0.0, 100.0), "saturation at E1"),
    ("E2", 2.3, "pu", (0.01, 100.0), "second voltage of the saturation curve"),
    ("SE2", 0.1, "pu", (0.0, 100.0), "saturation at E2"),
    ("VEMAX", 99.0, "pu", (-9999.0, 9999.0), "ceiling of the exciter voltage"),
    ("VEMIN", 0.0, "pu", (-9999.0, 9999.0), "floor of the exciter voltage"),
)

RECORDS = (
    record(
        "DC1C",
        "TR KA TA TB TC VRMAX VRMIN KE TE KF TF E1 SE1 E2 SE2 VEMAX VEMIN",
        icons={"OEL": 1, "UEL": 1},
        doubt="its order is from one public source",
    ),
)

STATES = COMMUTATOR_STATES
SETPOINTS = COMMUTATOR_SETPOINTS
rest = commutator_rest


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return efd."""
    vl = regulator_input(s, u, p, d, u.vsum)
    gated = smaller(larger(vl, u.vuel), u.voel)
    return excited(gated, 1.0, s, p, d, p.VEMIN, p.VEMAX)
