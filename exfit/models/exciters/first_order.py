"""FIRST_ORDER: k/(s + a), a check with a known response.

vref ─►[k]─►(+)─►[1/s]─┬─► vt
            -▲         │
             └──[a]◄───┘

After a unit step from rest, vt = k/a (1 - exp(-a t)).
"""

from exfit.engine.trace import Signal
from exfit.models.sheet import FREE, sheet

SHEET = sheet(
    ("k", 4.0, "1/s", (0.000001, 1000000.0), "gain", FREE),
    ("a", 2.0, "1/s", (0.000001, 1000000.0), "pole", FREE),
)

STATES = "V"


def equations(s: Signal, u: Signal, p: Signal, d: Signal) -> Signal:
    """Write the slope of the state into d and return it as the output."""
    d.V = p.k * (u.vref + u.vs) - p.a * s.V
    return s.V


def rest(v: Signal, u: Signal, p: Signal, x: Signal) -> Signal:
    """Write the state that holds v into x and return vref."""
    x.V = v
    return p.a * v / p.k - u.vs
