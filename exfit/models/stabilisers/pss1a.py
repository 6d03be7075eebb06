"""PSS1A: single input stabiliser (IEEE Std 421.5-2005, 8.1).

                                                             VSTMAX
vsi1 ─►[  1  ]─►[ sKST5 ]─►[1/(1+sA1+s²A2)]─►[1+sT1]─►[1+sT3]─►[clip]─► vs
       [1+sT6]  [1 + sT5]                    [1+sT2]  [1+sT4]  VSTMIN

KST5 is KS T5. A1 and A2 make the low-pass filter that the standard draws for
torsional modes: A2 = 0 leaves the lag A1, both 0 nothing. T6, T2 or T4 = 0
bypasses its block. Not modelled: a switch-off at terminal voltages beyond
VCU and VCL, which some programs add.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, second_order, washout
from exfit.models.sheet import OF_A_LIST, SHORT_TIME, WASHOUT_TIME, WITHIN_10000, record, sheet
from exfit.models.stabiliser_parts import of_stabiliser

INPUTS = "speed"

SHEET = sheet(
    ("A1", 0.061, *SHORT_TIME, "first coefficient of the filter"),
    ("A2", 0.0017, "s2", (0.0, 10.0), "second coefficient of the filter"),
    *of_stabiliser(T1=0.3, T2=0.03, T3=0.3, T4=0.03),
    ("T5", 10.0, *WASHOUT_TIME, "washout time constant"),
    ("T6", 0.0, *SHORT_TIME, "transducer lag"),
    ("KS", 5.0, *WITHIN_10000, "gain"),
    *of_stabiliser(VSTMAX=0.05, VSTMIN=-0.05),
)

RECORDS = record(
    "PSS1A",
    "A1 A2 T1 T2 T3 T4 T5 T6 KS VSTMAX VSTMIN VCU VCL",
    icons={"ICS": 1, "REMBUS": 0},
    absent={"VCU": 0.0, "VCL": 0.0},
    doubt="whether REMBUS, VCU and VCL are in the record of PSS1A is not confirmed",
)

PSLF_RECORDS = record(
    "pss1a",
    "ICS REMBUS A1 A2 T1 T2 T3 T4 T5 T6 KS VSTMAX VSTMIN VCU VCL",
    icons={"ICS": 1, "REMBUS": 0},
    absent={"VCU": 0.0, "VCL": 0.0},
    spelled={"ICS": "j", "REMBUS": "k", "VSTMAX": "lsmax", "VSTMIN": "lsmin"},
    doubt=OF_A_LIST,
)

STATES = "V1 V2 V3 DV3 V4 V5"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v1, d.V1 = lag(u.vsi1, s.V1, 1.0, p.T6)
    v2, d.V2 = washout(v1, s.V2, p.KS * p.T5, p.T5)
    v3, d.V3, d.DV3 = second_order(v2, s.V3, s.DV3, p.A1, p.A2)
    v4, d.V4 = lead_lag(v3, s.V4, p.T1, p.T2)
    v5, d.V5 = lead_lag(v4, s.V5, p.T3, p.T4)
    return clip(v5, p.VSTMIN, p.VSTMAX)


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1, x.V2, x.V3, x.DV3, x.V4, x.V5 = u.vsi1, u.vsi1, 0.0, 0.0, 0.0, 0.0
