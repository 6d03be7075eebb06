"""Searches advanced together: each gets its own answers, and goes the way it goes alone."""

import numpy as np
import pytest

from exfit.estimate.lockstep import ABREAST, finish, finish_all
from exfit.estimate.problem import (
    JacobianAt,
    OneByOne,
    ResidualsAt,
    SingularValuesOf,
    TriangleOf,
)

LINE = OneByOne(lambda x: np.array([x[0] - 1.0, 2.0 * x[0]]), lambda x: np.array([[1.0], [2.0]]))
PARABOLA = OneByOne(lambda x: x**2, lambda x: np.diag(2.0 * x))


def all_kinds(functions, x):
    """Ask once for everything there is to ask for."""
    here, there = yield ResidualsAt(functions, [x, x + 1.0])
    jacobian = yield JacobianAt(functions, x)
    triangle = yield TriangleOf(np.column_stack([jacobian, here]))
    singular = (yield SingularValuesOf(triangle))[1]
    return here, there, jacobian, singular


@pytest.mark.parametrize("workers", [1, 2, 3])
def test_every_search_gets_the_answers_to_its_own_questions(workers):
    """Of different functions, and of different shapes."""
    tasks = [(functions, np.array([0.5 * k])) for k in range(20) for functions in (LINE, PARABOLA)]
    ends = {}
    assert finish_all([all_kinds(*task) for task in tasks], workers, ends.__setitem__)
    for place, (functions, x) in enumerate(tasks):
        here, there, jacobian, singular = ends[place]
        assert here.tolist() == functions.fun(x).tolist()
        assert there.tolist() == functions.fun(x + 1.0).tolist()
        assert jacobian.tolist() == functions.jac(x).tolist()
        both = np.column_stack([jacobian, here])
        assert singular == pytest.approx(np.linalg.svd(both)[1], abs=1e-12)


def test_one_alone_gets_the_same_bits_as_in_a_stack():
    rng = np.random.default_rng(3)
    tasks = [(PARABOLA, rng.standard_normal(4)) for _ in range(10)]
    ends = {}
    finish_all([all_kinds(*task) for task in tasks], 1, ends.__setitem__)
    for place, task in enumerate(tasks):
        for alone, together in zip(finish(all_kinds(*task)), ends[place], strict=True):
            assert np.array_equal(alone, together)


def test_a_search_that_ends_leaves_its_place_to_the_next():
    sizes = []

    class Counted(OneByOne):
        def residuals(self, points):
            sizes.append(len(points))
            return super().residuals(points)

    def asking(times):
        for _ in range(times):
            yield ResidualsAt(counted, [np.ones(1)])

    counted = Counted(lambda x: x)
    finish_all([asking(1) for _ in range(2 * ABREAST)] + [asking(2)], 1, lambda place, end: None)
    assert sizes == [ABREAST, ABREAST, 1, 1]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_interruption_reaches_all_under_way_and_drops_the_others(workers):
    begun, ends = [], {}

    def endless(place):
        begun.append(place)
        try:
            while True:
                yield ResidualsAt(LINE, [np.zeros(1)])
        except KeyboardInterrupt:
            return "cut short"

    def interrupting():
        yield ResidualsAt(LINE, [np.zeros(1)])
        raise KeyboardInterrupt

    searches = [interrupting(), *(endless(place) for place in range(1, 300))]
    assert not finish_all(searches, workers, ends.__setitem__)
    assert ends == dict.fromkeys(begun, "cut short")
    assert 1 <= len(begun) < 299


@pytest.mark.parametrize("workers", [1, 2])
def test_a_mistake_in_one_search_is_raised(workers):
    def mistaken():
        yield ResidualsAt(LINE, [np.zeros(1)])
        raise LookupError("a mistake")

    searches = [all_kinds(LINE, np.zeros(1)), mistaken()]
    with pytest.raises(LookupError, match="a mistake"):
        finish_all(searches, workers, lambda place, end: None)


def test_one_that_is_interrupted_with_nothing_to_show_raises():
    def interrupted():
        yield ResidualsAt(LINE, [np.zeros(1)])
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        finish(interrupted())
