"""What a result says of itself: the figures of an overlay, the JSON of a fit, its search."""

import io
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from places import ROOT

from exfit import workflows
from exfit.results.comparisons import Overlay
from exfit.results.model import FitResult, Minima, Minimum, multiple
from exfit.results.side_by_side import outcome_of
from exfit.results.tables import table
from exfit.results.verdict import GOOD, MATCHES, MISSES, NO_MATCH, NOT_CONVERGED, Verdict
from exfit.util.typed import IN_FILE, plain

INSIDE = {"comparisons": "records"}  # under another name

laws = settings(deadline=None, derandomize=True, max_examples=25)


@pytest.fixture(scope="module")
def fitted():
    return workflows.fit(ROOT / "configs" / "first_order.yaml", search="local")


@laws
@given(seed=st.integers(0, 2**32 - 1), share=st.floats(0.0, 3.0))
def test_the_fit_percentage_is_what_is_left_of_the_spread(seed, share):
    """100 for the record itself, 0 for its mean, and in between as far as the error goes."""
    measured = np.random.default_rng(seed).normal(1.0, 0.1, 50)
    mean = np.full(50, measured.mean())
    between = measured + share * (mean - measured)
    # what rounding leaves of a difference of numbers near 1 that is 0.1 large
    assert Overlay(measured, measured).fit_percent == 100.0
    assert Overlay(measured, mean).fit_percent == pytest.approx(0.0, abs=1e-9)
    assert Overlay(measured, between).fit_percent == pytest.approx(100.0 * (1 - share), abs=1e-9)


def test_the_json_of_a_fit_has_every_field_with_its_value(fitted):
    told = fitted.to_dict()
    names = {one.name for one in fields(FitResult) if one.metadata != IN_FILE}
    assert {INSIDE.get(name, name) for name in names} <= told.keys()
    for name in names:
        value = getattr(fitted, name)
        if isinstance(value, bool | int | float | str):
            assert told[name] == value, name
    assert "history" not in told
    assert tuple(told["typical"]) == fitted.typical
    assert told["fit"] == plain(fitted.comparison) == told["records"][0]


@pytest.mark.parametrize(
    ("words", "holds"),
    [(GOOD, True), (MATCHES, True), (MISSES, False), (NO_MATCH, False), (NOT_CONVERGED, False)],
)
def test_a_fit_holds_by_its_verdict_and_its_validations(fitted, words, holds):
    result = replace(fitted, verdict=Verdict(words))
    assert result.holds is holds
    assert outcome_of(result) == words
    rejected = replace(result.comparison, accepted=False, reason="it is another unit")
    for worse in (
        replace(result, validation=(rejected,)),
        replace(result, interrupted=True),
    ):
        assert not worse.holds
        assert outcome_of(worse) not in (GOOD, MATCHES)


def test_a_long_table_keeps_the_extremes_of_every_column(monkeypatch):
    monkeypatch.setattr("exfit.results.tables.MOST_ROWS", 1000)
    time = np.linspace(0.0, 1.0, 50_001)
    signals = np.random.default_rng(1).standard_normal((2, len(time)))
    rows = np.loadtxt(
        io.StringIO(table(["t", "a", "b"], [time, *signals])), delimiter=",", skiprows=1
    )
    assert len(rows) <= 1002
    assert np.all(np.diff(rows[:, 0]) > 0.0)
    assert rows[:, 1:].max(axis=0) == pytest.approx(signals.max(axis=1))
    assert rows[:, 1:].min(axis=0) == pytest.approx(signals.min(axis=1))


def minima(*others, best=(1.0, 9), unfinished=0, failed=0, own=1):
    """Return minima of which each is given by cost, descents and whether it is refuted."""
    every = [Minimum({}, *best, 0.0, False)]
    every += [Minimum({}, cost, count, 5.0, refuted) for cost, count, refuted in others]
    ends = [each.cost for each in every for _ in range(each.starts)]
    ends += [np.nan] * (unfinished + failed)
    starts = [10.0] * (len(ends) - failed) + [np.inf] * failed
    ways = ("strategy",) * own + ("direct",) * (len(ends) - own)
    return Minima(tuple(every), np.array(starts), np.array(ends), ways)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (minima(), "from the start of the case and 8 further starts: 9 of 9 runs converge to"),
        (minima(best=(1.0, 2)), "1 further start: 2 of 2 runs"),
        (minima((4.68, 3, True)), "9 of 12 runs converge to this minimum, 3 to another at 4.68"),
        (minima((1.003, 2, False)), ", 2 to another at 1.003 times the cost (not rejected)"),
        (minima((1.5, 2, None)), ", 2 to another at 1.500 times the cost"),
        (
            minima((1.003, 1, False), (2.0, 2, True), (9.0, 1, True)),
            ", 1 to another at 1.003 times the cost (not rejected), 3 to 2 others at 2.00 times",
        ),
        (minima(failed=2), ", 2 without a response"),
        (minima(unfinished=3, own=2), "10 further starts: 9 of 12 runs converge to this"),
        (minima(unfinished=3), "minimum, 3 not finished"),
    ],
)  # fmt: skip
def test_the_sentence_counts_every_descent(found, words):
    assert words in found.summary(1.0)


def test_a_point_that_is_no_minimum_is_not_called_one():
    words = "0 of 9 runs converge to this point, 9 to another at 2.00 times the cost"
    assert words in minima().summary(0.5)


@pytest.mark.parametrize(
    ("ratio", "text"),
    [(1.0032, "1.003"), (0.997, "0.997"), (4.681, "4.68"), (84.32, "84.3"), (12358.4, "12358")],
)
def test_a_multiple_has_the_digits_that_tell_it_from_another(ratio, text):
    assert multiple(ratio) == f"{text} times"
