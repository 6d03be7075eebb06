"""How sections write numbers, and what they say where the result holds nothing."""

from math import isfinite

from exfit.features.report.sections.other_program import NO_TWIN, has_no_equations
from exfit.results.model import FitResult
from exfit.results.validation_result import Reported

DASH = "–"


def number(value: float | None, digits: int = 5) -> str:
    """Write a number in a few digits, a dash where there is none."""
    return DASH if value is None or not isfinite(value) else f"{value:.{digits}g}"


def values_of(result: Reported) -> str:
    """Name the values that are shown: those that were fitted, or given."""
    return "the fitted values" if isinstance(result, FitResult) else "the values compared"


def no_behaviour(result: Reported) -> str:
    """Explain why nothing shows how the model behaves."""
    if has_no_equations(result):
        return f"{NO_TWIN}.".capitalize()
    return "The result does not hold this: the fit was interrupted."
