"""Which of several estimates differs from the others: how often by mistake, and how surely."""

import numpy as np
import pytest
from tiers import few_of

from exfit.inference.outliers import FEWEST, LEVEL, SHARE, Estimates, deviations

RUNS = 200
# of so many runs in which an outlier is called with probability LEVEL, four standard deviations
MOST_FALSE = LEVEL + 4.0 * np.sqrt(LEVEL * (1.0 - LEVEL) / RUNS)


def estimates(values, errors):
    return Estimates(values, errors, errors)


def drawn(rng, count, spread, uneven):
    """Return estimates of units that differ by a spread, with errors about 1."""
    errors = np.exp(uneven * rng.standard_normal(count))
    units = 200.0 + spread * rng.standard_normal(count)
    return estimates(units + errors * rng.standard_normal(count), errors)


@pytest.mark.long
@pytest.mark.parametrize("count", [FEWEST, 12])
@pytest.mark.parametrize("spread", [0.5, 3.0, 30.0])
@pytest.mark.parametrize("uneven", [0.0, 1.0])
def test_an_outlier_is_called_among_units_that_are_alike_no_more_often_than_stated(
    count, spread, uneven
):
    rng = np.random.default_rng([count, int(10 * spread), int(uneven)])
    called = [deviations(drawn(rng, count, spread, uneven)).outlier.any() for _ in range(RUNS)]
    assert np.mean(called) <= MOST_FALSE


@pytest.mark.parametrize(("count", "size"), [(FEWEST, 30.0), (6, 10.0), (8, 10.0), (30, 7.0)])
@pytest.mark.parametrize("spread", few_of([0.0, 5.0], 1))
def test_an_outlier_of_some_standard_deviations_is_found(count, size, spread):
    """In a study of 400 runs each of these was found in 97 % at least."""
    rng = np.random.default_rng(count)
    found = 0
    for _ in range(60):
        sisters = drawn(rng, count, spread, 0.0)
        sisters.values[1] += size * np.hypot(1.0, spread)
        found += deviations(sisters).outlier[1]
    assert found >= 51


def test_two_outliers_do_not_hide_each_other():
    rng = np.random.default_rng(4)
    values = 200.0 + rng.standard_normal(2 * SHARE)
    values[[2, 5]] += 40.0
    outlier = deviations(estimates(values, np.full(2 * SHARE, 0.1))).outlier
    assert np.flatnonzero(outlier).tolist() == [2, 5]


def test_a_wide_interval_excuses_what_a_narrow_one_does_not():
    values, errors = np.full(8, 200.0) + np.arange(8.0), np.full(8, 1.0)
    values[3] = 260.0
    assert deviations(estimates(values, errors)).outlier[3]
    errors[3] = 40.0
    assert not deviations(estimates(values, errors)).outlier.any()


def test_the_side_of_an_interval_that_faces_the_others_counts():
    values, errors = np.full(8, 200.0) + np.arange(8.0), np.full(8, 1.0)
    values[3], wide = 260.0, errors.copy()
    wide[3] = 40.0
    assert not deviations(Estimates(values, wide, errors)).outlier[3]
    assert deviations(Estimates(values, errors, wide)).outlier[3]


def test_vague_sisters_say_little_of_a_sharp_one():
    """A spread that vague estimates cannot show may well be there."""
    rng = np.random.default_rng(7)
    values, errors = 200.0 + 10.0 * rng.standard_normal(8), np.full(8, 10.0)
    values[0], errors[0] = float(np.mean(values[1:])) + 8.0, 0.1
    judged = deviations(estimates(values, errors))
    assert not judged.outlier[0]
    assert judged.probability[0] > 0.5


@pytest.mark.parametrize("factor", [1e-9, 1.0, -1e7])
def test_units_and_sign_make_no_difference(factor):
    rng = np.random.default_rng(3)
    values, errors = 5.0 + rng.standard_normal(9), np.exp(rng.standard_normal(9))
    values[4] = 60.0
    one = deviations(estimates(values, errors))
    other = deviations(estimates(values * factor, errors * abs(factor)))
    np.testing.assert_allclose(other.deviation, np.sign(factor) * one.deviation, rtol=1e-7)
    np.testing.assert_allclose(other.centre, one.centre * factor, rtol=1e-9)
    np.testing.assert_allclose(other.spread, one.spread * abs(factor), rtol=1e-7)
    assert (other.outlier == one.outlier).all()
    assert one.outlier[4]


def test_equal_errors_give_the_test_of_the_textbook():
    """With equal errors that the spread exceeds, Grubbs' test in its form by Student's t."""
    rng = np.random.default_rng(11)
    values = rng.standard_normal(9) * 10.0
    judged = deviations(estimates(values, np.full(9, 0.1)))
    others = [np.delete(values, k) for k in range(9)]
    expected = [
        (value - rest.mean()) / (rest.std(ddof=1) * np.sqrt(1.0 + 1.0 / 8.0))
        for value, rest in zip(values, others, strict=True)
    ]
    # the error of the judged unit and the variance of the centre differ by 0.1² of 10²
    np.testing.assert_allclose(judged.deviation, expected, rtol=1e-3)


@pytest.mark.parametrize("value", [0.0, 5.0, -3.0])
def test_estimates_that_are_all_the_same_have_no_outlier(value):
    judged = deviations(estimates(np.full(6, value), np.zeros(6)))
    assert not judged.outlier.any()
    assert judged.centre == value
    assert judged.spread == 0.0
