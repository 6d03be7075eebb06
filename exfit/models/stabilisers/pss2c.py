"""PSS2C: dual input stabiliser, speed and power (IEEE Std 421.5-2016).

      VSI1MAX                               ramp tracking
vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
       VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                             │                  │
                                            [KS3]               │
      VSI2MAX                                ▲                  │
vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
       VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                                         VSTMAX
v ─►[KS1]─►[1 + sT1]─►[1 + sT3]─►[1 + sT10]─►[1 + sT12]─►[clip]─►[switch]─► vs
           [1 + sT2]  [1 + sT4]  [1 + sT11]  [1 + sT13]  VSTMIN

PSS2B with a fourth lead and lag, and a switch. The first input is the speed,
the second the electrical power (KS2 = T7 / 2H). TW2 = 0 and TW4 = 0 leave out
their washouts; T6, T7, T2, T4, T11 or T13 = 0 bypass their blocks. The ramp
tracking filter is N of the blocks that are drawn; M and N are whole numbers,
M N at most 8.

The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
at the start where p is PPSSON or more (as in InterPSS; Dynawo: more than
PPSSOFF). PPSSON = 0 leaves it out (as in PSS/E). The switching makes vs jump:
derivatives of a response do not include the shift of the jumps. Not modelled:
a lag of the power before the switch (PowerWorld), and XCOMP and TCOMP, which
make a compensated frequency of an input of PSS/E. Typical data are a sample of
the standard, as GridKit has them, with KS2 for H = 5.05 s.
"""

from exfit.models.blocks import Signal, clip, lead_lag
from exfit.models.sheet import MOST_LAGS, TIME, record, sheet
from exfit.models.stabiliser_parts import (
    ACCELERATING,
    INPUT_LIMITS,
    SWITCH,
    accelerating,
    accelerating_rest,
    of_stabiliser,
    switch_rest,
    switched,
)

INPUTS = ("speed", "p")

SHEET = (
    *ACCELERATING,
    *sheet(
        *of_stabiliser(KS1=5.0, T1=0.16, T2=0.04, T3=0.16, T4=0.04, T10=0.18, T11=0.03),
        ("T12", 0.0, *TIME, "fourth lead"),
        ("T13", 0.0, *TIME, "fourth lag"),
        *of_stabiliser(VSTMAX=0.1, VSTMIN=-0.1),
    ),
    *INPUT_LIMITS,
    *SWITCH,
)

RECORDS = (
    record(
        "PSS2C",
        "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11 "
        "VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN T12 T13 PPSSON PPSSOFF XCOMP TCOMP",
        icons={"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0, "M": 5, "N": 1},
        ignored="XCOMP TCOMP",
    ),
)

STATES = "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 V1 V3 V10 V12 ON"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v = accelerating(s, u, p, d, MOST_LAGS, p.N)
    v1, d.V1 = lead_lag(p.KS1 * v, s.V1, p.T1, p.T2)
    v3, d.V3 = lead_lag(v1, s.V3, p.T3, p.T4)
    v10, d.V10 = lead_lag(v3, s.V10, p.T10, p.T11)
    v12, d.V12 = lead_lag(v10, s.V12, p.T12, p.T13)
    return switched(clip(v12, p.VSTMIN, p.VSTMAX), s, u, p, d)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x, MOST_LAGS)
    x.V1 = x.V3 = x.V10 = x.V12 = 0.0
    switch_rest(u, p, x)
