"""IEESGO: steam turbine governor of one gain and three shares (PSS/E).

                                     PMAX
pref ─────────────────────────►(+)─►[clip]─►[   1   ]─► v4
                             -▲      PMIN   [1 + sT4]
dw ─►[  K1   ]─►[1 + sT2]─────┘
     [1 + sT1]  [1 + sT3]

v4 ─┬─►[1 - K2]────────────────────►(+)─►(+)─► Pm
    │                                ▲    ▲
    └─►[  K2   ]─┬─►[1 - K3]─────────┘    │
       [1 + sT5] │                        │
                 └─►[  K3   ]─────────────┘
                    [1 + sT6]

pref is a power. PMAX and PMIN clip what goes into the turbine: no state stops
there. T1, T4, T5 or T6 = 0 bypasses its block. Typical data are those of a unit
in a public library (iTesla, REN), with limits of 0 and 1.
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag
from exfit.models.sheet import DIVIDING_TIME, TIME, WITHIN_10, limits, record, sheet

SHEET = sheet(
    ("T1", 0.0, *TIME, "controller lag"),
    ("T2", 0.0, *TIME, "governor lead"),
    ("T3", 0.02, *DIVIDING_TIME, "governor lag"),
    ("T4", 0.673, *TIME, "steam inlet lag"),
    ("T5", 3.0, *TIME, "reheater lag"),
    ("T6", 0.45, *TIME, "crossover lag"),
    ("K1", 14.3, "pu", (0.01, 1000.0), "governor gain, 1 over the droop"),
    ("K2", 0.7, "1", (0.0, 10.0), "share behind the reheater"),
    ("K3", 1.0, "1", (-10.0, 10.0), "share of that behind the crossover"),
    *limits("PMAX", 1.0, 0.0, "the power demand", WITHIN_10),
)

RECORDS = record("IEESGO", "T1 T2 T3 T4 T5 T6 K1 K2 K3 PMAX PMIN")

STATES = "V1 V3 V4 V5 V6"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    v1, d.V1 = lag(u.dw, s.V1, p.K1, p.T1)
    v3, d.V3 = lead_lag(v1, s.V3, p.T2, p.T3)
    demand = clip(u.pref - v3, p.PMIN, p.PMAX)
    v4, d.V4 = lag(demand, s.V4, 1.0, p.T4)
    v5, d.V5 = lag(v4, s.V5, p.K2, p.T5)
    v6, d.V6 = lag(v5, s.V6, p.K3, p.T6)
    return (1.0 - p.K2) * v4 + (1.0 - p.K3) * v5 + v6


def rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1, x.V3, x.V4, x.V5, x.V6 = 0.0, 0.0, pm, p.K2 * pm, p.K2 * p.K3 * pm
    return pm
