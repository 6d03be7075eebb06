"""IEEEG1: steam turbine governor (IEEE 1973; PSS/E).

                               UO    PMAX
pref ──────────►(+)─►[ 1  ]─►[clip]─►[ 1 ]─┬─► valve
              -▲   ▲-[ T3 ]    UC    [ s ] │
dw ─►[K(1+sT2)]┘   │                 PMIN  │
     [ 1+sT1  ]    └───────────────────────┘

valve ─►[   1   ]─┬─►[   1   ]─┬─►[   1   ]─┬─►[   1   ]─┐
        [1 + sT4] │  [1 + sT5] │  [1 + sT6] │  [1 + sT7] │
                  ▼            ▼            ▼            ▼
                 [K1]         [K3]         [K5]         [K7]
                  │            ▼            ▼            ▼
                  └──────────►(+)─────────►(+)─────────►(+)─► Pm

pref is a power, that of the valve. UC is negative, the rate of closing. The
limits of the valve are non-windup. The shares K2, K4, K6 and K8 are those of
a second, low pressure machine of a cross compound unit, which is not modelled.
Pm is the sum of the shares: where they do not make 1, the valve is at rest at
Pm over their sum (ANDES scales them to 1). T1 = 0 bypasses its block with T2.
Typical data are those of IEC 61970-302 (GovSteamIEEE1).
"""

from exfit.models.blocks import Signal, clip, lag, lead_lag, limited
from exfit.models.sheet import DIVIDING_TIME, TIME, WITHIN_10, limits, record, sheet

SHEET = sheet(
    ("K", 25.0, "pu", (0.01, 1000.0), "governor gain, 1 over the droop"),
    ("T1", 0.0, *TIME, "governor lag"),
    ("T2", 0.0, *TIME, "governor lead"),
    ("T3", 0.1, *DIVIDING_TIME, "valve positioner time constant"),
    ("UO", 1.0, "pu/s", (0.0001, 1000.0), "fastest opening of the valve"),
    ("UC", -10.0, "pu/s", (-1000.0, -0.0001), "fastest closing of the valve"),
    *limits("PMAX", 1.0, 0.0, "the valve", WITHIN_10),
    ("T4", 0.3, *TIME, "steam inlet lag"),
    ("K1", 0.2, "1", (0.0, 10.0), "share behind the steam inlet"),
    ("T5", 5.0, *TIME, "second boiler pass lag"),
    ("K3", 0.3, "1", (0.0, 10.0), "share behind the second boiler pass"),
    ("T6", 0.5, *TIME, "third boiler pass lag"),
    ("K5", 0.5, "1", (0.0, 10.0), "share behind the third boiler pass"),
    ("T7", 0.0, *TIME, "fourth boiler pass lag"),
    ("K7", 0.0, "1", (0.0, 10.0), "share behind the fourth boiler pass"),
)

RECORDS = record(
    "IEEEG1",
    "K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8",
    icons={"JBUS": 0, "M": 0},
    absent={"K2": 0.0, "K4": 0.0, "K6": 0.0, "K8": 0.0},
)

# a dead band and a valve's curve, which the model does not have
NOT_MODELLED = "DB1 EPS DB2 GV1 PGV1 GV2 PGV2 GV3 PGV3 GV4 PGV4 GV5 PGV5 GV6 PGV6"
PSLF_RECORDS = record(
    "ieeeg1",
    f"K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8 {NOT_MODELLED}",
    absent=dict.fromkeys(["K2", "K4", "K6", "K8", *NOT_MODELLED.split()], 0.0),
)

STATES = "V1 VALVE V4 V5 V6 V7"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    v1, d.V1 = lead_lag(p.K * u.dw, s.V1, p.T2, p.T1)
    valve = clip(s.VALVE, p.PMIN, p.PMAX)
    velocity = clip((u.pref - v1 - valve) / p.T3, p.UC, p.UO)
    d.VALVE = limited(velocity, s.VALVE, p.PMIN, p.PMAX)
    v4, d.V4 = lag(valve, s.V4, 1.0, p.T4)
    v5, d.V5 = lag(v4, s.V5, 1.0, p.T5)
    v6, d.V6 = lag(v5, s.V6, 1.0, p.T6)
    v7, d.V7 = lag(v6, s.V7, 1.0, p.T7)
    return p.K1 * v4 + p.K3 * v5 + p.K5 * v6 + p.K7 * v7


def rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = 0.0
    x.VALVE = x.V4 = x.V5 = x.V6 = x.V7 = pm / (p.K1 + p.K3 + p.K5 + p.K7)
    return x.VALVE
