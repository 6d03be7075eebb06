"""Profiles of a case's parameters, against linear theory where it holds and refits where not."""

import json

import numpy as np
import pytest
from cases import local_case

from exfit.errors import CaseError
from exfit.estimate import Stop, least_squares
from exfit.fitting.build import build_experiments
from exfit.fitting.parameters import UNIT
from exfit.fitting.problem import residuals_of
from exfit.fitting.residuals import Residuals
from exfit.workflows import case_search, fit
from exfit.workflows.profiles import profile

# what the record of AC1A was made with: sample_data/README.md
TRUTH = {"KA": 364.1523, "KF": 0.0413, "TE": 1.6724, "TF": 1.458, "TA": 0.0542, "KC": 0.486}
BESIDE = 1e-6  # of a, about two standard errors of first_order


case_of = local_case


@pytest.fixture(scope="module")
def nearly_linear():
    return profile(case_of("first_order"))


@pytest.fixture(scope="module")
def kd():
    return profile(case_of("ac1a_typical"), ["KD"])


def test_all_free_parameters_are_profiled_in_their_order(nearly_linear):
    assert [one.name for one in nearly_linear.profiles] == ["k", "a"]
    assert [one.unit for one in nearly_linear.profiles] == ["1/s", "1/s"]
    assert nearly_linear.name == "first_order"
    assert not nearly_linear.interrupted
    assert nearly_linear.notes == ()


def test_where_the_response_is_linear_the_interval_is_that_of_linear_theory(nearly_linear):
    for one in nearly_linear.profiles:
        low, high = one.linear
        # 1e-3 of the rise, and the curvature over an interval of a millionth
        assert one.low == pytest.approx(low, abs=3e-3 * (high - low))
        assert one.high == pytest.approx(high, abs=3e-3 * (high - low))
        assert one.ends == ("", "")


@pytest.mark.long
def test_channels_of_unlike_noise_each_count_by_their_own():
    """The machine's data show in vt, whose errors are slow, and in ifd, whose errors are white."""
    found = profile(case_of("machine_playback"))
    noise = fit(case_of("machine_playback")).knowledge.confidence.noise
    assert max(one.spread for one in noise) > 10.0 * min(one.spread for one in noise)
    assert len({one.rise for one in found.profiles}) == 3
    for one in found.profiles:
        low, high = one.linear
        # intervals of a percent or less
        assert one.low == pytest.approx(low, abs=0.02 * (high - low))
        assert one.high == pytest.approx(high, abs=0.02 * (high - low))


def test_a_profile_is_lowest_at_the_value_that_the_fit_finds(nearly_linear):
    found = fit(case_of("first_order"))
    assert nearly_linear.cost == pytest.approx(found.cost, rel=1e-9)
    for one in nearly_linear.profiles:
        assert one.value == pytest.approx(found.values[one.name], rel=1e-9)
        assert one.at[np.argmin(one.costs)] == one.value
        assert min(one.costs) == nearly_linear.cost
        assert (np.diff(one.at) > 0.0).all()
        below, above = one.costs[one.at <= one.value], one.costs[one.at >= one.value]
        assert (np.diff(below) < 0.0).all()
        assert (np.diff(above) > 0.0).all()


@pytest.mark.long
def test_kd_of_ac1a_is_open_down_to_its_bound(kd):
    (one,) = kd.profiles
    assert one.linear is None
    assert one.low is None
    assert one.ends == ("the record does not exclude its min 0.03556", "")
    assert one.at[0] == 0.03556
    assert one.costs[0] < kd.cost + one.rise
    # what the record was made with lies inside
    assert one.value < 0.4039 < one.high


@pytest.mark.long
def test_at_the_end_of_the_interval_no_refit_costs_less_than_the_rise(kd):
    (one,) = kd.profiles
    case = case_of("ac1a_typical")
    whole = residuals_of(case, build_experiments(case))
    free = [other for other in whole.free if other.name != "KD"]
    residuals = Residuals(whole.experiments, free, {**whole.fixed, "KD": one.high}, whole.ties)
    best = fit(case).values
    start = [np.log([values[other.name] for other in free]) for values in (best, TRUTH)]
    costs = [
        least_squares(residuals, x, residuals.exact, residuals.bounds, x_scale=UNIT).cost
        for x in (residuals.start, *start)
    ]
    # from afar they may end a little higher, at a kink
    assert 0.99 < (min(costs) - kd.cost) / one.rise < 1.1


def test_the_rise_and_the_linear_interval_are_those_of_the_fit(kd, nearly_linear):
    for name, one in (("ac1a_typical", kd), ("first_order", nearly_linear)):
        known = fit(case_of(name)).knowledge
        for each in one.profiles:
            assert each.rise == pytest.approx(known.rises[each.name], rel=1e-9)
            linear = known.confidence.parameters[each.name].interval
            assert each.linear == (linear if linear is None else pytest.approx(linear, rel=1e-9))


def test_an_unknown_parameter_is_refused_with_a_hint():
    with pytest.raises(CaseError, match=r"ac1a_typical.yaml: Kd: not free; did you mean KD\?"):
        profile(case_of("ac1a_typical"), ["Kd"])
    with pytest.raises(CaseError, match="TR: not free; ") as caught:
        profile(case_of("ac1a_typical"), ["TR", "KD", "zzz"])
    assert "zzz: not free; known: KA, KF, TE, TF, TA, KC, KD" in str(caught.value)


def test_an_interruption_keeps_what_is_done(monkeypatch):
    monkeypatch.setenv("EXFIT_THREADS", "1")  # another thread might be done with its sides
    told = []

    def watch(line):
        told.append(line)
        if line.stage == "profiling" and line.done == 1:
            raise KeyboardInterrupt

    found = profile(case_of("first_order"), progress=watch)
    assert found.interrupted
    assert [one.name for one in found.profiles] == ["k", "a"]
    ends = [end for one in found.profiles for end in one.ends]
    assert "" in ends
    assert all(len(one.at) >= 1 for one in found.profiles)
    for one in found.profiles:
        for side, end in zip((one.low, one.high), one.ends, strict=True):
            assert (side is None) == (end != "")


def test_the_progress_is_reported_in_sides():
    told = []
    profile(case_of("first_order"), ["a"], told.append)
    assert [(one.stage, one.done, one.total) for one in told] == [
        ("profiling", 1, 2),
        ("profiling", 2, 2),
    ]


@pytest.fixture
def search_ends(monkeypatch):
    """Return a function that makes the search of a fit end with other results."""
    search = case_search.search

    def replaced(change):
        def other(case, problem, *rest, **settings):
            found = search(case, problem, *rest, **settings)
            return found._replace(best=change(problem.residuals, found.best))

        monkeypatch.setattr(case_search, "search", other)

    return replaced


def test_profiles_are_about_a_lower_minimum_that_is_met_on_the_way(search_ends, nearly_linear):
    def beside(residuals, found):
        x = found.x + np.array([0.0, BESIDE])
        return found._replace(x=x, cost=0.5 * float(np.sum(residuals(x) ** 2)))

    search_ends(beside)
    found = profile(case_of("first_order"))
    told = "the profiles reached a lower minimum than the fit and describe that one"
    assert found.notes == (told,)
    assert found.cost == pytest.approx(nearly_linear.cost, rel=1e-6)
    for one, other in zip(found.profiles, nearly_linear.profiles, strict=True):
        assert (one.low, one.high) == pytest.approx((other.low, other.high), rel=1e-8)
        # the noise by which the rise is judged is that of the lower one too
        assert one.rise == pytest.approx(other.rise, rel=1e-4)
        assert one.linear == pytest.approx(other.linear, rel=1e-8)


def test_a_fit_that_did_not_end_at_a_minimum_is_noted(search_ends):
    search_ends(lambda _, found: found._replace(success=False, message="no luck"))
    found = profile(case_of("first_order"), ["a"])
    assert found.notes == ("the fit did not end at a minimum: no luck",)


def test_an_interruption_of_the_fit_ends_all(search_ends):
    search_ends(lambda _, found: found._replace(success=False, stop=Stop.INTERRUPTED))
    told = []
    with pytest.raises(KeyboardInterrupt):
        profile(case_of("first_order"), progress=told.append)
    assert told == []


def test_the_figures_survive_json(kd):
    content = json.loads(json.dumps(kd.as_json(), allow_nan=False))
    one = content["parameters"]["KD"]
    assert one["low"] is None
    assert one["linear"] is None
    assert one["high"] == kd.profiles[0].high
    assert len(one["at"]) == len(one["costs"]) == len(kd.profiles[0].at)
    assert content["level"] == 0.95
