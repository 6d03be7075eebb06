"""Profile likelihood against linear theory and the published intervals of Bates & Watts 1988."""

from math import inf

import numpy as np
import pytest
from more_garbow_hillstrom import numbers
from scipy.stats import t as student

from exfit.estimate import LowerMinimum, OneByOne, ProfileEnd, least_squares, profile, profiles
from exfit.estimate.lockstep import finish
from exfit.estimate.problem import checked
from exfit.estimate.profiling import finish_sides, sides_of, valley_about

FREE = (-np.inf, np.inf)

# initial velocities with the enzyme treated with Puromycin (Bates & Watts 1988, A1.3)
CONCENTRATION = np.repeat([0.02, 0.06, 0.11, 0.22, 0.56, 1.10], 2)
RATE = numbers("76 47 97 107 123 139 159 152 191 201 207 200")


def michaelis_menten(x):
    return x[0] * CONCENTRATION / (x[1] + CONCENTRATION) - RATE


def michaelis_menten_slopes(x):
    share = CONCENTRATION / (x[1] + CONCENTRATION)
    return np.column_stack([share, -x[0] * share / (x[1] + CONCENTRATION)])


ENZYME = (michaelis_menten, michaelis_menten_slopes)
BOUNDS = (np.array([1.0, 1e-4]), np.array([1e3, 10.0]))


def enzyme_minimum():
    return least_squares(michaelis_menten, [205.0, 0.08], michaelis_menten_slopes, BOUNDS)


def rise_of(found, level=0.95):
    freedom = len(found.fun) - len(found.x)
    variance = 2.0 * found.cost / freedom
    return 0.5 * variance * student.ppf(0.5 + 0.5 * level, freedom) ** 2


def rises_of(found):
    """Return the same rise for both parameters."""
    return dict.fromkeys((0, 1), rise_of(found))


def linear(seed, samples=30, count=4):
    """Return a random linear problem and its minimum."""
    rng = np.random.default_rng(seed)
    J, b = rng.normal(size=(samples, count)), rng.normal(size=samples)
    return lambda x: J @ x - b, lambda x: J, np.linalg.lstsq(J, b)[0], J


@pytest.mark.parametrize("seed", range(5))
def test_on_a_linear_problem_the_interval_is_that_of_linear_theory(seed):
    fun, jac, x, J = linear(seed)
    rise = 0.7
    half = np.sqrt(2.0 * rise * np.diag(np.linalg.inv(J.T @ J)))
    for k, one in enumerate(profiles(OneByOne(fun, jac), x, dict.fromkeys(range(4), rise), FREE)):
        assert one.ends == (ProfileEnd.RISE, ProfileEnd.RISE)
        assert one.low == pytest.approx(x[k] - half[k], abs=1e-3 * half[k])
        assert one.high == pytest.approx(x[k] + half[k], abs=1e-3 * half[k])


@pytest.mark.parametrize("seed", range(5))
def test_on_a_linear_problem_the_profile_is_a_parabola(seed):
    fun, jac, x, J = linear(seed)
    one = profile(fun, jac, x, 1, FREE, 0.7)
    curvature = 1.0 / np.linalg.inv(J.T @ J)[1, 1]
    expected = one.cost + 0.5 * curvature * (one.at - x[1]) ** 2
    assert one.costs == pytest.approx(expected, abs=1e-3 * 0.7)


@pytest.mark.parametrize("seed", range(3))
def test_on_a_linear_problem_either_side_takes_as_many_evaluations(seed):
    """What is known of one step tells the next, downwards as upwards."""
    fun, jac, x, _ = linear(seed)
    below, above = [], []

    def counted(z):
        (below if z[1] < x[1] else above).append(z)
        return fun(z)

    profile(counted, jac, x, 1, FREE, 0.7)
    assert len(below) == pytest.approx(len(above), abs=4)


def test_a_minimum_lower_by_what_a_search_leaves_moves_no_profile():
    fun, jac, x, J = linear(7, count=1)
    rise = 0.7
    # two steps of a hundred to the rise: the first step falls, by less than counts
    left = x.copy()
    left[0] += 0.02 * np.sqrt(2.0 * rise * np.linalg.inv(J.T @ J)[0, 0])
    one = profile(fun, jac, left, 0, FREE, rise, points=100)
    assert np.min(one.costs) < one.cost
    assert not one.moved


@pytest.mark.parametrize("points", [1, 2, 10])  # few are far apart: it takes refits in between
@pytest.mark.parametrize(("index", "low", "high"), [(0, 197.3, 229.3), (1, 0.0469, 0.0862)])
def test_the_intervals_of_puromycin_are_the_published_ones(index, low, high, points):
    # profile t at 95 %, Bates & Watts 1988, chapter 6; the last digit is rounded
    found = enzyme_minimum()
    one = profile(*ENZYME, found.x, index, BOUNDS, rise_of(found), points=points)
    digit = 0.1 if index == 0 else 1e-4
    assert one.low == pytest.approx(low, abs=0.5 * digit)
    assert one.high == pytest.approx(high, abs=0.5 * digit)


@pytest.mark.parametrize("level", [0.5, 0.95, 0.999])
@pytest.mark.parametrize("index", [0, 1])
def test_at_the_ends_of_the_interval_a_refit_costs_the_rise(index, level):
    found = enzyme_minimum()
    rise = rise_of(found, level)
    one = profile(*ENZYME, found.x, index, BOUNDS, rise)
    rest = 1 - index
    for at in (one.low, one.high):

        def fun(z, at=at):
            return michaelis_menten([at, z[0]] if index == 0 else [z[0], at])

        cost = least_squares(fun, found.x[rest], "3-point", x_scale=found.x[rest]).cost
        assert np.sqrt((cost - found.cost) / rise) == pytest.approx(1.0, abs=2e-3)


@pytest.mark.parametrize("index", [0, 1])
def test_a_profile_has_points_enough_for_a_figure_that_shows_the_crossings(index):
    found = enzyme_minimum()
    rise = rise_of(found)
    one = profile(*ENZYME, found.x, index, BOUNDS, rise)
    for beyond in (one.at < one.low, one.at > one.high):
        assert np.count_nonzero(beyond) >= 1
    for side in (one.at <= found.x[index], one.at >= found.x[index]):
        assert 5 <= np.count_nonzero(side) <= 9  # those near the crossing come on top
        assert np.max(np.diff(np.sort(np.sqrt(np.maximum(one.costs[side] - one.cost, 0.0))))) < (
            0.3 * np.sqrt(rise)
        )
    assert np.max(one.costs) < one.cost + 1.7 * rise  # 1.3 in the root of the rise
    assert (np.diff(one.at) > 0.0).all()
    assert one.xs[:, index] == pytest.approx(one.at, rel=1e-12)


def test_the_costs_are_those_of_the_points():
    found = enzyme_minimum()
    one = profile(*ENZYME, found.x, 1, BOUNDS, rise_of(found))
    costs = [0.5 * np.sum(michaelis_menten(x) ** 2) for x in one.xs]
    assert one.costs == pytest.approx(costs, rel=1e-12)


def test_a_parameter_alone_needs_no_refit():
    fun, jac = (lambda x: np.append(x - 1.0, 0.5)), (lambda x: np.array([[1.0], [0.0]]))
    one = profile(fun, jac, [1.0], 0, FREE, 2.0)
    assert (one.low, one.high) == pytest.approx((-1.0, 3.0), abs=2e-3)


WIDE = np.array([5.0, 20.0, 20.0])  # so that the others do not meet their bounds first


@pytest.mark.parametrize(
    ("bounds", "end"), [(FREE, ProfileEnd.FLAT), ((-WIDE, WIDE), ProfileEnd.BOUND)]
)
def test_a_parameter_that_the_others_make_up_for_has_no_interval(bounds, end):
    # only the sum of the first two is seen
    times = np.linspace(0.0, 1.0, 20)
    J = np.column_stack([times, times, np.ones(20)])
    b = J @ [0.5, 0.5, 1.0] + np.sin(40.0 * times)
    fun, jac = (lambda x: J @ x - b), (lambda x: J)
    x = least_squares(fun, np.zeros(3), jac).x
    one = profile(fun, jac, x, 0, bounds, 0.1)
    assert (one.low, one.high) == (None, None)
    assert one.ends == (end, end)
    assert one.costs == pytest.approx(one.cost, abs=1e-4 * 0.1)  # what a refit may leave


def test_a_side_that_meets_a_bound_first_has_no_end():
    fun, jac, x, J = linear(3)
    half = np.sqrt(2.0 * 0.7 * np.linalg.inv(J.T @ J)[2, 2])
    low, high = np.full(4, -10.0), np.full(4, 10.0)
    low[2], high[2] = x[2] - 0.5 * half, x[2]
    one = profile(fun, jac, x, 2, (low, high), 0.7)
    assert one.ends == (ProfileEnd.BOUND, ProfileEnd.BOUND)
    assert (one.low, one.high) == (None, None)
    assert one.at[0] == low[2]  # exactly
    assert one.at[-1] == x[2]
    assert one.costs[0] == pytest.approx(one.cost + 0.25 * 0.7, rel=1e-3)


def test_residuals_that_are_not_finite_end_a_side():
    def fun(x):
        return np.append(x - 1.0, 0.1) if x[0] > 0.5 else np.full(2, np.nan)

    one = profile(fun, lambda x: np.array([[1.0], [0.0]]), [1.0], 0, FREE, 2.0)
    assert one.ends == (ProfileEnd.FAILED, ProfileEnd.RISE)
    assert one.low is None
    assert one.at[0] == pytest.approx(0.5, abs=0.05)


def test_a_start_beside_the_minimum_is_noticed_and_moved():
    found = enzyme_minimum()
    rise = rise_of(found)
    here = profile(*ENZYME, found.x, 1, BOUNDS, rise)
    beside = profile(*ENZYME, found.x * [1.0, 1.1], 1, BOUNDS, rise)
    assert not here.moved
    assert beside.moved
    assert beside.x == pytest.approx(found.x, rel=1e-4)
    assert (beside.low, beside.high) == pytest.approx((here.low, here.high), rel=2e-3)


def test_a_profile_alone_is_the_same_as_among_others():
    found = enzyme_minimum()
    stack = profiles(OneByOne(*ENZYME), found.x, rises_of(found), BOUNDS)
    for index, among in enumerate(stack):
        alone = profile(*ENZYME, found.x, index, BOUNDS, rise_of(found))
        assert alone.xs.tolist() == among.xs.tolist()
        assert (alone.low, alone.high) == (among.low, among.high)


def test_each_parameter_has_a_rise_of_its_own():
    found = enzyme_minimum()
    rises = {0: rise_of(found, 0.5), 1: rise_of(found, 0.99)}
    for one in profiles(OneByOne(*ENZYME), found.x, rises, BOUNDS):
        alone = profile(*ENZYME, found.x, one.index, BOUNDS, rises[one.index])
        assert (one.low, one.high) == (alone.low, alone.high)


@pytest.mark.parametrize("index", [0, 1])
def test_few_evaluations_are_enough(index):
    """From point to point the bend of the profile is followed: most refits need no step."""
    found, calls = enzyme_minimum(), []

    def fun(x):
        calls.append(x)
        return michaelis_menten(x)

    profile(fun, michaelis_menten_slopes, found.x, index, BOUNDS, rise_of(found))
    assert len(calls) <= 20


@pytest.mark.parametrize("index", [0, 1])
def test_a_side_whose_iterations_are_spent_is_open_and_others_do_not_depend_on_it(index):
    found = enzyme_minimum()
    functions = OneByOne(*ENZYME)
    whole = profiles(functions, found.x, rises_of(found), BOUNDS)[index]
    ended = []
    for most in range(1, 12):
        own = profiles(functions, found.x, rises_of(found), BOUNDS, most=most)[index]
        sides = zip(own.ends, (own.low, own.high), (whole.low, whole.high), strict=True)
        for end, limit, of_whole in sides:
            assert limit == (None if end is ProfileEnd.SPENT else of_whole)
        ended.append(own.ends.count(ProfileEnd.SPENT))
    assert ended[0] == 2
    assert ended[-1] == 0
    assert ended == sorted(ended, reverse=True)


def test_where_the_others_lie_at_a_kink_the_interval_is_that_of_a_search_over_a_grid():
    """The least cost for a given x0 is where |x1 - x0| has its kink, or beside it."""
    rise = 2.0

    def fun(x):
        return np.array([x[0], abs(x[1] - x[0]) + 0.5 * x[0] + 1.0, x[1] - 0.3])

    def jac(x):
        sign = 1.0 if x[1] > x[0] else -1.0
        return np.array([[1.0, 0.0], [0.5 - sign, sign], [0.0, 1.0]])

    x0, x1 = np.linspace(-3.0, 3.0, 1501)[:, None], np.linspace(-3.0, 3.0, 1501)
    costs = 0.5 * (x0**2 + (abs(x1 - x0) + 0.5 * x0 + 1.0) ** 2 + (x1 - 0.3) ** 2)
    at, least = x0[:, 0], costs.min(axis=1)
    lowest = int(np.argmin(least))
    start = np.array([at[lowest], x1[np.argmin(costs[lowest])]])
    one = profile(fun, jac, start, 0, ((-3.0, -3.0), (3.0, 3.0)), rise, x_scale=1.0)
    within = at[least <= least.min() + rise]
    width = within[-1] - within[0]
    assert one.low == pytest.approx(within[0], abs=0.01 * width)
    assert one.high == pytest.approx(within[-1], abs=0.01 * width)


def test_about_a_second_minimum_the_rise_counts_from_the_lowest():
    """(x^2 - 1)^2 with a tilt: at x = 1 the minimum is the higher one."""
    tilt, rise = 0.05, 0.2

    def fun(x):
        return np.array([x[0] ** 2 - 1.0, tilt * (x[0] + 1.0)])

    def jac(x):
        return np.array([[2.0 * x[0]], [tilt]])

    box = ((-3.0,), (3.0,))
    low, high = (least_squares(fun, [start], jac, box) for start in (-1.1, 0.9))
    one = profiles(
        OneByOne(fun, jac), high.x, {0: rise}, box, beside=LowerMinimum(low.cost, {}), x_scale=1.0
    )[0]
    assert high.cost > low.cost
    for at in (one.low, one.high):
        assert 0.5 * np.sum(fun([at]) ** 2) == pytest.approx(low.cost + rise, abs=0.01 * rise)
    assert 0.0 < one.low < 1.0 < one.high
    about_lower = LowerMinimum(low.cost, {0: (-2.0, 0.5 * (one.low + high.x[0]))})
    again = profiles(OneByOne(fun, jac), high.x, {0: rise}, box, beside=about_lower, x_scale=1.0)[0]
    assert again.ends == (ProfileEnd.KNOWN, ProfileEnd.RISE)
    assert again.high == one.high


def test_threads_change_nothing():
    found = enzyme_minimum()
    alone, together = (
        profiles(OneByOne(*ENZYME), found.x, rises_of(found), BOUNDS, workers=workers)
        for workers in (1, 4)
    )
    for one, other in zip(alone, together, strict=True):
        assert one.xs.tolist() == other.xs.tolist()
        assert (one.low, one.high) == (other.low, other.high)


def test_a_side_that_meets_a_lower_minimum_ends_no_other():
    """Else where the others end would depend on the threads that advance them."""
    found = enzyme_minimum()
    rises, box = rises_of(found), checked(found.x, BOUNDS, None)[1]
    aside = found.x * [1.0, 1.1]
    valley = finish(valley_about(OneByOne(*ENZYME), box, False, 5, aside, inf))
    limit = valley.lowest - 1e-3 * max(rises.values())
    together, alone = sides_of(valley, rises, {}), sides_of(valley, rises, {})
    finish_sides(together, limit, 1, lambda _: None)
    for side in alone:
        finish_sides([side], limit, 1, lambda _: None)
    assert len({side.spots[-1].cost < limit for side in alone}) == 2  # some meet it, some do not
    for side, own in zip(together, alone, strict=True):
        assert [spot.x.tolist() for spot in side.spots] == [spot.x.tolist() for spot in own.spots]


@pytest.mark.parametrize("calls", [3, 6, 9])
def test_an_interruption_keeps_the_points_so_far(calls):
    found = enzyme_minimum()
    whole = profile(*ENZYME, found.x, 1, BOUNDS, rise_of(found))
    left = [calls]

    def fun(x):
        left[0] -= 1
        if left[0] < 0:
            raise KeyboardInterrupt
        return michaelis_menten(x)

    one = profile(fun, michaelis_menten_slopes, found.x, 1, BOUNDS, rise_of(found))
    assert ProfileEnd.INTERRUPTED in one.ends
    assert 1 <= len(one.at) < len(whole.at)
    assert set(one.at) <= set(whole.at)


def test_watch_receives_every_side_and_may_interrupt():
    found = enzyme_minimum()
    told = []

    def watch(progress):
        told.append(progress)
        if progress.done == 3:
            raise KeyboardInterrupt

    given = (OneByOne(*ENZYME), found.x, rises_of(found), BOUNDS)
    profiles(*given, workers=1, watch=lambda progress: told.append(progress))
    assert [one.done for one in told] == [1, 2, 3, 4]
    assert all(one.total == 4 and one.stage == "profiling" for one in told)
    told.clear()
    first, _ = profiles(*given, workers=1, watch=watch)
    assert len(told) == 3
    assert first.ends == (ProfileEnd.RISE, ProfileEnd.RISE)


def test_what_cannot_be_profiled_is_refused():
    found = enzyme_minimum()
    with pytest.raises(ValueError, match="rise"):
        profile(*ENZYME, found.x, 1, BOUNDS, 0.0)
    with pytest.raises(ValueError, match="outside"):
        profile(*ENZYME, [0.0, 0.1], 1, BOUNDS, 1.0)
    with pytest.raises(ValueError, match="not finite"):
        profile(lambda x: x * np.nan, lambda x: np.eye(2), [1.0, 1.0], 0, FREE, 1.0)
