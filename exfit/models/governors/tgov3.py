"""TGOV3: steam turbine governor with the outflow of its reheater as a curve (PSS/E).

                               UO    PMAX
pref ──────────►(+)─►[ 1  ]─►[clip]─►[ 1 ]─┬─► valve
              -▲   ▲-[ T3 ]    UC    [ s ] │
dw ─►[K(1+sT2)]┘   │                 PMIN  │
     [ 1+sT1  ]    └───────────────────────┘

                        PRMAX
valve ─►[   1   ]─┬─►(+)─►[  1  ]─►[curve]─┬─►[   1   ]─┐
        [1 + sT4] │   ▲-  [ sT5 ]          │  [1 + sT6] │
                  │   └───────────── flow ─┤            ▼
                 [K1]                     [K2]         [K3]
                  │                        ▼            ▼
                  └──────────────────────►(+)─────────►(+)─► Pm

pref is a power over K1 + K2 + K3, that of the valve. The pressure of the
reheater has the ceiling PRMAX. It drives the flow through the open intercept
valve along the line through GV1 PGV1, GV2 PGV2, GV3 PGV3, GV4 PGV4, GV5 PGV5
and GV6 PGV6, pressure and flow, whose ends go on; a point not right of those
before is left out. A .dyr file does not have these points: there the flow is
the pressure, as in OPAL-RT's library and InterPSS. PowerWorld 24 takes
another curve, near a pressure of 0.12 the line 0.23 + 2.2 pressure. Not
modelled: the fast closing of the intercept valve, which no record starts (TA,
TB, TC). Typical data are those of IEC 61970-302 (GovSteamFV3), T3 that of
OPAL-RT's library.
"""

from math import inf

from exfit.models.blocks import Signal, clip, lag, larger, lead_lag, limited, smaller
from exfit.models.governor_parts import (
    BAND,
    ON_RATING,
    PLAIN,
    curve,
    governor,
    in_use,
    outside_band,
)
from exfit.models.sheet import (
    DIVIDING_TIME,
    OF_A_LIST,
    OF_TWO_PROGRAMS,
    TIME,
    WITHIN_10,
    limits,
    record,
    sheet,
)

POINTS = [(f"GV{k}", f"PGV{k}") for k in range(1, 7)]
CURVE = " ".join(name for point in POINTS for name in point)
# the flow that is the pressure, up to any that there is
NO_CURVE = {**dict.fromkeys(CURVE.split(), 0.0), "GV2": 10.0, "PGV2": 10.0}
CONS = "K T1 T2 T3 UO UC PMAX PMIN T4 K1 T5 K2 T6 K3 TA TB TC PRMAX"
FAST_VALVING = "TA TB TC"


def curve_of(p: Signal) -> tuple[list[Signal], list[Signal]]:
    """Return the pressures and the flows of the curve's points."""
    return [getattr(p, x) for x, _ in POINTS], [getattr(p, y) for _, y in POINTS]


def tgov3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    low, high, top = (
        in_use(s.PMIN0, p.PMIN),
        in_use(s.PMAX0, p.PMAX),
        in_use(s.PRMAX0, p.PRMAX),
    )
    v1, d.V1 = lead_lag(p.K * outside_band(u.dw, p), s.V1, p.T2, p.T1)
    valve = clip(s.VALVE, low, high)
    velocity = clip((u.pref - v1 - valve) / p.T3, p.UC, p.UO)
    d.VALVE = limited(velocity, s.VALVE, low, high)
    v4, d.V4 = lag(valve, s.V4, 1.0, p.T4)
    flow = curve(smaller(s.PR, top), *curve_of(p))
    d.PR = limited((v4 - flow) / p.T5, s.PR, -inf, top)
    v6, d.V6 = lag(flow, s.V6, 1.0, p.T6)
    return p.K1 * v4 + p.K2 * flow + p.K3 * v6


def tgov3_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1 = 0.0
    x.VALVE = x.V4 = x.V6 = pm / (p.K1 + p.K2 + p.K3)
    x.PR = curve(x.VALVE, *reversed(curve_of(p)))
    x.PMAX0, x.PMIN0 = larger(p.PMAX, x.VALVE), smaller(p.PMIN, x.VALVE)
    x.PRMAX0 = larger(p.PRMAX, x.PR)
    return x.VALVE


def points(*typical: tuple[float, float]) -> list[tuple[str, float, str, tuple[float, float], str]]:
    """Return the rows of a curve."""
    of_gate = "reheater pressure at point {} of the curve"
    return [
        (symbol, value, "pu", (0.0, 10.0), meaning.format(k))
        for k, (names, at) in enumerate(zip(POINTS, typical, strict=True), 1)
        for symbol, value, meaning in zip(
            names, at, (of_gate, "flow at point {} of the curve"), strict=True
        )
    ]


TGOV3 = governor(
    tgov3,
    tgov3_rest,
    sheet(
        ("K", 20.0, "pu", (0.01, 1000.0), "governor gain, 1 over the droop"),
        ("T1", 0.0, *TIME, "governor lag"),
        ("T2", 0.0, *TIME, "governor lead"),
        ("T3", 1.0, *DIVIDING_TIME, "valve positioner time constant"),
        ("UO", 0.1, "pu/s", (0.0001, 1000.0), "fastest opening of the valve"),
        ("UC", -1.0, "pu/s", (-1000.0, -0.0001), "fastest closing of the valve"),
        *limits("PMAX", 1.0, 0.0, "the valve", WITHIN_10),
        ("T4", 0.2, *TIME, "steam inlet lag"),
        ("K1", 0.2, "1", (0.0, 10.0), "share behind the steam inlet"),
        ("T5", 0.5, *DIVIDING_TIME, "reheater time constant"),
        ("K2", 0.2, "1", (0.0, 10.0), "share behind the reheater"),
        ("T6", 10.0, *TIME, "crossover lag"),
        ("K3", 0.6, "1", (0.0, 10.0), "share behind the crossover"),
        ("PRMAX", 1.0, "pu", (0.0, 10.0), "ceiling of the reheater pressure"),
        *points((0.0, 0.0), (0.4, 0.75), (0.5, 0.91), (0.6, 0.98), (1.0, 1.0), (0.0, 0.0)),
        *BAND,
    ),
    "V1 VALVE V4 PR V6",
    text=__doc__,
    aliases="TGOV3D",
    setpoints="PMAX0 PMIN0 PRMAX0",
    records=(
        *record("TGOV3", CONS, ignored=FAST_VALVING, held={**PLAIN, **NO_CURVE}),
        *record(
            "TGOV3D",
            f"{CONS} DBH DBL Trate",
            ignored=f"{FAST_VALVING} Trate",
            held={**ON_RATING, **NO_CURVE},
            doubt=OF_TWO_PROGRAMS,
        ),
    ),
    pslf_records=record(
        "tgov3", f"{CONS} {CURVE}", ignored=FAST_VALVING, held=PLAIN, doubt=OF_A_LIST
    ),
    doubt="where the curve acts: on the pressure of the reheater, as in PowerWorld and Dynawo",
)
