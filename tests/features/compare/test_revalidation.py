"""A new fit beside an old one: what moved beyond both intervals, and by more than is accepted."""

from dataclasses import replace

import pytest
from thesis_runs import first_order_fit

from exfit.features.compare.revalidation import revalidation
from exfit.results.comparisons import Event
from exfit.util.vocabulary import Criteria, Criterion

LIMIT = 1e-3  # pu


@pytest.fixture(scope="module")
def old():
    return first_order_fit()


def refitted(old, by=0.0, interval=(-1.0, 1.0), off=0.0, quantity="largest"):
    """Return a fit whose first parameter is elsewhere, and whose response is off by a constant."""
    name, own = next(iter(old.parameters.items()))
    value = own.value + by
    moved = replace(own, value=value, interval=tuple(value + end for end in interval))
    match = old.comparison
    overlays = {
        signal: replace(each, simulated=each.simulated + off)
        for signal, each in match.overlays.items()
    }
    return replace(
        old,
        parameters={**old.parameters, name: moved},
        comparisons=(replace(match, overlays=overlays), *old.comparisons[1:]),
        criteria=Criteria((Criterion(quantity, limit=LIMIT),), "a planner", given=True),
    )


@pytest.mark.parametrize(
    ("by", "interval", "outcome"),
    [
        (0.5, (-1.0, 1.0), "within an interval"),
        (1.5, (-1.0, 1.0), "moved"),
        (1.5, (-2.0, 1.0), "within an interval"),  # the new interval holds the old value
        (1.5, (-1.0, None), "moved"),
        (-1.5, (-1.0, None), "within an interval"),
    ],
)
def test_a_parameter_moved_where_each_value_is_beyond_the_interval_of_the_other(
    old, by, interval, outcome
):
    before = refitted(old)
    low, high = interval
    after = refitted(old, by)
    name, own = next(iter(after.parameters.items()))
    ends = own.value + low, None if high is None else own.value + high
    after = replace(after, parameters={**after.parameters, name: replace(own, interval=ends)})
    assert revalidation(before, after).parameters[0].outcome == outcome


def test_a_parameter_without_an_interval_is_not_called_unmoved(old):
    after = refitted(old, by=5.0)
    name, own = next(iter(after.parameters.items()))
    after = replace(after, parameters={**after.parameters, name: replace(own, interval=None)})
    assert revalidation(refitted(old), after).parameters[0].outcome == "no interval"


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_response_differs_by_more_than_the_new_criteria_allow(old, share):
    found, *_ = revalidation(old, refitted(old, off=share * LIMIT)).criteria
    assert found.difference == pytest.approx(share * LIMIT)
    assert found.outcome == ("met" if share < 1.0 else "not met")


def test_what_is_read_off_a_step_is_read_off_both_responses(old):
    match = replace(old.comparison, event=Event(float(old.comparison.time[1]), 1e9, True))
    stepped = replace(old, comparisons=(match,))
    found, *_ = revalidation(stepped, refitted(stepped, quantity="final_value", off=0.01)).criteria
    assert found.difference == pytest.approx(0.01, rel=1e-9)
