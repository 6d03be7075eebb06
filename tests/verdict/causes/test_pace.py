"""The search for causes ends where its time is over or it is interrupted, with what it has."""

import itertools
from dataclasses import replace

import pytest
from cases import FIRST_ORDER, TIME, TRUTH
from tiers import few_of

from exfit import workflows
from exfit.case.case import Case
from exfit.records.record import Record
from exfit.registry import parts
from exfit.results.verdict import MATCHES, MISSES, NOT_CONVERGED
from exfit.verdict.causes import Pace, recognisers_of
from exfit.verdict.causes.evidence import LEAST_TIME, OutOfTime, time_for_causes
from exfit.verdict.causes.recognisers import WITHOUT_TRIAL
from exfit.verdict.rule import verdict_of
from exfit.workflows import fit_run


def late(at=0.7):
    """Return a case whose step is later than that of its record."""
    content = FIRST_ORDER | {"test": {"vt0": 0.0, "vref": [{"at": at, "step": 1.0}]}}
    return Case.from_dict(content, Record.from_arrays(TIME, {"vt": TRUTH}))


@pytest.fixture(scope="module")
def evidence():
    """What is known of a fit that misses its record."""
    seen = []

    def watched(evidence):
        seen.append(evidence)
        return verdict_of(evidence)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fit_run, "verdict_of", watched)
        assert workflows.fit(late()).verdict.verdict == MISSES
    return seen[0]


class Announcements:
    """Counts announcements, and interrupts at one of them."""

    def __init__(self, last=None):
        self.last, self.count = last, 0

    def __call__(self, _):
        self.count += 1
        if self.count == self.last:
            raise KeyboardInterrupt


def with_pace(evidence, pace):
    """Return the verdict on what is known of a fit, by another pace."""
    return verdict_of(replace(evidence, pace=pace))


@pytest.mark.parametrize("search", [0.0, 1.0, LEAST_TIME, 600.0])
def test_causes_may_take_as_long_as_given_or_a_multiple_of_the_search(search):
    assert time_for_causes(None, search) == max(LEAST_TIME, search)
    for given in (0.0, 3.0, 1e4):
        assert time_for_causes(given, search) == given


@pytest.mark.parametrize("seconds", [0, 1, 7])
def test_no_trial_goes_on_beyond_its_time(seconds):
    """Each look at this clock is a second later than the one before."""
    pace = Pace(seconds, clock=itertools.count().__next__)
    for _ in range(seconds):
        pace.goes_on()
    with pytest.raises(OutOfTime):
        pace.goes_on()


@pytest.mark.parametrize("seconds", few_of([0, 5, 30, 45], 2))
def test_where_the_time_is_over_the_rest_is_said_to_be_untried(evidence, seconds):
    whole = with_pace(evidence, Pace())
    pace = Pace(seconds, clock=itertools.count().__next__)
    verdict = with_pace(evidence, pace)
    order = [*recognisers_of(evidence.case)]
    assert pace.untried
    assert order[-len(pace.untried) :] == [*pace.untried]
    assert not {*WITHOUT_TRIAL, *parts("CAUSES_AT_REST")} & {*pace.untried}
    assert not pace.interrupted
    assert f"estimate.causes, {seconds} s" in pace.sentence
    assert (verdict.verdict, verdict.reason) == (whole.verdict, whole.reason)


def test_with_time_enough_nothing_is_untried(evidence):
    pace = Pace()
    assert with_pace(evidence, pace).causes
    assert (pace.untried, pace.sentence) == ((), "")


@pytest.mark.long
def test_an_interruption_at_any_announcement_leaves_the_verdict_and_the_causes_until_then(evidence):
    heard = Announcements()
    whole = with_pace(evidence, Pace(watch=heard))
    untried, found = len(recognisers_of(evidence.case)), 0
    for last in range(1, heard.count + 1, max(1, heard.count // 20)):
        pace = Pace(watch=Announcements(last))
        verdict = with_pace(evidence, pace)
        assert pace.interrupted
        assert "interrupted" in pace.sentence
        assert 0 < len(pace.untried) <= untried
        assert len(verdict.causes) >= min(found, 1)
        assert (verdict.verdict, verdict.reason) == (whole.verdict, whole.reason)
        untried, found = len(pace.untried), len(verdict.causes)


@pytest.mark.long
def test_each_recogniser_may_be_interrupted(evidence, monkeypatch):
    from exfit.verdict import causes

    def interrupted(_):
        raise KeyboardInterrupt
        yield

    recognisers = recognisers_of(evidence.case)
    for place, words in enumerate(recognisers):
        others = {**recognisers, words: interrupted}
        monkeypatch.setattr(causes, "recognisers_of", lambda _, others=others: others)
        pace = Pace()
        assert with_pace(evidence, pace).verdict == MISSES
        assert pace.untried == (*recognisers,)[place:]
        assert pace.interrupted


@pytest.mark.parametrize(
    ("stage", "words"),
    [("rule.residual_tests", NOT_CONVERGED), ("score_tests.contradictions", MATCHES)],
)
def test_an_interruption_of_the_tests_never_leaves_a_good_fit(stage, words, monkeypatch):
    def interrupted(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"exfit.verdict.{stage}", interrupted)
    result = workflows.fit(late(0.5))
    assert result.verdict.verdict == words
    assert "interrupted" in result.verdict.reason
    assert result.interrupted
    assert not result.holds


def test_a_fit_that_is_interrupted_in_its_causes_is_kept_whole():
    def at_causes(progress):
        if progress.stage == "causes":
            raise KeyboardInterrupt

    whole, result = workflows.fit(late()), workflows.fit(late(), search_progress=at_causes)
    assert result.interrupted
    assert not result.holds
    assert result.verdict.verdict == whole.verdict.verdict
    assert result.values == whole.values
    assert any(note.startswith("not tried as causes (interrupted)") for note in result.notes)
