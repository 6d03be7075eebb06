"""Why a fit is not as good as its records allow: each cause has a small function that sees it.

A recogniser gets the `Evidence` of a fit and yields a `Cause` for each thing that it sees there:
what it is, with its place and its figures, and what to do about it.
"""

from exfit.analysis.causes.evidence import Evidence, FittedRecord, Recogniser
from exfit.analysis.causes.match import other_way, unexplained_error, worse_than_constant
from exfit.analysis.causes.rest import (
    unsteady_record,
    wrong_levels,
    wrong_start,
    wrong_voltage,
)
from exfit.analysis.causes.typical import typical_values
from exfit.results.verdict import Cause

__all__ = ["Evidence", "FittedRecord", "Recogniser", "causes_of"]

RECOGNISERS: tuple[Recogniser, ...] = (
    other_way,
    wrong_voltage,
    wrong_start,
    wrong_levels,
    worse_than_constant,
    unsteady_record,
    unexplained_error,
    typical_values,
)  # the likeliest first


def causes_of(evidence: Evidence) -> tuple[Cause, ...]:
    """Return what may be wrong with a fit, its test or its record, the likeliest first."""
    causes = (cause for recognise in RECOGNISERS for cause in recognise(evidence))
    return tuple(dict.fromkeys(causes))
