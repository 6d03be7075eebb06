"""STAB2A: power sensitive stabiliser of ASEA (PSS/E).

vsi1 ─►[ sK2 T2]─►[ sK2 T2]─►[ sK2 T2]─┬─►[   K3  ]─►(+)─► v
       [1 + sT2]  [1 + sT2]  [1 + sT2] │  [1 + sT3]   ▲
                                       └─►[   K4  ]───┘
                            HLIM
v ─►[  -K5  ]─►[   K5  ]─►[clip]─► vs
    [1 + sT5]  [1 + sT5]  -HLIM

The input is the electrical power; a rise of it lowers vs. T3 = 0 or T5 = 0
bypasses its block. Typical data are those of a unit in a public library, whose
drawing this is (OpenIPSL); that of PSS/E was not seen.
"""

from exfit.models.blocks import Signal, clip, lag, washout
from exfit.models.sheet import LONG_TIME, WASHOUT_TIME, WITHIN_1000, record, sheet
from exfit.models.stabiliser_parts import of_stabiliser

INPUTS = ("p",)

SHEET = sheet(
    ("K2", 1.0, *WITHIN_1000, "gain of each washout"),
    ("T2", 4.4, *WASHOUT_TIME, "time constant of each washout"),
    ("K3", 10.0, *WITHIN_1000, "gain of the lagged branch"),
    ("T3", 1.8, *LONG_TIME, "lag of the lagged branch"),
    ("K4", 1.0, *WITHIN_1000, "gain of the direct branch"),
    ("K5", 1.41, *WITHIN_1000, "gain of each output lag"),
    ("T5", 0.01, *LONG_TIME, "each output lag"),
    *of_stabiliser(HLIM=0.05),
)

RECORDS = record("STAB2A", "K2 T2 K3 T3 K4 K5 T5 HLIM", doubt="its order is from one public source")

STATES = "W1 W2 W3 V3 V5 V6"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    w1, d.W1 = washout(u.vsi1, s.W1, p.K2 * p.T2, p.T2)
    w2, d.W2 = washout(w1, s.W2, p.K2 * p.T2, p.T2)
    w3, d.W3 = washout(w2, s.W3, p.K2 * p.T2, p.T2)
    v3, d.V3 = lag(w3, s.V3, p.K3, p.T3)
    v5, d.V5 = lag(v3 + p.K4 * w3, s.V5, -p.K5, p.T5)
    v6, d.V6 = lag(v5, s.V6, p.K5, p.T5)
    return clip(v6, -p.HLIM, p.HLIM)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.W1, x.W2, x.W3, x.V3, x.V5, x.V6 = u.vsi1, 0.0, 0.0, 0.0, 0.0, 0.0
