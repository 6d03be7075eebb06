"""H6E: hydro turbine governor whose blades follow the gate, for a Kaplan turbine (WECC)."""

from exfit.models.blocks import (
    SHORTEST,
    Signal,
    clip,
    closed,
    lag,
    larger,
    limited,
    limited_lag,
    rate,
    smaller,
    sqrt,
    washout,
    where,
)
from exfit.models.governor_parts import BAND, PLAIN, backlash, curve, governor, in_use, outside_band
from exfit.models.governors.hygov import SHUT
from exfit.models.sheet import (
    DIVIDING_TIME,
    TIME,
    UP_TO_10,
    UP_TO_100,
    WITHIN_10,
    limits,
    record,
    sheet,
)

POINTS = range(1, 11)
CURVES = {
    "GV": ("gate", (0.0, 0.11, 0.22, 0.33, 0.44, 0.56, 0.67, 0.78, 0.89, 1.0)),
    "PGV": ("power per unit of head", (0.0, 0.09, 0.19, 0.3, 0.42, 0.55, 0.68, 0.84, 0.92, 1.0)),
    "BGV": ("blade", (0.7, 0.73, 0.77, 0.81, 0.85, 0.89, 0.93, 0.96, 0.98, 1.0)),
}
CONS = (
    "Re Rg Tpe Tsp Kp Ki Kd Td Velm GMAX GMIN Buf Buv Kg Tg BLG DBBD Tbd BLB DBBS Tbs Bgvmin Blv "
    "Dturb Pgc Deff Hdam Tw"
)
LISTED = " ".join(f"{name}{k}" for name in CURVES for k in POINTS)
NOT_MODELLED = dict.fromkeys(("DBBD", "BLB", "DBBS", "Pgc", "Sprate"), 0.0)
FD = {"Fd": 1}
ORDER = "its order is as InterPSS reads it, not confirmed by a file"
LEAST = 1e-9  # of a divisor that no curve which rises comes near


def share(p: Signal, blade: Signal) -> Signal:
    """Return the flow's area over the gate at a position of the blades."""
    return p.Bgvmin + (1.0 - p.Bgvmin) * blade


def points_of(p: Signal) -> tuple[list[Signal], list[Signal], list[Signal], list[Signal]]:
    """Return gates, blades, flows at a head of 1, and powers of the points (10,)."""
    gates, powers, blades = ([getattr(p, f"{name}{k}") for k in POINTS] for name in CURVES)
    flows = [gate * share(p, blade) for gate, blade in zip(gates, blades, strict=True)]
    return gates, blades, flows, powers


def gate_of(area: Signal, p: Signal) -> Signal:
    """Return the gate at which the flow has an area, which between two points is quadratic in it.

    Points are left out as in ``curve``.
    """
    gates, blades, areas, _ = points_of(p)
    found, (g0, b0, a0) = gates[0], (gates[0], blades[0], areas[0])
    for k, (g1, b1, a1) in enumerate(zip(gates[1:], blades[1:], areas[1:], strict=True)):
        rises = g1 > g0
        steep = (b1 - b0) / where(rises, g1 - g0, 1.0)
        square, straight = (1.0 - p.Bgvmin) * steep, share(p, b0 - steep * g0)
        root = sqrt(larger(straight * straight + 4.0 * square * area, 0.0))
        within = 2.0 * area / larger(straight + root, LEAST)
        found = where(rises if k == 0 else rises & (area > a0), within, found)
        g0, b0, a0 = where(rises, g1, g0), where(rises, b1, b0), where(rises, a1, a0)
    return found


def h6e(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """H6E: hydro turbine governor of a Kaplan turbine (WECC; PSS/E H6EU1).

                                           GMAX
    pref ─────────►(+)─►[Kp + Ki/s]─►(+)─►[clip]─► c
                   -▲                -▲    GMIN
    dw ─►[   1    ]─┴───────────►[   sKd   ]
         [1 + sTsp]              [1 + sTd  ]

                Velm      GMAX
    c ─►(+)─►[   Kg  ]─►[  1  ]─┬─► gate ─►[backlash]─► g
        -▲   [1 + sTg]  [  s  ] │
         │                GMIN  │
         └──────────────────────┘
                                        Blv
    c ─►[BGV of GV]─►[   1    ]─►[   1    ]─► b
                     [1 + sTbd]  [1 + sTbs]

    a = g (Bgvmin + (1 - Bgvmin) b)
    h = (q/a)² ─►[Hdam - h]─►[ 1 ]─► q ─►[h (PGV of q)]─►(+)─► Pm
                             [sTw]                       -▲
    dw ─►[Dturb g]────────────────────────────────────────┘

    Re p / (1 + sTpe) is subtracted before Ki/s, with Fd = 0 Rg c before both gains.
    Velm and Blv limit the rates of gate and blades; below Buf the gate closes at
    Buv at most. The limits of velocity and gate are non-windup, the integral is
    frozen while it would push c further beyond a limit; BLG is the play of the gate
    to each side. The blade is on the lines through the points (GV1, BGV1), (GV2,
    BGV2), (GV3, BGV3), (GV4, BGV4), (GV5, BGV5), (GV6, BGV6), (GV7, BGV7), (GV8,
    BGV8), (GV9, BGV9) and (GV10, BGV10). At their flows under a head of 1 the power
    is PGV1, PGV2, PGV3, PGV4, PGV5, PGV6, PGV7, PGV8, PGV9 and PGV10. The ends of
    both go on. Blades that are off what is asked cost Deff times the square of it.
    pref is Re times the electrical power at rest, with Fd = 0 Rg times the gate. A
    record has its dead band DB1, EPS in Hz. Not modelled: the dead bands and the
    play of the blades, Pgc, by which the power falls before the first point, a rate
    Sprate of the reference, and Tsp below 0, the frequency of the bus. InterPSS has
    all of it, a public script for WECC's model its rest; PowerWorld's curve agrees.
    The data are near those of that curve, not a sample.
    """
    low, high = in_use(s.GMIN0, p.GMIN), in_use(s.GMAX0, p.GMAX)
    of_gate = p.Fd < 0.5
    speed, d.SPEED = lag(u.dw, s.SPEED, 1.0, p.Tsp)
    steep, d.DERIV = washout(speed, s.DERIV, p.Kd, p.Td)
    power, d.PE = lag(u.p, s.PE, p.Re, p.Tpe)
    error, droop = u.pref - outside_band(speed, p), where(of_gate, p.Rg, 0.0)
    held = s.INTEG - steep
    wanted = p.Kp * closed(error, p.Kp, held, droop) + held
    c = clip(wanted, low, high)
    left = error - where(of_gate, p.Rg * c, power)
    slope = p.Ki * left
    outward = ((wanted >= high) & (slope > 0.0)) | ((wanted <= low) & (slope < 0.0))
    d.INTEG = where(outward, 0.0, slope)
    gate = clip(s.GATE, low, high)
    moved, d.VALVE = limited_lag(c - gate, s.VALVE, p.Kg, p.Tg, -p.Velm, p.Velm)
    velocity = where(gate < p.Buf, larger(moved, -p.Buv), moved)
    d.GATE = limited(velocity, s.GATE, low, high)
    g, d.PLAY = backlash(gate, s.PLAY, p.BLG)
    gates, blades, flows, powers = points_of(p)
    asked, d.ASKED = lag(curve(c, gates, blades), s.ASKED, 1.0, p.Tbd)
    blade = where(p.Tbs < SHORTEST, asked, s.BLADE)
    d.BLADE = clip((asked - s.BLADE) * rate(p.Tbs), -p.Blv, p.Blv)
    h = s.Q / larger(share(p, blade) * g, SHUT)
    h = h * h
    d.Q = (p.Hdam - h) / p.Tw
    off = asked - blade
    return h * (curve(s.Q, flows, powers) - p.Deff * off * off) - p.Dturb * g * u.dw


def h6e_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    gates, blades, flows, powers = points_of(p)
    of_gate = p.Fd < 0.5
    x.SPEED = x.DERIV = x.VALVE = 0.0
    x.PE = p.Re * u.p
    x.Q = curve(pm / p.Hdam, powers, flows)
    x.GATE = x.PLAY = gate_of(x.Q / sqrt(p.Hdam), p)
    x.ASKED = x.BLADE = curve(x.GATE, gates, blades)
    x.INTEG = x.GATE - where(of_gate, 0.0, p.Kp * x.PE)
    x.GMAX0, x.GMIN0 = larger(p.GMAX, x.GATE), smaller(p.GMIN, x.GATE)
    return where(of_gate, p.Rg * x.GATE, x.PE)


H6E = governor(
    h6e,
    h6e_rest,
    sheet(
        ("Fd", 1.0, "1", (0.0, 1.0), "signal of the droop: 1 electrical power, 0 gate"),
        ("Re", 0.05, *UP_TO_10, "droop of the electrical power"),
        ("Rg", 0.05, *UP_TO_10, "droop of the gate"),
        ("Tpe", 0.1, *TIME, "power transducer lag"),
        ("Tsp", 0.02, *TIME, "speed transducer lag"),
        ("Kp", 2.0, "1", (0.0, 1000.0), "proportional gain"),
        ("Ki", 1.0, "1/s", (0.0, 1000.0), "integral gain"),
        ("Kd", 0.05, "s", (0.0, 1000.0), "derivative gain"),
        ("Td", 0.05, *DIVIDING_TIME, "derivative lag"),
        ("Velm", 0.2, "pu/s", (0.0001, 1000.0), "fastest motion of the gate"),
        *limits("GMAX", 1.0, 0.0, "the gate", WITHIN_10),
        ("Buf", 0.1, "pu", (0.0, 1.0), "gate below which it closes more slowly"),
        ("Buv", 0.05, "pu/s", (0.0001, 1000.0), "fastest closing there"),
        ("Kg", 5.0, "1/s", (0.001, 1000.0), "gate servo gain"),
        ("Tg", 0.05, *TIME, "pilot valve lag"),
        ("BLG", 0.0, "pu", (0.0, 1.0), "backlash of the gate"),
        ("Tbd", 0.0, *TIME, "lag of the blades' demand"),
        ("Tbs", 0.5, *TIME, "blade servo lag"),
        ("Bgvmin", 0.1, "pu", (0.0, 0.9999), "share of the flow with blades at 0"),
        ("Blv", 1.0, "pu/s", (0.0, 1000.0), "fastest motion of the blades"),
        ("Dturb", 0.0, *UP_TO_100, "turbine damping"),
        ("Deff", 0.0, *UP_TO_100, "loss of blades that are off"),
        ("Hdam", 1.0, "pu", (0.01, 10.0), "head at rest"),
        ("Tw", 0.5, *DIVIDING_TIME, "water starting time"),
        *(
            (f"{name}{k}", value, *WITHIN_10, f"{what} of point {k}")
            for name, (what, values) in CURVES.items()
            for k, value in zip(POINTS, values, strict=True)
        ),
        *BAND,
    ),
    "PE SPEED INTEG DERIV VALVE GATE PLAY ASKED BLADE Q",
    aliases="H6EU1",
    records=(
        *record(
            "H6E",
            f"Trate {CONS} Sprate {LISTED}",
            icons=FD,
            absent=NOT_MODELLED,
            ignored="Trate",
            held=PLAIN,
            doubt=ORDER,
        ),
        *record(
            "H6EU1",
            f"{CONS} {LISTED} Sprate DB1 EPS Trate",
            icons=FD,
            absent={**NOT_MODELLED, "DB1": 0.0, "EPS": 0.0},
            ignored="Trate",
            held=PLAIN,
            doubt=ORDER,
            user="5 0 1 62 9 24",
        ),
    ),
    setpoints="GMAX0 GMIN0",
)
