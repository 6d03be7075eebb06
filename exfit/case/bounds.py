"""How far a fit may move a parameter: between its bounds, or as far as its equations allow."""

from math import inf

from exfit.case.schema.values import FreeSection
from exfit.models.blocks import SHORTEST
from exfit.models.sheet import Limits, Parameter

UNBOUNDED = -inf, inf


def bounds_of(section: FreeSection, row: Parameter | None) -> Limits:
    """Return the bounds of a free parameter of a case."""
    if section.bounds == "none":
        return UNBOUNDED
    return search_bounds(section.min, section.max, row)


def search_bounds(low: float | None, high: float | None, row: Parameter | None) -> Limits:
    """Return the bounds of a free parameter, given those that the case has.

    A missing one is the limit of the equations, which may be infinite; a time constant stays where
    its block is not bypassed, also where its bound of 0 belongs to a start of 0 that another one
    has replaced. Without a data sheet there is no limit.
    """
    lowest, highest = UNBOUNDED if row is None else row.domain
    if row is not None and row.is_time:
        lowest = max(lowest, SHORTEST)
        low = None if low == 0.0 else low
    return lowest if low is None else low, highest if high is None else high


def is_held(start: float | None, row: Parameter | None) -> bool:
    """Tell if a free parameter is a time constant of 0, whose block is bypassed.

    The response does not depend on it there, so that no fit can leave that value.
    """
    return row is not None and row.is_time and row.low == 0.0 and start == 0.0
