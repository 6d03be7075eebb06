"""WESGOV: digital governor of a gas turbine, by Westinghouse (PSS/E).

                                         ALIM/DTC
pref ─►(+)─►[KP + 1/(sTI)]─►(+)─►[  2  ]─►[clip]─►[ 1 ]─┬─► command
     -▲ ▲-                    -▲ [ DTC ]          [ s ] │
dw ───┘ │                      └────────────────────────┘
        └─[DROOP]◄─[exp(-s(DTP-DTC)/2)]◄─[    1    ]◄── p
                                         [1 + sTPE ]
command ─►[   1   ]─►[   1   ]─► Pm
          [1 + sT1]  [1 + sT2]

pref is a speed, DROOP times the power at rest. The controls are sampled every
DTC seconds, the power every DTP; the command changes by at most ALIM from one
sample to the next. What is sampled and held is late by half a sample on
average: here the command follows with a lag of half its sample, at ALIM/DTC
at most, and the power is delayed to half of its own (Padé approximant of
order two, see DEGOV1). When the program samples, no record says: in
PowerWorld 24 both begin with the simulation, so that a DTP of several DTC is
late by half of it. Of a swing of Pm by 1e-3 pu there this model misses
1.1e-5. Typical data are those of OPAL-RT's library.
"""

from exfit.models.blocks import Signal, clip, integrator, lag, larger
from exfit.models.governor_parts import BAND, banded, delayed, governor, outside_band
from exfit.models.sheet import DIVIDING_TIME, SHORT_TIME, TIME, UP_TO_10, sheet


def wesgov(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    measured, d.PE = lag(u.p, s.PE, 1.0, p.TPE)
    sampled, d.LATE, d.DLATE = delayed(measured, s.LATE, s.DLATE, larger(p.DTP - p.DTC, 0.0) / 2.0)
    error = u.pref - outside_band(u.dw, p) - p.DROOP * sampled
    integral, d.INTEG = integrator(error, s.INTEG, p.TI)
    asked = p.KP * error + integral
    d.HELD = clip(2.0 * (asked - s.HELD), -p.ALIM, p.ALIM) / p.DTC
    valve, d.VALVE = lag(s.HELD, s.VALVE, 1.0, p.T1)
    power, d.PM = lag(valve, s.PM, 1.0, p.T2)
    return power


def wesgov_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.PE = x.LATE = u.p
    x.DLATE = 0.0
    x.INTEG = x.HELD = x.VALVE = x.PM = pm
    return p.DROOP * u.p


WESGOV = governor(
    wesgov,
    wesgov_rest,
    sheet(
        ("DTC", 0.1, *DIVIDING_TIME, "sample of the controls"),
        ("DTP", 0.1, *SHORT_TIME, "sample of the power"),
        ("DROOP", 0.05, *UP_TO_10, "permanent droop"),
        ("KP", 15.0, "1", (0.0, 1000.0), "proportional gain"),
        ("TI", 1.0, *DIVIDING_TIME, "integrator time constant"),
        ("T1", 0.1, *TIME, "first turbine lag"),
        ("T2", 0.25, *TIME, "second turbine lag"),
        ("ALIM", 0.2, "pu", (0.0001, 1000.0), "largest change of the command in a sample"),
        ("TPE", 0.1, *TIME, "power transducer lag"),
        *BAND,
    ),
    "PE LATE DLATE INTEG HELD VALVE PM",
    text=__doc__,
    aliases="WESGOVD",
    records=banded("WESGOV", "DTC DTP DROOP KP TI T1 T2 ALIM TPE"),
    doubt="sampling is taken as a delay of half a sample",
)
