"""PSS3C: dual input stabiliser, power and speed (IEEE Std 421.5-2016).

vsi1 ─►[  KS1  ]─►[ sTW1  ]─►(+)─►[ sTW3  ]─►[1 + sA1 + s²A2]─► v
       [1 + sT1]  [1 + sTW1]  ▲   [1 + sTW3] [1 + sA3 + s²A4]
                              │
vsi2 ─►[  KS2  ]─►[ sTW2  ]───┘
       [1 + sT2]  [1 + sTW2]
                         VSTMAX
v ─►[1 + sA5 + s²A6]─►[clip]─►[switch]─► vs
    [1 + sA7 + s²A8]   VSTMIN

PSS3B with a switch. The first input is the electrical power (KS1 is negative),
the second the speed, as Dynawo has it. T1 or T2 = 0 bypasses its block, TW3 = 0
leaves out its washout. A4 = 0 leaves a lag, without A2, and A3 = A4 = 0 no
filter; so do A7 and A8.

The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
at the start where p is PPSSON or more (as in InterPSS; Dynawo: more than
PPSSOFF). PPSSON = 0 leaves it out (as in PSS/E). The switching makes vs jump:
derivatives of a response do not include the shift of the jumps. Not modelled:
TPGFILT, a lag of the power before the switch, and XCOMP and TCOMP, which make a
compensated frequency of an input of PSS/E. Typical data are PSS3B's.
"""

from exfit.engine.trace import Signal
from exfit.models.sheet import record
from exfit.models.stabiliser_parts import SWITCH, switch_rest, switched
from exfit.models.stabilisers import pss3b

INPUTS = pss3b.INPUTS

SHEET = (*pss3b.SHEET, *SWITCH)

RECORDS = (
    record(
        "PSS3C",
        "KS1 T1 TW1 KS2 T2 TW2 TW3 A1 A2 A3 A4 A5 A6 A7 A8 VSTMAX VSTMIN "
        "PPSSON PPSSOFF XCOMP TCOMP TPGFILT",
        icons={"ICS1": 3, "REMBUS1": 0, "ICS2": 1, "REMBUS2": 0},
        absent={"TPGFILT": 0.0},
        ignored="XCOMP TCOMP",
    ),
)

STATES = f"{pss3b.STATES} ON"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    return switched(pss3b.equations(s, u, p, d), s, u, p, d)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    pss3b.rest(vs, u, p, x)
    switch_rest(u, p, x)
