"""LCFB1: load controller of a turbine, with a bias of the frequency (WECC; PSS/E, PSLF).

                                           emax          Irmax
Pset ─────────────────►(+)─►[band db]─►[clip]─┬─►[Ki]─►(+)─►[clip]─► to pref
                       -▲              -emax  │  [s ]   ▲   -Irmax
p ─►[Pbf/(1 + sTpelec)]─┤                     └─►[Kp]───┘
                        │
dw ─►[Fbf Fb]───────────┘

Pset is the power at the start. What is added to the governor's reference is in
its unit: a speed or a power. The integral has Irmax as a non-windup limit, too. A
step of pref is of the governor's own reference, from which the controller brings
the power back. p is per unit of the machine's base. Fbf and Pbf switch the bias
and the power on. Typical data are the defaults of Engee's block, but for Tpelec,
of IEC 61970-302 (TurbLCFB1), and Irmax, of PowerWorld's curve.
"""

from types import SimpleNamespace

from exfit.models.blocks import Signal, clip, lag, limited
from exfit.models.governor_parts import outside_band
from exfit.models.sheet import TIME, UP_TO_10, UP_TO_1000, record, sheet

SHEET = sheet(
    ("Fbf", 0.0, "1", (0.0, 1.0), "bias of the frequency: 1 on, 0 off"),
    ("Pbf", 1.0, "1", (0.0, 1.0), "control of the power: 1 on, 0 off"),
    ("Fb", 0.0, *UP_TO_1000, "bias, power per speed"),
    ("Tpelec", 0.0, *TIME, "power transducer lag"),
    ("db", 0.0, *UP_TO_10, "dead band of the error, to each side"),
    ("emax", 0.1, *UP_TO_10, "limit of the error"),
    ("Kp", 0.0, *UP_TO_1000, "proportional gain"),
    ("Ki", 0.1, "1/s", (0.0, 1000.0), "integral gain"),
    ("Irmax", 0.05, *UP_TO_10, "limit of what is added to the reference"),
)
STATES = "PE INTEG"
SETPOINTS = "Pset"
INPUTS = "p speed"
SWITCHES = {"Fbf": 0, "Pbf": 1}
RECORDS = record("LCFB1", "Fb Tpelec db emax Kp Ki Irmax", icons=SWITCHES)
# type: the reference is a speed, 1, or a load, 0: here it is as the governor's model has it
PSLF_RECORDS = record(
    "lcfb1",
    "type db emax Fb Kp Ki Fbf Pbf Tpelec Irmax pmwset",
    icons={"type": 1, **SWITCHES},
    absent={"pmwset": 0.0},
    doubt="its order is that of IEC 61970-302's list of parameters, not confirmed by a file",
)


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slopes of the states into d and return what is added to the reference."""
    power, d.PE = lag(u.p, s.PE, 1.0, p.Tpelec)
    error = p.Pbf * (s.Pset - power) - p.Fbf * p.Fb * u.dw
    outside = outside_band(error, SimpleNamespace(DBL=-p.db, DBH=p.db))
    left = clip(outside, -p.emax, p.emax)
    d.INTEG = limited(p.Ki * left, s.INTEG, -p.Irmax, p.Irmax)
    return clip(p.Kp * left + clip(s.INTEG, -p.Irmax, p.Irmax), -p.Irmax, p.Irmax)


def rest(_: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the states of rest into x; nothing is added to the reference."""
    x.INTEG = 0.0
    x.Pset = x.PE = u.p
    return 0.0
