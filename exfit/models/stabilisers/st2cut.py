"""ST2CUT: dual input stabiliser with a voltage cut-off (PSS/E).

vsi1 ─►[  K1   ]─►(+)─►[  sT3  ]─►[1 + sT5]─►[1 + sT7]─►[1 + sT9 ]─► v
       [1 + sT1]   ▲   [1 + sT4]  [1 + sT6]  [1 + sT8]  [1 + sT10]
                   │
vsi2 ─►[  K2   ]───┘
       [1 + sT2]
    LSMAX
v ─►[clip]─► vs
    LSMIN

T1, T2, T6, T8 or T10 = 0 bypasses its block. T3 = 0 makes 1 / (1 + sT4) of the
washout, as in PSS/E; an input with a value at rest, as the power, is refused
then. Not modelled: the cut-off where the terminal voltage leaves its initial
value by more than VCU and VCL.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, washout_or_lag
from exfit.models.sheet import LONG_TIME, TIME, WITHIN_10000, record, sheet
from exfit.models.stabiliser_parts import SPEED_AND_POWER, of_stabiliser

INPUTS = ("speed", "p")

SHEET = sheet(
    ("K1", 5.0, *WITHIN_10000, "gain of the first input"),
    ("K2", 0.0, *WITHIN_10000, "gain of the second input"),
    *of_stabiliser(T1_OF_INPUT=0.02, T2_OF_INPUT=0.02),
    ("T3", 10.0, *LONG_TIME, "washout lead"),
    ("T4", 10.0, "s", (0.001, 1000.0), "washout lag"),
    ("T5", 0.3, *TIME, "first lead"),
    ("T6", 0.03, *TIME, "first lag"),
    ("T7", 0.3, *TIME, "second lead"),
    ("T8", 0.03, *TIME, "second lag"),
    ("T9", 0.0, *TIME, "third lead"),
    ("T10", 0.0, *TIME, "third lag"),
    *of_stabiliser(LSMAX=0.1, LSMIN=-0.1),
)

RECORDS = record(
    "ST2CUT",
    "K1 K2 T1 T2 T3 T4 T5 T6 T7 T8 T9 T10 LSMAX LSMIN VCU VCL",
    icons=SPEED_AND_POWER,
    absent={"VCU": 0.0, "VCL": 0.0},
)

STATES = "V1 V2 V3 V4 V5 V6"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v1, d.V1 = lag(u.vsi1, s.V1, p.K1, p.T1)
    v2, d.V2 = lag(u.vsi2, s.V2, p.K2, p.T2)
    v3, d.V3 = washout_or_lag(v1 + v2, s.V3, 1.0, p.T3, p.T4)
    v4, d.V4 = lead_lag(v3, s.V4, p.T5, p.T6)
    v5, d.V5 = lead_lag(v4, s.V5, p.T7, p.T8)
    v6, d.V6 = lead_lag(v5, s.V6, p.T9, p.T10)
    return clip(v6, p.LSMIN, p.LSMAX)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, x.V2 = p.K1 * u.vsi1, p.K2 * u.vsi2
    x.V3, x.V4, x.V5, x.V6 = x.V1 + x.V2, 0.0, 0.0, 0.0
