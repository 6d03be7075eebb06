"""How well a fit is determined: by linear theory and, where that does not serve, by profiles.

A signal that jumps with a step shows only which sample comes before the step and which behind.
The cost then has minima of its own between each two samples, beside either, which no descent
leaves: instants of such steps are looked for in each interval.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf, isinf
from typing import NamedTuple

import numpy as np

from exfit import estimate
from exfit.errors import SimulationError
from exfit.estimate import AT_TOLERANCE, Stop
from exfit.estimate.lockstep import finish_all
from exfit.fitting.experiment import Experiment, ExperimentSetup
from exfit.fitting.global_search import SearchResult
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import names_of_records
from exfit.fitting.uncertainty import (
    UncertaintyAnalysis,
    nonlinear_parameters,
    not_served_by_linear_theory,
    uncertainty_at,
)
from exfit.inference.confidence import Uncertainty
from exfit.signals import SIGNALS
from exfit.util.arrays import Array
from exfit.util.text import listed

Watch = Callable[[estimate.Progress], object]

POINTS = 3  # of a side: only its end is asked for
REFUTING = 1e-3  # of the rise: a minimum lower by more refutes the solution

INTERVALS = 3  # between samples on either side, in which an instant is tried
BESIDE_SAMPLE = 0.5  # of the width of a jump: where descents begin
MOST_ITERATIONS = 30  # of a descent there: it begins next to its end
DECIDING = 0.8  # of what the record shows of an instant: samples that show so much decide it
MOST_DECIDING = 2  # samples

NO_MINIMUM = "has no interval: the search did not end at a minimum"
NEEDS_PROFILE = (
    "has no interval: linear theory does not hold over it; use the default search or "
    "`exfit profile`"
)
UNFINISHED = "has no interval: its profile was interrupted"
THE_RECORD_DOES = "the record does"  # not exclude a bound


class FoundMinimum(NamedTuple):
    """A minimum of the cost: its point (N,), in scaled parameters, and its cost."""

    x: Array
    cost: float


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
    residuals = problem.compressed
    own_end = best.success and best.stop not in AT_TOLERANCE
    if search.interrupted or not (profiled and own_end):
        names, why = uncertainty.confidence.names, NO_MINIMUM
        if best.success:
            why = NEEDS_PROFILE
            names = not_served_by_linear_theory(residuals, best.x, uncertainty, of_record)
        return Determination(without_linear_intervals(uncertainty, names, why))
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
    return with_profile_intervals(residuals, solution, others, uncertainty, of_record, progress)


def uncertainty_of_solution(
    problem: FitProblem, theta: Array, of_record: tuple[str, ...]
) -> UncertaintyAnalysis | None:
    """Analyse the uncertainty of a solution theta (N,); None where derivatives are not finite."""
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
    index_of = {parameter.name: index for index, parameter in enumerate(residuals.free)}
    largest = max(uncertainty.rises.values(), default=0.0)
    near = [other for other in others if allowed(solution, other, largest)]
    names: Iterable[str] = uncertainty.rises
    if not near:
        names = not_served_by_linear_theory(residuals, solution.x, uncertainty, of_record)
    rises = {index_of[name]: uncertainty.rises[name] for name in names}
    if not rises:
        return Determination(without_limits_of_others(uncertainty))
    profiles = profiles_about(residuals, solution, near, rises, POINTS, progress)
    if profiles.lower is not None:
        return Determination(uncertainty, lower=profiles.lower)
    profiled = [residuals.free[index].name for index in rises]
    served = without_linear_intervals(uncertainty, profiled, UNFINISHED)
    with_profiles = with_intervals(served, residuals.free, profiles.by_index)
    return Determination(without_limits_of_others(with_profiles), interrupted=profiles.interrupted)


def without_linear_intervals(
    uncertainty: UncertaintyAnalysis, names: Iterable[str], why: str
) -> UncertaintyAnalysis:
    """Return the uncertainty without the linear intervals of some parameters, and why."""
    parameters = dict(uncertainty.confidence.parameters)
    for name in names:
        if parameters[name].interval is not None:
            parameters[name] = parameters[name]._replace(interval=None, why=why)
    return without_limits_of_others(uncertainty.with_parameters(parameters))


def without_limits_of_others(uncertainty: UncertaintyAnalysis) -> UncertaintyAnalysis:
    """Return the uncertainty without intervals that something else than the record limits.

    That is the bound of another parameter, for those tied to it whose profile does not close, or
    one sample that decides an instant.
    """
    parameters = dict(uncertainty.confidence.parameters)
    for name, partners in uncertainty.tied_to_bounds.items():
        if parameters[name].determined and parameters[name].method != "linear":
            continue  # a profile, in which the other may leave its bound, is closed
        why = f"has no interval: it is known only together with {listed(partners)}, on a bound"
        parameters[name] = parameters[name]._replace(interval=None, why=why)
    for name, why in uncertainty.by_few_samples.items():
        parameters[name] = parameters[name]._replace(interval=None, why=why)
    return uncertainty.with_parameters(parameters)


def with_intervals(
    uncertainty: UncertaintyAnalysis,
    free: Sequence[FreeParameter],
    profiles: "Mapping[int, Sequence[estimate.CostProfile]]",
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
    within = {}
    for parameter in free:
        own = parameters[parameter.name]
        if own.method in ("profile", "hull"):  # open sides end at the bounds
            low, high = own.interval or (None, None)
            within[parameter.name] = (
                parameter.low if low is None else low,
                parameter.high if high is None else high,
            )
    known = uncertainty.identifiability.within(within)
    return replace(uncertainty, identifiability=known).with_parameters(parameters)


def of_profiles(
    own: Uncertainty,
    parameter: FreeParameter,
    profiles: "Sequence[estimate.CostProfile]",
    data_does: str = THE_RECORD_DOES,
) -> Uncertainty:
    """Combine the profiles of a parameter to its uncertainty, by their hull."""
    hull = limits_of(profiles)
    low, high = (None if isinf(limit) else parameter.value(limit) for limit in hull)
    below, above = reasons(parameter, profiles, data_does)
    open_sides = [
        f"has no {side} limit: {reason}"
        for side, reason in (("lower", below), ("upper", above))
        if reason
    ]
    return own._replace(
        interval=None if low is None and high is None else (low, high),
        why=" and ".join(open_sides) or None,
        method="profile" if hull == limits_of(profiles[:1]) else "hull",
    )


class ProfilesAboutMinima(NamedTuple):
    """Profiles of parameters, by their places among the free ones, each about several minima.

    The first is that about the solution. ``lower`` is a minimum (N,) with a lower cost, where they
    led to one: then all are about that one alone.
    """

    by_index: "Mapping[int, Sequence[estimate.CostProfile]]"
    lower: Array | None = None
    interrupted: bool = False


def other_minima(search: SearchResult) -> list[FoundMinimum]:
    """Return the minima of a search beside its best point."""
    minima = enumerate(() if search.minima is None else search.minima.minima)
    return [FoundMinimum(local.x, local.cost) for k, local in minima if k != search.place]


def profiles_about(
    residuals: Residuals,
    solution: FoundMinimum,
    others: Sequence[FoundMinimum],
    rises: Mapping[int, float],
    points: int,
    progress: Watch,
) -> ProfilesAboutMinima:
    """Return the profiles about a solution, and about others as far as these are not refuted.

    What lies within the interval of a parameter already needs no further profile. An interruption
    keeps what is done by then.
    """
    profiles: dict[int, list[estimate.CostProfile]] = {}
    for minimum in (solution, *others):
        limits = {index: limits_of(each) for index, each in profiles.items()}
        within = {}
        for k, rise in rises.items():
            low, high = limits.get(k, limits_of(()))
            if allowed(solution, minimum, rise) and not low <= minimum.x[k] <= high:
                within[k] = rise
        if not within:
            continue
        known = None if minimum is solution else estimate.LowerMinimum(solution.cost, limits)
        about_minimum = estimate.profiles(
            residuals,
            minimum.x,
            within,
            residuals.bounds,
            beside=known,  # an interval that need not be found again
            points=points,
            most=residuals.iterations_of_side(len(rises)),
            workers=residuals.threads,
            x_scale=residuals.units,
            watch=progress,
        )
        interrupted = not all(map(complete, about_minimum))
        if about_minimum[0].moved:
            lower = {profile.index: [profile] for profile in about_minimum}
            return ProfilesAboutMinima(lower, about_minimum[0].x, interrupted)
        for profile in about_minimum:
            profiles.setdefault(profile.index, []).append(profile)
        if interrupted:
            return ProfilesAboutMinima(profiles, interrupted=True)
    return ProfilesAboutMinima(profiles)


def allowed(solution: FoundMinimum, other: FoundMinimum, rise: float) -> bool:
    """Test whether another minimum lies below the rise at which a parameter's interval ends."""
    return other.cost - solution.cost < rise


def complete(profile: "estimate.CostProfile") -> bool:
    """Test whether both sides of a profile came to their ends."""
    return estimate.ProfileEnd.INTERRUPTED not in profile.ends


def limits_of(profiles: "Iterable[estimate.CostProfile]") -> tuple[float, float]:
    """Interval that encloses those of all profiles of a parameter, infinite where one is open."""
    low, high = inf, -inf
    for profile in profiles:
        below, above = (end is estimate.ProfileEnd.KNOWN for end in profile.ends)
        low = low if below else min(low, -inf if profile.low is None else profile.low)
        high = high if above else max(high, inf if profile.high is None else profile.high)
    return low, high


def reasons(
    parameter: FreeParameter,
    profiles: "Sequence[estimate.CostProfile]",
    data_does: str = THE_RECORD_DOES,
) -> tuple[str, str]:
    """Reasons for which profiles leave the lower and upper limit open; "" for one that they set."""
    words = {
        estimate.ProfileEnd.BOUND: f"{data_does} not exclude its {{}} {{:.4g}}",
        estimate.ProfileEnd.FAILED: "there is no response beyond",
        estimate.ProfileEnd.FLAT: "the cost hardly rises",
        estimate.ProfileEnd.SPENT: "its profile ended at its budget (estimate.iterations)",
        estimate.ProfileEnd.INTERRUPTED: "interrupted",
    }
    below, above = (
        next((words[each.ends[side]] for each in profiles if each.ends[side] in words), "").format(
            name, bound
        )
        for side, (name, bound) in enumerate((("min", parameter.low), ("max", parameter.high)))
    )
    return below, above


class FreeInstant(NamedTuple):
    """An instant of a step, by its place among the free parameters, in a test with a jump."""

    place: int
    name: str
    experiment: Experiment

    @property
    def samples(self) -> Array:
        """The instants of the samples (M,) that are compared in a channel that jumps, in s."""
        channels = [c for c in self.experiment.channels if SIGNALS[c.signal].jumps]
        times: Array = self.experiment.simulator.times[np.any([c.kept for c in channels], axis=0)]
        return times


def free_instants(problem: FitProblem) -> Iterator[FreeInstant]:
    """Yield the instants that are free where a channel jumps with the step."""
    places = {parameter.name: k for k, parameter in enumerate(problem.residuals.free)}
    for experiment in problem.residuals.experiments:
        if any(SIGNALS[signal].jumps for signal in experiment.signals):
            for nuisance in experiment.nuisances:
                if nuisance.kind == "at" and nuisance.name in places:
                    yield FreeInstant(places[nuisance.name], nuisance.name, experiment)


def minima_between_samples(problem: FitProblem, x: Array) -> list[FoundMinimum]:
    """Return the minima (N,) near a solution x (N,), two of each interval between samples."""
    functions, (low, high) = problem.compressed, problem.compressed.bounds
    descents = []
    for instant in free_instants(problem):
        parameter, k = problem.residuals.free[instant.place], instant.place
        for first, last in intervals_near(instant.samples, parameter.value(float(x[k]))):
            within_low, within_high = low.copy(), high.copy()
            within_low[k] = max(low[k], parameter.scaled(first))
            within_high[k] = min(high[k], parameter.scaled(last))
            if within_low[k] >= within_high[k]:
                continue
            descent = estimate.Descent(
                functions=functions,
                bounds=(within_low, within_high),
                method="lm-then-dgn",
                max_iterations=MOST_ITERATIONS,
                x_scale=problem.residuals.units,
            )
            beside = BESIDE_SAMPLE * instant.experiment.simulator.jump
            for value in (first + beside, last - beside):
                start = x.copy()
                start[k] = np.clip(parameter.scaled(value), within_low[k], within_high[k])
                descents.append(descent.begin(start))
    minima: dict[int, FoundMinimum] = {}
    finish_all(
        descents,
        problem.residuals.threads,
        lambda k, end: minima.update({k: FoundMinimum(end.x, end.cost)}),
    )
    return [minima[k] for k in sorted(minima)]


def intervals_near(samples: Array, instant: float) -> Iterator[tuple[float, float]]:
    """Yield the intervals between samples (M,) about an instant, its own among them."""
    own = int(np.searchsorted(samples, instant, side="right")) - 1
    for k in range(own - INTERVALS, own + INTERVALS + 1):
        if 0 <= k < len(samples) - 1:
            gap = samples[k + 1] - samples[k]
            # a sample at the very instant counts as before or behind the step by rounding alone
            yield float(samples[k] + 1e-3 * gap), float(samples[k + 1] - 1e-3 * gap)


def decided_by_few_samples(problem: FitProblem, x: Array) -> dict[str, str]:
    """Name instants that one or two samples decide, each with the reason for no interval."""
    instants = [*free_instants(problem)]
    if not instants:
        return {}
    residuals = problem.residuals
    slopes = residuals.errors(x)[1]
    reasons = {}
    for instant in instants:
        others = np.delete(slopes, instant.place, axis=1)
        own = slopes[:, instant.place]
        shown = (own - others @ np.linalg.lstsq(others, own)[0]) ** 2
        largest = np.argsort(shown)[::-1][:MOST_DECIDING]
        shares = np.cumsum(shown[largest]) / max(float(np.sum(shown)), np.finfo(float).tiny)
        count = int(np.searchsorted(shares, DECIDING)) + 1
        if count <= MOST_DECIDING:
            parameter = residuals.free[instant.place]
            value = parameter.value(float(x[instant.place]))
            k = int(np.searchsorted(instant.samples, value, side="right"))
            around = instant.samples[max(k - 1, 0) : k + 1]
            samples = "one sample decides" if count == 1 else "two samples decide"
            between = " and ".join(f"{at:.6g}" for at in around)
            reasons[instant.name] = f"has no interval: {samples} it, between those at {between} s"
    return reasons
