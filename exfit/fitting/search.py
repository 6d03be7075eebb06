"""The search for the parameters of a case."""

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import Estimate
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import FitProblem, problem_of, residuals_of
from exfit.fitting.residuals import (
    JACOBIANS,
    Residuals,
    SimulationCounter,
    jacobian_error,
)
from exfit.fitting.setup import ExperimentSetup

CUTS = {"parabola": estimate.to_parabola, "half": estimate.to_half}
UNIT = 0.5  # of a scaled parameter, a reasonable step: a factor of 1.6, or half of the interval


def fitted(case: Case) -> tuple[tuple[ExperimentSetup, ...], FitProblem]:
    """Return the tests of a case with the records that it is fitted to, and what is made small.

    Raises ExfitError where there is none, or one that cannot be fitted.
    """
    start = case.values()
    setups = tuple(setup.with_enough_substeps(start) for setup in build_experiments(case, start))
    problem = problem_of(residuals_of(case, setups, start))
    refuse_unfit(case, problem)
    return setups, problem


def names_of_records(setups: Iterable[ExperimentSetup]) -> tuple[str, ...]:
    """Return the names of all that is found about the records themselves."""
    return tuple(parameter.name for setup in setups for parameter in setup.free)


def search(
    case: Case,
    problem: FitProblem,
    method: str,
    announce: Callable[[estimate.SolverIteration], None],
    progress: Callable[[estimate.Progress], None],
    counter: SimulationCounter | None = None,
    options: Estimate | None = None,
) -> tuple[estimate.Result, estimate.MultistartResult | None]:
    """Return the best point found from the start of a case, or from all its starts.

    ``counter`` counts the simulations of the search alone; ``options`` are by default the case's.
    """
    options = options or case.estimate
    residuals = problem.compressed.counted_by(counter)
    jacobian = JACOBIANS[options.jacobian](residuals)
    settings = _settings(options, residuals)
    if options.starts == 1:
        result = estimate.least_squares(
            residuals,
            residuals.start,
            jac=jacobian,
            bounds=residuals.bounds,
            method=method,
            callback=announce,
            **settings,
        )
        return result, None
    minima = estimate.multistart(
        residuals,
        jacobian,
        residuals.bounds,
        options.starts,
        x0=residuals.start,
        screen=residuals.costs,
        refine=options.refine,
        watch=progress,
        method=method,
        **settings,
    )
    best = minima.best
    if best is None:
        raise KeyboardInterrupt
    for line in best.history:
        announce(line)
    return best, minima


def _settings(options: Estimate, residuals: Residuals) -> dict[str, Any]:
    """Return the settings of a search, by the names that `exfit.estimate` has for them."""
    priors = len(residuals.priors)
    share = (residuals.samples + priors) / (residuals.count + priors)
    stop = options.stop
    return {
        "max_iterations": options.most_iterations,
        "gtol": options.tolerance.gradient,
        "gtol_absolute": options.tolerance.gradient_absolute,
        "xtol": options.tolerance.step,
        "x_scale": UNIT,
        "jacobian_error": jacobian_error(options.jacobian, options.difference_step),
        "good_enough": options.good_enough.rmse * np.sqrt(share),
        "matches": None if stop is None else partial(residuals.match, rmse=stop.rmse),
        "searches": searches_of(options),
    }


def searches_of(options: Estimate) -> estimate.Searches:
    """Return the searches with the settings of a case."""
    dgn = estimate.LineSearch(
        capped=options.dgn.step == "capped", cut=CUTS[options.dgn.cut], armijo=options.armijo
    )
    by_ratio = estimate.RatioDamping(
        options.lm.nu, options.lm.nu_min, options.lm.increase, options.lm.decrease
    )
    by_radius = estimate.TrustRegion(options.lm.radius / UNIT, options.armijo)
    return estimate.Searches(dgn=dgn, lm=by_ratio if options.lm.update == "ratio" else by_radius)


def refuse_unfit(case: Case, problem: FitProblem) -> None:
    """Raise ExfitError where a record cannot be fitted: it is too short, flat, or out of scale."""
    residuals = problem.residuals
    samples, free = residuals.count, len(residuals.free)
    if samples < free:
        raise CaseError([f"{case.path}: record: {samples} samples for {free} free parameters"])
    for channel in residuals.channels:
        measured = channel.measured[channel.kept]
        if np.all(measured == measured[0]):
            level = f"{channel.signal} is {measured[0]:g} pu throughout"
            raise CaseError([f"{case.path}: record: {level}: there is no step in it"])
    with np.errstate(over="ignore"):
        start = problem.compressed(residuals.start)
        square = float(start @ start)
    if not np.isfinite(square):
        largest = float(np.max(np.abs(start)))
        raise SimulationError(
            f"{case.path}: the residuals at the start values are too large to be squared: "
            f"up to {largest:.3g}; check scale, weight and start"
        )
