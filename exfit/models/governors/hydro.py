"""Hydro governors with a linear water column: IEEEG2, IEEEG3, HYGOV2, PIDGOV and WPIDHY."""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    larger,
    lead_lag,
    limited,
    smaller,
    washout,
    where,
)
from exfit.models.governor_parts import (
    BAND,
    ON_RATING,
    banded,
    curve,
    governor,
    in_use,
    outside_band,
)
from exfit.models.sheet import (
    DIVIDING_TIME,
    LONG_TIME,
    TIME,
    UP_TO_10,
    UP_TO_100,
    WITHIN_10,
    Sheet,
    limits,
    record,
    sheet,
)

GAIN = ("1", (0.0, 1000.0))
GATE = limits("GMAX", 1.0, 0.0, "the gate", WITHIN_10)
VELOCITY = sheet(
    ("VELMAX", 0.2, "pu/s", (0.0001, 1000.0), "fastest opening of the gate"),
    ("VELMIN", -0.2, "pu/s", (-1000.0, -0.0001), "fastest closing of the gate"),
)


def points(G0: float, G1: float, P1: float, G2: float, P2: float, P3: float) -> Sheet:
    """Return the rows of a curve of the power over the gate, which ends at a gate of 1."""
    return sheet(
        ("G0", G0, *WITHIN_10, "gate at no load"),
        ("G1", G1, *WITHIN_10, "first gate of the curve of the power"),
        ("P1", P1, *WITHIN_10, "power at G1"),
        ("G2", G2, *WITHIN_10, "second gate of the curve of the power"),
        ("P2", P2, *WITHIN_10, "power at G2"),
        ("P3", P3, *WITHIN_10, "power at a gate of 1"),
    )


def gates_and_powers(p: Signal) -> tuple[list[Signal], list[Signal]]:
    """Return the points (4,) of the curve of the power over the gate."""
    return [p.G0, p.G1, p.G2, 1.0], [0.0, p.P1, p.P2, p.P3]


def ieeeg2(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEEG2: hydro turbine governor (IEEE 1973; PSS/E).

                                  PMAX
    pref ──────────────────►(+)─►[clip]─►[1 - sT4  ]─► Pm
                          -▲      PMIN   [1 + sT4/2]
    dw ─►[K (1 + sT2)   ]──┘
         [(1+sT1)(1+sT3)]

    pref is a power. PMAX and PMIN clip what goes into the turbine: no state stops
    there. T1 = 0 bypasses its lag with T2, T3 = 0 its lag. Typical data give the
    response of those of IEEEG3 off its limits: T2 = TR, T1 = TR (1 + Rtemp/Rperm),
    T3 = TG / (Rtemp + Rperm), T4 = TW.
    """
    v1, d.V1 = lead_lag(p.K * u.dw, s.V1, p.T2, p.T1)
    v3, d.V3 = lag(v1, s.V3, 1.0, p.T3)
    demand = clip(u.pref - v3, in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX))
    power, d.WATER = lead_lag(demand, s.WATER, -p.T4, 0.5 * p.T4)
    return power


def ieeeg2_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.V1, x.V3, x.WATER = 0.0, 0.0, pm
    x.PMAX0, x.PMIN0 = larger(p.PMAX, pm), smaller(p.PMIN, pm)
    return pm


IEEEG2 = governor(
    ieeeg2,
    ieeeg2_rest,
    sheet(
        ("K", 20.0, "pu", (0.01, 1000.0), "governor gain, 1 over the droop"),
        ("T1", 132.0, *LONG_TIME, "governor lag"),
        ("T2", 12.0, *TIME, "governor lead"),
        ("T3", 0.91, *TIME, "gate actuator lag"),
        *limits("PMAX", 1.0, 0.0, "the gate", WITHIN_10),
        ("T4", 2.0, *DIVIDING_TIME, "water starting time"),
    ),
    "V1 V3 WATER",
    records=record("IEEEG2", "K T1 T2 T3 PMAX PMIN T4", held=ON_RATING),
    setpoints="PMAX0 PMIN0",
    doubt="rests on two diagrams: no curve of a program is public",
)


def ieeeg3(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """IEEEG3: hydro turbine governor with a transient droop (IEEE 1973; PSS/E).

                                   UO      PMAX
    pref ─►(+)─►(+)─►[    1     ]─►[clip]─►[ 1 ]─┬─► gate
          -▲    -▲   [TG (1+sTP)]   UC     [ s ] │
    dw ────┘     │                         PMIN  │
                 └──(+)◄──[ Rperm ]◄─────────────┤
                     ▲                           │
                     └────[Rtemp sTR/(1+sTR)]◄───┘

    gate ─►[A23 (1 + (A11 - A13 A21/A23) sTW)]─► Pm
           [          1 + A11 sTW            ]

    UC is negative, the rate of closing. The limits of the gate are non-windup. pref
    is a speed, Rperm times the gate at rest. Typical data are those of IEC
    61970-302 (GovHydroIEEE2), with A11, A13, A21 and A23 of an ideal turbine.
    """
    low, high = in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX)
    gate = clip(s.GATE, low, high)
    transient, d.DROOP = washout(gate, s.DROOP, p.Rtemp * p.TR, p.TR)
    error = u.pref - outside_band(u.dw, p) - p.Rperm * gate - transient
    servo, d.SERVO = lag(error / p.TG, s.SERVO, 1.0, p.TP)
    d.GATE = limited(clip(servo, p.UC, p.UO), s.GATE, low, high)
    lead = (p.A11 - p.A13 * p.A21 / p.A23) * p.TW
    power, d.WATER = lead_lag(gate, s.WATER, lead, p.A11 * p.TW)
    return p.A23 * power


def ieeeg3_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.SERVO = 0.0
    x.GATE = x.DROOP = x.WATER = pm / p.A23
    x.PMAX0, x.PMIN0 = larger(p.PMAX, x.GATE), smaller(p.PMIN, x.GATE)
    return p.Rperm * x.GATE


IEEEG3 = governor(
    ieeeg3,
    ieeeg3_rest,
    sheet(
        ("TG", 0.5, *DIVIDING_TIME, "gate servomotor time constant"),
        ("TP", 0.03, *TIME, "pilot valve lag"),
        ("UO", 0.1, "pu/s", (0.0001, 1000.0), "fastest opening of the gate"),
        ("UC", -0.1, "pu/s", (-1000.0, -0.0001), "fastest closing of the gate"),
        *limits("PMAX", 1.0, 0.0, "the gate", WITHIN_10),
        ("Rperm", 0.05, *UP_TO_10, "permanent droop"),
        ("Rtemp", 0.5, *UP_TO_10, "transient droop"),
        ("TR", 12.0, *DIVIDING_TIME, "transient droop time constant"),
        ("TW", 2.0, *DIVIDING_TIME, "water starting time"),
        ("A11", 0.5, "1", (0.01, 10.0), "turbine: flow over head"),
        ("A13", 1.0, "1", (0.0, 10.0), "turbine: flow over gate"),
        ("A21", 1.5, "1", (0.0, 10.0), "turbine: power over head"),
        ("A23", 1.0, "1", (0.01, 10.0), "turbine: power over gate"),
        *BAND,
    ),
    "SERVO GATE DROOP WATER",
    aliases="IEEEG3D",
    records=banded("IEEEG3", "TG TP UO UC PMAX PMIN Rperm Rtemp TR TW A11 A13 A21 A23"),
    setpoints="PMAX0 PMIN0",
)


def hygov2(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """HYGOV2: hydro turbine governor with a linear turbine (PSS/E).

                                                   VGMAX  GMAX
    pref ─►(+)─►(+)─►[KA(1+sT1)]─►[1 + sT2]─►[clip]─►[ 1 ]─┬─► gate
          -▲    -▲   [   sT3   ]  [1 + sT4] -VGMAX   [ s ] │
           │     │                                   GMIN  │
    dw ─►[KP+KI] └──(+)◄──────[ R ]◄───────────────────────┤
         [   s ]     ▲                                     │
                     └───[Rtemp sTR/(1+sTR)]◄──────────────┘

    gate ─►[PMAX (1 - sT5)]─► Pm
           [    1 + sT6   ]

    The limits of the gate are non-windup, as in PSS/E; PowerWorld has them wind up.
    pref is a speed, R times the gate at rest. The data are those that PowerWorld
    ran for InterPSS, not a sample.
    """
    low, high = in_use(s.GMIN0, p.GMIN), in_use(s.GMAX0, p.GMAX)
    speed, gate = outside_band(u.dw, p), clip(s.GATE, low, high)
    d.PI = p.KI * speed
    transient, d.DROOP = washout(gate, s.DROOP, p.Rtemp * p.TR, p.TR)
    error = u.pref - p.KP * speed - s.PI - p.R * gate - transient
    d.GOV = p.KA * error / p.T3
    velocity, d.SERVO = lead_lag(s.GOV + p.T1 * d.GOV, s.SERVO, p.T2, p.T4)
    d.GATE = limited(clip(velocity, -p.VGMAX, p.VGMAX), s.GATE, low, high)
    power, d.WATER = lead_lag(gate, s.WATER, -p.T5, p.T6)
    return p.PMAX * power


def hygov2_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.PI = x.GOV = x.SERVO = 0.0
    x.GATE = x.DROOP = x.WATER = pm / p.PMAX
    x.GMAX0, x.GMIN0 = larger(p.GMAX, x.GATE), smaller(p.GMIN, x.GATE)
    return p.R * x.GATE


HYGOV2 = governor(
    hygov2,
    hygov2_rest,
    sheet(
        ("KP", 0.0, *GAIN, "proportional gain of the speed"),
        ("KI", 1.0, "1/s", (0.0, 1000.0), "integral gain of the speed"),
        ("KA", 1.0, *GAIN, "governor gain"),
        ("T1", 0.1, *TIME, "governor lead"),
        ("T2", 0.2, *TIME, "servo lead"),
        ("T3", 0.3, *DIVIDING_TIME, "governor integral time"),
        ("T4", 0.4, *DIVIDING_TIME, "servo lag"),
        ("T5", 0.5, *TIME, "lead of the water column"),
        ("T6", 0.6, *DIVIDING_TIME, "lag of the water column"),
        ("TR", 1.0, *DIVIDING_TIME, "temporary droop time constant"),
        ("Rtemp", 0.2, *UP_TO_10, "temporary droop"),
        ("R", 0.05, *UP_TO_10, "permanent droop"),
        ("VGMAX", 0.1, "pu/s", (0.0001, 1000.0), "fastest motion of the gate"),
        *GATE,
        ("PMAX", 1.2, "pu", (0.01, 10.0), "power over gate"),
        *BAND,
    ),
    "PI GOV SERVO GATE DROOP WATER",
    aliases="HYGOV2D",
    records=banded("HYGOV2", "KP KI KA T1 T2 T3 T4 T5 T6 TR Rtemp R VGMAX GMAX GMIN PMAX"),
    setpoints="GMAX0 GMIN0",
)


def pidgov(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """PIDGOV: hydro turbine governor with a PID and a straight penstock (PSS/E).

    pref ─►(+)─►[  Rperm  ]─►(+)─┬─►[Kp + Ki/s]─►[  1  ]─►(+)─►[  1  ]─► c
          -▲    [1 + sTreg] -▲   │               [1+sTa]  ▲    [1+sTa]
    gate or p                │   └─►[    sKd    ]─────────┘
    dw ──────────────────────┘      [1 + sTa    ]

              VELMAX  GMAX
    c ─►(+)─►[1/Tb]─►[ 1 ]─┬─► gate ─►[G0 to P3]─►[1 - sAtw Tw  ]─►(+)─► Pm
        -▲   VELMIN  [ s ] │                      [1 + sAtw Tw/2] -▲
         │           GMIN  │                               dw ─►[Dturb]
         └─────────────────┘

    Feedback = 1 feeds the gate back, 0 the electrical power; pref is that at rest.
    The power over the gate is on the lines through (G0, 0), (G1, P1), (G2, P2) and
    (1, P3). The limits of the gate are non-windup. The data are those that
    PowerWorld ran for InterPSS, not a sample.
    """
    low, high = in_use(s.GMIN0, p.GMIN), in_use(s.GMAX0, p.GMAX)
    gate = clip(s.GATE, low, high)
    back = where(p.Feedback > 0.5, gate, u.p)
    drooped, d.DROOP = lag(u.pref - back, s.DROOP, p.Rperm, p.Treg)
    error = drooped - outside_band(u.dw, p)
    d.INTEG = p.Ki * error
    first, d.REG1 = lag(p.Kp * error + s.INTEG, s.REG1, 1.0, p.Ta)
    steep, d.DERIV = washout(error, s.DERIV, p.Kd, p.Ta)
    second, d.REG2 = lag(first + steep, s.REG2, 1.0, p.Ta)
    velocity = clip((second - gate) / p.Tb, p.VELMIN, p.VELMAX)
    d.GATE = limited(velocity, s.GATE, low, high)
    flow, reach = curve(gate, *gates_and_powers(p)), p.Atw * p.Tw
    power, d.WATER = lead_lag(flow, s.WATER, -reach, 0.5 * reach)
    return power - p.Dturb * u.dw


def pidgov_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    gates, powers = gates_and_powers(p)
    x.DROOP, x.DERIV, x.WATER = 0.0, 0.0, pm
    x.GATE = x.INTEG = x.REG1 = x.REG2 = curve(pm, powers, gates)
    x.GMAX0, x.GMIN0 = larger(p.GMAX, x.GATE), smaller(p.GMIN, x.GATE)
    return where(p.Feedback > 0.5, x.GATE, u.p)


PIDGOV = governor(
    pidgov,
    pidgov_rest,
    sheet(
        ("Feedback", 1.0, "1", (0.0, 1.0), "signal of the droop: 1 gate, 0 electrical power"),
        ("Rperm", 0.04, *UP_TO_10, "permanent droop"),
        ("Treg", 0.1, *TIME, "droop lag"),
        ("Kp", 1.5, *GAIN, "proportional gain"),
        ("Ki", 0.5, "1/s", (0.0, 1000.0), "integral gain"),
        ("Kd", 0.2, "s", (0.0, 1000.0), "derivative gain"),
        ("Ta", 0.02, *DIVIDING_TIME, "controller lag"),
        ("Tb", 0.1, *DIVIDING_TIME, "gate servo time constant"),
        ("Dturb", 0.1, *UP_TO_100, "turbine damping"),
        *points(0.0, 0.3, 0.2, 0.6, 0.8, 1.0),
        *GATE,
        ("Atw", 1.0, "1", (0.0, 10.0), "factor of the water starting time"),
        ("Tw", 0.5, *TIME, "water starting time"),
        *VELOCITY,
        *BAND,
    ),
    "DROOP INTEG REG1 DERIV REG2 GATE WATER",
    aliases="PIDGOVD",
    records=banded(
        "PIDGOV",
        "Rperm Treg Kp Ki Kd Ta Tb Dturb G0 G1 P1 G2 P2 P3 GMAX GMIN Atw Tw VELMAX VELMIN",
        icons={"Feedback": 1},
    ),
    setpoints="GMAX0 GMIN0",
)


def wpidhy(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """WPIDHY: Woodward PID governor of a hydro turbine (PSS/E).

                                           VELMAX   GMAX
    p ─►(+)─►[   Reg   ]─►(+)─►[PID]─►[   s   ]─►[ 1 ]─► gate
        -▲   [1 + sTreg] -▲           [1 + sTb]  [ s ]
    pref ┘           dw ──┘                VELMIN   GMIN

    PID = (Kp + Ki/s + sKd) / (1 + sTa)²               PMAX
    gate ─►[curve G0 to P3]─►[1 - sTw  ]──────────────►[clip]─►(+)─► Pm
                             [1 + sTw/2]               PMIN    -▲
    dw ─►[D]────────────────────────────────────────────────────┘

    Reg is negative, minus the droop. pref is the electrical power at rest. The
    power over the gate is on the lines through (G0, 0), (G1, P1), (G2, P2) and (1,
    P3). The limits of the gate are non-windup. InterPSS has no s in the numerator
    of the servo, with which PowerWorld's curve is met. The data are those of that
    curve, not a sample.
    """
    low, high = in_use(s.GMIN0, p.GMIN), in_use(s.GMAX0, p.GMAX)
    gate, speed = clip(s.GATE, low, high), outside_band(u.dw, p)
    drooped, d.DROOP = lag(u.p - u.pref, s.DROOP, p.Reg, p.Treg)
    error = drooped - speed
    # s PID: of the error behind one lag, PID1, and behind two, PID2
    steep, d.PID1 = washout(error, s.PID1, 1.0, p.Ta)
    slope, d.PID2 = washout(s.PID1, s.PID2, 1.0, p.Ta)
    asked = p.Ki * s.PID2 + p.Kp * slope + p.Kd * (steep - slope) / p.Ta
    servo, d.SERVO = lag(asked, s.SERVO, 1.0, p.Tb)
    d.GATE = limited(clip(servo, p.VELMIN, p.VELMAX), s.GATE, low, high)
    flow = curve(gate, *gates_and_powers(p))
    power, d.WATER = lead_lag(flow, s.WATER, -p.Tw, 0.5 * p.Tw)
    held = clip(power, in_use(s.PMIN0, p.PMIN), in_use(s.PMAX0, p.PMAX))
    return held - p.D * u.dw


def wpidhy_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    gates, powers = gates_and_powers(p)
    x.DROOP = x.PID1 = x.PID2 = x.SERVO = 0.0
    x.GATE, x.WATER = curve(pm, powers, gates), pm
    x.GMAX0, x.GMIN0 = larger(p.GMAX, x.GATE), smaller(p.GMIN, x.GATE)
    x.PMAX0, x.PMIN0 = larger(p.PMAX, pm), smaller(p.PMIN, pm)
    return u.p


WPIDHY = governor(
    wpidhy,
    wpidhy_rest,
    sheet(
        ("Treg", 0.2, *TIME, "droop lag"),
        ("Reg", -0.05, *WITHIN_10, "minus the permanent droop"),
        ("Kp", 2.0, *GAIN, "proportional gain"),
        ("Ki", 1.0, "1/s", (0.0, 1000.0), "integral gain"),
        ("Kd", 0.1, "s", (0.0, 1000.0), "derivative gain"),
        ("Ta", 0.2, *DIVIDING_TIME, "controller lag"),
        ("Tb", 0.3, *TIME, "gate servo lag"),
        *VELOCITY,
        *GATE,
        ("Tw", 0.6, *TIME, "water starting time"),
        *limits("PMAX", 1.2, 0.0, "the power", WITHIN_10),
        ("D", 0.1, *UP_TO_100, "turbine damping"),
        *points(0.1, 0.4, 0.3, 0.7, 0.7, 1.1),
        *BAND,
    ),
    "DROOP PID1 PID2 SERVO GATE WATER",
    aliases="WPIDHYD",
    records=banded(
        "WPIDHY",
        "Treg Reg Kp Ki Kd Ta Tb VELMAX VELMIN GMAX GMIN Tw PMAX PMIN D G0 G1 P1 G2 P2 P3",
    ),
    setpoints="GMAX0 GMIN0 PMAX0 PMIN0",
)
