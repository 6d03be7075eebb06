"""DEGOV1: governor of a diesel engine, by Woodward (PSS/E).

                                        TMAX
pref ─►(+)─►[     1 + sT3     ]─►[   K(1 + sT4)   ]─┬─►[exp(-sTD)]─►(x)─► Pm
     -▲   ▲-[1 + sT1 + s²T1T2 ]  [s(1+sT5)(1+sT6) ] │                ▲
dw ───┘   │                             TMIN        │       1 + dw ──┘
          └─[DROOP]◄─┬─ throttle (M = 0) ◄──────────┘
                     └─ pe (M = 1) ◄──[   1   ]◄── p
                                      [1 + sTE]

pref is a speed, DROOP times the throttle or the power at rest. The throttle
is clipped, and the integral stops at the same limits; in OPAL-RT's library
and InterPSS it waits while the throttle is beyond one. T1 = 0 bypasses the
control box with T3.

The delay of the engine is its Padé approximant of order two, as in OPAL-RT's
library: its phase errs by 0.07 degrees at 1/TD rad/s and 2.0 at 2/TD. Typical
data are those of a unit that PowerSimulationsDynamics.jl compares with PSS/E,
with limits of 1 and 0 and the delay of OPAL-RT's library.
"""

from exfit.models.blocks import (
    Signal,
    clip,
    lag,
    larger,
    lead_lag,
    limited,
    second_order_lead,
    smaller,
    where,
)
from exfit.models.governor_parts import BAND, banded, delayed, governor, in_use, outside_band
from exfit.models.sheet import SHORT_TIME, TIME, UP_TO_10, WITHIN_10, limits, sheet


def degov1(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return Pm."""
    low, high = in_use(s.TMIN0, p.TMIN), in_use(s.TMAX0, p.TMAX)
    integral = clip(s.INTEG, low, high)
    lead, d.LEAD = lead_lag(integral, s.LEAD, p.T4, p.T5)
    behind, d.ACT = lag(lead, s.ACT, 1.0, p.T6)
    throttle = clip(behind, low, high)
    pe, d.PE = lag(u.p, s.PE, 1.0, p.TE)
    droop = p.DROOP * where(p.M > 0.5, pe, throttle)
    error = u.pref - outside_band(u.dw, p) - droop
    box, d.BOX, d.DBOX = second_order_lead(error, s.BOX, s.DBOX, p.T3, 0.0, p.T1, p.T1 * p.T2)
    d.INTEG = limited(p.K * box, integral, low, high)
    torque, d.TORQUE, d.DTORQUE = delayed(throttle, s.TORQUE, s.DTORQUE, p.TD)
    return torque * (1.0 + u.dw)


def degov1_rest(pm: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states into x that hold Pm at rest and return pref."""
    x.BOX = x.DBOX = x.DTORQUE = 0.0
    x.INTEG = x.LEAD = x.ACT = x.TORQUE = pm
    x.PE = u.p
    x.TMAX0, x.TMIN0 = larger(p.TMAX, pm), smaller(p.TMIN, pm)
    return p.DROOP * where(p.M > 0.5, x.PE, pm)


DEGOV1 = governor(
    degov1,
    degov1_rest,
    sheet(
        ("M", 0.0, "1", (0.0, 1.0), "signal of the droop: 0 throttle, 1 power"),
        ("T1", 0.1905, *SHORT_TIME, "control box lag"),
        ("T2", 0.0476, *SHORT_TIME, "second time of the control box lag"),
        ("T3", 0.018, *SHORT_TIME, "control box lead"),
        ("K", 1.0, "1/s", (0.001, 1000.0), "actuator gain"),
        ("T4", 5.1, *TIME, "actuator lead"),
        ("T5", 0.322, *TIME, "actuator lag"),
        ("T6", 0.0, *TIME, "second actuator lag"),
        ("TD", 0.04, *SHORT_TIME, "engine delay"),
        *limits("TMAX", 1.0, 0.0, "the throttle", WITHIN_10),
        ("DROOP", 0.07, *UP_TO_10, "permanent droop"),
        ("TE", 0.05, *TIME, "power transducer lag"),
        *BAND,
    ),
    "BOX DBOX INTEG LEAD ACT PE TORQUE DTORQUE",
    text=__doc__,
    aliases="DEGOV1D",
    setpoints="TMAX0 TMIN0",
    records=banded("DEGOV1", "T1 T2 T3 K T4 T5 T6 TD TMAX TMIN DROOP TE", icons={"M": 0}),
    doubt="its delay is a Padé approximant of order two; what its limits stop",
)
