"""Texts for a terminal: what would control it is shown as a code, all else as it is."""

import codecs
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mutant_runs import CONTROL

from exfit.util.text import near, percentage, printable, rounded

TEXTS = st.text(st.one_of(st.characters(), st.sampled_from("\x00\x1b\x7f\x9b\u202e\u2066\r\n\t\\")))


@given(TEXTS)
def test_a_text_for_a_terminal_has_codes_in_place_of_controls(text):
    shown = printable(text)
    assert not CONTROL.search(shown)
    assert printable(shown) == shown
    if not CONTROL.search(text):
        assert shown == text


@given(TEXTS.filter(lambda text: "\\" not in text))
def test_the_codes_say_what_was_there(text):
    shown = printable(text)
    code = r"\\x[0-9a-f]{2}|\\u[0-9a-f]{4}|\\r"
    assert re.sub(code, lambda c: codecs.decode(c[0], "unicode_escape"), shown) == text


@pytest.mark.parametrize("value", [1.7e308, -1e99, 0.0])
def test_a_number_of_any_size_is_rounded_to_few_characters(value):
    assert len(rounded(value, 1e97)) <= 12
    assert len(rounded(value, 1e306)) <= 12
    assert len(percentage(value)) <= 10


def test_a_percentage_has_two_decimals():
    assert [percentage(value) for value in (99.987, -3.0, 999_999.0)] == [
        "99.99",
        "-3.00",
        "999999.00",
    ]
    assert percentage(float("nan")) == "-"


@pytest.mark.parametrize(("word", "meant"), [("RR", "R"), ("rr", "r"), ("Tpd", "TPD0"), ("R", "R")])
def test_a_hint_at_a_name_is_at_the_one_in_the_same_case(word, meant):
    assert near(word, ["r", "R", "TPD0"]) == f"did you mean {meant}?"
