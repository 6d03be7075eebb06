"""TGOV1: steam turbine governor (PSS/E).

                     VMAX
pref ─►(+)─►[ 1 ]─►[   1   ]─►[1 + sT2]─►(+)─► Pm
       -▲   [ R ]  [1 + sT1]  [1 + sT3]  -▲
        │            VMIN                 │
dw ─────┴────────────────────────[Dt]─────┘

pref is a speed, R times the power at rest. The limits are non-windup. Typical
data are those of IEC 61970-302 (GovSteam0).
"""

from exfit.models.blocks import Signal, lead_lag, limited_lag
from exfit.models.sheet import TIME, UP_TO_100, WITHIN_10, limits, record, sheet

SHEET = sheet(
    ("R", 0.05, "pu", (0.001, 10.0), "permanent droop"),
    ("T1", 0.5, *TIME, "valve lag"),
    *limits("VMAX", 1.0, 0.0, "the valve", WITHIN_10),
    ("T2", 3.0, *TIME, "reheater lead"),
    ("T3", 10.0, *TIME, "reheater lag"),
    ("Dt", 0.0, *UP_TO_100, "turbine damping"),
)

RECORDS = record("TGOV1", "R T1 VMAX VMIN T2 T3 Dt")

PSLF_RECORDS = record("tgov1", "R T1 VMAX VMIN T2 T3 Dt")

STATES = "V1 V3"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    v1, d.V1 = limited_lag((u.pref - u.dw) / p.R, s.V1, 1.0, p.T1, p.VMIN, p.VMAX)
    v3, d.V3 = lead_lag(v1, s.V3, p.T2, p.T3)
    return v3 - p.Dt * u.dw


def rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = x.V3 = pm
    return p.R * pm
