"""The search for the parameters of a case: weighted, judged, and continued where profiles lead."""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import Estimate
from exfit.fitting.channel_weights import as_fitted, searched, weighted_alike
from exfit.fitting.descents import Announce
from exfit.fitting.global_search import SearchResult
from exfit.fitting.nonlinearity import not_served_by_linear_theory
from exfit.fitting.nuisances.found_lines import with_found_lines
from exfit.fitting.problem import FitProblem, problem_of, residuals_of, with_setups
from exfit.fitting.program import Program
from exfit.fitting.search import continued_from, names_of_records, search
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.simulation_counter import SimulationCounter
from exfit.registry import parts
from exfit.results.intervals.determination import (
    NEEDS_PROFILE,
    Determination,
    determination,
    uncertainty_of_solution,
    without_linear_intervals,
)
from exfit.results.intervals.samples_at_steps import without_contradicting_samples
from exfit.util.strategies import WEIGHED_BY_NOISE
from exfit.workflows.choice_by_validation import judge_of

Array = NDArray[np.float64]
Watch = Callable[[estimate.Progress], None]

MOST_MINIMA = 3  # that profiles lead to, each below the other: two are rare


class SearchTask(NamedTuple):
    """What a case is searched with: the tests of the fit, ``unseen`` ones, the settings."""

    case: Case
    setups: tuple[ExperimentSetup, ...]
    unseen: tuple[ExperimentSetup, ...]
    method: str
    options: Estimate
    counter: SimulationCounter
    program: Program | None = None


class SearchOutcome(NamedTuple):
    """The problem and the tests with the weights of the fit, the search, what it determines."""

    problem: FitProblem
    setups: tuple[ExperimentSetup, ...]
    unseen: tuple[ExperimentSetup, ...]
    found: SearchResult
    determined: Determination


def search_outcome(
    task: SearchTask, problem: FitProblem, announce: Announce, progress: Watch
) -> SearchOutcome:
    """Return the best point of a case and how well it is determined.

    Where profiles lead to a lower minimum the search goes on from there.
    """
    options, counter = task.options, task.counter
    problem, found = weighed_search(task, problem, announce, progress)
    setups, unseen = as_fitted(task.setups, problem), task.unseen
    if task.program is not None:
        values = problem.residuals.values(found.best.x)
        setups = task.program.settled(setups, values, problem.residuals)
        unseen = task.program.settled(unseen, values)
        problem = with_setups(problem, setups)
    if options.weights == "balanced":
        unseen = weighted_alike(unseen, problem.residuals)
    if task.program is not None:
        determined = determined_by_twin(task, problem, found, setups, progress)
        return SearchOutcome(problem, setups, unseen, found, determined)
    profiled = options.search != "local"
    determined = determination(problem, found, setups, profiled, progress)
    judge = judge_of(task.case, problem, setups, unseen)
    for _ in range(MOST_MINIMA):
        if determined.lower is None:
            break
        found = continued_from(
            determined.lower, found, problem, announce, counter, options, judge=judge
        )
        determined = determination(problem, found, setups, profiled, progress)
    return SearchOutcome(problem, setups, unseen, found, determined)


def determined_by_twin(
    task: SearchTask,
    problem: FitProblem,
    found: SearchResult,
    setups: tuple[ExperimentSetup, ...],
    progress: Watch,
) -> Determination:
    """Return how well the records determine the parameters of a program, by its corrected twin.

    Profiles take no run. Where they lead to a lower cost, which the program need not have, the
    result is not at the minimum of the corrected twin. The intervals are those of linear theory
    then, which is judged at that minimum; without a twin they are so as well.
    """
    if task.case.has_no_equations:
        return determination(problem, found, setups, False, progress)
    determined = determination(problem, found, setups, True, progress)
    if determined.lower is None:
        return determined
    counter, of_record = SimulationCounter(), names_of_records(setups)
    try:
        of_twin = continued_from(
            determined.lower, found, problem, lambda _: None, counter, task.options
        ).best
        own, there = (
            uncertainty_of_solution(problem, point, of_record)
            for point in (found.best.x, of_twin.x)
        )
    except KeyboardInterrupt:
        return Determination(None, interrupted=True)
    if own is None or there is None:
        return Determination(None)
    if found.best.cost - of_twin.cost > max(own.rises.values(), default=0.0):  # another minimum
        return determination(problem, found, setups, False, progress)
    names = not_served_by_linear_theory(problem.residuals, of_twin.x, there, of_record)
    own = replace(own, nonlinear=there.nonlinear)
    return Determination(without_linear_intervals(own, names, NEEDS_PROFILE))


def with_lines(
    task: SearchTask, problem: FitProblem, progress: Watch
) -> tuple[SearchTask, FitProblem, tuple[str, ...]]:
    """Return the tests and the problem with the lines that residuals of a first search show.

    Notes say which. Raises KeyboardInterrupt where an interruption ended that search.
    """
    if not any(setup.automatic_sines for setup in task.setups):
        return task, problem, ()
    weighted, first = weighted_search(task, problem, lambda _: None, progress)
    if first.interrupted or first.best.stop is estimate.Stop.INTERRUPTED:
        raise KeyboardInterrupt
    setups, notes = with_found_lines(task.setups, weighted.residuals, first.best.x)
    disturbed = problem_of(residuals_of(task.case, setups))
    return task._replace(setups=setups), disturbed, notes


def weighed_search(
    task: SearchTask, problem: FitProblem, announce: Announce, progress: Watch
) -> tuple[FitProblem, SearchResult]:
    """Return the problem weighed by the noise of the signals that drive its events, and its search.

    It is that of `weighted_search` for tests that no event drives.
    """
    problem, found = weighted_search(task, problem, announce, progress)
    ended = found.interrupted or found.best.stop is estimate.Stop.INTERRUPTED
    if ended or not task.case.kind.finds_rest:
        return problem, found

    def proceed(weighed: FitProblem, found: SearchResult, point: Array) -> SearchResult:
        counter, options = task.counter, task.options
        return continued_from(point, found, weighed, announce, counter, options, WEIGHED_BY_NOISE)

    weigh = parts("INPUT_NOISE")["weighed search"].load()
    weighed: tuple[FitProblem, SearchResult] = weigh(
        problem, as_fitted(task.setups, problem), found, proceed, progress
    )
    return weighed


def weighted_search(
    task: SearchTask, problem: FitProblem, announce: Announce, progress: Watch
) -> tuple[FitProblem, SearchResult]:
    """Return the problem with the weights that the case asks for, and its search.

    Without the samples at the instant of a step that contradict all others, which notes name.
    """
    problem, found = _weighted_search(task, problem, announce, progress)
    if found.interrupted or found.best.stop is estimate.Stop.INTERRUPTED:
        return problem, found
    fewer, notes = without_contradicting_samples(problem, found.best.x)
    if not notes:
        return problem, found
    task = task._replace(setups=as_fitted(task.setups, fewer))
    problem, found = _weighted_search(task, fewer, announce, progress)
    return problem, found._replace(notes=(*found.notes, *notes))


def _weighted_search(
    task: SearchTask, problem: FitProblem, announce: Announce, progress: Watch
) -> tuple[FitProblem, SearchResult]:
    def search_of(problem: FitProblem) -> SearchResult:
        program, judge = task.program, None
        if program is None:  # whose runs are too dear to judge its ends
            judge = judge_of(task.case, problem, task.setups, task.unseen)
        rest = task.counter, task.options, judge, program
        return search(task.case, problem, task.method, announce, progress, *rest)

    return searched(problem, task.options, search_of, task.counter)
