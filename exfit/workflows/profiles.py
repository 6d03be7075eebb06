"""The profile likelihood of a case's parameters: how far each can move if the others follow."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf, isinf
from typing import Any, NamedTuple

import numpy as np

from exfit import estimate
from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.errors import CaseError, ExfitError
from exfit.fitting.build import build_unseen
from exfit.fitting.channel_weights import as_fitted
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.problem import FitProblem, with_setups
from exfit.fitting.program import Program
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import fitted, names_of_records
from exfit.fitting.uncertainty import UncertaintyAnalysis, uncertainty_at
from exfit.inference.confidence import LEVEL, Interval
from exfit.results.compare_with_record import compare_with_record
from exfit.results.intervals.determination import (
    FoundMinimum,
    ProfilesAboutMinima,
    limits_of,
    other_minima,
    profiles_about,
    reasons,
)
from exfit.results.verdict import Verdict
from exfit.util.arrays import Array
from exfit.util.text import error_of_interval, near, rounded_value
from exfit.verdict.causes import Evidence, FittedRecord
from exfit.verdict.diagnostics import search_range_notes
from exfit.verdict.rule import verdict_alone
from exfit.workflows.case_search import SEARCH
from exfit.workflows.search_state import SearchState, in_turn

LOWER = "the profiles reached a lower minimum than the fit and describe that one"
LOWER_BY_TWIN = (
    "the profiles reached a lower cost of the corrected twin: fit again from there to see whether "
    "the program confirms it"
)
ENCLOSED = "the intervals enclose another minimum, which the record does not reject"
BY_THE_RECORD = "given values count as exact here; the intervals of a fit allow for their errors"
MOST_MINIMA = 3  # that lie each below the other by more than rounding: two are rare

POINTS = 5  # of a side: enough for a smooth figure


class Branch(NamedTuple):
    """The profile about another minimum: values (K,) of the parameter, and the least costs (K,)."""

    at: Array
    costs: Array


@dataclass(frozen=True, eq=False)
class Profile:
    """The least cost (K,) for given values ``at`` (K,) of a parameter, the others fitted anew.

    ``low`` and ``high`` end the interval, None where the cost does not rise as far before what
    ``ends`` says: at the ends of the interval the cost is ``rise`` above the minimum.
    ``linear`` is the interval of the linear theory, if it has one. ``others`` are profiles about
    other minima that the record does not refute: the interval encloses theirs. ``min`` and ``max``
    are the bounds.
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
    others: tuple[Branch, ...] = ()
    min: float = -inf
    max: float = inf

    def rounded(self, number: float | None) -> str:
        """Return the value, or an end of an interval, as tables print it: within the bounds.

        It has the digits that its interval allows, or else the linear one.
        """
        error = error_of_interval(self.low, self.high)
        if error is None and self.linear is not None:
            error = error_of_interval(*self.linear)
        return rounded_value(number, error, self.min, self.max)


@dataclass(frozen=True, eq=False)
class Profiles:
    """Profiles of some parameters about the minimum ``cost``, with the ``verdict`` on the fit.

    Where the response misses the records, or does not match them, no profile has an interval.
    """

    name: str
    cost: float
    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]
    interrupted: bool
    verdict: Verdict

    def as_json(self) -> dict[str, Any]:
        """Return the figures."""
        return {
            "cost": self.cost,
            "verdict": self.verdict.verdict,
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
                    "others": [
                        {"at": branch.at.tolist(), "costs": branch.costs.tolist()}
                        for branch in profile.others
                    ],
                }
                for profile in self.profiles
            },
        }


def profile(
    case: Case,
    names: Iterable[str] = (),
    progress: Callable[[estimate.Progress], None] = lambda _: None,
    program: Program | None = None,
) -> Profiles:
    """Fit a case and return the profiles of some of its free parameters, all by default.

    ``progress`` is called with how far it is; an interruption keeps what is done of the profiles,
    one of the fit before them is passed on. Where a ``program`` simulates the case its corrected
    twin has the profiles, or, without a twin, the program itself. Raises ExfitError for input that
    cannot be used.

    Source: Venzon & Moolgavkar 1988.
    """
    setups, problem = fitted(case, program)
    names = tuple(names)
    if not any(setup.automatic_sines for setup in setups):  # else more may become free
        _indices(case, problem.residuals, names)
    state = _searched(case, setups, problem, progress, program)
    setups, problem, best = state.setups, state.problem, state.found.best
    x, records = best.x, names_of_records(setups)
    uncertainty = uncertainty_at(problem, x, records)
    values = problem.residuals.values(x)
    compared = []
    for recording, setup in zip(case.recordings, setups, strict=True):
        fine = setup.with_enough_substeps(values)
        match = compare_with_record(fine, values)
        compared.append(FittedRecord(recording.test, fine, match))
    verdict = verdict_alone(Evidence(case, problem.residuals, best, compared, uncertainty))
    by_twin = program is not None and program.has_twin
    if program is not None and by_twin:
        setups = program.settled(as_fitted(setups, problem), values)
        problem = with_setups(problem, setups)
        uncertainty = uncertainty_at(problem, x, records)
    wanted = _indices(case, problem.residuals, names)
    residuals, others = problem.compressed, other_minima(state.found)
    for further in range(MOST_MINIMA):
        if further:  # the residuals of another minimum, and so the rise, are others
            uncertainty = uncertainty_at(problem, x, records)
        rises = {index: uncertainty.rises[name] for name, index in wanted.items()}
        solution = FoundMinimum(x, estimate.half_square(residuals(x)))
        profiles = profiles_about(residuals, solution, others, rises, POINTS, progress)
        if profiles.lower is None or profiles.interrupted or by_twin:
            break
        x = profiles.lower
    _refuse_exact(case, profiles)
    first = next(iter(profiles.by_index.values()))[0]
    return Profiles(
        name=case.path.stem,
        cost=first.cost,
        profiles=tuple(
            _profile(case, residuals, uncertainty, each, verdict)
            for each in profiles.by_index.values()
        ),
        notes=(
            *_notes(case, verdict, best, profiles, by_twin),
            *([] if program is None else program.notes(setups, "profiles")),
        ),
        interrupted=profiles.interrupted,
        verdict=verdict,
    )


def _searched(
    case: Case,
    setups: tuple[ExperimentSetup, ...],
    problem: FitProblem,
    progress: Callable[[estimate.Progress], None],
    program: Program | None,
) -> SearchState:
    """Search a case to its minimum; raises KeyboardInterrupt at an interruption."""
    options = case.estimate.to_the_minimum()
    start, judged = case.values(), case.validations if options.strategy == "auto" else ()
    unseen = build_unseen(case, judged, start, setups)
    at = case, setups, unseen, problem, options.strategy, options, program
    state = in_turn(SEARCH, SearchState(*at, watch=progress))
    if state.interrupted:
        raise KeyboardInterrupt
    return state


def _refuse_exact(case: Case, profiles: ProfilesAboutMinima) -> None:
    """Raise ExfitError where no profile came about: without noise no rise of the cost is one."""
    if not profiles.by_index:
        text = "nothing to profile: the record is matched exactly, without noise to rise above"
        raise ExfitError(f"{case.path}: {text}")


def _notes(
    case: Case,
    verdict: Verdict,
    best: estimate.Result,
    profiles: ProfilesAboutMinima,
    by_twin: bool,
) -> Iterator[str]:
    """Yield notes on the minimum that the profiles are about, and on others."""
    if verdict.misfit:
        yield f"no parameter has an interval: {verdict.misfit}"
    yield from search_range_notes(case)
    if given_std_errors(case):
        yield BY_THE_RECORD
    if not best.success:
        yield f"the fit did not end at a minimum: {best.message}"
    if by_twin and profiles.lower is not None:
        yield LOWER_BY_TWIN
    if not np.array_equal(next(iter(profiles.by_index.values()))[0].x, best.x):
        yield LOWER
    if any(others for _, *others in profiles.by_index.values()):
        yield ENCLOSED


def _indices(case: Case, residuals: Residuals, names: Iterable[str]) -> dict[str, int]:
    """Return the indices of named free parameters, by default all; CaseError for others."""
    free = {parameter.name: index for index, parameter in enumerate(residuals.free)}
    wanted = tuple(names) or tuple(free)
    unknown = [name for name in wanted if name not in free]
    if unknown:
        raise CaseError(f"{case.path}: {name}: not free; {near(name, free)}" for name in unknown)
    return {name: free[name] for name in wanted}


def _profile(
    case: Case,
    residuals: Residuals,
    uncertainty: UncertaintyAnalysis,
    profiles: Sequence[estimate.CostProfile],
    verdict: Verdict,
) -> Profile:
    """Return a parameter's profiles about several minima, without an interval beside a misfit."""
    first, *others = profiles
    parameter = residuals.free[first.index]
    low, high = (None if isinf(limit) else parameter.value(limit) for limit in limits_of(profiles))
    units = {name: own.unit for name, own in residuals.of_records.items()} | case.units()

    def branch(profile: estimate.CostProfile) -> Branch:
        return Branch(np.array([parameter.value(float(x)) for x in profile.at]), profile.costs)

    linear = uncertainty.confidence.parameters[parameter.name].interval
    ends = reasons(parameter, profiles)
    if verdict.misfit:
        low = high = linear = None
        ends = (verdict.no_interval, verdict.no_interval)
    return Profile(
        name=parameter.name,
        unit=units.get(parameter.name, ""),
        value=parameter.value(float(first.x[first.index])),
        at=branch(first).at,
        costs=first.costs,
        low=low,
        high=high,
        ends=ends,
        rise=uncertainty.rises[parameter.name],
        linear=linear,
        others=tuple(map(branch, others)),
        min=parameter.low,
        max=parameter.high,
    )
