"""What static exciters share from IEEE Std 421.5-2016 on: supply and PID."""

from exfit.models.blocks import Signal, compound_source, rectifier, smaller, where
from exfit.models.sheet import shared

SUPPLY_SWITCH = shared(SW1=1.0)
# a source of the terminals' voltage alone, and a ceiling 1.5 times that
SUPPLY = (
    *SUPPLY_SWITCH,
    *shared(KP=1.0, KI=0.0, XL=0.0, THETAP=0.0, KC=0.05, VBMAX=1.5),
)
# a PI with a small derivative, in front of the gain of the edition of 2005, which then stays fixed
PID = shared(KPR=1.0, KIR=0.5, KDR=0.02, TDR=0.1, VPIDMAX=1.0, VPIDMIN=-1.0)


def supply(u: Signal, p: Signal) -> Signal:
    """Return VB, what the source of a static exciter gives behind its rectifier, at most VBMAX.

    It is fed from the terminals (SW1 = 1) or does not depend on them (SW1 = 2).
    """
    terminals = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    ve = where(p.SW1 < 1.5, terminals, p.KP)
    return smaller(rectifier(ve, p.KC * u.ifd), p.VBMAX)
