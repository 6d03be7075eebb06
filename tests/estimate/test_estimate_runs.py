"""What holds for every run of the estimator: its calls, its log, its end, its failures."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from known_minima import CERTIFIED, KNOWN, TEXTBOOK, random_problem
from more_garbow_hillstrom import beale, rosenbrock
from tiers import few_of

from exfit.estimate import STATUS, Descent, Stop, least_squares
from exfit.estimate.problem import OneByOne, half_square
from exfit.estimate.solver import STRATEGIES

EVERY_METHOD = list(STRATEGIES)
SAFE_METHODS = [method for method in STRATEGIES if method != "gn"]  # full steps may diverge


@dataclass(frozen=True)
class Watched:
    """A run on a random problem: its result, the points and costs tried, and the lines told."""

    found: object
    points: list
    costs: list
    lines: list


def watched(seed, method, jac):
    fun, exact, start, bounds = random_problem(seed)
    points, costs, lines = [], [], []

    def counted(x):
        points.append(x)
        costs.append(half_square(fun(x)))
        return fun(x)

    jac = exact if jac == "exact" else jac
    found = least_squares(counted, start, jac, bounds, method, callback=lines.append)
    return Watched(found, points, costs, lines)


def for_every_run(law):
    """Try a law on sixty random problems, methods and kinds of Jacobian."""
    given_runs = given(
        seed=st.integers(0, 2**32 - 1),
        method=st.sampled_from(EVERY_METHOD),
        jac=st.sampled_from(["2-point", "3-point", "exact"]),
    )
    return given_runs(law)


@pytest.mark.parametrize("method", [method for method in SAFE_METHODS if method != "robust"])
def test_a_trial_that_was_rejected_and_yet_is_the_best_is_the_result(method):
    """The full step to 1 gains a little, far less than promised; whatever is shorter loses.

    gn, with which robust begins, accepts it.
    """

    def fun(x):
        return np.where(x <= 0.0, 1.0, np.where(x < 0.9, 2.0, 1.0 - 1e-7))

    found = least_squares(fun, [0.0], lambda x: [[-1.0]], method=method, x_scale=1.0)
    assert found.history[-1].cost == found.history[0].cost == 0.5  # nothing was accepted
    assert found.x == pytest.approx([1.0])
    assert found.cost == pytest.approx(0.5 * (1.0 - 1e-7) ** 2, rel=1e-12)
    assert found.fun == pytest.approx(fun(found.x), rel=1e-12)


@for_every_run
def test_fun_is_never_called_outside_the_bounds_and_every_call_counts(seed, method, jac):
    low, high = random_problem(seed)[3]
    run = watched(seed, method, jac)
    assert all(np.all((low <= x) & (x <= high)) for x in run.points)
    assert run.found.nfev == len(run.points)


@pytest.mark.long
@pytest.mark.parametrize("method", few_of(EVERY_METHOD, 2))
def test_rounding_carries_no_call_across_a_bound(method):
    # the unit is far wider than the box: one-sided parabolas reach across all of it
    for low, high in np.random.default_rng(0).uniform([-1.0, 0.0], [0.0, 1.0], (100, 2)):
        points = []
        for start in (low, high):
            least_squares(
                lambda x, seen=points: seen.append(x[0]) or x,
                start,
                "3-point",
                (low, high),
                method,
                x_scale=1e9,
            )
        assert low <= min(points) <= max(points) <= high


@pytest.mark.parametrize("method", SAFE_METHODS)
@pytest.mark.parametrize("power", [-300, 180, 300])
def test_the_unit_of_the_residuals_changes_no_step(method, power):
    """A power of two changes no digit: of residuals as large as 1e90 no square may overflow."""
    for fun, start in (rosenbrock, [-1.2, 1.0]), (beale, [1.0, 1.0]):
        once = least_squares(fun, start, method=method, x_scale=1.0)
        times = least_squares(
            lambda x, fun=fun: fun(x) * 2.0**power, start, method=method, x_scale=1.0
        )
        assert times.nfev == once.nfev
        assert times.x == pytest.approx(once.x, rel=1e-9)


@pytest.mark.long
@for_every_run
def test_the_result_belongs_to_the_best_trial(seed, method, jac):
    fun, exact, *_ = random_problem(seed)
    run = watched(seed, method, jac)
    found = run.found
    assert found.cost == half_square(fun(found.x))
    assert found.cost <= run.costs[0]
    assert jac != "exact" or found.cost == min(run.costs)  # a point of a difference is no trial
    assert np.array_equal(found.fun, fun(found.x))
    assert found.grad == pytest.approx(found.jac.T @ found.fun, rel=1e-12)
    assert found.jac == pytest.approx(exact(found.x), rel=1e-5, abs=1e-5)


@for_every_run
def test_the_log_is_what_was_announced_numbered_from_the_start(seed, method, jac):
    run = watched(seed, method, jac)
    assert run.found.history == tuple(run.lines)
    assert [line.number for line in run.lines] == list(range(len(run.lines)))
    assert run.lines[0].cost == run.costs[0]
    starts = sum(np.isnan(line.damping) for line in run.lines)
    assert run.found.nit == len(run.lines) - starts


@for_every_run
def test_message_status_and_success_tell_the_same_reason(seed, method, jac):
    found = watched(seed, method, jac).found
    assert found.message == found.stop.value
    assert found.status == STATUS[found.stop]
    assert found.success == (found.status > 0)


@pytest.mark.parametrize("method", SAFE_METHODS)
@pytest.mark.parametrize("failure", [np.nan, np.inf, FloatingPointError, ZeroDivisionError])
def test_a_trial_that_blows_up_is_rejected(method, failure):
    def fragile(x):
        if x[1] < 0.9:
            if isinstance(failure, type):
                raise failure
            return np.full(2, failure)
        return rosenbrock(x)

    found = least_squares(
        fragile, [3.0, 5.0], TEXTBOOK["rosenbrock"].jac, method=method, x_scale=1.0
    )
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-6)
    assert all(np.isfinite(line.cost) for line in found.history)


@pytest.mark.parametrize("method", EVERY_METHOD)
@pytest.mark.parametrize("where", ["fun", "jac", "callback"])
@pytest.mark.parametrize("count", [1, 2, 3, 5])
def test_an_interruption_keeps_the_best_point(method, where, count):
    best, calls = [np.inf], {"fun": 0, "jac": 0, "callback": 0}

    def maybe(place):
        calls[place] += 1
        if place == where and calls[place] > count:
            raise KeyboardInterrupt

    def fun(x):
        maybe("fun")
        best[0] = min(best[0], half_square(beale(x)))
        return beale(x)

    def jac(x):
        maybe("jac")
        return TEXTBOOK["beale"].jac(x)

    found = least_squares(fun, [1.0, 1.0], jac, method=method, callback=lambda _: maybe("callback"))
    if calls[where] > count:
        assert found.stop is Stop.INTERRUPTED
        assert found.status < 0
    assert found.cost == best[0]
    assert found.cost == half_square(beale(found.x))


def test_an_interruption_before_the_first_point_goes_on_up():
    def fun(x):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        least_squares(fun, [1.0])


def line(x):
    return np.array([x[0] - 1.0, 2.0 * x[0] + 1.0])


def noisy_floor(x):
    """Rounded so coarsely that the last steps drown in it."""
    return np.round(np.array([x[0] - 1.0, x[0] ** 2 + 1.0]), 9)


def kinked(x):
    """Lowest at 0, where the derivative jumps."""
    return np.array([1.0 + 0.01 * abs(x[0]), x[0]])


def steeper(x):
    """Return the derivative from the right, also at 0: it promises 5e-5 of the cost."""
    return np.array([[0.01 if x[0] >= 0.0 else -0.01], [1.0]])


def walled(x):
    """Large whatever x is, and not to be had below 0.5, where the lowest point would be."""
    return np.array([1e3, x[0] if x[0] > 0.5 else np.nan])


def ended(stop):
    """A run that ends for the reason given."""
    jac = TEXTBOOK["rosenbrock"].jac
    start = [-1.2, 1.0]
    unsound = np.diag([1.0, 1e-9])
    case = CERTIFIED["Misra1a"]
    match stop:
        case Stop.GRADIENT:
            return least_squares(line, [3.0])
        case Stop.FLOOR:
            return least_squares(case.fun, case.starts[1], case.jac, ftol=1e-10, gtol=0.0)
        case Stop.STEP:
            return least_squares(case.fun, case.starts[1], case.jac, xtol=1e-3)
        case Stop.ITERATIONS:
            return least_squares(rosenbrock, start, jac, max_iterations=3)
        case Stop.EVALUATIONS:
            return least_squares(rosenbrock, start, jac, max_nfev=3)
        case Stop.LOST:
            far = CERTIFIED["BoxBOD"]  # by dgn, to a rate so high that no sample shows it
            return least_squares(far.fun, far.starts[0], far.jac, method="dgn")
        case Stop.INTERRUPTED:
            return least_squares(rosenbrock, start, jac, callback=interrupt)
        case Stop.JACOBIAN:
            return least_squares(rosenbrock, start, lambda x: np.full((2, 2), np.nan))
        case Stop.KINK:
            return least_squares(kinked, [1.0], steeper, method="dgn")
        case Stop.CREEPING:
            return least_squares(walled, [1.0], lambda x: np.array([[0.0], [1.0]]), method="dgn")
        case Stop.HIGH:  # of something else a minimum is known that is lower by far
            return Descent(functions=OneByOne(rosenbrock, jac), known=-1e4).run(start)
        case Stop.STALLED:
            return least_squares(rosenbrock, start, lambda x: -jac(x), method="dgn")
        case Stop.FULL_STEP:
            # so far out that the step, shortened once, still leads farther out
            return least_squares(np.arctan, [30.0], lambda x: np.diag(1 / (1 + x**2)), method="gn")
        case Stop.MATCH:
            return least_squares(rosenbrock, start, jac, matches=lambda r: bool(r @ r < 1.0))
        case Stop.FLAT:
            return least_squares(rosenbrock, start, jac, gtol=0.0, gtol_absolute=1.0)
        case Stop.ILL_CONDITIONED:
            # the scale is given: that of the columns would hide the difference
            return least_squares(
                lambda x: unsound @ x, [1.0, 1.0], lambda x: unsound, method="gn", x_scale=1.0
            )


def interrupt(_):
    raise KeyboardInterrupt


# no end of one search: inside it, or after several
INSIDE = (Stop.TRUSTED, Stop.UNCONFIRMED)


@pytest.mark.parametrize("stop", [s for s in Stop if s not in INSIDE])
def test_every_reason_to_stop_is_reachable_and_says_so(stop):
    found = ended(stop)
    assert found.stop is stop
    assert found.message == stop.value
    assert found.success == (STATUS[stop] > 0)
    at_minimum = (Stop.GRADIENT, Stop.FLOOR, Stop.STEP, Stop.KINK, Stop.CREEPING)
    assert found.success == (stop in (*at_minimum, Stop.MATCH, Stop.FLAT))


@pytest.mark.parametrize("method", SAFE_METHODS)
def test_a_minimum_where_the_derivative_jumps_counts_as_one(method):
    found = least_squares(kinked, [1.0], steeper, method=method)
    assert found.success
    assert abs(found.x[0]) < 1e-6


@pytest.mark.parametrize("method", few_of(EVERY_METHOD, 2))
def test_no_run_ends_with_an_inner_reason(method):
    for case in TEXTBOOK.values():
        assert (
            least_squares(case.fun, case.starts[0], case.jac, method=method).stop
            is not Stop.TRUSTED
        )


@pytest.mark.parametrize("method", SAFE_METHODS)
def test_a_start_at_the_minimum_stays_there(method):
    case = CERTIFIED["Misra1a"]
    found = least_squares(case.fun, case.minimum, case.jac, method=method)
    assert found.success
    assert found.x == pytest.approx(case.minimum, rel=1e-6)
    assert found.nfev <= 4
    exact = least_squares(rosenbrock, [1.0, 1.0], TEXTBOOK["rosenbrock"].jac, method=method)
    assert exact.success
    assert list(exact.x) == [1.0, 1.0]
    assert exact.nfev == 1


@pytest.mark.parametrize("method", ["dgn", "lm", "auto", "robust"])
def test_coarse_residuals_do_not_burn_the_iterations(method):
    found = least_squares(noisy_floor, [3.0], "3-point", method=method)
    assert found.x == pytest.approx(
        least_squares(lambda x: np.array([x[0] - 1.0, x[0] ** 2 + 1.0]), [3.0]).x, abs=1e-3
    )
    assert found.nit < 30


def test_full_steps_that_shrink_slowly_are_extrapolated():
    """Each is 0.6 of the one before, so that 36 of them would shrink to 1e-8."""
    found = least_squares(
        lambda x: np.array([x[0], 1.0 - 0.3 * x[0] ** 2]),
        [0.5],
        lambda x: np.array([[1.0], [-0.6 * x[0]]]),
        method="dgn",
    )
    assert found.success
    assert abs(found.x[0]) < 1e-7
    assert found.nit < 12


def phases(found):
    """The phases of a run, each as often as it was entered."""
    names = [line.phase for line in found.history[1:]]
    return [name for name, before in zip(names, [None, *names], strict=False) if name != before]


@pytest.mark.parametrize(
    ("method", "expected"),
    [
        ("gn", ["gn"]),
        ("dgn", ["dgn"]),
        ("lm", ["lm"]),
        ("lm-then-dgn", ["lm", "dgn"]),
        ("auto", ["dgn"]),
        ("robust", ["gn", "lm"]),
    ],
)
def test_each_method_goes_through_its_phases(method, expected):
    case = TEXTBOOK["osborne 1"]
    assert phases(least_squares(case.fun, case.starts[0], case.jac, method=method)) == expected


def test_auto_goes_on_until_the_match_is_good_enough():
    case = TEXTBOOK["osborne 1"]
    rms = np.sqrt(case.squares / 33)
    content = least_squares(case.fun, case.starts[0], case.jac, good_enough=1.01 * rms)
    greedy = least_squares(case.fun, case.starts[0], case.jac, good_enough=0.99 * rms)
    assert phases(content) == ["dgn"]
    assert phases(greedy)[:2] == ["dgn", "lm"]
    assert greedy.cost <= content.cost * (1.0 + 1e-12)
    restart = next(line for line in greedy.history if line.phase == "lm")
    assert np.array_equal(restart.x, case.starts[0])
    assert [line.number for line in greedy.history] == list(range(len(greedy.history)))
    assert greedy.nit == len(greedy.history) - 2  # two of the lines are starts


@pytest.mark.long
def test_the_cost_falls_within_every_phase():
    for case in KNOWN.values():
        for method in EVERY_METHOD:
            lines = least_squares(case.fun, case.starts[-1], case.jac, method=method).history
            for before, after in pairwise(lines):
                assert after.cost <= before.cost or np.isnan(after.damping)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"x0": [np.nan]}, "finite"),
        ({"x0": []}, "finite"),
        ({"x0": [[1.0]]}, "one dimension"),
        ({"x0": [1.0], "bounds": (2.0, 3.0)}, "lies outside"),
        ({"x0": [1.0], "bounds": (2.0, 1.0)}, "exceeds"),
        ({"x0": [1.0], "bounds": ([0.0, 0.0], 2.0)}, "bounds"),
        ({"x0": [1.0], "method": "newton"}, "newton"),
        ({"x0": [1.0], "jac": "4-point"}, "4-point"),
        ({"x0": [1.0], "x_scale": 0.0}, "x_scale"),
        ({"x0": [1.0], "fun": lambda x: [np.nan]}, "not finite"),
        ({"x0": [1.0], "fun": lambda x: x / 0}, "not finite"),
        ({"x0": [1.0], "fun": lambda x: [[1.0]]}, "one dimension"),
        ({"x0": [1.0], "jac": lambda x: np.ones((3, 1))}, "shape"),
    ],
)
def test_unusable_arguments_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        least_squares(**{"fun": line, **arguments})


def test_neither_the_result_nor_its_log_can_be_changed():
    found = least_squares(line, [3.0])
    for frozen in (found, *found.history):
        with pytest.raises(AttributeError):
            frozen.cost = 0.0


def test_every_reason_to_stop_has_a_status_of_its_own():
    assert set(STATUS) == set(Stop)
    assert len(set(STATUS.values())) == len(Stop)


@pytest.mark.parametrize("jac", ["2-point", "3-point"])
def test_a_box_as_narrow_as_rounding_fixes_its_variable(jac):
    start = np.array([1.0, 5.0])
    high = np.array([np.nextafter(1.0, 2.0), 9.0])
    found = least_squares(lambda x: x - 3.0, start, jac, (np.array([1.0, -9.0]), high))
    assert found.success
    assert found.x[1] == pytest.approx(3.0)
    assert 1.0 <= found.x[0] <= high[0]
