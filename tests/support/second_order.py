"""SECOND_ORDER: w²/(s² + 2 z w s + w²), a response whose features have formulas.

vref ─►[w² / (s² + 2 z w s + w²)]─► vt
"""

from exfit.models.sheet import FREE, sheet

SHEET = sheet(
    ("w", 6.0, "rad/s", (0.01, 1000.0), "natural frequency", FREE),
    ("z", 0.5, "", (0.01, 10.0), "damping ratio", FREE),
)
STATES = "X V"


def equations(s, u, p, d):
    """Write the slopes of the states into d and return the output."""
    d.V = s.X
    d.X = p.w * (p.w * (u.vref + u.vs - s.V) - 2.0 * p.z * s.X)
    return s.V


def rest(v, u, p, x):
    """Write the states that hold v into x and return vref."""
    x.X, x.V = 0.0, v
    return v - u.vs
