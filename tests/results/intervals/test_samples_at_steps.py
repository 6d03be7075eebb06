"""Samples at the instant of a step: in a channel that jumps they may be of either side."""

from dataclasses import replace

import numpy as np
import pytest
import yaml
from coverage_cases import free, noisy
from places import CONFIGS
from tiers import few_of

from exfit.case.load import parse_case
from exfit.fitting.build import build_experiments
from exfit.fitting.problem import problem_of, residuals_of
from exfit.results.intervals.samples_at_steps import without_contradicting_samples
from exfit.workflows.case_search import STAGES, WEIGHTED, samples_at_steps
from exfit.workflows.search_state import SearchState, in_turn

TIME = np.arange(0.0, 6.0, 0.01)
SAMPLE = 2.0  # s: an instant of these
TRUTH = {
    "st1a": {"KA": 190.0, "TC": 1.0, "TB": 10.0},
    "ac8b": {"KPR": 80.0, "KIR": 5.0, "KDR": 10.0, "TDR": 0.1, "TE": 1.2},
}
NOISE = 1e-4
FOUND = {"start": SAMPLE + 0.004, "min": SAMPLE - 0.25, "max": SAMPLE + 0.25}
FAR = 5.0  # standard errors: noise alone takes an estimate so far in one of 1.7 million

SEARCHED = (*WEIGHTED, samples_at_steps)


def state_of(folder, model, signals, true_instant, at, seed=0):
    """Return the search of a noisy record of a step at an instant, and its problem.

    The record is that of an exact step; the case has the instant ``at``.
    """
    content = yaml.safe_load((CONFIGS / f"models/{model}.yaml").read_text(encoding="utf-8"))
    content["record"] = {"file": "r.csv", "time": "t", "channels": {s: s for s in signals}}
    content["parameters"] = {
        "fixed": {k: v for k, v in content["parameters"]["fixed"].items() if k not in TRUTH[model]},
        "free": {name: free(1.1 * value) for name, value in TRUTH[model].items()},
    }
    content["estimate"] = {"weights": "balanced", "search": "local"}
    columns = np.column_stack([TIME, *[np.ones_like(TIME)] * len(signals)])
    np.savetxt(
        folder / "r.csv", columns, "%.9g", ",", header=",".join(["t", *signals]), comments=""
    )

    def tests_of(instant):
        content["test"] = {"vt0": 1.0, "vref": [{"at": instant, "step": 0.05}]}
        case = parse_case(yaml.safe_dump(content, sort_keys=False), folder / "case.yaml")
        values = {**case.values(), **TRUTH[model]}
        return case, [setup.with_enough_substeps(values) for setup in build_experiments(case)]

    case, (exact,) = tests_of(true_instant)
    samples = exact.experiment.samples({**case.values(), **TRUTH[model]})[0]
    samples = samples + NOISE * np.random.default_rng(seed).standard_normal(samples.shape)
    case, (setup,) = tests_of(at)
    channels = tuple(
        replace(channel, measured=samples[:, k])
        for k, channel in enumerate(setup.experiment.channels)
    )
    setups = (replace(setup, experiment=replace(setup.experiment, channels=channels)),)
    options = case.estimate
    problem = problem_of(residuals_of(case, setups))
    return SearchState(case, setups, (), problem, options.strategy, options)


CONTRADICTIONS = [
    ("st1a", ("efd",), SAMPLE - 1e-8, FOUND),  # the sample has the value behind the step
    ("st1a", ("vt", "efd"), SAMPLE - 1e-8, SAMPLE),  # given as a round number
]


@pytest.mark.parametrize(("model", "signals", "true_instant", "at"), few_of(CONTRADICTIONS, 1))
def test_a_sample_that_contradicts_all_others_is_left_out(
    tmp_path, model, signals, true_instant, at
):
    outcome = in_turn(STAGES, state_of(tmp_path, model, signals, true_instant, at))
    (note,) = outcome.found.notes
    assert note == (
        "efd: the sample at 2 s is left out: at the time of a step, where efd may jump, and "
        "inconsistent with all others"
    )
    left_out = {
        channel.signal: TIME[~channel.kept].tolist() for channel in outcome.fitted[0].channels
    }
    assert left_out == {signal: [SAMPLE] if signal == "efd" else [] for signal in signals}
    fitted = outcome.problem.residuals.values(outcome.found.best.x)
    truth = TRUTH[model] | ({"vref.at": true_instant} if at is FOUND else {})
    parameters = outcome.determined.uncertainty.confidence.parameters
    assert parameters.keys() == truth.keys()
    for name, value in truth.items():
        assert abs(fitted[name] - value) < FAR * parameters[name].std_error, name


@pytest.mark.parametrize(
    ("signals", "true_instant", "at"),
    [
        (("vt", "efd"), SAMPLE + 0.0035, FOUND),  # between two samples
        (("vt",), SAMPLE, FOUND),  # vt does not jump
        # before the step, at which a search ends
        pytest.param(("vt", "efd"), SAMPLE, FOUND, marks=pytest.mark.long),
        (("vt",), SAMPLE - 1e-8, SAMPLE),
        (("vt", "efd"), SAMPLE, SAMPLE),  # before the step, as the simulation has it
    ],
)
def test_where_nothing_contradicts_the_problem_stays_the_same(tmp_path, signals, true_instant, at):
    state = in_turn(SEARCHED, state_of(tmp_path, "st1a", signals, true_instant, at))
    problem, found = state.problem, state.found
    assert found.notes == ()
    assert without_contradicting_samples(problem, found.best.x) == (problem, ())
    assert all(channel.kept.all() for channel in problem.residuals.channels)


def test_a_sample_that_agrees_in_another_minimum_stays():
    # a local search ends beside a sample that is not at the instant, 4.4 ms later
    case, setups, problem = noisy("st6b_instant", np.random.default_rng([1, 1]))
    options = case.estimate.model_copy(update={"search": "local"})
    state = SearchState(case, setups, (), problem, options.strategy, options)
    state = in_turn(SEARCHED, state)
    assert state.found.notes == ()
    assert all(channel.kept.all() for channel in state.problem.residuals.channels)
