"""Numbers in the digits that their errors allow."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exfit.util.text import DIGITS, MOST_DIGITS, rounded

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


@given(value=VALUES)
def test_without_an_error_there_are_five_digits(value):
    assert float(rounded(value)) == pytest.approx(value, rel=10.0 ** (1 - DIGITS))
