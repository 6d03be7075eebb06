"""The median and the distinct values against NumPy's own."""

import numpy as np
import pytest

from exfit.util.arrays import distinct, median


@pytest.mark.parametrize("count", [1, 2, 3, 10, 101])
@pytest.mark.parametrize("axis", [0, 1, -1])
def test_the_median_is_numpys(count, axis):
    samples = np.random.default_rng(count).standard_normal((count, count + 1))
    assert np.array_equal(median(samples, axis), np.median(samples, axis))
    assert np.array_equal(
        median(samples, axis, keepdims=True), np.median(samples, axis, keepdims=True)
    )


def test_the_median_of_a_list_is_a_number_and_nan_where_a_sample_is():
    assert median([3.0, 1.0, 2.0]) == 2.0
    assert np.isnan(median([3.0, np.nan, 2.0]))
    assert np.array_equal(
        median([[1.0, np.nan], [2.0, 4.0]], axis=1), [np.nan, 3.0], equal_nan=True
    )


@pytest.mark.parametrize("count", [0, 1, 2, 50])
def test_the_distinct_values_are_numpys(count):
    values = np.random.default_rng(count).integers(0, 10, count)
    assert np.array_equal(distinct(values), np.unique(values))
    assert np.array_equal(distinct(values / 3.0), np.unique(values / 3.0))
