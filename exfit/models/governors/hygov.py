"""HYGOV: hydro turbine governor with a rigid penstock (PSS/E).

                                  VELM
pref ─►(+)─►[   1   ]─►[1 + sTr]─►[clip]─┬─► c ─►[   1   ]─► g
     -▲   ▲-[1 + sTf]  [ r sTr ]  -VELM  │       [1 + sTg]
dw ───┘   └──────────────[R]◄────────────┘

g ─►[h = (q/g)²]─►[1 - h]─►[  1  ]─► q ─►[At h (q - qNL)]─►(+)─► Pm
                           [ sTW ]                         -▲
dw ─►[Dturb g]──────────────────────────────────────────────┘

c is the desired gate: VELM limits its rate, GMAX and GMIN its position, both
non-windup. g is the gate, q the flow, h the head. pref is a speed, R times the
gate at rest. A gate below 0.01 has the head of one of 0.01, where the equation
of the flow ends. ANDES leaves the factor r Tr out of the integral of c, so it
agrees where r Tr = 1. Not modelled: the curve of gate and power of later
versions. Typical data are those of IEC 61970-302 (GovHydro1).
"""

from exfit.models.blocks import Signal, clip, lag, larger, limited, smaller
from exfit.models.governor_parts import BAND, PLAIN, banded, governor, in_use, outside_band
from exfit.models.sheet import (
    AS_IN_PSSE,
    DIVIDING_TIME,
    TIME,
    UP_TO_100,
    WITHIN_10,
    limits,
    record,
    sheet,
)

SHUT = 0.01  # pu of gate


def hygov(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    low, high = in_use(s.GMIN0, p.GMIN), in_use(s.GMAX0, p.GMAX)
    c = clip(s.C, low, high)
    _, d.E = lag(u.pref - outside_band(u.dw, p) - p.R * c, s.E, 1.0, p.Tf)
    velocity = clip((s.E / p.Tr + d.E) / p.r, -p.VELM, p.VELM)
    d.C = limited(velocity, s.C, low, high)
    g, d.G = lag(c, s.G, 1.0, p.Tg)
    h = s.Q / larger(g, SHUT)
    h = h * h
    d.Q = (1.0 - h) / p.TW
    return p.At * h * (s.Q - p.qNL) - p.Dturb * g * u.dw


def hygov_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.E = 0.0
    x.C = x.G = x.Q = pm / p.At + p.qNL
    x.GMAX0, x.GMIN0 = larger(p.GMAX, x.C), smaller(p.GMIN, x.C)
    return p.R * x.C


HYGOV = governor(
    hygov,
    hygov_rest,
    sheet(
        ("R", 0.04, "pu", (0.001, 10.0), "permanent droop"),
        ("r", 0.3, "pu", (0.001, 100.0), "temporary droop"),
        ("Tr", 5.0, "s", (0.001, 1000.0), "dashpot time constant"),
        ("Tf", 0.05, *DIVIDING_TIME, "filter lag"),
        ("Tg", 0.5, *TIME, "gate servo lag"),
        ("VELM", 0.2, "pu/s", (0.0001, 1000.0), "fastest motion of the gate"),
        *limits("GMAX", 1.0, 0.0, "the gate", WITHIN_10),
        ("TW", 1.0, *DIVIDING_TIME, "water starting time"),
        ("At", 1.2, "1", (0.001, 100.0), "turbine gain"),
        ("Dturb", 0.5, *UP_TO_100, "turbine damping"),
        ("qNL", 0.08, "pu", (0.0, 1.0), "flow at no load"),
        *BAND,
    ),
    "E C G Q",
    text=__doc__,
    setpoints="GMAX0 GMIN0",
    aliases="HYGOVD",
    records=banded("HYGOV", "R r Tr Tf Tg VELM GMAX GMIN TW At Dturb qNL"),
    pslf_records=record(
        "hygov",
        "R r Tr Tf Tg VELM GMAX GMIN TW At Dturb qNL",
        spelled={"R": "rperm", "r": "rtemp"},
        held=PLAIN,
        doubt=AS_IN_PSSE,
    ),
)
