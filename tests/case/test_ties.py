"""Parameters that follow from others: read, computed, differentiated, refused."""

import re
from fractions import Fraction
from math import isfinite
from types import SimpleNamespace

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from exfit.case.ties import MOST_CHARACTERS, Tie, TieError, Ties, parse

NAMES = ("KE", "TE0", "machine.Tpd0")
NUMBER = re.compile(r"(?<![\w.])\d+(\.\d+)?")


def ties(**texts):
    return Ties({name: parse(text) for name, text in texts.items()})


def told(text):
    """Return what is wrong with a text, read and computed, or the text."""
    try:
        tie = parse(text)
        tie.slopes(dict.fromkeys(tie.names, 1.5))
    except TieError as error:
        return str(error)
    return tie.text


def by_python(body, values):
    """Return what Python itself makes of an expression."""
    names = {name: value for name, value in values.items() if "." not in name}
    machine = SimpleNamespace(Tpd0=values["machine.Tpd0"])
    return eval(body, {"machine": machine, "Fraction": Fraction}, names)


def exactly(body, values):
    """Return the value of an expression in rational numbers, without any rounding."""
    return by_python(
        NUMBER.sub(r'Fraction("\g<0>")', body),
        {name: Fraction(value) for name, value in values.items()},
    )


def expressions(numbers, operators, signs, exponents, depth=4):
    """Return a strategy of expressions at most ``depth`` operations deep."""
    leaves = st.sampled_from(NAMES) | st.sampled_from(numbers)
    if depth == 0:
        return leaves
    inner = expressions(numbers, operators, signs, exponents, depth - 1)
    kinds = [
        leaves,
        st.tuples(inner, st.sampled_from(operators), inner).map("({0[0]} {0[1]} {0[2]})".format),
        st.tuples(inner, st.sampled_from(exponents)).map("({0[0]})**{0[1]}".format),
    ]
    if signs:
        kinds.append(st.tuples(st.sampled_from(signs), inner).map("{0[0]}({0[1]})".format))
    return st.one_of(kinds)


FLOATS = ("0.5", "2.0", "3.25", "1e-3", ".1", "1e150")
ANY = expressions(FLOATS, "+-*/", "+-", ("2", "-1", "0.5", "-1.5", "0", "3.0"))


@pytest.mark.long
@settings(max_examples=300, deadline=None, derandomize=True)
@given(ANY, st.tuples(*(st.floats(-10.0, 10.0) for _ in NAMES)))
def test_a_value_is_to_the_last_bit_what_python_makes_of_the_text(body, numbers):
    assume(len(body) < MOST_CHARACTERS)
    values = dict(zip(NAMES, numbers, strict=True))
    try:
        expected = by_python(body, values)
    except (ZeroDivisionError, OverflowError):
        expected = None
    if isinstance(expected, float) and isfinite(expected):
        assert parse("=" + body).value(values) == expected
    else:
        tie = parse("=" + body)
        with pytest.raises(TieError, match=re.escape(tie.text)):
            tie.value(values)


# no rounding: whole numbers, small enough for a float
POLYNOMIALS = expressions("1234", "+-*", "+-", "012")
# no cancellation: nothing is negative
QUOTIENTS = expressions(("0.5", "1.5", "2", "3"), "+*/", "", ("-2", "-1", "0", "1", "2"))
STEP = Fraction(1, 10**30)  # in rational numbers the difference errs by its square only


@pytest.mark.long
@pytest.mark.parametrize("bodies", [POLYNOMIALS, QUOTIENTS], ids=["polynomials", "quotients"])
def test_slopes_are_the_differences_of_exact_rational_values(bodies):
    @settings(max_examples=200, deadline=None, derandomize=True)
    @given(bodies, st.tuples(*(st.integers(1, 4) for _ in NAMES)))
    def holds(body, numbers):
        assume(len(body) < MOST_CHARACTERS)
        values = dict(zip(NAMES, map(float, numbers), strict=True))
        tie = parse("=" + body)
        value, slopes = tie.value(values), tie.slopes(values)
        assert slopes.keys() <= set(tie.names)
        error = 1e-12 * max(1.0, abs(value))  # the terms of a slope are as large as the value
        for name in tie.names:
            above = exactly(body, values | {name: Fraction(values[name]) + STEP})
            below = exactly(body, values | {name: Fraction(values[name]) - STEP})
            expected = float((above - below) / (2 * STEP))
            assert slopes.get(name, 0.0) == pytest.approx(expected, rel=1e-12, abs=error)

    holds()


@pytest.mark.parametrize(
    ("text", "at", "slopes"),
    [
        ("=-VAMAX", {"VAMAX": 5.0}, {"VAMAX": -1.0}),
        ("=0.9*TE0", {"TE0": 2.0}, {"TE0": 0.9}),
        ("=KE**0.5", {"KE": 4.0}, {"KE": 0.25}),
        ("=KE**-(1/2)", {"KE": 4.0}, {"KE": -0.0625}),
        ("=KE**0", {"KE": 0.0}, {"KE": 0.0}),
        ("=KE**1", {"KE": 0.0}, {"KE": 1.0}),
        ("=-KE**2", {"KE": 3.0}, {"KE": -6.0}),
        (
            "=2*machine.Tpd0/(1+KE)",
            {"machine.Tpd0": 6.0, "KE": 3.0},
            {"machine.Tpd0": 0.5, "KE": -0.75},
        ),
        ("=1/3", {}, {}),
        ("=3*exp(2*KE)", {"KE": 0.0}, {"KE": 6.0}),
        ("=exp(0)/KE", {"KE": 2.0}, {"KE": -0.25}),
    ],
)
def test_slopes_of_known_laws(text, at, slopes):
    assert parse(text).slopes(at) == slopes


def test_names_stand_in_the_order_of_appearance_each_once():
    tie = parse("= stabiliser.KS1*(KE - TE0)/KE + machine . Tpd0")
    assert tie.names == ("stabiliser.KS1", "KE", "TE0", "machine.Tpd0")


def test_ties_of_the_same_text_are_equal():
    assert parse("=-VAMAX") == parse("=-VAMAX") != parse("=-VRMAX")
    assert isinstance(parse("=-VAMAX"), Tie)


@pytest.mark.parametrize(
    ("text", "piece"),
    [
        ("=sqrt(KE)", "sqrt(KE)"),
        ("=1+open(KE)", "open(KE)"),
        ("=().__class__", "().__class__"),
        ("=(1).real", "(1).real"),
        ("=KE.__class__.__base__", "KE.__class__.__base__"),
        ("=KE<2", "<"),
        ("=KE==2", "="),
        ("=lambda: 2", ":"),
        ("=(KE:=2)", ":"),
        ("='KE'", "'"),
        ("=f'{KE}'", "'"),
        ("=KE[0]", "["),
        ("=[KE]", "["),
        ("=KE, TE", ","),
        ("=KE%2", "%"),
        ("=KE^2", "^"),
        ("=KE;TE", ";"),
        ("=KE\n", r"\n"),
        ("=KE#2", "#"),
        ("=\0", r"\x00"),
        ("=2×KE", "×"),
        ("=ＫＥ", "Ｋ"),
        ("=٢*KE", "٢"),
        ("=KE//2", "KE//2"),
        ("=not KE", "not KE"),
        ("=KE and 2", "KE and 2"),
        ("=KE in TE", "KE in TE"),
        ("=2 if KE else 3", "2 if KE else 3"),
        ("=(yield)", "yield"),
        ("=await KE", "await KE"),
        ("=()", "()"),
        ("=...", "..."),
        ("=True", "True"),
        ("=None", "None"),
        ("=1j", "1j"),
        ("=0x10", "0x10"),
        ("=1_000", "1_000"),
        ("=1e999", "1e999"),
        ("=2**KE", "KE"),
        ("=2**(1+TE0)", "1+TE0"),
        ("=KE**'2'", "'"),
        ("=2 KE", "KE"),
        ("=2KE", "2KE"),
        ("=010", "010"),
        ("=(KE", "(KE"),
        ("=KE)", ")"),
        ("=2*", "2*"),
        ("=import os", "import os"),
        ("=", "ends too soon"),
        ("=  ", "ends too soon"),
        ("KE", "does not begin with ="),
        ("", "does not begin with ="),
        (" =KE", "does not begin with ="),
    ],
)
def test_anything_but_arithmetic_is_refused_and_named(text, piece):
    with pytest.raises(TieError) as refusal:
        parse(text)
    assert str(refusal.value).startswith(text)
    assert piece in str(refusal.value).removeprefix(text)


def test_a_text_too_long_is_refused_without_being_read():
    assert parse("=" + "1" * (MOST_CHARACTERS - 1)).value({}) > 1.0
    with pytest.raises(TieError, match=f"{10**7 + 1} characters; at most {MOST_CHARACTERS}"):
        parse("=" + "(" * 10**7)


@pytest.mark.parametrize("open_", ["(", "-", "-(", "KE+", "KE+(", "2**", "KE**-", "(KE)/(", "1--"])
def test_the_deepest_text_is_computed_or_refused_without_harm(open_):
    body = open_ * ((MOST_CHARACTERS - 3) // (len(open_) + open_.count("(")))
    text = f"={body}1{')' * (body.count('(') - body.count(')'))}"
    assert len(text) <= MOST_CHARACTERS
    assert told(text).startswith(text)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.text("KE0129.+-*/() eEjx_ifornt\"'[]:,=", max_size=30) | st.text(max_size=10))
def test_no_text_does_anything_but_become_a_tie_or_an_error(body):
    assert told("=" + body).startswith("=" + body)


@pytest.mark.parametrize(
    ("text", "values", "message"),
    [
        ("=1/KE", {"KE": 0.0}, "=1/KE: division by zero at KE = 0"),
        ("=TE0/(KE-1)", {"TE0": 2.5, "KE": 1.0}, "division by zero at TE0 = 2.5, KE = 1"),
        ("=KE**-1", {"KE": 0.0}, "division by zero at KE = 0"),
        ("=KE**0.5", {"KE": -2.0}, "-2 has no real power 0.5 at KE = -2"),
        ("=KE*1e300", {"KE": 1e300}, "not a finite number at KE = 1e+300"),
        ("=KE", {"KE": float("nan")}, "not a finite number at KE = nan"),
        ("=9**9**9", {}, "=9**9**9: too large a number"),
        ("=KE**9**9", {"KE": 9.0}, "too large a number at KE = 9"),
        ("=1/0", {}, "=1/0: division by zero"),
    ],
)
def test_what_has_no_finite_value_is_reported_with_its_names(text, values, message):
    tie = parse(text)
    for computed in (tie.value, tie.slopes):
        with pytest.raises(TieError, match=re.escape(message)):
            computed(values)


def test_a_slope_that_is_not_finite_is_an_error_only_where_it_is_needed():
    tie = parse("=KE**0.5")
    assert tie.value({"KE": 0.0}) == 0.0
    with pytest.raises(TieError, match="the slope to KE is not finite at KE = 0"):
        tie.slopes({"KE": 0.0})
    assert ties(A="=KE**0.5").slopes({"KE": 0.0}, ["TE0"]) == {"A": {}}


def test_a_tie_may_use_a_tie_that_stands_below_it():
    chain = ties(A="=2*B", B="=C**2 + D", E="=5")
    values = {"C": 3.0, "D": 1.0, "A": 77.0}
    assert chain.apply(values) == {"A": 20.0, "B": 10.0, "C": 3.0, "D": 1.0, "E": 5.0}
    assert values == {"C": 3.0, "D": 1.0, "A": 77.0}


def test_slopes_run_through_chains_to_the_free_names_alone():
    chain = ties(A="=2*B*C", B="=C**2 + D", E="=F")
    values = {"C": 3.0, "D": 1.0, "F": 2.0}
    assert chain.slopes(values, ["C", "D"]) == {
        "A": {"C": 2 * (3 * 9.0 + 1.0), "D": 6.0},
        "B": {"C": 6.0, "D": 1.0},
        "E": {},
    }
    assert chain.slopes(values, []) == {"A": {}, "B": {}, "E": {}}


@pytest.mark.parametrize(
    ("texts", "path"),
    [
        ({"KA": "=KA"}, "KA -> KA"),
        ({"VAMIN": "=-VAMAX", "VAMAX": "=-VAMIN"}, "VAMIN -> VAMAX -> VAMIN"),
        ({"VAMAX": "=-VAMIN", "VAMIN": "=-VAMAX"}, "VAMAX -> VAMIN -> VAMAX"),
        (
            {"X": "=A", "A": "=KE*B", "B": "=C + 1", "C": "=2*A + Q", "Q": "=2"},
            "A -> B -> C -> A",
        ),
    ],
)
def test_a_circle_is_refused_along_its_path(texts, path):
    with pytest.raises(TieError, match=f"^{path}: a circle$"):
        ties(**texts)


def test_no_ties_change_nothing():
    assert Ties().apply({"KE": 1.0}) == {"KE": 1.0}
    assert Ties().slopes({"KE": 1.0}, ["KE"]) == {}
