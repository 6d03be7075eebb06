"""What static exciters share from IEEE Std 421.5-2016 on: the supply of the rectifier."""

from exfit.engine.trace import Signal
from exfit.models.blocks import compound_source, rectifier, smaller, where
from exfit.models.sheet import sheet

SUPPLY_SWITCH = sheet(
    ("SW1", 1.0, "1", (1.0, 2.0), "supply of the rectifier: 1 terminals, 2 independent"),
)
# a source of the terminals' voltage alone, and a ceiling 1.5 times that
SUPPLY = (
    *SUPPLY_SWITCH,
    *sheet(
        ("KP", 1.0, "pu", (0.01, 100.0), "potential source gain"),
        ("KI", 0.0, "pu", (0.0, 100.0), "current source gain, on load"),
        ("XL", 0.0, "pu", (0.0, 10.0), "reactance of the potential source, on load"),
        ("THETAP", 0.0, "deg", (-360.0, 360.0), "angle of the potential source, on load"),
        ("KC", 0.05, "pu", (0.0, 100.0), "rectifier loading factor"),
        ("VBMAX", 1.5, "pu", (0.01, 9999.0), "ceiling of the source voltage"),
    ),
)


def supply(u: Signal, p: Signal) -> Signal:
    """Return VB, what the source of a static exciter gives behind its rectifier, at most VBMAX.

    It is fed from the terminals (SW1 = 1) or does not depend on them (SW1 = 2).
    """
    terminals = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    ve = where(p.SW1 < 1.5, terminals, p.KP)
    return smaller(rectifier(ve, p.KC * u.ifd), p.VBMAX)
