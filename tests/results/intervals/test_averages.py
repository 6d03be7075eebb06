"""A recorder that averages is named or in doubt where its case does not speak of it."""

import pytest
from averaged_records import TRUTH, recorded, unsaid
from tiers import few_of

from exfit.results.verdict import GOOD
from exfit.workflows import fit

NOISE = 1e-4  # pu
LATE = {False: 0.0, True: 0.5}  # of the window


def said(result):
    """Return all that a verdict says."""
    verdict = result.verdict
    return " ".join([verdict.sentence, *(cause.sentence for cause in verdict.causes)])


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.long) for k in (2, 3))])
@pytest.mark.parametrize("trailing", few_of([False, True], 1))
@pytest.mark.parametrize(("rate", "window"), few_of([(10.0, 0.1), (50.0, 0.1)], 1))
def test_averages_of_which_a_case_does_not_speak_are_never_called_good(
    rate, window, trailing, seed
):
    record = recorded(rate, window, trailing, NOISE, seed)
    result = fit(unsaid(record, late=LATE[trailing] * window))
    assert result.verdict.verdict != GOOD
    changes = {place: to for cause in result.verdict.causes for place, to in cause.changes.items()}
    assert changes["record.channels.vt.averaged"] == f"{window:g}"
    intervals = {name: result.parameters[name].interval for name in TRUTH}
    held = [low <= TRUTH[name] <= high for name, (low, high) in intervals.items()]
    assert sum(held) >= len(held) - 1  # one of twenty may miss, all of five would without averages


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.long) for k in (2, 3))])
@pytest.mark.parametrize("rate", [10.0, 50.0, 100.0])
def test_samples_of_instants_are_not_called_averages(rate, seed):
    result = fit(unsaid(recorded(rate, noise=NOISE, seed=seed), search="local"))
    assert "recorder averages" not in said(result)
    if rate > 10.0:
        assert "averag" not in said(result)


@pytest.mark.parametrize("stated", [0.1, 0])
def test_where_a_case_speaks_of_averages_no_others_are_asked_about(stated):
    channel = {"column": "vt", "averaged": stated}
    result = fit(unsaid(recorded(10.0, stated, noise=NOISE, seed=1), channel, search="local"))
    assert "averag" not in said(result)
    assert "averages" not in {each.interval_method for each in result.parameters.values()}


@pytest.mark.long
def test_an_interval_in_doubt_holds_what_is_fitted_without_averages_and_with_them():
    record = recorded(10.0, 0.1, noise=NOISE, seed=1)
    plain, averaged = (
        fit(unsaid(record, {"column": "vt", "averaged": window})) for window in (0, 0.1)
    )
    unknown = fit(unsaid(record))
    assert {unknown.parameters[name].interval_method for name in TRUTH} == {"averages"}
    for name in TRUTH:
        low, high = unknown.parameters[name].interval
        least, most = plain.parameters[name].interval
        assert low <= min(least, averaged.values[name])
        assert high >= max(most, averaged.values[name])
