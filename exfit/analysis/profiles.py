"""The profile likelihood of a case's parameters: how far each can move if the others follow."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.analysis.diagnostics import search_range_notes
from exfit.analysis.judgement import doubt_of
from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.build import build_experiment
from exfit.fitting.parameters import UNIT
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals, SideBySide
from exfit.fitting.search import fitted, names_of_records, search
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.uncertainty import UncertaintyAnalysis, uncertainty_at
from exfit.inference import LEVEL, Interval
from exfit.util.text import near

Array = NDArray[np.float64]

LOWER = "the profiles led to a lower minimum than the fit: they are about that one"
MOST_MINIMA = 3  # that lie each below the other by more than rounding: two are rare

ENDS = {
    estimate.ProfileEnd.RISE: "",
    estimate.ProfileEnd.BOUND: "the record does not exclude the bound",
    estimate.ProfileEnd.FLAT: "the cost hardly rises",
    estimate.ProfileEnd.FAILED: "no response beyond",
    estimate.ProfileEnd.INTERRUPTED: "interrupted",
}


@dataclass(frozen=True, eq=False)
class Profile:
    """The least cost (K,) for given values ``at`` (K,) of a parameter, the others fitted anew.

    ``low`` and ``high`` end the interval, None where the cost does not rise as far before what
    ``ends`` says: at the ends of the interval the cost is ``rise`` above the minimum.
    ``linear`` is the interval of the linear theory, if it has one.
    """

    name: str
    unit: str
    value: float
    at: Array
    costs: Array
    low: float | None
    high: float | None
    ends: tuple[str, str]
    rise: float
    linear: Interval | None


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles of some parameters about the minimum ``cost``."""

    name: str
    cost: float
    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]
    interrupted: bool

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "cost": self.cost,
            "level": LEVEL,
            "interrupted": self.interrupted,
            "notes": list(self.notes),
            "parameters": {
                profile.name: {
                    "value": profile.value,
                    "low": profile.low,
                    "high": profile.high,
                    "ends": list(profile.ends),
                    "rise": profile.rise,
                    "linear": profile.linear,
                    "at": profile.at.tolist(),
                    "costs": profile.costs.tolist(),
                }
                for profile in self.profiles
            },
        }


def profile(
    case: Case,
    names: Iterable[str] = (),
    progress: Callable[[estimate.Progress], None] = lambda _: None,
) -> Profiles:
    """Fit a case and return the profiles of some of its free parameters, all by default.

    ``progress`` is called with how far it is; an interruption keeps what is done of the profiles,
    one of the fit before them is passed on. Raises ExfitError for input that cannot be used.

    Source: Venzon & Moolgavkar 1988.
    """
    setups, problem = fitted(case)
    wanted = _indices(case, problem.residuals, names)
    best = _minimum(case, setups, problem, progress)
    x, records = best.x, names_of_records(setups)
    for _ in range(MOST_MINIMA):
        uncertainty = uncertainty_at(problem, x, records)
        rises = {index: uncertainty.rises[name] for name, index in wanted.items()}
        residuals = problem.compressed
        about_x = estimate.profiles(
            SideBySide(residuals), x, rises, residuals.bounds, x_scale=UNIT, watch=progress
        )
        interrupted = any(_interrupted(cost_profile) for cost_profile in about_x)
        if interrupted or not about_x[0].moved:
            break
        x = about_x[0].x  # its residuals, and so the rise, are others
    return Profiles(
        name=case.path.stem,
        cost=about_x[0].cost,
        profiles=tuple(
            _profile(case, problem.residuals, uncertainty, cost_profile) for cost_profile in about_x
        ),
        notes=(*search_range_notes(case), *_notes(best, about_x[0].x)),
        interrupted=interrupted,
    )


def _indices(case: Case, residuals: Residuals, names: Iterable[str]) -> dict[str, int]:
    """Return the indices of the named parameters among the free ones, all if none is named.

    Raises CaseError for a name that is not free.
    """
    free = {parameter.name: index for index, parameter in enumerate(residuals.free)}
    wanted = tuple(names) or tuple(free)
    unknown = [name for name in wanted if name not in free]
    if unknown:
        raise CaseError(f"{case.path}: {name}: not free; {near(name, free)}" for name in unknown)
    return {name: free[name] for name in wanted}


def _minimum(
    case: Case,
    setups: Sequence[ExperimentSetup],
    problem: FitProblem,
    progress: Callable[[estimate.Progress], None],
) -> estimate.Result:
    """Return the fit of a case; raises KeyboardInterrupt where it was interrupted."""
    options = case.estimate.to_the_minimum()
    start, judged = case.values(), case.validations if options.strategy == "auto" else ()
    unseen = [build_experiment(case, recording, start) for recording in judged]
    doubt = doubt_of(case, problem, setups, unseen)
    best, minima, *_ = search(
        case, problem, options.strategy, lambda _: None, progress, options=options, doubt=doubt
    )
    if best.stop is estimate.Stop.INTERRUPTED or (minima is not None and minima.interrupted):
        raise KeyboardInterrupt
    return best


def _notes(best: estimate.Result, x: Array) -> Iterator[str]:
    """Yield what must be known of the minimum x that the profiles are about."""
    if not best.success:
        yield f"the fit did not end at a minimum: {best.message}"
    if not np.array_equal(x, best.x):
        yield LOWER


def _interrupted(cost_profile: estimate.CostProfile) -> bool:
    return estimate.ProfileEnd.INTERRUPTED in cost_profile.ends


def _profile(
    case: Case,
    residuals: Residuals,
    uncertainty: UncertaintyAnalysis,
    cost_profile: estimate.CostProfile,
) -> Profile:
    """Return a profile in the parameter's own values."""
    parameter = residuals.free[cost_profile.index]
    low, high = cost_profile.low, cost_profile.high
    below, above = cost_profile.ends
    units = {
        nuisance.name: nuisance.unit
        for experiment in residuals.experiments
        for nuisance in experiment.nuisances
    }
    return Profile(
        name=parameter.name,
        unit={**units, **case.units()}.get(parameter.name, ""),
        value=parameter.value(float(cost_profile.x[cost_profile.index])),
        at=np.array([parameter.value(float(x)) for x in cost_profile.at]),
        costs=cost_profile.costs,
        low=None if low is None else parameter.value(low),
        high=None if high is None else parameter.value(high),
        ends=(ENDS[below], ENDS[above]),
        rise=uncertainty.rises[parameter.name],
        linear=uncertainty.confidence.parameters[parameter.name].interval,
    )
