"""Numbers in the digits that their errors allow."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exfit.util.text import DIGITS, MOST_DIGITS, rounded, rounded_value

VALUES = st.floats(1e-6, 1e6).flatmap(lambda x: st.sampled_from([x, -x]))


@given(value=VALUES, share=st.floats(1e-4, 2.0))
def test_a_number_has_the_digits_of_two_of_its_error_and_no_more(value, share):
    error = share * abs(value)
    text = rounded(value, error)
    step = 10.0 ** (math.floor(math.log10(error)) - 1)
    least = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - MOST_DIGITS)
    # rounded to the second digit of the error: by half a step at most
    assert abs(float(text) - value) <= 0.5 * max(step, least) * (1.0 + 1e-9)
    if step >= 1.0:
        assert "." not in text
    assert len(text.lstrip("-")) <= 13


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (364.49, 25.0, "364"),
        (3641.7, 250.0, "3640"),
        (0.0544052, 2.4e-4, "0.05441"),
        (0.0, 0.031, "0.000"),
        (-0.049997, 2.3e-4, "-0.05000"),
        (1.0, 1e-12, "1.000000"),
        (2.5e-9, 3e-10, "2.50e-09"),
        (364.123456, None, "364.12"),
        (364.123456, 0.0, "364.12"),
        (None, 1.0, "-"),
    ],
)
def test_numbers_as_tables_have_them(value, error, text):
    assert rounded(value, error) == text


ERRORS = st.none() | st.floats(1e-12, 1e12)


@given(value=VALUES, error=ERRORS)
def test_the_value_of_a_parameter_has_three_digits_at_least(value, error):
    text = rounded_value(value, error)
    step = 10.0 ** (math.floor(math.log10(abs(value))) - 2)
    assert abs(float(text) - value) <= 0.5 * step * (1.0 + 1e-9)


@given(limits=st.lists(VALUES, min_size=5, max_size=5).map(sorted), error=ERRORS)
def test_a_value_is_printed_within_its_interval_and_both_within_the_bounds(limits, error):
    low, *_, high = limits
    printed = [float(rounded_value(number, error, low, high)) for number in limits]
    assert low <= printed[0]
    assert printed[-1] <= high
    assert printed == sorted(printed)


@pytest.mark.parametrize(
    ("value", "error", "bounds", "text"),
    [
        (5.347, 2278.0, (0.3, 30.0), "5.35"),
        (0.2996, 0.2, (0.0, 0.2997), "0.2996"),
        (0.2996, 0.2, (0.0, 0.3), "0.300"),
        (0.299966, None, (0.0, 0.29997), "0.29997"),
        (0.2999966, None, (0.0, 0.299997), "0.299997"),
        (-53470.0, 1e5, (-1e6, 0.0), "-53500"),
        (0.0, 2278.0, (0.0, 1.0), "0"),
        (math.inf, 1.0, (0.0, math.inf), "inf"),
        (math.nan, 1.0, (0.0, 1.0), "nan"),
        (None, 1.0, (0.0, 1.0), "-"),
    ],
)
def test_values_of_parameters_as_tables_have_them(value, error, bounds, text):
    assert rounded_value(value, error, *bounds) == text


@given(value=VALUES)
def test_without_an_error_there_are_five_digits(value):
    assert float(rounded(value)) == pytest.approx(value, rel=10.0 ** (1 - DIGITS))
