"""Intervals of a fit: linear theory where it serves, profiles and their hulls where not."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
from places import CONFIGS

import exfit.workflows as workflows
from exfit.case.load import load_case
from exfit.estimate import CostProfile, ProfileEnd, least_squares
from exfit.fitting.global_search import SearchResult
from exfit.fitting.parameters import UNIT, FreeParameter
from exfit.fitting.search import fitted, names_of_records, search
from exfit.fitting.uncertainty import not_served_by_linear_theory
from exfit.inference.confidence import Uncertainty
from exfit.results.intervals.determination import (
    FoundMinimum,
    determination,
    limits_of,
    of_profiles,
    uncertainty_of_solution,
    with_profile_intervals,
    without_limits_of_others,
)
from exfit.workflows.fit_run import INTERRUPTED_AFTERWARDS

RISE, BOUND, FLAT = ProfileEnd.RISE, ProfileEnd.BOUND, ProfileEnd.FLAT
KNOWN = ProfileEnd.KNOWN
KA = FreeParameter("KA", 200.0, 20.0, 2000.0, logarithmic=True)
LINEAR = Uncertainty(10.0, 0.05, (180.0, 220.0), None, "linear")


def case_of(name, **options):
    """Return a sample case with a global search from few starts."""
    case = load_case(CONFIGS / f"{name}.yaml")
    settings = {"search": "global", "starts": 2, **options}
    return replace(case, estimate=case.estimate.model_copy(update=settings))


def profile_with(low, high, ends=(RISE, RISE)):
    """Return a profile of KA whose interval has these limits, None where it is open."""
    limits = [None if limit is None else np.log(limit) for limit in (low, high)]
    x = np.array([np.log(200.0)])
    return CostProfile(0, x, np.ones(1), x[None], *limits, ends, x, 1.0, False)


def local_end(residuals):
    """Return the end of the descent from the start."""
    return least_squares(
        residuals, residuals.start, residuals.exact, residuals.bounds, x_scale=UNIT
    )


SECOND = {"KPR": 75.7, "KIR": 2.232, "KDR": 22.4, "TDR": 0.2038, "TE": 1.637, "KC": 0.0055,
          "KD": 0.0628}  # fmt: skip


@pytest.fixture(scope="module")
def unit2():
    """AC8B with KD on its bound; a second minimum, with KC on its own, is not refuted."""
    case = case_of("ac8b_unit2")
    setups, problem = fitted(case)
    residuals, of_record = problem.compressed, names_of_records(setups)
    second = np.array([free.scaled(SECOND[free.name]) for free in residuals.free])
    solution, other = (
        least_squares(residuals, x, residuals.exact, residuals.bounds, x_scale=UNIT)
        for x in (residuals.start, second)
    )
    linear = uncertainty_of_solution(problem, solution.x, of_record)
    minima = [FoundMinimum(end.x, end.cost) for end in (solution, other)]
    determined = with_profile_intervals(
        residuals, minima[0], minima[1:], linear, of_record, lambda _: None
    )
    return residuals, minima, linear, determined.uncertainty


def test_an_interval_is_that_of_the_profile():
    uncertainty = of_profiles(LINEAR, KA, [profile_with(150.0, 260.0)])
    assert uncertainty.interval == pytest.approx((150.0, 260.0))
    assert (uncertainty.method, uncertainty.why) == ("profile", None)
    assert uncertainty.std_error == LINEAR.std_error
    assert uncertainty.determined


def test_of_several_minima_the_interval_is_the_hull():
    about = [profile_with(150.0, 260.0), profile_with(90.0, None, (RISE, KNOWN))]
    uncertainty = of_profiles(LINEAR, KA, about)
    assert uncertainty.interval == pytest.approx((90.0, 260.0))
    assert (uncertainty.method, uncertainty.why) == ("hull", None)
    within = of_profiles(LINEAR, KA, [profile_with(150.0, 260.0), profile_with(160.0, 250.0)])
    assert within.interval == pytest.approx((150.0, 260.0))
    assert within.method == "profile"


@pytest.mark.parametrize(
    ("low", "high", "ends", "why"),
    [
        (None, 260.0, (BOUND, RISE), "has no lower limit: the record does not exclude its min 20"),
        (150.0, None, (RISE, FLAT), "has no upper limit: the cost hardly rises"),
        (
            150.0,
            None,
            (RISE, ProfileEnd.SPENT),
            "has no upper limit: its profile ended at its budget (estimate.iterations)",
        ),
        (
            None,
            None,
            (ProfileEnd.FAILED, BOUND),
            "has no lower limit: there is no response beyond and has no upper limit: the record "
            "does not exclude its max 2000",
        ),
    ],
)
def test_an_open_side_has_a_reason(low, high, ends, why):
    uncertainty = of_profiles(LINEAR, KA, [profile_with(low, high, ends)])
    if low is None and high is None:
        assert uncertainty.interval is None
    else:
        sides = zip(uncertainty.interval, (low, high), strict=True)
        assert all(mine is None if other is None else mine == pytest.approx(other)
                   for mine, other in sides)  # fmt: skip
    assert uncertainty.why == why
    assert not uncertainty.determined


def test_what_one_minimum_leaves_open_no_other_closes():
    about = [profile_with(150.0, 260.0), profile_with(90.0, None, (RISE, BOUND))]
    assert limits_of(about) == (pytest.approx(np.log(90.0)), inf)
    uncertainty = of_profiles(LINEAR, KA, about)
    assert uncertainty.interval == (pytest.approx(90.0), None)
    assert uncertainty.method == "hull"


def test_where_the_response_is_linear_no_interval_changes():
    local = workflows.fit(case_of("first_order"), search="local")
    result = workflows.fit(case_of("first_order"))
    for name, parameter in result.parameters.items():
        assert parameter.interval_method == "linear"
        assert parameter.interval == pytest.approx(local.parameters[name].interval, rel=1e-6)


@pytest.mark.long
def test_a_parameter_on_its_bound_and_those_that_lean_on_it_are_profiled(unit2):
    residuals, minima, linear, uncertainty = unit2
    names = not_served_by_linear_theory(residuals, minima[0].x, linear, ())
    assert set(names) >= {"KPR", "KIR", "KDR", "TE", "KC", "KD"}
    for name, own in uncertainty.confidence.parameters.items():
        assert own.method in ("profile", "hull"), name
    assert not any("`exfit profile`" in sentence for sentence in uncertainty.sentences)
    assert uncertainty.confidence.parameters["KD"].interval[0] is None
    assert "KD has no lower limit: the record does not exclude its min 0.011" in (
        uncertainty.sentences
    )


@pytest.mark.long
def test_the_hull_holds_both_minima_within_the_bounds(unit2):
    residuals, minima, _, uncertainty = unit2
    for k, free in enumerate(residuals.free):
        own = uncertainty.confidence.parameters[free.name]
        low, high = own.interval
        low, high = free.low if low is None else low, free.high if high is None else high
        assert free.low <= low < high <= free.high
        for minimum in minima:
            assert low <= free.value(minimum.x[k]) * (1.0 + 1e-9)
            assert high >= free.value(minimum.x[k]) * (1.0 - 1e-9)


def test_a_local_search_has_no_profiles_and_no_interval_where_linear_theory_does_not_serve():
    result = workflows.fit(case_of("ac8b_unit2"), search="local")
    methods = {parameter.interval_method for parameter in result.parameters.values()}
    assert methods == {"linear", None}
    assert not any(parameter.interval for parameter in result.parameters.values())
    assert any("or `exfit profile`" in text for text in result.knowledge.sentences)


def test_a_search_that_ended_nowhere_has_no_intervals():
    setups, problem = fitted(case_of("first_order"))
    found = local_end(problem.compressed)
    best = found._replace(success=False)
    uncertainty = determination(
        problem, SearchResult(best, None, (), best), setups, True, lambda _: None
    ).uncertainty
    for parameter in uncertainty.confidence.parameters.values():
        assert parameter.interval is None
        assert parameter.why == "has no interval: the search did not end at a minimum"


@pytest.mark.long
def test_a_parameter_tied_to_one_on_its_bound_is_named_with_it(unit2):
    _, _, linear, _ = unit2
    tied = replace(linear, tied_to_bounds={"KPR": ("KD",)})
    parameters = without_limits_of_others(tied).confidence.parameters
    assert parameters["KPR"].interval is None
    assert parameters["KPR"].why == "has no interval: it is known only together with KD, on a bound"
    assert parameters["KIR"] == linear.confidence.parameters["KIR"]


def test_a_closed_profile_of_a_parameter_tied_to_a_bound_is_printed(unit2):
    _, _, _, profiled = unit2
    tied = replace(profiled, tied_to_bounds={"KPR": ("KD",), "KC": ("KD",)})
    parameters = without_limits_of_others(tied).confidence.parameters
    assert parameters["KPR"].interval == profiled.confidence.parameters["KPR"].interval
    assert profiled.confidence.parameters["KC"].interval[0] is None
    assert parameters["KC"].interval is None


@pytest.mark.long
def test_profiles_that_lead_to_a_lower_minimum_lead_the_fit_there(monkeypatch):
    def beside(case, problem, *rest):
        result = search(case, problem, *rest)
        x = result.best.x + np.array([0.0, 5e-7])
        cost = 0.5 * float(np.sum(problem.compressed(x) ** 2))
        return result._replace(best=result.best._replace(x=x, cost=cost), minima=None, place=None)

    monkeypatch.setattr(
        "exfit.results.intervals.determination.not_served_by_linear_theory", lambda *_: ("a",)
    )
    whole = workflows.fit(case_of("first_order"))
    monkeypatch.setattr("exfit.workflows.case_search.search", beside)
    result = workflows.fit(case_of("first_order"))
    assert result.cost == pytest.approx(whole.cost, rel=1e-9)
    assert result.values == pytest.approx(whole.values, rel=1e-7)
    assert result.nit > whole.nit
    assert result.parameters["a"].interval == pytest.approx(
        whole.parameters["a"].interval, rel=1e-7
    )


@pytest.mark.long
def test_an_interruption_of_the_profiles_keeps_the_intervals_that_are_whole(monkeypatch):
    monkeypatch.setenv("EXFIT_THREADS", "1")  # another thread might be done with its sides

    def watch(progress):
        if progress.stage == "profiling" and progress.done == 3:
            raise KeyboardInterrupt

    result = workflows.fit(case_of("ac8b_unit2", starts=1), search_progress=watch)
    assert result.interrupted
    assert result.success
    assert INTERRUPTED_AFTERWARDS in result.notes
    methods = [parameter.interval_method for parameter in result.parameters.values()]
    assert "linear" in methods
