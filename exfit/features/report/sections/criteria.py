"""Whether the responses match their records, by the limits of the case."""

from dataclasses import dataclass

from exfit.results.criteria import CriteriaVerdict, judged_by_criteria
from exfit.results.validation_result import Reported
from exfit.util.criteria import ORIGIN, Criteria


@dataclass(frozen=True)
class CriteriaView:
    """The criteria, each with its result, and where their limits are from."""

    judged: CriteriaVerdict
    origin: str


def criteria(result: Reported) -> CriteriaView:
    """Return the criteria of a fit with their results."""
    origin = ORIGIN
    if result.criteria != Criteria():
        origin = f"The case gives limits of its own. {ORIGIN}"
    return CriteriaView(judged_by_criteria(result), f"{origin}.")
