"""How well a fit is determined: by linear theory and, where that does not serve, by profiles."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import isinf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.errors import SimulationError
from exfit.estimate import Stop
from exfit.fitting.global_search import AT_TOLERANCE, SearchResult
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import names_of_records
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.uncertainty import (
    UncertaintyAnalysis,
    nonlinear_parameters,
    not_served_by_linear_theory,
    uncertainty_at,
)
from exfit.inference.confidence import Uncertainty
from exfit.inference.wording import listed
from exfit.results.intervals.instants import decided_by_few_samples, minima_between_samples
from exfit.results.intervals.profile_hull import (
    FoundMinimum,
    allowed,
    complete,
    limits_of,
    other_minima,
    profiles_about,
    reasons,
)

Array = NDArray[np.float64]
Watch = Callable[[estimate.Progress], object]

POINTS = 3  # of a side: only its end is asked for
REFUTING = 1e-3  # of the rise: a minimum lower by more refutes the solution

NO_MINIMUM = "has no interval: the search did not end at a minimum"
NEEDS_PROFILE = (
    "has no interval of linear theory, which does not hold over it: the default search or "
    "`exfit profile` gives one"
)
UNFINISHED = "has no interval: its profile was interrupted"


class Determination(NamedTuple):
    """Uncertainty of the best point of a search, and a lower minimum if profiles led to one.

    ``uncertainty`` is None where that is not known; ``lower`` is a point (N,) with a lower cost,
    where profiles led to one: what is said of the best point then holds for no minimum.
    """

    uncertainty: UncertaintyAnalysis | None
    lower: Array | None = None
    interrupted: bool = False


def determination(
    problem: FitProblem,
    search: SearchResult,
    setups: Iterable[ExperimentSetup],
    profiled: bool,
    progress: Watch,
) -> Determination:
    """Determine intervals of the best point of a search, by profiles or by linear theory.

    ``profiled``: with the intervals of profiles where linear theory does not serve, if the search
    ended at a minimum by itself.
    """
    best, of_record = search.best, names_of_records(setups)
    if best.stop is Stop.INTERRUPTED:
        return Determination(None)
    try:
        uncertainty = uncertainty_of_solution(problem, best.x, of_record)
    except KeyboardInterrupt:
        return Determination(None, interrupted=True)
    if uncertainty is None:
        return Determination(None)
    own_end = best.success and best.stop not in AT_TOLERANCE
    if search.interrupted or not (profiled and own_end):
        linear = by_linear_theory_alone(problem.compressed, best, uncertainty, of_record)
        return Determination(linear)
    between = minima_between_samples(problem, best.x)
    margin = REFUTING * max(uncertainty.rises.values(), default=0.0)
    lowest = min(between, key=lambda minimum: minimum.cost, default=None)
    if lowest is not None and lowest.cost < best.cost - margin:
        return Determination(uncertainty, lower=lowest.x)
    # strategy auto may prefer a minimum that is not the lowest: their hull is about both
    solution, *others = sorted(
        [FoundMinimum(best.x, best.cost), *other_minima(search), *between],
        key=lambda minimum: minimum.cost,
    )
    return with_profile_intervals(
        problem.compressed, solution, others, uncertainty, of_record, progress
    )


def by_linear_theory_alone(
    residuals: Residuals,
    best: estimate.Result,
    uncertainty: UncertaintyAnalysis,
    of_record: Sequence[str],
) -> UncertaintyAnalysis:
    """Return the uncertainty with the intervals that linear theory serves, and no others."""
    if not best.success:
        return without_linear_intervals(uncertainty, uncertainty.confidence.names, NO_MINIMUM)
    names = not_served_by_linear_theory(residuals, best.x, uncertainty, of_record)
    return without_linear_intervals(uncertainty, names, NEEDS_PROFILE)


def uncertainty_of_solution(
    problem: FitProblem, theta: Array, of_record: tuple[str, ...]
) -> UncertaintyAnalysis | None:
    """Analyse the uncertainty of the solution theta (N,), in scaled parameters.

    None where the derivatives there are not finite. ``of_record`` names what belongs to a record.
    """
    try:
        uncertainty = uncertainty_at(problem, theta, of_record)
    except SimulationError:
        return None
    nonlinear = nonlinear_parameters(problem.compressed, theta, uncertainty, of_record)
    by_few_samples = decided_by_few_samples(problem, theta)
    return replace(uncertainty, nonlinear=nonlinear, by_few_samples=by_few_samples)


def with_profile_intervals(
    residuals: Residuals,
    solution: FoundMinimum,
    others: Sequence[FoundMinimum],
    uncertainty: UncertaintyAnalysis,
    of_record: Sequence[str],
    progress: Watch,
) -> Determination:
    """Return the uncertainty with intervals of profiles where linear theory does not serve.

    Where the record does not refute one of the other minima, the intervals of all parameters are
    the hulls of profiles about each. An interruption keeps those that are complete.
    """
    rises, near = what_to_profile(residuals, solution, others, uncertainty, of_record)
    if not rises:
        return Determination(without_limits_of_others(uncertainty))
    profiles = profiles_about(residuals, solution, near, rises, POINTS, progress)
    if profiles.lower is not None:
        return Determination(uncertainty, lower=profiles.lower)
    names = [residuals.free[index].name for index in rises]
    served = without_linear_intervals(uncertainty, names, UNFINISHED)
    with_profiles = with_intervals(served, residuals.free, profiles.by_index)
    return Determination(without_limits_of_others(with_profiles), interrupted=profiles.interrupted)


def what_to_profile(
    residuals: Residuals,
    solution: FoundMinimum,
    others: Sequence[FoundMinimum],
    uncertainty: UncertaintyAnalysis,
    of_record: Sequence[str],
) -> tuple[dict[int, float], list[FoundMinimum]]:
    """Return the rises of the parameters to profile, and the minima that are not refuted."""
    index_of = {parameter.name: index for index, parameter in enumerate(residuals.free)}
    own = {index_of[name]: rise for name, rise in uncertainty.rises.items()}
    largest = max(own.values(), default=0.0)
    near = [other for other in others if allowed(solution, other, largest)]
    if near:
        return own, near
    names = not_served_by_linear_theory(residuals, solution.x, uncertainty, of_record)
    return {index_of[name]: uncertainty.rises[name] for name in names}, near


def without_linear_intervals(
    uncertainty: UncertaintyAnalysis, names: Iterable[str], why: str
) -> UncertaintyAnalysis:
    """Return the uncertainty without the linear intervals of some parameters, and why."""
    parameters = dict(uncertainty.confidence.parameters)
    for name in names:
        if parameters[name].interval is not None:
            parameters[name] = replace(parameters[name], interval=None, why=why)
    return without_limits_of_others(with_parameters(uncertainty, parameters))


def without_limits_of_others(uncertainty: UncertaintyAnalysis) -> UncertaintyAnalysis:
    """Return the uncertainty without intervals that something else than the record limits.

    That is the bound of another parameter, for those tied to it whose profile does not close, or
    one sample that decides an instant.
    """
    parameters = dict(uncertainty.confidence.parameters)
    for name, partners in uncertainty.tied_to_bounds.items():
        if parameters[name].determined and parameters[name].method != "linear":
            continue  # a profile, in which the other may leave its bound, is closed
        why = f"has no interval: the record ties it to {listed(partners)}, on a bound"
        parameters[name] = replace(parameters[name], interval=None, why=why)
    for name, why in uncertainty.by_few_samples.items():
        parameters[name] = replace(parameters[name], interval=None, why=why)
    return with_parameters(uncertainty, parameters)


def with_parameters(
    uncertainty: UncertaintyAnalysis, parameters: Mapping[str, Uncertainty]
) -> UncertaintyAnalysis:
    """Return the uncertainty with what is known of each parameter in place of its own."""
    return replace(uncertainty, confidence=replace(uncertainty.confidence, parameters=parameters))


def with_intervals(
    uncertainty: UncertaintyAnalysis,
    free: Sequence[FreeParameter],
    profiles: Mapping[int, Sequence[estimate.CostProfile]],
) -> UncertaintyAnalysis:
    """Return the uncertainty with the intervals of complete profiles in place of its own.

    Of several profiles of a parameter, by its place among the free ones, it is the hull. What
    linear theory says against them is left out.
    """
    parameters = dict(uncertainty.confidence.parameters)
    for index, (first, *others) in profiles.items():
        if complete(first):
            name = free[index].name
            each = [first, *filter(complete, others)]
            parameters[name] = of_profiles(parameters[name], free[index], each)
    known = uncertainty.identifiability.within(
        {
            parameter.name: interval_or_bounds(parameters[parameter.name], parameter)
            for parameter in free
            if parameters[parameter.name].method in ("profile", "hull")
        }
    )
    return with_parameters(replace(uncertainty, identifiability=known), parameters)


def interval_or_bounds(own: Uncertainty, parameter: FreeParameter) -> tuple[float, float]:
    """Return an interval whose open sides end at the bounds."""
    low, high = own.interval or (None, None)
    return parameter.low if low is None else low, parameter.high if high is None else high


def of_profiles(
    own: Uncertainty, parameter: FreeParameter, profiles: Sequence[estimate.CostProfile]
) -> Uncertainty:
    """Combine the profiles of a parameter to its uncertainty, by their hull."""
    hull = limits_of(profiles)
    low, high = (None if isinf(limit) else parameter.value(limit) for limit in hull)
    below, above = reasons(parameter, profiles)
    open_sides = [
        f"has no {side} limit: {reason}"
        for side, reason in (("lower", below), ("upper", above))
        if reason
    ]
    return replace(
        own,
        interval=None if low is None and high is None else (low, high),
        why=" and ".join(open_sides) or None,
        method="profile" if hull == limits_of(profiles[:1]) else "hull",
    )
