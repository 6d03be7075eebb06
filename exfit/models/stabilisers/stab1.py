"""STAB1: speed sensitive stabiliser (PSS/E).

                                            HLIM
vsi1 ─►[  sK  ]─►[1 + sT1]─►[1 + sT2]─►[clip]─► vs
       [1 + sT]  [1 + sT3]  [1 + sT4]  -HLIM

The data sheet gives three ratios, as PSS/E does (there K/T, T1/T3 and T2/T4):
K = K_T T, T1 = T1_T3 T3 and T2 = T2_T4 T4. T3 = 0 or T4 = 0 bypasses its block.
"""

from exfit.models.blocks import Signal, clip, lead_lag, washout
from exfit.models.sheet import TIME, WASHOUT_TIME, record, sheet
from exfit.models.stabiliser_parts import of_stabiliser

INPUTS = ("speed",)

SHEET = sheet(
    ("K_T", 5.0, "pu/s", (-10000.0, 10000.0), "K/T: gain over washout time constant"),
    ("T", 10.0, *WASHOUT_TIME, "washout time constant"),
    ("T1_T3", 10.0, "1", (0.0, 1000.0), "T1/T3: first lead over first lag"),
    ("T3", 0.05, *TIME, "first lag"),
    ("T2_T4", 10.0, "1", (0.0, 1000.0), "T2/T4: second lead over second lag"),
    *of_stabiliser(T4=0.05, HLIM=0.05),
)

RECORDS = record("STAB1", "K_T T T1_T3 T3 T2_T4 T4 HLIM")

STATES = "V1 V2 V3"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v1, d.V1 = washout(u.vsi1, s.V1, p.K_T * p.T, p.T)
    v2, d.V2 = lead_lag(v1, s.V2, p.T1_T3 * p.T3, p.T3)
    v3, d.V3 = lead_lag(v2, s.V3, p.T2_T4 * p.T4, p.T4)
    return clip(v3, -p.HLIM, p.HLIM)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, x.V2, x.V3 = u.vsi1, 0.0, 0.0
