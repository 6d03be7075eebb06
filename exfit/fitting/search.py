"""The search for the parameters of a case."""

from collections.abc import Callable, Iterable

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import ExperimentSetup, build_experiments, residuals_of
from exfit.fitting.compression import compressed
from exfit.fitting.residuals import JACOBIANS, Residuals

UNIT = 0.5  # of a scaled parameter, a reasonable step: a factor of 1.6, or half of the interval


def fitted(case: Case) -> tuple[tuple[ExperimentSetup, ...], Residuals]:
    """Return the tests of a case with the records that it is fitted to, and what is made small.

    Raises ExfitError where there is none, or one that cannot be fitted.
    """
    given = case.values()
    trials = tuple(trial.with_enough_substeps(given) for trial in build_experiments(case))
    residuals = residuals_of(case, trials)
    refuse_unfit(case, residuals)
    return trials, residuals


def names_of_records(trials: Iterable[ExperimentSetup]) -> tuple[str, ...]:
    """Return the names of all that is found about the records themselves."""
    return tuple(one.name for trial in trials for one in trial.free)


def search(
    case: Case,
    residuals: Residuals,
    method: estimate.Method,
    announce: Callable[[estimate.SolverIteration], None],
    progress: Callable[[estimate.Progress], None],
) -> tuple[estimate.Result, estimate.MultistartResult | None]:
    """Return the best point found from the start of a case, or from all its starts."""
    asked = case.estimate
    fewer = compressed(residuals)
    known = len(fewer.priors)
    share = (fewer.samples + known) / (fewer.count + known)
    good_enough = asked.good_enough.rmse * np.sqrt(share)
    jacobian = JACOBIANS[asked.jacobian](fewer)
    if asked.starts == 1:
        found = estimate.least_squares(
            fewer,
            fewer.start,
            jac=jacobian,
            bounds=fewer.bounds,
            method=method,
            max_iterations=asked.iterations,
            gtol=asked.tolerance.gradient,
            xtol=asked.tolerance.step,
            x_scale=UNIT,
            good_enough=good_enough,
            callback=announce,
        )
        return found, None
    minima = estimate.multistart(
        fewer,
        jacobian,
        fewer.bounds,
        asked.starts,
        x0=fewer.start,
        screen=fewer.costs,
        refine=asked.refine,
        watch=progress,
        method=method,
        max_iterations=asked.iterations,
        gtol=asked.tolerance.gradient,
        xtol=asked.tolerance.step,
        x_scale=UNIT,
        good_enough=good_enough,
    )
    if not minima.minima:
        raise KeyboardInterrupt
    best = minima.minima[0].result
    for line in best.history:
        announce(line)
    return best, minima


def refuse_unfit(case: Case, residuals: Residuals) -> None:
    """Raise ExfitError where a record cannot be fitted: it is too short, flat, or out of scale."""
    samples, unknown = residuals.count, len(residuals.free)
    if samples < unknown:
        raise CaseError([f"{case.path}: record: {samples} samples for {unknown} free parameters"])
    for channel in residuals.channels:
        measured = channel.measured[channel.kept]
        if np.all(measured == measured[0]):
            level = f"{channel.signal} is {measured[0]:g} pu throughout"
            raise CaseError([f"{case.path}: record: {level}: it shows no test"])
    with np.errstate(over="ignore"):
        start = compressed(residuals)(residuals.start)
        square = float(start @ start)
    if not np.isfinite(square):
        largest = float(np.max(np.abs(start)))
        raise SimulationError(
            f"{case.path}: the residuals at the start values are too large to be squared: "
            f"up to {largest:.3g}; check scale, weight and start"
        )
