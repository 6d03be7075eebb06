"""How well a fit is determined: by linear theory and, where that does not serve, by profiles."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf, isinf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.errors import SimulationError
from exfit.estimate import Stop
from exfit.fitting.global_search import AT_TOLERANCE, SearchResult
from exfit.fitting.nonlinearity import nonlinear_parameters, not_served_by_linear_theory
from exfit.fitting.parameters import UNIT, FreeParameter
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals, SideBySide
from exfit.fitting.search import names_of_records
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.uncertainty import UncertaintyAnalysis, uncertainty_at
from exfit.inference import Uncertainty

Array = NDArray[np.float64]
Watch = Callable[[estimate.Progress], object]

POINTS = 3  # of a side: only its end is asked for


class Determination(NamedTuple):
    """How well the records determine the best point of a search.

    ``uncertainty`` is None where that is not known; ``lower`` is a point (N,) with a lower cost,
    where profiles led to one: what is said of the best point then holds for no minimum.
    """

    uncertainty: UncertaintyAnalysis | None
    lower: Array | None = None
    interrupted: bool = False


class FoundMinimum(NamedTuple):
    """A minimum of the cost: its point (N,), in scaled parameters, and its cost."""

    x: Array
    cost: float


def determination(
    problem: FitProblem,
    search: SearchResult,
    setups: Iterable[ExperimentSetup],
    profiled: bool,
    progress: Watch,
) -> Determination:
    """Return how well the records determine the best point of a search.

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
    own_end = best.success and best.stop not in AT_TOLERANCE
    if uncertainty is None or search.interrupted or not (profiled and own_end):
        return Determination(uncertainty)
    minima = () if search.minima is None else search.minima.minima
    others = [
        FoundMinimum(local.x, local.cost) for k, local in enumerate(minima) if k != search.place
    ]
    solution = FoundMinimum(best.x, best.cost)
    return with_profile_intervals(
        problem.compressed, solution, others, uncertainty, of_record, progress
    )


def uncertainty_of_solution(
    problem: FitProblem, theta: Array, of_record: tuple[str, ...]
) -> UncertaintyAnalysis | None:
    """Return how well the records determine the solution theta (N,), in scaled parameters.

    None where the derivatives there are not finite. ``of_record`` names what belongs to a record.
    """
    try:
        uncertainty = uncertainty_at(problem, theta, of_record)
    except SimulationError:
        return None
    nonlinear = nonlinear_parameters(problem.compressed, theta, uncertainty, of_record)
    return replace(uncertainty, nonlinear=nonlinear)


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
    profiles: dict[int, list[estimate.CostProfile]] = {}
    for minimum in (solution, *near) if rises else ():
        within = {k: rise for k, rise in rises.items() if allowed(solution, minimum, rise)}
        lower = None if minimum is solution else beside(solution, profiles)
        about_minimum = about(residuals, minimum, within, lower, progress)
        if about_minimum[0].moved:
            return Determination(uncertainty, lower=about_minimum[0].x)
        for profile in about_minimum:
            profiles.setdefault(profile.index, []).append(profile)
        if not all(map(complete, about_minimum)):
            return Determination(with_intervals(uncertainty, residuals.free, profiles), None, True)
    return Determination(with_intervals(uncertainty, residuals.free, profiles))


def what_to_profile(
    residuals: Residuals,
    solution: FoundMinimum,
    others: Sequence[FoundMinimum],
    uncertainty: UncertaintyAnalysis,
    of_record: Sequence[str],
) -> tuple[dict[int, float], list[FoundMinimum]]:
    """Return the rises of the parameters to profile, and the minima that are not refuted."""
    index_of = {parameter.name: index for index, parameter in enumerate(residuals.free)}
    own = {
        index_of[name]: rise for name, rise in uncertainty.rises.items() if name not in of_record
    }
    largest = max(own.values(), default=0.0)
    near = [other for other in others if allowed(solution, other, largest)]
    if near:
        return own, near
    names = not_served_by_linear_theory(residuals, solution.x, uncertainty, of_record)
    return {index_of[name]: uncertainty.rises[name] for name in names}, near


def allowed(solution: FoundMinimum, other: FoundMinimum, rise: float) -> bool:
    """Return whether another minimum lies below the rise at which a parameter's interval ends."""
    return other.cost - solution.cost < rise


def beside(
    solution: FoundMinimum, profiles: Mapping[int, Sequence[estimate.CostProfile]]
) -> estimate.LowerMinimum:
    """Return what a profile about another minimum need not find again."""
    return estimate.LowerMinimum(
        solution.cost, {index: limits_of(each) for index, each in profiles.items()}
    )


def about(
    residuals: Residuals,
    minimum: FoundMinimum,
    rises: Mapping[int, float],
    lower: estimate.LowerMinimum | None,
    progress: Watch,
) -> tuple[estimate.CostProfile, ...]:
    """Return the profiles of some parameters about a minimum."""
    return estimate.profiles(
        SideBySide(residuals),
        minimum.x,
        rises,
        residuals.bounds,
        beside=lower,
        points=POINTS,
        x_scale=UNIT,
        watch=progress,
    )


def complete(profile: estimate.CostProfile) -> bool:
    """Return whether both sides of a profile came to their ends."""
    return estimate.ProfileEnd.INTERRUPTED not in profile.ends


def limits_of(profiles: Iterable[estimate.CostProfile]) -> tuple[float, float]:
    """Return the interval that all profiles of a parameter lie in, infinite where one is open."""
    low, high = inf, -inf
    for profile in profiles:
        below, above = (end is estimate.ProfileEnd.KNOWN for end in profile.ends)
        low = low if below else min(low, -inf if profile.low is None else profile.low)
        high = high if above else max(high, inf if profile.high is None else profile.high)
    return low, high


def with_intervals(
    uncertainty: UncertaintyAnalysis,
    free: Sequence[FreeParameter],
    profiles: Mapping[int, Sequence[estimate.CostProfile]],
) -> UncertaintyAnalysis:
    """Return the uncertainty with the intervals of complete profiles in place of its own.

    Of several profiles of a parameter, by its place among the free ones, it is the hull.
    """
    parameters = dict(uncertainty.confidence.parameters)
    for index, (first, *others) in profiles.items():
        if complete(first):
            name = free[index].name
            each = [first, *filter(complete, others)]
            parameters[name] = of_profiles(parameters[name], free[index], each)
    return replace(uncertainty, confidence=replace(uncertainty.confidence, parameters=parameters))


def of_profiles(
    own: Uncertainty, parameter: FreeParameter, profiles: Sequence[estimate.CostProfile]
) -> Uncertainty:
    """Return what is known of a parameter by the hull of its profiles."""
    hull = limits_of(profiles)
    low, high = (None if isinf(limit) else parameter.value(limit) for limit in hull)
    return replace(
        own,
        interval=None if low is None and high is None else (low, high),
        why=" and ".join(open_sides(parameter, profiles)) or None,
        method="profile" if hull == limits_of(profiles[:1]) else "hull",
    )


def open_sides(parameter: FreeParameter, profiles: Sequence[estimate.CostProfile]) -> Iterator[str]:
    """Yield which limits profiles leave open, and why."""
    closed = (estimate.ProfileEnd.RISE, estimate.ProfileEnd.KNOWN)
    bounds = (("lower", "min", parameter.low), ("upper", "max", parameter.high))
    for side, (adjective, bound, limit) in enumerate(bounds):
        ends = [profile.ends[side] for profile in profiles]
        end = next((end for end in ends if end not in closed), None)
        if end is not None:
            yield f"has no {adjective} limit: {reason(end, f'its {bound} {limit:.4g}')}"


def reason(end: estimate.ProfileEnd, bound: str) -> str:
    """Return in words why a side of a profile has no limit."""
    if end is estimate.ProfileEnd.BOUND:
        return f"the record does not exclude {bound}"
    if end is estimate.ProfileEnd.FAILED:
        return "there is no response beyond"
    return "the cost hardly rises"
