"""The problem of a fit: its residuals, as functions of all that is free."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.compression import compressed
from exfit.fitting.experiment import ExperimentSetup, Values
from exfit.fitting.parameters import FreeParameter, free_parameter
from exfit.fitting.residuals import Residuals, Robust


class FitProblem(NamedTuple):
    """Residuals of a fit, in two forms with the same cost and gradient at every point.

    ``residuals`` are those of all samples; ``compressed`` are fewer, or the same where nothing is
    gained.
    """

    residuals: Residuals
    compressed: Residuals


def problem_of(residuals: Residuals) -> FitProblem:
    """Return both forms of the residuals of all samples."""
    return FitProblem(residuals, compressed(residuals))


def with_setups(problem: FitProblem, setups: Sequence[ExperimentSetup]) -> FitProblem:
    """Make the problem of other tests, without another form."""
    experiments = [setup.experiment for setup in setups]
    residuals = replace(problem.residuals, experiments=experiments)
    return FitProblem(residuals, residuals)


def residuals_of(
    case: Case, setups: Sequence[ExperimentSetup], start: Values | None = None
) -> Residuals:
    """Return the residuals of a case as functions of its free parameters.

    ``start`` are the case's values, where they are at hand. Raises CaseError where nothing is free.
    """
    free = free_parameters(case, setups)
    if not free:
        raise CaseError(f"{case.path}: parameters.free: empty; a fit needs a free parameter")
    fixed = {**(case.values() if start is None else start)}
    for parameter in free:
        fixed.pop(parameter.name, None)
    limit = case.estimate.most_iterations
    return Residuals(
        [setup.experiment for setup in setups],
        free,
        fixed,
        case.ties,
        robust_of(case),
        case.estimate.difference_step,
        case.estimate.differences == "relative",
        iterations=limit if isinstance(limit, int) else max(limit.values(), default=0),
    )


def robust_of(case: Case) -> Robust | None:
    """Loss of a case in place of the squares."""
    estimate = case.estimate
    if estimate.loss == "least-squares":
        return None
    from exfit.dsp.robust_loss import LOSSES

    return Robust(LOSSES[estimate.loss], estimate.loss_scale)


def free_parameters(case: Case, setups: Sequence[ExperimentSetup] = ()) -> list[FreeParameter]:
    """Return the free parameters of a case, then what is found about its records.

    Raises CaseError for a start given beside the case that gives no size by which to search.
    """
    rows = case.rows()
    shared = [
        free_parameter(name, section, rows.get(name)) for name, section in case.free().items()
    ]
    sizeless = [each.name for each in shared if each.width == 0.0 or each.divisor == 0.0]
    if sizeless:
        raise CaseError(
            f"{case.path}: {name}: a start of 0 sets no scale for the search: give min and max"
            for name in sizeless
        )
    return [*shared, *(parameter for setup in setups for parameter in setup.free)]
