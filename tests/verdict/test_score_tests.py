"""Score tests of what a case holds fixed: their chi-square is that of the fit with it free."""

import numpy as np
import pytest
from faulty_cases import drawn
from faulty_events import drawn as event
from records import TEST, TIME, case_of, one, synthetic
from tiers import few_of

from exfit.case.load import load_case
from exfit.fitting.parameters import freed_within
from exfit.fitting.residuals import with_freed
from exfit.fitting.uncertainty import spread_of
from exfit.results.verdict import GOOD, MATCHES
from exfit.verdict import score_tests
from exfit.verdict.causes.trials import linear_model, refitted
from exfit.verdict.score_tests import Held, _linearised, _score
from exfit.workflows import fit

SATURATION = ("saturation", (2026, 11, 1))  # times 0.63; chi-square 29 to 1600 samples of noise
DRAWS = 4000
TPD0 = "machine.Tpd0"


@pytest.fixture
def evidence(monkeypatch):
    """What the score tests get of a fit that is good without them."""
    all_evidence = []

    def watched(evidence):
        all_evidence.append(evidence)
        return []

    def of(case):
        monkeypatch.setattr(score_tests, "contradictions", watched)
        fit(case, search="local")
        monkeypatch.undo()
        return all_evidence[0]

    return of


def test_a_value_that_the_record_contradicts_is_not_good():
    fault = drawn(*SATURATION)
    verdict = fit(fault.faulty, search="local").verdict
    assert all(test.are_noise for test in verdict.residuals)
    assert verdict.verdict == MATCHES
    assert verdict.reason.startswith("the record contradicts machine.")
    saturation = next(each.cause for each in verdict.causes if "S10" in each.cause)
    assert saturation.endswith("1.6 times would match better")
    sound = fit(fault.sound, search="local").verdict
    assert (sound.verdict, sound.causes) == (GOOD, ())


def test_chi_square_is_by_how_much_the_value_set_free_lowers_the_cost(evidence):
    """To second order in the change, which is 20 %: a fifth of either."""
    fitted = evidence(drawn(*SATURATION).faulty)
    (score,) = [each for each in score_tests.contradictions(fitted) if TPD0 in each.held.words]
    value = fitted.residuals.fixed[TPD0]
    trial = refitted(fitted, with_freed(fitted.residuals, [freed_within(TPD0, value, 4.0)]))
    variance = float(spread_of(fitted.residuals, fitted.uncertainty.confidence.noise)[0]) ** 2
    assert score.chi_square == pytest.approx(2.0 * (fitted.cost - trial.cost) / variance, rel=0.2)
    assert np.exp(score.change) == pytest.approx(trial.values[TPD0] / value, rel=0.2)


def test_a_value_may_be_off_by_the_standard_error_it_is_given_with():
    """Its variance adds to that of the record: chi-square of a change is change^2 over both."""
    errors, direction, slopes = np.split(
        np.random.default_rng(1).standard_normal((60, 3)), 3, axis=1
    )
    linear, none = linear_model(errors[:, 0], slopes), np.zeros(60)
    exact = _score(Held("H"), direction[:, 0], linear, none + 1e-3, none)
    given = Held("H", std_error=abs(exact.change))
    score = _score(given, direction[:, 0], linear, none + 1e-3, none)
    assert score.change == exact.change
    assert exact.chi_square > 100.0
    assert 1.0 / score.chi_square == pytest.approx(1.0 / exact.chi_square + 1.0, rel=1e-9)


@pytest.mark.long
def test_sound_grid_events_contradict_the_inertia_as_often_as_noise_does(evidence, tmp_path):
    """The mean chi-square of 6 records has a standard error of 0.58; corners made it 20."""
    scores = []
    for seed in range(11, 17):
        fitted = evidence(load_case(event("H", seed, tmp_path).sound))
        linear, directions, shift = _linearised(fitted)
        held, direction = next(each for each in directions if "machine.H" in each[0].words)
        scores.append(
            _score(
                held,
                direction,
                linear,
                spread_of(fitted.residuals, fitted.uncertainty.confidence.noise),
                shift,
            ).chi_square
        )
    assert np.mean(scores) < 3.5


@pytest.mark.long
def test_the_scores_of_noise_are_chi_square(evidence):
    """Of two signals, one much noisier; the mean of 4000 has a standard error of 0.022."""
    fitted = evidence(drawn("ripple", (16, 1, 7)).sound)
    linear, directions, shift = _linearised(fitted)
    spread, rng = (
        spread_of(fitted.residuals, fitted.uncertainty.confidence.noise),
        np.random.default_rng(1),
    )
    held, direction = next(each for each in directions if TPD0 in each[0].words)
    always = Held(held.words, unit="pu")  # tested however much it would have to change
    scores = [
        _score(always, direction, linear._replace(errors=noise), spread, shift).chi_square
        for noise in spread * rng.standard_normal((DRAWS, len(spread)))
    ]
    assert np.mean(scores) == pytest.approx(1.0, abs=0.1)
    assert np.mean(np.array(scores) > 6.635) == pytest.approx(0.01, abs=0.008)


@pytest.mark.long
@pytest.mark.parametrize(
    ("of_case", "words"),
    few_of(
        [({"step": 0.0499}, "the step of +0.0499 pu"), ({"at": 1.004}, "the time of the step")],
        1,
    ),
    ids=str,
)
def test_a_step_that_is_hardly_another_is_contradicted(tmp_path, of_case, words):
    """By 0.2 % of its size, or 4 ms, of parameters that are all known but one."""
    synthetic(tmp_path, TEST, TIME, seed=1)
    (step,) = TEST["vref"]
    test = {**TEST, "vref": [{**step, **of_case}]}
    verdict = fit(case_of(one(test, free=["TE"]), tmp_path), search="local").verdict
    assert verdict.verdict != GOOD
    assert words in verdict.sentence or not all(test.are_noise for test in verdict.residuals)
