"""How a report writes numbers, and what it says of the program that simulated."""

from math import isfinite

from exfit.results.model import FitResult
from exfit.results.validation_result import Reported

DASH = "–"
INTERRUPTED = "Not in the result: the fit was interrupted."
NO_TWIN = "not stated: it needs the equations of a twin, and the case has none"


def number(value: float | None, digits: int = 5) -> str:
    """Write a number in a few digits, a dash where there is none."""
    return DASH if value is None or not isfinite(value) else f"{value:.{digits}g}"


def values_of(result: Reported) -> str:
    """Name the values that are shown: those that were fitted, or given."""
    return "the fitted values" if isinstance(result, FitResult) else "the values compared"


def has_no_equations(result: Reported) -> bool:
    """Tell whether a program without a twin simulated the records."""
    return result.other_program is not None and result.other_program.twin is None


def no_behaviour(result: Reported) -> str:
    """Explain why nothing shows how the model behaves."""
    if has_no_equations(result):
        return f"{NO_TWIN}.".capitalize()
    return INTERRUPTED
