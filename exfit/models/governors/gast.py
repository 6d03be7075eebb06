"""GAST: gas turbine governor (PSS/E).

                                   VMAX
pref ─────────►(+)─►[lower of]─►[   1   ]─►[   1   ]─┬─►(+)─► Pm
             -▲     [the two ]  [1 + sT1]  [1 + sT2] │-▲
dw ─►[  1/R  ]┘         ▲          VMIN              │ │
                  AT ─►(+)◄─[KT]◄─(+)◄── AT          │ │
                                   ▲-                │ │
                                   └─[   1   ]◄──────┘ │
                                     [1 + sT3]         │
dw ─►[Dturb]───────────────────────────────────────────┘

pref is a power. The limits are non-windup. A unit that starts above AT, the
load that the ambient temperature allows, is not at rest. Typical data are those
of IEC 61970-302 (GovGAST).
"""

from exfit.models.blocks import Signal, lag, limited_lag, smaller
from exfit.models.sheet import DIVIDING_TIME, TIME, UP_TO_100, WITHIN_10, limits, record, sheet

SHEET = sheet(
    ("R", 0.04, "pu", (0.001, 10.0), "permanent droop"),
    ("T1", 0.5, *TIME, "fuel valve lag"),
    ("T2", 0.5, *TIME, "turbine lag"),
    ("T3", 3.0, *DIVIDING_TIME, "exhaust temperature lag"),
    ("AT", 1.0, "pu", (0.001, 10.0), "load limit by the ambient temperature"),
    ("KT", 3.0, "1", (0.0, 1000.0), "temperature limiter gain"),
    *limits("VMAX", 1.0, 0.0, "the valve", WITHIN_10),
    ("Dturb", 0.18, *UP_TO_100, "turbine damping"),
)

RECORDS = record("GAST", "R T1 T2 T3 AT KT VMAX VMIN Dturb")

STATES = "V1 V2 V3"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    demand = smaller(u.pref - u.dw / p.R, p.AT + p.KT * (p.AT - s.V3))
    v1, d.V1 = limited_lag(demand, s.V1, 1.0, p.T1, p.VMIN, p.VMAX)
    v2, d.V2 = lag(v1, s.V2, 1.0, p.T2)
    _, d.V3 = lag(v2, s.V3, 1.0, p.T3)
    return v2 - p.Dturb * u.dw


def rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = x.V2 = x.V3 = pm
    return pm
