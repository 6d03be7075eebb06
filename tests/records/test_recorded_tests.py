"""The tests of a recorder's file: which steps are one, their windows, their names."""

from itertools import pairwise

import numpy as np
import pytest
from columns import Columns
from tiers import few_of

from exfit.records.inspection import inspect
from exfit.records.recorded_tests import tests_of as recorded_tests
from exfit.records.recorded_tests import unique_names

INTERVAL, LENGTH = 0.02, 600.0  # s
LAG = 0.4  # s, of a second-order response without overshoot
NOISE = 2e-4  # pu


def stepped(time, steps, lag=LAG, tail=0.0):
    """Return a voltage (M,), pu, that follows steps (s, pu) of its reference.

    A share of each, the ``tail``, follows with a time constant of 6 s.
    """
    y = np.ones_like(time)
    for at, step in steps:
        since = np.maximum(time - at, 0.0)
        quick = (1.0 + since / lag) * np.exp(-since / lag)
        y += step * (time >= at) * (1.0 - (1.0 - tail) * quick - tail * np.exp(-since / 6.0))
    return y


def inspected(steps, seed=0, scale=1.0, name="vt", length=LENGTH, **response):
    """Return the inspection of a record with steps, and its tests."""
    time = np.arange(0.0, length, INTERVAL)
    y = stepped(time, steps, **response) + NOISE * np.random.default_rng(seed).standard_normal(
        time.size
    )
    inspection = inspect(Columns({"t": time, name: scale * y}))
    return inspection, recorded_tests(inspection)


def test_a_record_at_rest_has_no_test():
    assert inspected([])[1] == ()


@pytest.mark.parametrize("seed", few_of(range(5), 2))
def test_each_step_that_settles_is_a_test_with_a_window_of_its_own(seed):
    """Drawn steps at least 20 s apart: 8 times what the response takes."""
    rng = np.random.default_rng([seed, 15])
    instants = 30.0 + np.cumsum(rng.uniform(20.0, 120.0, 4))
    steps = [(at, rng.choice([-1.0, 1.0]) * rng.choice([0.02, 0.03, 0.05])) for at in instants]
    _, tests = inspected(steps, seed, 15.75, "Ugen (kV)")
    assert [test.at for test in tests] == pytest.approx(instants, abs=0.1)
    for test, (at, step), others in zip(tests, steps, without_each(instants), strict=True):
        start, end = test.window
        assert start < at - 2.0
        assert end > at + 5.0
        assert end - start < 25.0
        assert not [other for other in others if start - 8.0 * LAG < other < end]
        assert test.changes == pytest.approx((step,), rel=0.06)  # a share of the level at first


def test_windows_do_not_overlap():
    _, tests = inspected([(50.0 + 6.0 * k, (-1.0) ** k * 0.05) for k in range(6)])
    assert len(tests) == 6
    for before, after in pairwise(tests):
        assert before.steps[-1].at < before.window[1] <= after.window[0] < after.at


def without_each(values):
    """Return for each of some values the others."""
    return [[other for other in values if other != value] for value in values]


def test_a_step_and_its_return_before_it_settles_are_one_test():
    steps = [(50.0, 0.05), (58.0, -0.05), (200.0, 0.03)]
    _, (pulse, later) = inspected(steps, tail=0.1)
    assert len(pulse.steps) == 2
    assert pulse.name().startswith("pulse-up-")
    assert pulse.name().endswith("-at-50s")
    assert pulse.window[0] < 48.0
    assert pulse.window[1] > 66.0
    assert later.name() == "up-3%-at-200s"


def test_the_response_rests_where_its_window_begins():
    """The step before has settled: to a thousandth of it, which is far below the noise."""
    _, tests = inspected([(50.0, 0.05), (58.0, -0.05), (100.0, -0.02)], lag=0.6)
    for before, test in pairwise(tests):
        since = (test.window[0] - before.steps[-1].at) / 0.6
        assert (1.0 + since) * np.exp(-since) < 0.02
        assert test.window[0] <= test.at - 1.0


def test_a_name_takes_the_size_that_was_keyed_in():
    _, (test,) = inspected([(30.0, -0.0483)], length=60.0)
    assert test.name() == "down-4.8%-at-30s"
    assert test.name(-0.05) == "down-5%-at-30s"


def test_no_two_tests_have_one_name():
    _, tests = inspected([(50.0, 0.05), (100.0, -0.05)])
    assert unique_names(["a-at-50s", "a-at-50s"], tests) == ["a-at-50.0s", "a-at-100.0s"]
    assert unique_names(["a-at-50s"] * 2, [tests[0]] * 2) == ["a-at-50.0s-1", "a-at-50.0s-2"]
