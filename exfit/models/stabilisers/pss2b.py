"""PSS2B: dual input stabiliser, speed and power (IEEE Std 421.5-2005, 8.2).

      VSI1MAX                               ramp tracking
vsi1 ─►[clip]─►[ sTW1 ]─►[ sTW2 ]─►[  1  ]─►(+)─►[ 1 + sT8  ]─►(+)─► v
       VSI1MIN [1+sTW1]  [1+sTW2]  [1+sT6]   ▲   [(1+sT9)^M ]  -▲
                                             │                  │
                                            [KS3]               │
      VSI2MAX                                ▲                  │
vsi2 ─►[clip]─►[ sTW3 ]─►[ sTW4 ]─►[ KS2 ]───┴──────────────────┘
       VSI2MIN [1+sTW3]  [1+sTW4]  [1+sT7]
                                              VSTMAX
v ─►[KS1]─►[1 + sT1]─►[1 + sT3]─►[1 + sT10]─►[clip]─► vs
           [1 + sT2]  [1 + sT4]  [1 + sT11]   VSTMIN

The first input is the speed, the second the electrical power (KS2 = T7 / 2H).
TW2 = 0 and TW4 = 0 leave out their washouts; T6, T7, T2, T4 or T11 = 0 bypass
their blocks. The ramp tracking filter has N = 1, and M is a whole number from 1
to 5. With T10 = T11 = 0 and input limits out of reach this is PSS2A, whose
record has no such rows: it is read as PSS2B with these values.
"""

from exfit.models.blocks import Signal, clip, lead_lag
from exfit.models.sheet import (
    DIVIDING_TIME,
    LIMIT,
    LONG_TIME,
    TIME,
    WASHOUT_TIME,
    WITHIN_1000,
    record,
    sheet,
)
from exfit.models.stabiliser_parts import accelerating, accelerating_rest, of_stabiliser

INPUTS = ("speed", "p")
ALIASES = ("PSS2A",)
NO_LIMIT = 9999.0  # pu

SHEET = sheet(
    ("TW1", 10.0, *WASHOUT_TIME, "first washout of the first input"),
    ("TW2", 10.0, *LONG_TIME, "second washout of the first input"),
    ("T6", 0.0, *TIME, "transducer lag of the first input"),
    ("TW3", 10.0, *WASHOUT_TIME, "first washout of the second input"),
    ("TW4", 0.0, *LONG_TIME, "second washout of the second input"),
    ("T7", 10.0, *LONG_TIME, "transducer lag of the second input"),
    ("KS2", 0.99, *WITHIN_1000, "gain of the second input"),
    ("KS3", 1.0, *WITHIN_1000, "share of the second input that is filtered"),
    ("T8", 0.5, *TIME, "lead of the ramp tracking filter"),
    ("T9", 0.1, *DIVIDING_TIME, "lag of the ramp tracking filter"),
    ("M", 5.0, "1", (1.0, 5.0), "number of lags of the ramp tracking filter"),
    *of_stabiliser(KS1=20.0, T1=0.15, T2=0.025, T3=0.15, T4=0.025, T10=0.0, T11=0.033),
    ("VSI1MAX", 0.08, *LIMIT, "ceiling of the first input"),
    ("VSI1MIN", -0.08, *LIMIT, "floor of the first input"),
    ("VSI2MAX", 1.25, *LIMIT, "ceiling of the second input"),
    ("VSI2MIN", -1.25, *LIMIT, "floor of the second input"),
    *of_stabiliser(VSTMAX=0.1, VSTMIN=-0.1),
)

PSS2A_HELD = {
    **{"T10": 0.0, "T11": 0.0},
    **{"VSI1MAX": NO_LIMIT, "VSI1MIN": -NO_LIMIT},
    **{"VSI2MAX": NO_LIMIT, "VSI2MIN": -NO_LIMIT},
}

RECORDS = (
    record(
        "PSS2B",
        "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 T10 T11 "
        "VSI1MAX VSI1MIN VSI2MAX VSI2MIN VSTMAX VSTMIN",
        icons={"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0, "M": 5, "N": 1},
    ),
    record(
        "PSS2A",
        "TW1 TW2 T6 TW3 TW4 T7 KS2 KS3 T8 T9 KS1 T1 T2 T3 T4 VSTMAX VSTMIN",
        icons={"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0, "M": 5, "N": 1},
        held=PSS2A_HELD,
    ),
)

PSLF_RECORDS = (
    record(
        "pss2b",
        "ICS1 REMBUS1 ICS2 REMBUS2 VSI1MAX VSI1MIN TW1 TW2 VSI2MAX VSI2MIN TW3 TW4 T6 "
        "T7 KS2 KS3 T8 T9 N M KS1 T1 T2 T3 T4 T10 T11 VSTMAX VSTMIN A TA TB KS4",
        icons={"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0, "M": 5, "N": 1},
        absent={"KS4": 1.0, "A": 1.0, "TA": 0.0, "TB": 0.0},
        spelled={"ICS1": "j1", "REMBUS1": "k1", "ICS2": "j2", "REMBUS2": "k2"},
    ),
    record(
        "pss2a",
        "ICS1 REMBUS1 ICS2 REMBUS2 TW1 TW2 TW3 TW4 T6 T7 KS2 KS3 KS4 T8 T9 N M KS1 T1 "
        "T2 T3 T4 VSTMAX VSTMIN A TA TB",
        icons={"ICS1": 1, "REMBUS1": 0, "ICS2": 3, "REMBUS2": 0, "M": 5, "N": 1},
        absent={"KS4": 1.0, "A": 1.0, "TA": 0.0, "TB": 0.0},
        held=PSS2A_HELD,
        spelled={"ICS1": "j1", "REMBUS1": "k1", "ICS2": "j2", "REMBUS2": "k2"},
    ),
)

LAGS = 5  # of the ramp tracking filter: the highest M
STATES = "W1 W2 V6 W3 W4 V7 R1 R2 R3 R4 R5 V1 V3 V10"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v = accelerating(s, u, p, d, LAGS, 1.0)
    v1, d.V1 = lead_lag(p.KS1 * v, s.V1, p.T1, p.T2)
    v3, d.V3 = lead_lag(v1, s.V3, p.T3, p.T4)
    v10, d.V10 = lead_lag(v3, s.V10, p.T10, p.T11)
    return clip(v10, p.VSTMIN, p.VSTMAX)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    accelerating_rest(u, p, x, LAGS)
    x.V1 = x.V3 = x.V10 = 0.0
