"""`least_squares` as a drop-in for SciPy's, and beside it on problems with known minima."""

from functools import cache

import numpy as np
import pytest
from known_minima import CERTIFIED, TEXTBOOK
from more_garbow_hillstrom import rosenbrock
from scipy.optimize import least_squares as scipy_least_squares
from solver_ends import WANTED_DIGITS, certified_ends, published_ends

from exfit.estimate import Stop, least_squares

METHODS = ["dgn", "lm", "lm-then-dgn"]
CERTIFIED_METHODS = ["dgn", "lm", pytest.param("lm-then-dgn", marks=pytest.mark.long)]


def by_method(method):
    return lambda fun, x0, jac: least_squares(fun, x0, jac, method=method)


@cache
def on_certified_sets(method):
    return certified_ends(by_method(method))


@pytest.mark.long
@pytest.mark.parametrize("method", CERTIFIED_METHODS)
def test_finds_six_certified_digits_from_nearly_every_start(method):
    enough = [end.digits >= WANTED_DIGITS for end in on_certified_sets(method).values()]
    # the four that dgn does not reach are far starts, from which it has no radius to shrink
    assert len(enough) == 54
    assert sum(enough) >= 50


@pytest.mark.long
@pytest.mark.parametrize("method", CERTIFIED_METHODS)
def test_claims_no_success_where_nist_has_no_minimum(method):
    assert [start for start, end in on_certified_sets(method).items() if end.wrong] == []


@pytest.mark.long
def test_scipy_needs_no_fewer_evaluations_for_as_many_digits():
    # tolerances of SciPy that bring it to within two of the starts that lm solves
    tight = {"ftol": 1e-15, "xtol": 1e-15, "gtol": 1e-15, "x_scale": "jac"}
    theirs = certified_ends(
        lambda fun, x0, jac: scipy_least_squares(fun, x0, jac, method="trf", **tight)
    )
    assert sum(end.digits >= WANTED_DIGITS for end in theirs.values()) >= 50
    ours = on_certified_sets("lm").values()
    calls = [sum(end.nfev + end.njev for end in ends) for ends in (ours, theirs.values())]
    assert calls[0] <= calls[1]


@pytest.mark.long
def test_lm_ends_at_a_minimum_from_nearly_every_start_of_the_textbook():
    ends = published_ends(by_method("lm"))
    assert [start for start, end in ends.items() if end.wrong] == []
    # not where Bard's minimum has two variables at infinity, nor after 100 iterations
    assert sum(end.success for end in ends.values()) >= len(ends) - 6


def test_follows_a_bent_valley_with_half_the_jacobians():
    case = CERTIFIED["Bennett5"]
    bent = least_squares(case.fun, case.starts[1], case.jac, method="lm")
    straight = scipy_least_squares(case.fun, case.starts[1], case.jac, method="lm", max_nfev=2000)
    assert bent.success
    assert bent.njev < 0.5 * straight.njev


def test_a_variable_that_got_lost_is_no_success():
    # by dgn from afar the rate ends so high that no sample shows it
    case = CERTIFIED["BoxBOD"]
    result = least_squares(case.fun, case.starts[0], case.jac, method="dgn")
    assert result.stop is Stop.LOST
    assert not result.success


@pytest.mark.parametrize("method", ["auto", "lm", "lm-then-dgn", "dgn"])
def test_a_variable_that_moved_the_start_by_less_than_differences_err_may_get_lost(method):
    # at the start the last rate shows in one sample alone, and at the end in none
    case = CERTIFIED["MGH17"]
    result = least_squares(case.fun, case.starts[0], "2-point", method=method)
    assert result.stop is Stop.LOST


def test_a_variable_that_was_never_seen_does_no_harm():
    case = CERTIFIED["Misra1a"]
    fun = lambda x: case.fun(x[:2])  # noqa: E731
    result = least_squares(fun, [*case.starts[1], 7.0], method="lm")
    assert result.success
    assert result.x[2] == 7.0
    assert result.x[:2] == pytest.approx(case.minimum, rel=1e-6)


def test_a_start_far_out_does_not_make_a_small_cost_of_a_large_one():
    # the sum of squares at the start is 1e10 times that of the usual one
    start = 100.0 * np.array(TEXTBOOK["wood"].starts[0])
    result = least_squares(TEXTBOOK["wood"].fun, start, TEXTBOOK["wood"].jac, method="lm")
    assert result.success
    assert result.x == pytest.approx(np.ones(4), abs=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_coarse_residuals_waste_no_trials_at_the_floor(method):
    # rounded to 1e-7 of their size, so that f is known to 1e-13 or so, and ftol asks for more
    case = CERTIFIED["Misra1a"]
    step = 1e-7 * np.sqrt(case.squares)
    fun = lambda x: step * np.round(case.fun(x) / step)  # noqa: E731
    result = least_squares(fun, case.starts[1], case.jac, method=method)
    assert result.success
    assert [line.inner for line in result.history if line.capped is not None][-1] <= 1


CALLS = {
    "differences": {},
    "central differences": {"jac": "3-point"},
    "bounds": {"bounds": ([-2.0, -2.0], [0.5, 2.0])},
    "lm": {"method": "lm"},
    "scaled by J": {"x_scale": "jac"},
    "scaled": {"x_scale": [1.0, 2.0]},
    "tolerances": {"ftol": 1e-12, "xtol": 1e-12, "gtol": 1e-12},
    "arguments": {"args": (3.0,), "kwargs": {"right": 0.5}},
    "enough evaluations": {"max_nfev": 500},
}


def shifted(x, left=10.0, *, right=1.0):
    return np.array([left * (x[1] - x[0] ** 2), right - x[0]])


@pytest.mark.parametrize("options", CALLS.values(), ids=CALLS)
def test_takes_the_calls_of_scipy(options):
    ours = least_squares(shifted, [-1.2, 1.0], **options)
    theirs = scipy_least_squares(shifted, [-1.2, 1.0], **options)
    assert ours.success
    assert theirs.success
    assert ours.x == pytest.approx(theirs.x, abs=1e-5)
    assert ours.fun == pytest.approx(theirs.fun, abs=1e-5)
    assert ours.jac == pytest.approx(theirs.jac, rel=1e-4, abs=1e-4)
    assert ours.grad == pytest.approx(ours.jac.T @ ours.fun)
    assert list(ours.active_mask) == list(theirs.active_mask)
    assert ours.cost == pytest.approx(0.5 * np.sum(ours.fun**2), abs=1e-300)
    for name in ("nfev", "njev", "status", "message", "optimality"):
        assert hasattr(ours, name)


def test_jac_gets_the_same_arguments_as_fun():
    def jac(x, left, *, right):
        assert right == 0.5
        return np.array([[-2.0 * left * x[0], left], [-1.0, 0.0]])

    result = least_squares(shifted, [-1.2, 1.0], jac, args=(3.0,), kwargs={"right": 0.5})
    assert result.x == pytest.approx([0.5, 0.25])


@pytest.mark.parametrize("option", ["loss", "diff_step", "tr_solver", "verbose", "workers"])
def test_refuses_what_it_does_not_do(option):
    with pytest.raises(TypeError, match=option):
        least_squares(rosenbrock, [-1.2, 1.0], **{option: None})


@pytest.mark.parametrize("jac", ["2-point", TEXTBOOK["rosenbrock"].jac])
@pytest.mark.parametrize("most", [1, 2, 3, 7, 12])
@pytest.mark.parametrize("method", ["dgn", "lm", "auto"])
def test_never_calls_fun_more_often_than_allowed(method, most, jac):
    trials = []

    def fun(x):
        trials.append(x)
        return rosenbrock(x)

    result = least_squares(fun, [-1.2, 1.0], jac, method=method, max_nfev=most)
    for_the_jacobian_at_the_end = 2 if jac == "2-point" else 0
    assert result.nfev == len(trials) <= most + for_the_jacobian_at_the_end
    if not result.success:
        assert result.stop is Stop.EVALUATIONS
        costs = [0.5 * np.sum(rosenbrock(x) ** 2) for x in trials[:most]]
        assert result.cost <= (1.0 + 1e-6) * min(costs)  # a difference may be a hair lower
    assert result.grad == pytest.approx(result.jac.T @ result.fun)


def test_refuses_a_limit_without_an_evaluation():
    with pytest.raises(ValueError, match="max_nfev: 0 is less than 1"):
        least_squares(rosenbrock, [-1.2, 1.0], max_nfev=0)


def test_a_callback_ends_the_search_by_stop_iteration():
    seen = []

    def after_three(iteration):
        seen.append(iteration.cost)
        if len(seen) == 3:
            raise StopIteration

    result = least_squares(rosenbrock, [-1.2, 1.0], callback=after_three)
    assert result.stop is Stop.INTERRUPTED
    assert result.cost == min(seen)
