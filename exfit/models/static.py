"""What static exciters share from IEEE Std 421.5-2016 on: supply and PID."""

from exfit.engine.trace import Signal
from exfit.models.blocks import compound_source, rectifier, smaller, where
from exfit.models.rows import shared
from exfit.models.sheet import FREE, SearchRange, sheet

SUPPLY_SWITCH = sheet(
    ("SW1", 1.0, "1", (1.0, 2.0), "supply: 1 terminals, 2 independent"),
)
# a source of the terminals' voltage alone, and a ceiling 1.5 times that
SUPPLY = (
    *SUPPLY_SWITCH,
    *sheet(
        *shared(KP=1.0, KI=0.0, XL=0.0, THETAP=0.0, KC=0.05, VBMAX=1.5),
    ),
)
# a PI with a small derivative, in front of the gain of the edition of 2005, which then stays fixed
PID = sheet(
    ("KPR", 1.0, "pu", (0.0, 100000.0), "proportional gain", FREE),
    *shared(KIR=0.5),
    ("KDR", 0.02, "pu s", (0.0, 100000.0), "derivative gain", SearchRange(needs="TDR")),
    *shared(TDR=0.1),
    ("VPIDMAX", 1.0, "pu", (-9999.0, 9999.0), "ceiling of the PID"),
    ("VPIDMIN", -1.0, "pu", (-9999.0, 9999.0), "floor of the PID"),
)


def supply(u: Signal, p: Signal) -> Signal:
    """Return VB, what the source of a static exciter gives behind its rectifier, at most VBMAX.

    It is fed from the terminals (SW1 = 1) or does not depend on them (SW1 = 2).
    """
    terminals = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    ve = where(p.SW1 < 1.5, terminals, p.KP)
    return smaller(rectifier(ve, p.KC * u.ifd), p.VBMAX)
