"""The search from many starts, on problems whose minima are known."""

import signal
from threading import Event, Lock
from time import sleep

import numpy as np
import pytest
from known_minima import CERTIFIED
from scipy.stats import qmc
from tiers import few_of

from exfit.estimate import Descent, OneByOne, Stop, least_squares, multistart, spread
from exfit.estimate.lockstep import ABREAST

# the four zeros of Himmelblau's function (Himmelblau 1972), to the digits that are known
ZEROS = [(3.0, 2.0), (-2.805118, 3.131312), (-3.779310, -3.283186), (3.584428, -1.848126)]
BOX = (np.full(2, -6.0), np.full(2, 6.0))
COUNT = 40


def himmelblau(x):
    return np.array([x[0] ** 2 + x[1] - 11.0, x[0] + x[1] ** 2 - 7.0])


def himmelblau_slopes(x):
    return np.array([[2.0 * x[0], 1.0], [1.0, 2.0 * x[1]]])


HIMMELBLAU = (himmelblau, himmelblau_slopes, BOX)


def search(fun, jac, bounds, count=COUNT, *, x0=None, seed=1, **more):
    """Search from starts over the bounds, with the tolerances that tell minima apart."""
    running = {key: more.pop(key) for key in ("workers", "watch") if key in more}
    leg = Descent(functions=OneByOne(fun, jac), bounds=bounds, **{"ftol": 1e-8, **more})
    return multistart(spread(bounds, count, x0, seed), [leg], **running)


def two_valleys(x):
    """A minimum near 1 and a higher one near -1, of a curved record."""
    t = np.linspace(0.0, 1.0, 40)
    return np.concatenate([(x[0] ** 2 - 1.0) * t, 0.3 * (x[0] - 1.0) * np.ones(40) + 0.01 * t])


def two_valleys_slopes(x):
    t = np.linspace(0.0, 1.0, 40)
    return np.concatenate([2.0 * x[0] * t, np.full(40, 0.3)])[:, None]


def cost_of(fun, x):
    return 0.5 * float(np.sum(fun(x) ** 2))


def points_of(minima):
    return np.array([one.x for one in minima.minima])


def test_finds_every_minimum_and_counts_who_led_there():
    found = search(*HIMMELBLAU, COUNT)
    assert sum(one.starts for one in found.minima) == COUNT
    zeros = [one for one in found.minima if one.cost < 1e-12]
    assert sorted(one.x.round(3).tolist() for one in zeros) == sorted(np.round(ZEROS, 3).tolist())
    assert (found.failed, found.unrefined, found.interrupted) == (0, 0, False)


def test_the_lowest_minimum_comes_first():
    found = search(two_valleys, two_valleys_slopes, ([-3.0], [3.0]), COUNT)
    assert [round(one.x[0]) for one in found.minima] == [1, -1]
    costs = [one.cost for one in found.minima]
    assert costs == sorted(costs)


def test_every_minimum_is_the_result_that_its_best_start_led_to():
    found = search(two_valleys, two_valleys_slopes, ([-3.0], [3.0]), COUNT)
    for one in found.minima:
        assert one.x.tolist() == one.result.x.tolist()
        assert one.result.fun.tolist() == two_valleys(one.x).tolist()
        assert one.result.jac.tolist() == two_valleys_slopes(one.x).tolist()
        assert cost_of(two_valleys, one.x) == pytest.approx(one.cost, rel=1e-12)
        start, given = one.result.history[0].x, (two_valleys_slopes, ([-3.0], [3.0]))
        again = least_squares(two_valleys, start, *given, "lm-then-dgn", ftol=1e-8)
        assert again.x.tolist() == one.x.tolist()


def test_no_end_is_above_its_start():
    found = search(*HIMMELBLAU, COUNT)
    assert (found.end_costs <= found.start_costs).all()


@pytest.mark.parametrize("workers", few_of([2, 1, 5], 1))
def test_a_run_repeats_whatever_the_threads(workers):
    first, again = search(*HIMMELBLAU, COUNT), search(*HIMMELBLAU, COUNT, workers=workers)
    assert points_of(first).tolist() == points_of(again).tolist()
    assert [one.starts for one in first.minima] == [one.starts for one in again.minima]
    assert first.end_costs.tolist() == again.end_costs.tolist()


def test_another_seed_gives_other_starts():
    first, other = search(*HIMMELBLAU, COUNT), search(*HIMMELBLAU, COUNT, seed=2)
    assert not np.isin(first.start_costs, other.start_costs).any()


@pytest.mark.parametrize("count", [16, 64])
def test_the_starts_are_spread_evenly_over_the_bounds(count):
    starts = spread(BOX, count)
    assert starts.shape == (count, 2)
    # of a power of two of its points a Sobol sequence puts one into each such part of every side
    for side in starts.T:
        assert sorted(np.floor((side + 6.0) / 12.0 * count)) == list(range(count))


def test_starts_fill_pairs_of_sides_more_evenly_than_chance():
    """By the centred discrepancy: how far their share of a box is from its area."""
    starts = spread((np.zeros(30), np.ones(30)), 256)
    chance = np.random.default_rng(0).random((256, 30))
    pairs = [(k, k + 1) for k in range(29)]
    even, random = (
        np.mean([qmc.discrepancy(points[:, pair]) for pair in pairs]) for points in (starts, chance)
    )
    assert even < 0.25 * random


def test_the_users_own_start_is_the_first():
    start = [0.1, 0.0]  # near a summit: among the worst
    found = search(*HIMMELBLAU, x0=start)
    assert found.start_costs[0] == pytest.approx(cost_of(himmelblau, start))
    assert len(found.start_costs) == COUNT


def test_each_leg_goes_on_where_the_one_before_ended():
    """A first leg of another problem, whose only minimum is near one of the four, leads to it."""
    near = OneByOne(lambda x: x - [-3.0, 3.0], lambda x: np.eye(2))
    legs = [
        Descent(functions=near, bounds=BOX),
        Descent(functions=OneByOne(himmelblau, himmelblau_slopes), bounds=BOX),
    ]
    found = multistart(spread(BOX, COUNT), legs)
    (only,) = found.minima
    assert only.x == pytest.approx(ZEROS[1], abs=1e-5)
    assert only.starts == COUNT
    assert only.result.history[0].x == pytest.approx([-3.0, 3.0])


def test_a_leg_that_cannot_begin_is_left_out():
    nowhere = OneByOne(lambda x: x * np.nan, lambda x: np.eye(2))
    legs = [
        Descent(functions=nowhere, bounds=BOX),
        Descent(functions=OneByOne(himmelblau, himmelblau_slopes), bounds=BOX, ftol=1e-8),
    ]
    found, plain = multistart(spread(BOX, COUNT), legs), search(*HIMMELBLAU)
    assert found.end_costs.tolist() == plain.end_costs.tolist()


def test_starts_whose_first_leg_ends_alike_go_on_as_one():
    """The ends of one minimum of the first leg are merged, those of two minima are not."""
    counted = []

    def fun(x):
        counted.append(x)
        return himmelblau(x)

    hills = OneByOne(
        lambda x: np.append(x**2 - 9.0, 1.0), lambda x: np.vstack([np.diag(2.0 * x), np.zeros(2)])
    )
    legs = [
        Descent(functions=hills, bounds=BOX),
        Descent(functions=OneByOne(fun, himmelblau_slopes), bounds=BOX),
    ]
    each, calls = multistart(spread(BOX, COUNT), legs, workers=1), len(counted)
    merged = multistart(spread(BOX, COUNT), legs, merged=3.0, workers=1)
    assert len(counted) - calls < 0.25 * calls
    assert len(merged.minima) == len(each.minima) == 4
    assert [local.starts for local in merged.minima] == [local.starts for local in each.minima]
    assert np.sort(merged.end_costs) == pytest.approx(np.sort(each.end_costs), abs=1e-12)


@pytest.mark.parametrize("workers", few_of([3, 1], 1))
def test_each_search_goes_the_way_it_goes_alone(workers):
    together = search(*HIMMELBLAU, workers=workers)
    for x, cost in zip(spread(BOX, COUNT), together.end_costs, strict=True):
        alone = least_squares(himmelblau, x, himmelblau_slopes, BOX, "lm-then-dgn", ftol=1e-8)
        assert alone.cost == cost


def test_what_many_ask_for_is_asked_for_in_one_call():
    sizes = []

    class Counted(OneByOne):
        def residuals(self, points):
            sizes.append(len(points))
            return super().residuals(points)

    legs = [Descent(functions=Counted(himmelblau, himmelblau_slopes), bounds=BOX)]
    multistart(spread(BOX, 32), legs, workers=1)
    assert sizes[0] == 32
    assert np.mean(sizes) > 4.0


@pytest.mark.parametrize("kind", few_of(["nan", "infinite", "fails"], 1))
def test_starts_that_are_not_finite_are_dropped_and_counted(kind):
    def fun(x):
        if x[0] < 0.0:
            if kind == "fails":
                raise ZeroDivisionError
            return np.full(2, np.nan if kind == "nan" else np.inf)
        return himmelblau(x)

    found = search(fun, himmelblau_slopes, BOX, 64)
    assert found.failed == 32  # the sequence is balanced
    assert np.count_nonzero(np.isinf(found.start_costs)) == 32
    assert np.count_nonzero(np.isnan(found.end_costs)) == 32
    assert sum(one.starts for one in found.minima) == 32
    assert all(one.x[0] >= 0.0 for one in found.minima)


def test_where_nothing_is_finite_there_are_no_minima():
    found = search(lambda x: x * np.nan, himmelblau_slopes, BOX, 8)
    assert (found.minima, found.failed, found.unrefined) == ((), 8, 0)


def test_ends_along_a_flat_valley_are_one_minimum():
    # the product of the first two is all that is seen
    case = CERTIFIED["Misra1a"]
    center = np.log([25.0, 10.0, 5e-4])

    def fun(z):
        return case.fun(np.array([np.exp(z[0] + z[1]), np.exp(z[2])]))

    def jac(z):
        J = case.jac(np.array([np.exp(z[0] + z[1]), np.exp(z[2])]))
        first, second = J[:, 0] * np.exp(z[0] + z[1]), J[:, 1] * np.exp(z[2])
        return np.column_stack([first, first, second])

    found = search(fun, jac, (center - 1.0, center + 1.0), 30, x_scale=1.0)
    best = found.minima[0]
    assert best.starts == 30
    assert 2.0 * best.cost == pytest.approx(case.squares, rel=1e-7)


def test_minima_of_equal_cost_at_other_places_are_two():
    t = np.linspace(0.0, 1.0, 30)
    fun = lambda x: (x[0] ** 2 - 1.0) * (1.0 + t) + 0.1 * np.sin(40.0 * t)  # noqa: E731
    jac = lambda x: (2.0 * x[0] * (1.0 + t))[:, None]  # noqa: E731
    found = search(fun, jac, ([-3.0], [3.0]), 20)
    assert len(found.minima) == 2
    assert found.minima[0].x == pytest.approx(-found.minima[1].x, rel=1e-6)
    assert found.minima[0].cost == pytest.approx(found.minima[1].cost, rel=1e-9)


def test_watch_receives_how_far_the_search_is():
    seen = []
    found = search(*HIMMELBLAU, watch=seen.append)
    assert [progress.done for progress in seen] == list(range(1, COUNT + 1))
    assert {(progress.stage, progress.total) for progress in seen} == {("refining", COUNT)}
    best = [progress.best for progress in seen]
    assert best == sorted(best, reverse=True)
    assert best[-1] == found.minima[0].cost


@pytest.mark.parametrize("workers", few_of([1, 3], 1))
def test_an_interruption_from_watch_keeps_what_is_done(workers):
    def watch(progress):
        if progress.done >= 5:
            raise KeyboardInterrupt

    found = search(*HIMMELBLAU, 500, workers=workers, watch=watch)
    assert found.interrupted
    refined = np.count_nonzero(np.isfinite(found.end_costs))
    assert sum(minimum.starts for minimum in found.minima) == refined
    assert found.unrefined == 500 - refined
    assert 5 <= refined < 500


def test_an_interruption_of_the_first_refinement_keeps_its_best_point():
    costs, sent = [], Event()

    def fun(x):
        if costs and costs[-1] < 1.0 and not sent.is_set():
            sent.set()
            raise KeyboardInterrupt
        costs.append(cost_of(himmelblau, x))
        return himmelblau(x)

    result = search(fun, himmelblau_slopes, BOX, 1, x0=[0.0, 0.0])
    assert (result.minima, result.interrupted) == ((), True)
    assert result.best.stop is Stop.INTERRUPTED
    assert result.best.cost == pytest.approx(min(costs), rel=1e-12)
    assert result.best.history[0].cost == pytest.approx(costs[0], rel=1e-12)


def test_without_an_interruption_the_best_is_the_lowest_minimum():
    result = search(*HIMMELBLAU, COUNT)
    assert result.best is result.minima[0].result
    nothing = search(lambda x: x * np.nan, himmelblau_slopes, BOX, 8)
    assert nothing.best is None


@pytest.fixture
def heeded():
    """Heed SIGINT as a terminal's programme does: one in the background is told to ignore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("place", [10, 700])
@pytest.mark.usefixtures("heeded")
def test_a_signal_ends_the_threads_at_once(place):
    """What Ctrl-C does: the main thread is interrupted while others are in the middle of fun."""
    calls, released, once = [], Event(), Lock()

    def fun(x):
        calls.append(x)
        if len(calls) >= place:
            # another thread may have counted on in between: the first to come sends it
            if once.acquire(blocking=False):
                signal.raise_signal(signal.SIGINT)
            released.wait(0.002)
        return himmelblau(x)

    found = search(fun, himmelblau_slopes, BOX, 500, workers=3)
    assert found.interrupted
    after = len(calls)
    assert after < place + 3 * ABREAST  # what each thread is in the middle of
    sleep(0.1)
    assert len(calls) == after  # no thread goes on


@pytest.mark.parametrize("place", [10, 700])
def test_a_mistake_in_fun_is_raised_and_ends_the_threads(place):
    calls = []

    def fun(x):
        calls.append(x)
        if len(calls) >= place:
            raise LookupError("a mistake")
        return himmelblau(x)

    with pytest.raises(LookupError, match="a mistake"):
        search(fun, himmelblau_slopes, BOX, 500, workers=3)
    after = len(calls)
    sleep(0.1)
    assert len(calls) == after


def test_the_tolerances_reach_the_refinements():
    loose = search(*HIMMELBLAU, 8, max_iterations=1, method="lm")
    assert all(one.result.nit <= 1 for one in loose.minima)
    assert loose.end_costs.min() > 1e-12


def test_what_cannot_be_searched_is_refused():
    given = (himmelblau, himmelblau_slopes)
    with pytest.raises(ValueError, match="finite"):
        search(*given, (np.full(2, -6.0), np.full(2, np.inf)), 8)
    with pytest.raises(ValueError, match="count"):
        search(*given, BOX, 0)
    with pytest.raises(ValueError, match="outside"):
        search(*given, BOX, 8, x0=[7.0, 0.0])
    with pytest.raises(ValueError, match="exceeds"):
        search(*given, (BOX[1], BOX[0]), 8)


def test_an_end_that_did_not_converge_says_so():
    found = search(*HIMMELBLAU, 1, max_iterations=0)
    assert [one.result.success for one in found.minima] == [False]
    assert found.end_costs.tolist() == found.start_costs.tolist()
