"""The further starts of a global search: where they lie, and by which legs they go."""

import numpy as np
import pytest
from cases import local_case
from event_sets import recorded, set_case

from exfit.case.load import load_case
from exfit.estimate import spread
from exfit.fitting.further_starts import further_starts
from exfit.fitting.residuals import UNSTABLE
from exfit.fitting.search import fitted
from exfit.util.text import rounded_value
from exfit.workflows import fit

COUNT = 7
# of AC1A: from there a descent ends in a minimum that the record refutes
ASTRAY = {
    "KA": 199.0, "KF": 0.00557, "TE": 1.53, "TF": 0.184, "TA": 0.00302, "KC": 1.03, "KD": 0.939
}  # fmt: skip


def starts_of(case):
    return further_starts(fitted(case)[1], COUNT, None)


def test_the_first_is_that_of_the_case_and_all_lie_within_its_bounds():
    case = local_case("ac1a_typical")
    residuals = fitted(case)[1].residuals
    starts = starts_of(case)
    low, high = residuals.bounds
    assert starts.points.shape == (COUNT, len(residuals.free))
    assert starts.points[0].tolist() == residuals.start.tolist()
    assert (starts.points >= low).all()
    assert (starts.points <= high).all()


def test_two_of_three_go_by_way_of_the_linear_phase():
    starts = starts_of(local_case("ac1a_typical"))
    assert starts.why_direct == ""
    assert starts.ways == ("linear", "linear", "direct") * 2 + ("linear",)
    assert starts.first_legs == (0, 0, 1, 0, 0, 1, 0)
    assert len(starts.legs) == 3


def test_where_the_linear_phase_has_no_meaning_all_go_directly():
    starts = starts_of(local_case("machine_playback"))
    assert "drive" in starts.why_direct
    assert starts.ways == ("direct",) * COUNT
    assert {*starts.first_legs} == {0}
    assert len(starts.legs) == 2


def test_they_are_the_same_at_every_run():
    first, again = (starts_of(local_case("ac1a_typical")) for _ in range(2))
    assert first.points.tolist() == again.points.tolist()


def test_the_last_leg_is_on_the_residuals_of_the_fit():
    problem = fitted(local_case("ac1a_typical"))[1]
    starts = further_starts(problem, COUNT, None)
    x = problem.residuals.start
    (own,) = starts.legs[-1].functions.residuals([x])
    assert np.array_equal(own, problem.compressed(x))


@pytest.fixture(scope="module")
def both():
    """Return a fit from a start that leads astray, with a local and with a global search."""
    case = local_case("ac1a_typical")
    return [fit(case, values=ASTRAY, search=search) for search in ("local", "global")]


@pytest.mark.long
def test_a_search_leaves_a_false_minimum_by_a_path_that_is_whole(both):
    local, whole = both
    known = fit(local_case("ac1a_typical"))
    assert local.success
    assert local.cost > 4.0 * known.cost
    assert whole.cost == pytest.approx(known.cost, rel=1e-6)
    count = len(local.history)
    assert whole.history[:count] == local.history
    assert [line.phase == "search" for line in whole.history[count:]].index(True) == 0
    assert [line.number for line in whole.history] == list(range(len(whole.history)))
    assert whole.history[-1].cost == whole.cost
    assert [end.iteration for end in whole.phase_ends] == [
        end.iteration for end in local.phase_ends
    ]


@pytest.mark.long
def test_what_the_own_start_led_to_is_noted_with_what_the_record_says_of_it(both):
    local, whole = both
    (note,) = [text for text in whole.notes if "start of the case ended" in text]
    assert f"{local.cost / whole.cost:.2f} times this cost, which the record rejects" in note
    assert f"KF {local.values['KF']:.4g} (here {whole.values['KF']:.4g})" in note


@pytest.mark.long
def test_the_minima_of_a_search_are_counted_and_judged(both):
    local, whole = both
    assert local.minima is None
    lowest, *others = whole.minima.minima
    assert lowest.cost == whole.cost
    assert lowest.values == {name: whole.values[name] for name in whole.parameters}
    assert (lowest.chi_square, lowest.refuted) == (0.0, False)
    assert all(minimum.refuted for minimum in others)
    assert sum(minimum.starts for minimum in whole.minima.minima) == whole.minima.starts == 9
    assert whole.minima.ways[0] == "strategy"
    # twice the difference of the costs in variances of white residuals
    freedom = len(whole.comparison.time) - len(whole.parameters)
    rise = (others[0].cost / lowest.cost - 1.0) * freedom
    assert others[0].chi_square == pytest.approx(rise, rel=0.02)


@pytest.mark.long
def test_a_minimum_that_the_record_does_not_refute_is_named():
    result = fit(local_case("ac8b_unit2"), search="global")
    likely = [minimum for minimum in result.minima.minima if not minimum.refuted]
    assert len(likely) == 2
    (note,) = [text for text in result.notes if "rejects no point" in text]
    assert any("1.003 times the lowest one:" in text for text in result.notes)
    ends = sorted(minimum.values["KPR"] for minimum in likely)
    assert f"KPR {rounded_value(ends[0])} ... {rounded_value(ends[1])}" in note


def test_starts_for_a_recorded_event_have_a_stable_rest_where_the_bounds_hold_one(tmp_path):
    recorded(tmp_path, lengths=(8.0,))
    case = load_case(set_case(tmp_path, count=1))
    problem = fitted(case)[1]
    residuals = problem.residuals
    assert residuals.growth(residuals.start) > UNSTABLE  # TB and TC are exchanged
    drawn = [residuals.growth(point) > UNSTABLE for point in spread(residuals.bounds, COUNT)]
    assert sum(drawn) > 0
    points = further_starts(problem, COUNT, None).points
    assert sum(residuals.growth(point) > UNSTABLE for point in points) < sum(drawn)
