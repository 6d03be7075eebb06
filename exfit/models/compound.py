"""The supply of exciters that voltage and current of the terminals feed, or nothing does."""

from exfit.models.blocks import Signal, compound_source, rectifier, where


def supply(u: Signal, p: Signal) -> Signal:
    """Return VB, the voltage behind the rectifier of KP VT + j KI IT, and 1 where KP = KI = 0."""
    ve = compound_source(u.vt, u.p, u.q, p.KP, p.KI)
    return where((p.KP <= 0.0) & (p.KI <= 0.0), 1.0, rectifier(ve, p.KC * u.ifd))
