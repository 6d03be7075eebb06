"""The limits that the responses were on."""

from exfit.results.description import HitLimits
from exfit.results.validation_result import Reported


def limits(result: Reported) -> tuple[HitLimits, ...] | None:
    """Return the limits that each test was on; None where the result does not hold them."""
    return None if result.behaviour is None else result.behaviour.limits
