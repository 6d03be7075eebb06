"""Whether a run without a step stays where it starts."""

from exfit.results.description import FlatRun
from exfit.results.model import FitResult


def flat_runs(result: FitResult) -> tuple[FlatRun, ...] | None:
    """Return the flat runs of the tests; None where the result does not hold them."""
    return None if result.behaviour is None else result.behaviour.flat_runs
