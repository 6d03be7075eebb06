"""What casts doubt on the end of a search: the noise of its records, and its validations."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from exfit.case.case import Case
from exfit.errors import SimulationError
from exfit.estimate import Result
from exfit.fitting.descents import Judge
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import LEAST_NOISE, noise_of
from exfit.inference.noise import LEAST_P, SURPRISING, whiteness
from exfit.inference.wording import digits
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison
from exfit.workflows.solution import aligned, validation_of

Values = Mapping[str, float]

MISFIT = 2.0  # times the noise: three quarters of the squared error are not noise then


def judge_of(
    case: Case,
    problem: FitProblem,
    setups: Sequence[ExperimentSetup],
    unseen: Sequence[ExperimentSetup],
) -> Judge:
    """Make the judge of the ends of a search.

    ``setups`` are the tests of the fit, ``unseen`` those of the validations. An end is refused
    where one of these is not accepted. It is in doubt there, where the search did not converge, and
    where its errors are not white or larger than the noise (or larger than good_enough, where the
    case gives that).
    """

    def refused(end: Result) -> str:
        return _first(_refusals(case, unseen, *_fitted(problem, setups, end)))

    def doubt(end: Result) -> str:
        return _first(_doubts(case, problem, setups, unseen, end))

    return Judge(refused, doubt)


def _first(reasons: Iterator[str]) -> str:
    """Return the first of some reasons, "" where there is none."""
    try:
        return next(reasons, "")
    except SimulationError as fault:
        return str(fault)


def _fitted(
    problem: FitProblem, setups: Sequence[ExperimentSetup], end: Result
) -> tuple[Values, list[Comparison]]:
    """Return the values of an end, and how they compare with the records of the fit."""
    values = problem.residuals.values(end.x)
    return values, [
        compare_with_record(setup.with_enough_substeps(values), setup.name, values)
        for setup in setups
    ]


def _refusals(
    case: Case, unseen: Sequence[ExperimentSetup], values: Values, fitted: Sequence[Comparison]
) -> Iterator[str]:
    for setup in unseen:
        yield from filter(None, [validation_of(case, fitted, *aligned(case, setup, values)).reason])


def _doubts(
    case: Case,
    problem: FitProblem,
    setups: Sequence[ExperimentSetup],
    unseen: Sequence[ExperimentSetup],
    end: Result,
) -> Iterator[str]:
    if not end.success:
        yield f"the search had not converged: {end.message}"
    residuals = problem.residuals
    values, fitted = _fitted(problem, setups, end)
    good_enough = case.estimate.good_enough
    if good_enough is None:
        for setup, comparison in zip(setups, fitted, strict=True):
            yield from _beyond_noise(setup, comparison)
    else:
        rmse = float(np.sqrt(2.0 * end.cost / (residuals.count + len(residuals.priors))))
        if rmse > good_enough.rmse:
            yield f"the error, {rmse:.3e} pu, exceeded good_enough, {good_enough.rmse:g} pu"
    yield from _refusals(case, unseen, values, fitted)


def _beyond_noise(setup: ExperimentSetup, comparison: Comparison) -> Iterator[str]:
    """Yield the signals whose error is larger than the noise of their record, or not white."""
    for channel in setup.channels:
        overlay = comparison.overlays[channel.signal]
        if overlay.rmse <= LEAST_NOISE:
            continue
        times = overlay.rmse / noise_of(channel)
        if times > MISFIT:
            yield f"the error of {channel.signal} was {times:.2g} times the noise of its record"
        p_value = whiteness(overlay.error[np.isfinite(overlay.error)])
        if p_value is not None and p_value < SURPRISING:
            p = digits(p_value) if p_value > LEAST_P else f"below {LEAST_P:.0e}"
            yield f"the residuals of {channel.signal} were not white (Ljung-Box p {p})"
