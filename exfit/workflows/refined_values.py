"""Given values that the records refine: they are fitted, with their standard errors as priors."""

from dataclasses import replace

import numpy as np

from exfit.case.given_errors import given_std_errors
from exfit.fitting.channel_weights import balanced, residual_deviations
from exfit.fitting.compression import compressed
from exfit.fitting.global_search import extended
from exfit.fitting.parameters import LARGEST_FACTOR, FreeParameter, freed_within
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import with_freed
from exfit.fitting.search import CaseSearches
from exfit.results.compare_with_record import compare_with_record
from exfit.util.vocabulary import REFINING_VALUES
from exfit.verdict.causes import Evidence, FittedRecord
from exfit.verdict.score_tests import value_that_the_record_refines
from exfit.workflows.search_state import SearchState, ignore

MOST_VALUES = 8  # each the one that explains most of what is left


def with_refined_values(state: SearchState) -> SearchState:
    """Fit those given values, too, of which the records say more than that they are as given.

    One after the other, each with its standard error: the one that would explain most of the
    residuals beyond their noise. None where a test or a record would explain more.
    """
    std_errors = given_std_errors(state.case)
    for _ in range(MOST_VALUES):
        refined = None if state.interrupted else value_that_the_record_refines(_evidence(state))
        if refined is None:
            break
        fixed = state.problem.residuals.fixed
        added = [
            freed_within(name, fixed[name], LARGEST_FACTOR, std_errors[name])
            for name in refined.names
            if name in std_errors
        ]
        state = _with_freed(replace(state, refined=(*state.refined, refined)), added)
    return state


def _evidence(state: SearchState) -> Evidence:
    residuals, best = state.problem.residuals, state.found.best
    values = residuals.values(best.x)
    tests = zip(state.case.recordings, state.fitted, strict=True)
    records = tuple(
        FittedRecord(each.test, setup, compare_with_record(setup, values)) for each, setup in tests
    )
    return Evidence(state.case, residuals, best, records, uncertainty=None)


def _with_freed(state: SearchState, added: list[FreeParameter]) -> SearchState:
    """Search on with more parameters, from where the search has come to."""
    counter = state.problem.residuals.counter
    residuals = with_freed(state.problem.residuals, added).counted_by(counter)
    more = np.array([free.scaled(free.start) for free in added])
    point = np.append(state.found.best.x, more)
    problem = FitProblem(residuals, compressed(residuals, point))
    by_noise = any(each.whitening is not None for each in residuals.experiments)
    if state.options.weights == "balanced" and not by_noise:  # until now by what a value explains
        deviations = residual_deviations(problem.compressed, point)
        problem = balanced(problem, point, counter, deviations)
    searches = CaseSearches(problem, state.options, ignore, state.counter)
    searched = extended(
        searches, state.found, more, replace(state, problem=problem).on_line, REFINING_VALUES
    )
    return replace(state, problem=problem, searched=searched)
