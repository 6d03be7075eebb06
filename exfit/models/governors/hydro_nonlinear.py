"""Hydro governors with a rigid penstock whose head follows the flow: HYG3 and HYGOVR."""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    larger,
    lead_lag,
    limited,
    limited_lag,
    smaller,
    sqrt,
    washout,
    where,
)
from exfit.models.governor_parts import BAND, PLAIN, backlash, curve, governor, in_use, outside_band
from exfit.models.governors.hygov import SHUT
from exfit.models.sheet import (
    DIVIDING_TIME,
    OF_TWO_PROGRAMS,
    TIME,
    UP_TO_10,
    UP_TO_100,
    WITHIN_10,
    Sheet,
    limits,
    record,
    sheet,
)

SERVO = sheet(
    ("Kg", 2.0, "1/s", (0.001, 1000.0), "gate servo gain"),
    ("Tp", 0.05, *TIME, "pilot valve lag"),
    ("VELOPEN", 0.2, "pu/s", (0.0001, 1000.0), "fastest opening of the gate"),
    ("VELCLOSE", -0.2, "pu/s", (-1000.0, -0.0001), "fastest closing of the gate"),
    *limits("PMAX", 1.0, 0.0, "the gate", WITHIN_10),
    ("BLG", 0.0, "pu", (0.0, 1.0), "backlash of the gate"),
)
COLUMN = sheet(
    ("Tw", 1.0, *DIVIDING_TIME, "water starting time"),
    ("At", 1.2, "1", (0.001, 100.0), "turbine gain"),
    ("Dturb", 0.2, *UP_TO_100, "turbine damping"),
    ("qNL", 0.08, "pu", (0.0, 1.0), "flow at no load"),
)
# a record has its bands in Hz and MW, while a governor does not see f0 and its rating
IN_HERTZ = f"{OF_TWO_PROGRAMS}; DBH, DBL and BLG, per unit, are not in the record"
HELD = {**PLAIN, "BLG": 0.0}
PAIRS = range(1, 7)
CURVE_POINTS = " ".join(f"GV{k} PGV{k}" for k in PAIRS)
VELOCITIES = {"VELOPEN": "velop", "VELCLOSE": "velcl"}


def gate_servo(c: Signal, s: Signal, p: Signal, d: Signal, low: Signal, high: Signal) -> Signal:
    """Return the gate behind its backlash, of the demand c."""
    gate = clip(s.GATE, low, high)
    g, d.PLAY = backlash(gate, s.PLAY, p.BLG)
    velocity, d.VALVE = limited_lag(c - g, s.VALVE, p.Kg, p.Tp, p.VELCLOSE, p.VELOPEN)
    d.GATE = limited(velocity, s.GATE, low, high)
    return g


def column(opening: Signal, s: Signal, p: Signal, d: Signal, H0: Signal) -> Signal:
    """Return the power of the flow through an opening, whose head is H0 at rest."""
    h = s.Q / larger(opening, SHUT)
    h = h * h
    d.Q = (H0 - h) / p.Tw
    return p.At * h * (s.Q - p.qNL)


def hygovr(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """HYGOVR: hydro turbine governor with four lead-lags (PSS/E HYGOVR1).

    dw ─►[   1   ]─►[1 + sT1]─►[1 + sT3]─►[1 + sT5]─►[1 + sT7]─┐
         [1 + sTd]  [1 + sT2]  [1 + sT4]  [1 + sT6]  [1 + sT8] ▼-
    pref ─────────────────────────────────────────────────────►(+)─►[Kp]─► c
                                                               ▲-   [s ]
    p ─►[   R   ]──────────────────────────────────────────────┘
        [1 + sTt]

               VELOPEN    PMAX
    c ─►(+)─►[   Kg  ]─►[ 1 ]─► gate ─►[backlash]─┬─► g
        -▲   [1 + sTp]  [ s ]                     │
         │   VELCLOSE   PMIN                      │
         └────────────────────────────────────────┘

    g ─►[h = (q/g)²]─►[1 - h]─►[  1  ]─► q ─►[At h (q - qNL)]─►(+)─► Pm
                               [ sTw ]                         -▲
    dw ─►[Dturb g]──────────────────────────────────────────────┘

    The limits of velocity and gate are non-windup; BLG is the play of the gate to
    each side. pref is R times the electrical power at rest. A record has its dead
    band DB1 in Hz, with a hysteresis ERR, and its backlash DB2 in MW. Not modelled:
    the hysteresis. Typical data are those of IEC 61970-302 (GovHydroR).
    """
    low, high = in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX)
    v, d.SPEED = lag(outside_band(u.dw, p), s.SPEED, 1.0, p.Td)
    v, d.LL1 = lead_lag(v, s.LL1, p.T1, p.T2)
    v, d.LL3 = lead_lag(v, s.LL3, p.T3, p.T4)
    v, d.LL5 = lead_lag(v, s.LL5, p.T5, p.T6)
    v, d.LL7 = lead_lag(v, s.LL7, p.T7, p.T8)
    drooped, d.PE = lag(u.p, s.PE, p.R, p.Tt)
    d.C = p.Kp * (u.pref - v - drooped)
    g = gate_servo(s.C, s, p, d, low, high)
    return column(g, s, p, d, 1.0) - p.Dturb * g * u.dw


def hygovr_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.SPEED = x.LL1 = x.LL3 = x.LL5 = x.LL7 = x.VALVE = 0.0
    x.PE = p.R * u.p
    x.C = x.GATE = x.PLAY = x.Q = pm / p.At + p.qNL
    x.PMAX0, x.PMIN0 = larger(p.PMAX, x.GATE), smaller(p.PMIN, x.GATE)
    return x.PE


HYGOVR = governor(
    hygovr,
    hygovr_rest,
    sheet(
        ("Td", 0.05, *TIME, "speed lag"),
        ("T1", 1.5, *TIME, "first lead"),
        ("T2", 0.1, *TIME, "first lag"),
        ("T3", 1.5, *TIME, "second lead"),
        ("T4", 0.1, *TIME, "second lag"),
        ("T5", 0.0, *TIME, "third lead"),
        ("T6", 0.05, *TIME, "third lag"),
        ("T7", 0.0, *TIME, "fourth lead"),
        ("T8", 0.05, *TIME, "fourth lag"),
        ("Kp", 0.5, "1/s", (0.0, 1000.0), "integral gain of the governor"),
        ("R", 0.05, *UP_TO_10, "permanent droop"),
        ("Tt", 0.0, *TIME, "power transducer lag"),
        *SERVO,
        *COLUMN,
        *BAND,
    ),
    "SPEED LL1 LL3 LL5 LL7 PE C VALVE GATE PLAY Q",
    aliases="HYGOVR1",
    records=record(
        "HYGOVR1",
        "DB1 ERR Td T1 T2 T3 T4 T5 T6 T7 T8 Kp R Tt Kg Tp VELOPEN VELCLOSE PMAX PMIN DB2 Tw At "
        "Dturb qNL Trate",
        absent=dict.fromkeys(("DB1", "ERR", "DB2"), 0.0),
        ignored="Trate",
        held=HELD,
        doubt=IN_HERTZ,
    ),
    pslf_records=record(  # GMAX and GMIN limit c
        "hygovr",
        "PMAX PMIN R Td T1 T2 T3 T4 T5 T6 T7 T8 Tp VELOPEN VELCLOSE Kp Kg GMAX GMIN Tt DB1 EPS "
        f"DB2 Tw At Dturb qNL H0 {CURVE_POINTS}",
        absent={
            **{"GMAX": 99.0, "GMIN": -99.0, "H0": 1.0},
            **dict.fromkeys(f"DB1 EPS DB2 {CURVE_POINTS}".split(), 0.0),
        },
        held=HELD,
        spelled={**VELOCITIES, "Kp": "ki"},
    ),
    setpoints="PMAX0 PMIN0",
)


def gate_curve() -> Sheet:
    """Return the rows of six points of the opening over the gate."""
    rows: list[tuple[str, float, str, tuple[float, float], str]] = []
    for k, value in zip(PAIRS, (0.1, 0.25, 0.5, 0.7, 0.85, 1.0), strict=True):
        rows.append((f"GV{k}", value, *WITHIN_10, f"gate of point {k}"))
        rows.append((f"PGV{k}", value, *WITHIN_10, f"opening of point {k}"))
    return sheet(*rows)


def gates_and_openings(p: Signal) -> tuple[list[Signal], list[Signal]]:
    """Return the points (8,) of the opening over the gate, from (0, 0) to (1, 1)."""
    gates, openings = ([getattr(p, f"{name}{k}") for k in PAIRS] for name in ("GV", "PGV"))
    return [0.0, *gates, 1.0], [0.0, *openings, 1.0]


def hyg3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """HYG3: hydro turbine governor, PID or double derivative (WECC).

    Cflag = 1:                                          PMAX
    pref ─►(+)─►[   1   ]─►[Ki/s + K2 + sK1/(1 + sTf)]─►[clip]─┬─► c
          -▲-▲  [1 + sTd]                               PMIN   │
    dw ────┘ └─(+)◄──────────────[ Rgate ]◄────────────────────┘
                ▲
                └──[  Relec  ]◄── p
                   [1 + sTt  ]

    Cflag = 0:                                       PMAX
    pref ───────────────────────────────────────►(+)─►[Ki]─┬─► c
                                                -▲-▲  [s ] │
    dw ─►[   1   ]─►[1 +   sK1    +   s²K2   ]───┘ │  PMIN │
         [1 + sTd]  [    1 + sTf  (1 + sTf)² ]     │       │
    p ─►[ Relec ]────────────────────────────────►(+)◄─[Rgate]
        [1 + sTt]

               VELOPEN    PMAX
    c ─►(+)─►[   Kg  ]─►[ 1 ]─► gate ─►[backlash]─┬─► g ─►[curve]─► pgv
        -▲   [1 + sTp]  [ s ]                     │
         │   VELCLOSE   PMIN                      │
         └────────────────────────────────────────┘

    pgv ─►[h = (q/pgv)²]─►[H0 - h]─►[ 1 ]─► q ─►[At h (q - qNL)]─►(+)─► Pm
                                    [sTw]                         -▲
    dw ─►[Dturb g]─────────────────────────────────────────────────┘

    The limits of velocity, gate and Ki/s are non-windup; BLG is the play of the
    gate to each side. The curve is on the lines through (0, 0), (GV1, PGV1), (GV2,
    PGV2), (GV3, PGV3), (GV4, PGV4), (GV5, PGV5), (GV6, PGV6) and (1, 1). pref is
    Rgate times c plus Relec times the power at rest. A record has its dead band
    DB1, DB1L in Hz, with a hysteresis, and its backlash DB2 in MW. Not modelled:
    the hysteresis; the curve that PSLF has where GV1 < 0. Typical data are those of
    IEC 61970-302 (GovHydro3), but for a straight curve, and the droop: of the gate,
    there of the power.
    """
    low, high = in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX)
    speed, is_pid = outside_band(u.dw, p), p.Cflag > 0.5
    power, d.PE = lag(u.p, s.PE, p.Relec, p.Tt)
    k1, d.K1 = washout(s.TD, s.K1, p.K1, p.Tf)
    first, d.K2A = washout(s.TD, s.K2A, 1.0, p.Tf)
    second, d.K2B = washout(first, s.K2B, p.K2, p.Tf)
    c = clip(s.INTEG + where(is_pid, p.K2 * s.TD + k1, 0.0), low, high)
    wanted = u.pref - power - p.Rgate * c
    _, d.TD = lag(where(is_pid, wanted - speed, speed), s.TD, 1.0, p.Td)
    error = where(is_pid, s.TD, wanted - s.TD - k1 - second)
    d.INTEG = limited(p.Ki * error, s.INTEG, low, high)
    g = gate_servo(c, s, p, d, low, high)
    opening = curve(g, *gates_and_openings(p))
    return column(opening, s, p, d, p.H0) - p.Dturb * g * u.dw


def hyg3_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    gates, openings = gates_and_openings(p)
    x.TD = x.K1 = x.K2A = x.K2B = x.VALVE = 0.0
    x.PE = p.Relec * u.p
    x.Q = pm / (p.At * p.H0) + p.qNL
    x.INTEG = x.GATE = x.PLAY = curve(x.Q / sqrt(p.H0), openings, gates)
    x.PMAX0, x.PMIN0 = larger(p.PMAX, x.GATE), smaller(p.PMIN, x.GATE)
    return p.Rgate * x.INTEG + x.PE


HYG3 = governor(
    hyg3,
    hyg3_rest,
    sheet(
        ("Cflag", 1.0, "1", (-1.0, 1.0), "controller: 1 PID, 0 (PSLF: -1) double derivative"),
        ("Rgate", 0.05, *UP_TO_10, "droop of the gate"),
        ("Relec", 0.0, *UP_TO_10, "droop of the electrical power"),
        ("Tt", 0.2, *TIME, "power transducer lag"),
        ("Td", 0.05, *DIVIDING_TIME, "controller input lag"),
        ("K2", 2.5, "1", (0.0, 1000.0), "proportional or double derivative gain"),
        ("Ki", 0.5, "1/s", (0.0, 1000.0), "integral gain"),
        ("K1", 0.01, "s", (0.0, 1000.0), "derivative gain"),
        ("Tf", 0.1, *DIVIDING_TIME, "derivative lag"),
        *SERVO,
        *gate_curve(),
        ("H0", 1.0, "pu", (0.01, 10.0), "head at rest"),
        *COLUMN,
        *BAND,
    ),
    "TD K1 K2A K2B PE INTEG VALVE GATE PLAY Q",
    records=record(
        "HYG3",
        "Rgate Relec Tt Td K2 Ki K1 Tf Kg Tp VELOPEN VELCLOSE PMAX PMIN DB2 "
        + CURVE_POINTS
        + " H0 qNL Tw At Dturb Trate DB1 EPS DB1L",
        icons={"Cflag": 1},
        absent=dict.fromkeys(("DB2", "DB1", "EPS", "DB1L"), 0.0),
        ignored="Trate",
        held=HELD,
        doubt=IN_HERTZ,
    ),
    pslf_records=record(
        "hyg3",
        "PMAX PMIN Cflag Rgate Relec Td Tf Tp VELOPEN VELCLOSE K1 K2 Ki Kg Tt DB1 EPS DB2 Tw At "
        f"Dturb qNL H0 {CURVE_POINTS}",
        icons={"Cflag": 1},
        absent=dict.fromkeys(("DB1", "EPS", "DB2"), 0.0),
        held=HELD,
        spelled=VELOCITIES,
    ),
    setpoints="PMAX0 PMIN0",
)
