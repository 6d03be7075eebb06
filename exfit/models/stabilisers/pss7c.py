"""PSS7C: dual input stabiliser, speed and power (IEEE Std 421.5-2016).

      VSI1MAX                               ramp tracking
vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
       VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                             │                  │
                                            [KS3]               │
      VSI2MAX                                ▲                  │
vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
       VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                   VSTMAX
v ─►[KS1]─►(+)─ e ─►[form]─ y ─────►[clip]─►[switch]─► vs
           -▲         │            VSTMIN
            └── f ◄───┘

PSS2C with the canonical form of PSS6C in place of its leads and lags: four
integrators in a row, sTI1 x1 = e, sTI2 x2 = x1, sTI3 x3 = KI3 x2, sTI4 x4 = KI4
x3; f = x1 + x2 + x3 + x4 is fed back, and y = K0 e + K1 x1 + K2 x2 + K3 x3 + K4
x4. The first input is the speed, the second the electrical power (KS2 = T7 /
2H). TW2 = 0 and TW4 = 0 leave out their washouts; T6 or T7 = 0 bypasses its
block. The ramp tracking filter is N of the blocks that are drawn; M and N are
whole numbers, M N at most 8. vt with it is that of PSS/E 36.7 (1e-5 pu over a
fault, with KS3 = 1). InterPSS, which draws it, multiplies both signals before
the filter with KS3, here it is as in PSS2C; where KS3 = 1 there is no
difference.

The switch makes vs 0 from where the power p of the machine falls to PPSSOFF to
where it rises to PPSSON; it goes over 5 ms after the power has passed. It is on
at the start where p is PPSSON or more. PPSSON = 0 leaves it out (as in PSS/E).
The switching makes vs jump: derivatives of a response do not include the shift
of the jumps. Not modelled: XCOMP and TCOMP, which make a compensated frequency
of an input of PSS/E. Typical data are the standard's, as GridKit has them, but
for KS2, which is that of H = 5.05 s as in PSS2C (there 0.7052).
"""

from exfit.models.blocks import Signal, clip
from exfit.models.sheet import MOST_LAGS, record, sheet, with_typical
from exfit.models.stabiliser_parts import (
    ACCELERATING,
    CANONICAL,
    FILTERED_SPEED_AND_POWER,
    INPUT_LIMITS,
    SWITCH,
    accelerating,
    accelerating_rest,
    canonical,
    of_stabiliser,
    switch_rest,
    switched,
)

INPUTS = ("speed", "p")

SHEET = (
    *ACCELERATING,
    *sheet(*of_stabiliser(KS1=50.0, VSTMAX=0.05, VSTMIN=-0.05)),
    *with_typical(
        CANONICAL,
        **{"K0": 0.399, "K1": 1.8462, "K2": 0.4231, "K3": 0.2104},
        **{"TI1": 0.03, "TI2": 0.0293, "TI3": 0.2804},
    ),
    *INPUT_LIMITS,
    *with_typical(SWITCH, PPSSON=0.21, PPSSOFF=0.19),
)

RECORDS = record(
    "PSS7C",
    "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 K0 K1 K2 K3 K4 TI1 TI2 KI3 TI3 KI4 TI4 VSI1MAX "
    "VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN PPSSON PPSSOFF XCOMP TCOMP",
    icons=FILTERED_SPEED_AND_POWER,
    ignored="XCOMP TCOMP",
)

STATES = "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 R6 R7 R8 X1 X2 X3 X4 ON"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v = accelerating(s, u, p, d, MOST_LAGS, p.N)
    y = canonical(p.KS1 * v, s, p, d)
    return switched(clip(y, p.VSTMIN, p.VSTMAX), s, u, p, d)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x, MOST_LAGS)
    x.X1 = x.X2 = x.X3 = x.X4 = 0.0
    switch_rest(u, p, x)
