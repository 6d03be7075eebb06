"""What alternator exciters share since IEEE Std 421.5-2016: the machine, the supply."""

from exfit.models.blocks import (
    Limited,
    Signal,
    compound_source,
    field_ceiling,
    limited_integrator,
    rectifier,
    smaller,
    where,
)
from exfit.models.sheet import UP_TO_100, shared, sheet

# the limits of the alternator that the edition of 2016 gave to all its types, out of reach
FLOOR = shared(VEMIN=0.0)
FIELD_LIMITS = (
    *shared(VFEMAX=99.0),
    *FLOOR,
)
# the source of the regulator's power stage: terminal voltage alone, and a ceiling 1.5 times that
SUPPLY = sheet(
    *shared(SW1=1.0, KP=1.0, KI=0.0, XL=0.0, THETAP=0.0),
    ("KC1", 0.05, *UP_TO_100, "loading factor of the supply's rectifier"),
    *shared(VBMAX=1.5),
)


def alternator(efe: Signal, vfe: Signal, s: Signal, u: Signal, p: Signal) -> tuple[Signal, Limited]:
    """Return efd and the slope of VE: 1 / sTE from VEMIN to where VFE = VFEMAX, and a rectifier."""
    vemax = field_ceiling(s.VE, vfe, p)
    ve, slope = limited_integrator(efe - vfe, s.VE, p.TE, p.VEMIN, vemax)
    return rectifier(ve, p.KC * u.ifd), slope


def supply(u: Signal, vfe: Signal, p: Signal) -> Signal:
    """Return VB, what the power stage of the regulator gets, at most VBMAX.

    A rectifier loaded with the exciter's field current, behind the terminals (SW1 = 1) or behind a
    source that does not depend on them (SW1 = 2).
    """
    terminals = compound_source(u.vt, u.p, u.q, p.KP, p.KI, p.XL, p.THETAP)
    source = where(p.SW1 < 1.5, terminals, p.KP)
    return smaller(rectifier(source, p.KC1 * vfe), p.VBMAX)
