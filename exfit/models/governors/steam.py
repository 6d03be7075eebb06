"""Governors of steam turbines: IEEEG1, IEESGO and TGOV1."""

from exfit.models.blocks import Signal, clip, lag, larger, lead_lag, limited, limited_lag, smaller
from exfit.models.governor_parts import (
    BAND,
    PLAIN,
    banded,
    governor,
    in_use,
    outside_band,
    with_band,
)
from exfit.models.sheet import (
    DIVIDING_TIME,
    TIME,
    UP_TO_100,
    UP_TO_1000,
    WITHIN_10,
    limits,
    record,
    sheet,
)

# a dead band and a valve's curve, which the model does not have
WITHOUT = "DB1 EPS DB2 GV1 PGV1 GV2 PGV2 GV3 PGV3 GV4 PGV4 GV5 PGV5"
NOT_MODELLED = f"{WITHOUT} GV6 PGV6"
CONS = "K T1 T2 T3 UO UC PMAX PMIN T4 K1 K2 T5 K3 K4 T6 K5 K6 T7 K7 K8"
LOW_PRESSURE = dict.fromkeys(["K2", "K4", "K6", "K8"], 0.0)  # shares of a second machine
SECOND_MACHINE = {"JBUS": 0, "M": 0}  # there is none, and M, its id, says nothing


def ieeeg1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
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
    limits of the valve are non-windup. Its machine is that of the high pressure:
    K2, K4, K6 and K8, of a second one of a cross compound unit, do nothing to it.
    Pm is the sum of the shares: where they do not make 1, the valve is at rest at
    Pm over their sum (ANDES scales them to 1). T1 = 0 bypasses its block with T2.
    Typical data are those of IEC 61970-302 (GovSteamIEEE1).
    """
    low, high = in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX)
    v1, d.V1 = lead_lag(p.K * outside_band(u.dw, p), s.V1, p.T2, p.T1)
    valve = clip(s.VALVE, low, high)
    velocity = clip((u.pref - v1 - valve) / p.T3, p.UC, p.UO)
    d.VALVE = limited(velocity, s.VALVE, low, high)
    v4, d.V4 = lag(valve, s.V4, 1.0, p.T4)
    v5, d.V5 = lag(v4, s.V5, 1.0, p.T5)
    v6, d.V6 = lag(v5, s.V6, 1.0, p.T6)
    v7, d.V7 = lag(v6, s.V7, 1.0, p.T7)
    return p.K1 * v4 + p.K3 * v5 + p.K5 * v6 + p.K7 * v7


def ieeeg1_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = 0.0
    x.VALVE = x.V4 = x.V5 = x.V6 = x.V7 = pm / (p.K1 + p.K3 + p.K5 + p.K7)
    x.PMAX0, x.PMIN0 = larger(p.PMAX, x.VALVE), smaller(p.PMIN, x.VALVE)
    return x.VALVE


IEEEG1 = governor(
    ieeeg1,
    ieeeg1_rest,
    sheet(
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
        *BAND,
    ),
    "V1 VALVE V4 V5 V6 V7",
    aliases="IEEEG1D WSIEG1",
    records=(
        *record("IEEEG1", CONS, icons=SECOND_MACHINE, absent=LOW_PRESSURE, ignored="M", held=PLAIN),
        *with_band("IEEEG1", CONS, icons=SECOND_MACHINE, absent=LOW_PRESSURE, ignored="M"),
        *record(
            "WSIEG1",
            f"{CONS} {WITHOUT} IBLOCK",
            icons={**SECOND_MACHINE, "IBLOCK": 0},
            absent={**LOW_PRESSURE, **dict.fromkeys(WITHOUT.split(), 0.0)},
            ignored="M",
            held=PLAIN,
        ),
    ),
    pslf_records=record(
        "ieeeg1",
        f"{CONS} {NOT_MODELLED}",
        absent={**LOW_PRESSURE, **dict.fromkeys(NOT_MODELLED.split(), 0.0)},
        held=PLAIN,
    ),
    setpoints="PMAX0 PMIN0",
)


def ieesgo(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEESGO: steam turbine governor with one gain and three power fractions (PSS/E).

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
    v1, d.V1 = lag(outside_band(u.dw, p), s.V1, p.K1, p.T1)
    v3, d.V3 = lead_lag(v1, s.V3, p.T2, p.T3)
    demand = clip(u.pref - v3, in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX))
    v4, d.V4 = lag(demand, s.V4, 1.0, p.T4)
    v5, d.V5 = lag(v4, s.V5, p.K2, p.T5)
    v6, d.V6 = lag(v5, s.V6, p.K3, p.T6)
    return (1.0 - p.K2) * v4 + (1.0 - p.K3) * v5 + v6


def ieesgo_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1, x.V3, x.V4, x.V5, x.V6 = 0.0, 0.0, pm, p.K2 * pm, p.K2 * p.K3 * pm
    x.PMAX0, x.PMIN0 = larger(p.PMAX, pm), smaller(p.PMIN, pm)
    return pm


IEESGO = governor(
    ieesgo,
    ieesgo_rest,
    sheet(
        ("T1", 0.0, *TIME, "controller lag"),
        ("T2", 0.0, *TIME, "governor lead"),
        ("T3", 0.02, *DIVIDING_TIME, "governor lag"),
        ("T4", 0.673, *TIME, "steam inlet lag"),
        ("T5", 3.0, *TIME, "reheater lag"),
        ("T6", 0.45, *TIME, "crossover lag"),
        ("K1", 14.3, *UP_TO_1000, "governor gain, 1 over the droop"),
        ("K2", 0.7, "1", (0.0, 10.0), "share behind the reheater"),
        ("K3", 1.0, "1", (-10.0, 10.0), "share of that behind the crossover"),
        *limits("PMAX", 1.0, 0.0, "the power demand", WITHIN_10),
        *BAND,
    ),
    "V1 V3 V4 V5 V6",
    aliases="IEESGOD",
    records=banded("IEESGO", "T1 T2 T3 T4 T5 T6 K1 K2 K3 PMAX PMIN"),
    setpoints="PMAX0 PMIN0",
)


def tgov1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """TGOV1: steam turbine governor (PSS/E).

                         VMAX
    pref ─►(+)─►[ 1 ]─►[   1   ]─►[1 + sT2]─►(+)─► Pm
           -▲   [ R ]  [1 + sT1]  [1 + sT3]  -▲
            │            VMIN                 │
    dw ─────┴────────────────────────[Dt]─────┘

    pref is a speed, R times the power at rest. The limits are non-windup. Typical
    data are those of IEC 61970-302 (GovSteam0).
    """
    low, high = in_use(s.VMIN0, p.VMIN), in_use(s.VMAX0, p.VMAX)
    demand = (u.pref - outside_band(u.dw, p)) / p.R
    v1, d.V1 = limited_lag(demand, s.V1, 1.0, p.T1, low, high)
    v3, d.V3 = lead_lag(v1, s.V3, p.T2, p.T3)
    return v3 - p.Dt * u.dw


def tgov1_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = x.V3 = pm
    x.VMAX0, x.VMIN0 = larger(p.VMAX, pm), smaller(p.VMIN, pm)
    return p.R * pm


TGOV1 = governor(
    tgov1,
    tgov1_rest,
    sheet(
        ("R", 0.05, "pu", (0.001, 10.0), "permanent droop"),
        ("T1", 0.5, *TIME, "valve lag"),
        *limits("VMAX", 1.0, 0.0, "the valve", ("pu", (-1e6, 1e6))),
        ("T2", 3.0, "s", (-100.0, 100.0), "reheater lead"),
        ("T3", 10.0, *TIME, "reheater lag"),
        ("Dt", 0.0, *UP_TO_100, "turbine damping"),
        *BAND,
    ),
    "V1 V3",
    aliases="TGOV1D",
    records=banded("TGOV1", "R T1 VMAX VMIN T2 T3 Dt"),
    pslf_records=record("tgov1", "R T1 VMAX VMIN T2 T3 Dt", held=PLAIN),
    setpoints="VMAX0 VMIN0",
)
