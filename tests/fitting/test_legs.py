"""The legs of further starts: where they lead to, with the linear phase and without."""

import pytest
from places import ROOT
from records import config

from exfit.case.case import Case
from exfit.case.load import load_case
from exfit.estimate.starts import multistart, spread
from exfit.fitting.further_starts import last_leg, legs_of, telling_form
from exfit.fitting.search import fitted

STARTS = 4
LOWEST = {"ac1a_typical": (5.057e-6,), "ac8b_unit2": (5.074e-6, 5.090e-6)}


def legs(name):
    """Return the legs of a case, why none is linear, and the last of them."""
    _, problem = fitted(load_case(ROOT / "configs" / f"{name}.yaml"))
    own = last_leg(problem)
    return (*legs_of(problem.residuals, own), own)


@pytest.mark.long
@pytest.mark.parametrize("name", LOWEST)
def test_by_way_of_the_linear_phase_every_start_reaches_the_lowest_minimum(name):
    """Without it two in three do: tests/studies/global_search.py counts more of them."""
    of_case, _, own = legs(name)
    found = multistart(spread(own.bounds, STARTS), of_case)
    for cost in found.end_costs:
        assert any(cost == pytest.approx(lowest, rel=1e-3) for lowest in LOWEST[name])


@pytest.mark.long
def test_some_starts_go_the_direct_way():
    of_case, _, own = legs("ac1a_typical")
    (x,) = spread(own.bounds, 1)
    both = multistart([x, x], of_case, first_legs=[0, 1])
    direct = multistart([x], of_case[1:])
    assert both.end_costs[1] == direct.end_costs[0]
    assert both.start_costs[1] == direct.start_costs[0] != both.start_costs[0]


def test_a_case_that_has_no_linear_response_says_why():
    of_case, why_direct, own = legs("exciter_playback")
    assert "recorded signals drive the simulation" in why_direct
    assert [leg.method for leg in of_case] == ["lm-then-dgn", own.method]
    assert of_case[-1] is own


def test_of_many_records_the_first_legs_take_those_that_tell_enough():
    """Which tell a quarter of each direction, so that one with a quantity of its own stays."""
    content = config("ac1a_both")
    up, down = content["records"]
    up["test"]["vref"] = [{"at": 1.0, "step": 0.05}]
    content["records"] = [{**up, "name": f"up{k}"} for k in range(4)] + [down]
    _, problem = fitted(Case.from_dict(content, folder=ROOT / "configs"))
    some = telling_form(problem.residuals)
    assert [each.name for each in some.experiments] == ["up0", "down"]
    *first, own = legs_of(problem.residuals, last_leg(problem))[0]
    assert {leg.functions.count for leg in first} == {some.count}
    assert own.functions.count == problem.residuals.count
