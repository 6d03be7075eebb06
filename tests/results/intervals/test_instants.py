"""Instants of steps in records of a signal that jumps: one minimum between each two samples."""

import numpy as np
import pytest
from coverage_cases import HARD_CASES, noisy, truth_of

from exfit.results.intervals.determination import (
    decided_by_few_samples,
    intervals_near,
    minima_between_samples,
)
from exfit.workflows.case_search import STAGES
from exfit.workflows.search_state import SearchState, in_turn

NAME, INSTANT = "st6b_instant", "vref.at"


@pytest.fixture(scope="module")
def record():
    """A record of ST6B whose step lies just before a sample, 5 ms apart."""
    return noisy(NAME, np.random.default_rng([1, 0]))


def test_the_intervals_between_samples_about_an_instant_are_tried():
    samples = np.arange(10.0)
    near = [*intervals_near(samples, 4.5)]
    middles = [round(0.5 * (first + last), 6) for first, last in near]
    assert middles == [1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5]
    assert len([*intervals_near(samples, 0.5)]) == 4


@pytest.mark.long
def test_beside_an_instant_between_the_wrong_samples_a_lower_minimum_is_found(record):
    _, _, problem = record
    truth = truth_of(NAME, problem)
    place = [parameter.name for parameter in problem.residuals.free].index(INSTANT)
    parameter = problem.residuals.free[place]
    aside = truth.copy()
    aside[place] = parameter.scaled(0.9975)  # two intervals off
    minima = minima_between_samples(problem, aside)
    lowest = min(minima, key=lambda minimum: minimum.cost)
    # the step lies 0.1 ms before a sample, which noise may move to the other side of it
    assert 1.0 < parameter.value(lowest.x[place]) < 1.0051
    assert lowest.cost < problem.compressed.costs([truth])[0]


@pytest.mark.long
def test_an_instant_just_before_a_sample_of_a_jump_has_an_interval_that_ends_there(record):
    case, setups, problem = record
    options = case.estimate
    state = SearchState(case, setups, (), problem, options.strategy, options)
    outcome = in_turn(STAGES, state)
    parameters = outcome.determined.uncertainty.confidence.parameters
    low, high = parameters[INSTANT].interval
    assert low < HARD_CASES[NAME].truth[INSTANT] < high
    assert low > 1.0
    assert 1.004999 < high < 1.005
    assert all(parameters[name].interval is not None for name in HARD_CASES[NAME].truth)
    # the search alone ends between the wrong samples, at a cost that no noise explains
    fitted = outcome.problem.residuals.values(outcome.found.best.x)
    assert 1.0 < fitted[INSTANT] < 1.005


def test_where_no_channel_jumps_no_sample_decides():
    _, _, problem = noisy("linear", np.random.default_rng(1))
    assert decided_by_few_samples(problem, truth_of("linear", problem)) == {}
