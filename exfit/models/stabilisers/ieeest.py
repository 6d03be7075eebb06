"""IEEEST: single input stabiliser with two filters (PSS/E).

                                                            LSMAX
vsi1 ─►[ F ]─►[1 + sT1]─►[1 + sT3]─►[ KS ]─►[ sT5   ]─►[clip]─► vs
              [1 + sT2]  [1 + sT4]          [1 + sT6]   LSMIN

F = (1 + sA5 + s²A6) / ((1 + sA1 + s²A2) (1 + sA3 + s²A4)). A2 = 0 or A4 = 0
leaves a lag, A1 = A2 = 0 or A3 = A4 = 0 no filter; of the numerator acts what
the filters that remain can make. T2 = 0 or T4 = 0 bypasses its block. T5 = 0
makes 1 / (1 + sT6) of the washout, as in PSS/E; an input with a value at rest,
as the power, is refused then. Not modelled: a switch-off at terminal voltages
beyond VCU and VCL.
"""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    is_curved,
    lead_lag,
    rate,
    second_order,
    washout_or_lag,
    where,
)
from exfit.models.sheet import LONG_TIME, SHORT_TIME, WITHIN_10000, record, sheet
from exfit.models.stabiliser_parts import of_stabiliser

INPUTS = ("speed",)

SHEET = sheet(
    ("A1", 0.061, *SHORT_TIME, "first coefficient of the first filter"),
    ("A2", 0.0017, "s2", (0.0, 10.0), "second coefficient of the first filter"),
    ("A3", 0.0, *SHORT_TIME, "first coefficient of the second filter"),
    ("A4", 0.0, "s2", (0.0, 10.0), "second coefficient of the second filter"),
    ("A5", 0.0, "s", (-10.0, 10.0), "first coefficient of the filters' numerator"),
    ("A6", 0.0, "s2", (-10.0, 10.0), "second coefficient of the filters' numerator"),
    *of_stabiliser(T1=0.15, T2=0.03, T3=0.15, T4=0.03),
    ("T5", 1.65, *LONG_TIME, "washout lead"),
    ("T6", 1.65, "s", (0.001, 1000.0), "washout lag"),
    ("KS", 6.2, *WITHIN_10000, "gain"),
    *of_stabiliser(LSMAX=0.1, LSMIN=-0.1),
)

RECORDS = record(
    "IEEEST",
    "A1 A2 A3 A4 A5 A6 T1 T2 T3 T4 T5 T6 KS LSMAX LSMIN VCU VCL",
    icons={"ICS": 1, "REMBUS": 0},
    absent={"VCU": 0.0, "VCL": 0.0},
)

PSLF_RECORDS = record(
    "ieeest",
    "ICS REMBUS A1 A2 A3 A4 A5 A6 T1 T2 T3 T4 T5 T6 KS LSMAX LSMIN VCU VCL TDELAY",
    icons={"ICS": 1, "REMBUS": 0},
    absent={"VCU": 0.0, "VCL": 0.0, "TDELAY": 0.0},
    spelled={"ICS": "j", "REMBUS": "k"},
)

STATES = "V1 DV1 V2 DV2 V3 V4 V5"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return vs."""
    v1, d.V1, d.DV1 = second_order(u.vsi1, s.V1, s.DV1, p.A1, p.A2)
    v2, d.V2, d.DV2 = second_order(v1, s.V2, s.DV2, p.A3, p.A4)
    f = v2 + numerator(d, p)
    v3, d.V3 = lead_lag(f, s.V3, p.T1, p.T2)
    v4, d.V4 = lead_lag(v3, s.V4, p.T3, p.T4)
    v5, d.V5 = washout_or_lag(v4, s.V5, p.KS, p.T5, p.T6)
    return clip(v5, p.LSMIN, p.LSMAX)


def numerator(d: Signal, p: Signal) -> Signal:
    """Compute the part of A5 and A6 in the output of both filters, from the states' slopes."""
    lagged, curved = p.A3 >= SHORTEST, is_curved(p.A3, p.A4)
    filtered = (p.A1 >= SHORTEST) | is_curved(p.A1, p.A2)
    slope = where(curved | lagged, d.V2, d.V1)
    of_lag = where(filtered, (d.V1 - d.V2) * rate(p.A3), 0.0)
    bend = where(curved, d.DV2, where(lagged, of_lag, d.DV1))
    return p.A5 * slope + p.A6 * bend


def rest(vs: Signal, u: Signal, p: Signal, x: Signal) -> None:
    """Write the states into x that still inputs lead to; vs is then 0."""
    x.V1 = x.V2 = x.V3 = x.V4 = u.vsi1
    x.DV1, x.DV2, x.V5 = 0.0, 0.0, p.KS * u.vsi1
