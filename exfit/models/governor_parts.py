"""What governors share: limits that a unit at full load starts on or slightly beyond."""

from exfit.models.blocks import Signal, where

# pu: a recorded power is known to about 1 % (transformers of class 0.5), a limit to two decimals
AT_LIMIT = 0.01


def in_use(start: Signal, limit: Signal) -> Signal:
    """Limit that acts: where a unit starts beyond it by at most AT_LIMIT, it is the start.

    ``start`` is what the limited value is at rest, or the limit where that is not beyond it. So
    does PowerWorld, however far beyond ("If Valve > Vmax, then Vmax = Valve", help on TGOV1).
    """
    near = (start - limit <= AT_LIMIT) & (limit - start <= AT_LIMIT)
    return where(near, start, limit)
