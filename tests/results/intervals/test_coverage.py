"""A few records of the study of coverage: the printed intervals hold the truth they were made with.

``python tests/studies/coverage.py`` counts it over 500 records of each hard case.
"""

from dataclasses import replace

import numpy as np
import pytest
from coverage_cases import HARD_CASES, covariance_of, exact, noisy, truth_of
from scipy.stats import binom
from tiers import few_of
from truths import holds

from exfit.inference.confidence import LEVEL
from exfit.workflows.case_search import STAGES
from exfit.workflows.search_state import SearchState, in_turn

RECORDS = 8
LEAST = binom.ppf(1e-3, RECORDS, LEVEL)  # fewer hold the truth in one of a thousand such tests


def printed(name, seed):
    """Return the intervals of a fit to one record, by parameter."""
    case, setups, problem = noisy(name, np.random.default_rng([seed, 1]))
    options = case.estimate.model_copy(update={"starts": 2})
    case = replace(case, estimate=options)
    state = SearchState(case, setups, (), problem, options.strategy, options)
    determined = in_turn(STAGES, state).determined
    return {
        parameter: known.interval
        for parameter, known in determined.uncertainty.confidence.parameters.items()
    }


@pytest.mark.long
@pytest.mark.parametrize(
    "name",
    ["coarse", *(pytest.param(name, marks=pytest.mark.long) for name in ("ac1a_limit", "st3a"))],
)
def test_printed_intervals_hold_the_truth(name):
    truth = HARD_CASES[name].truth
    records = [printed(name, seed) for seed in range(RECORDS)]
    for parameter in records[0]:
        intervals = [record[parameter] for record in records]
        assert sum(holds(own, truth[parameter]) for own in intervals if own) >= LEAST, parameter


@pytest.mark.parametrize("name", few_of(["coarse", "coloured"], 1))
def test_the_noise_of_the_study_has_the_covariance_it_counts_with(name):
    """Of the sum of all errors of a record, over many records."""
    rng, records = np.random.default_rng(1), 400
    (setup,) = exact(name)[1]
    (channel,) = setup.experiment.channels
    ones = np.ones((len(channel.measured), 1))
    sums = []
    for _ in range(records):
        (noise,) = noisy(name, rng)[1][0].experiment.channels
        sums.append(np.sum(noise.measured - channel.measured))
    # the variance of 400 is known to 7 %
    assert np.var(sums) == pytest.approx(float(covariance_of(name, channel, ones)[0, 0]), rel=0.3)


@pytest.mark.long
def test_the_truth_of_every_case_has_a_response_within_the_bounds():
    for name in HARD_CASES:
        problem = noisy(name, np.random.default_rng(0))[2]
        truth, (low, high) = truth_of(name, problem), problem.compressed.bounds
        assert np.all((truth > low) & (truth < high)), name
        # as large as the noise: a recorder's rounding adds its own
        assert 0.3 < problem.compressed.costs([truth])[0] / expected_cost(name, problem) < 3.0


def expected_cost(name, problem):
    """Return half the expected sum of squares of the errors at the truth."""
    hard = HARD_CASES[name]
    return 0.5 * sum(
        channel.weight**2
        * channel.samples
        * (hard.noise[channel.signal] ** 2 + hard.rounding**2 / 12.0)
        for channel in problem.residuals.channels
    )
