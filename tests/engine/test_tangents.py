"""Exact derivatives of a graph: the chain rule, limits, and what they cost."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exfit.engine.tangents import tangents
from exfit.engine.trace import (
    Graph,
    clip,
    cos,
    evaluate,
    exp,
    in_order,
    larger,
    log,
    sin,
    sqrt,
    where,
)


def squared(x):
    return x * x


def differentiated(function, count):
    """Return the derivative of a function of some values, the values and their tangents."""
    graph = Graph()
    symbols = [graph.symbol(f"x{k}", varies=True) for k in range(count)]
    moved = [graph.symbol(f"dx{k}", varies=True, wide=True) for k in range(count)]
    seeds = dict(zip(symbols, moved, strict=True))
    (slope,) = tangents([graph.lift(function(*symbols))], seeds)
    return slope, symbols, moved


def derivatives(function, *values):
    """Return the derivatives of a function with respect to each of its values."""
    slope, symbols, moved = differentiated(function, len(values))
    at = dict(zip(symbols, values, strict=True))
    zeros = dict.fromkeys(moved, 0.0)
    return [evaluate([slope], at | zeros | {tangent: 1.0})[slope] for tangent in moved]


@settings(deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.sampled_from([0, 1]))
def test_derivatives_equal_central_differences(x, y, direction):
    def smooth(x, y):
        a = 1.0 + x * x
        wave = sin(1.3 * x) * cos(x - 0.7 * y)
        return sqrt(a) * exp(0.3 * y) / (2.0 + y * y) - log(a + y * y) + (1.0 - x) / a + wave

    exact = derivatives(smooth, x, y)[direction]
    h = 1e-3
    shift = [(h, 0.0), (0.0, h)][direction]

    def difference(k):
        up = smooth(x + k * shift[0], y + k * shift[1])
        return (up - smooth(x - k * shift[0], y - k * shift[1])) / (2 * k * h)

    # two differences cancel the error of order h^2: what is left is h^4 = 1e-12 and rounding
    assert exact == pytest.approx((4 * difference(1) - difference(2)) / 3, abs=1e-9)


@pytest.mark.parametrize(("value", "moves_with"), [(0.3, "x"), (-1.0, "low"), (2.0, "high")])
def test_what_lies_on_a_limit_moves_with_it(value, moves_with):
    """There a limit puts a state back: it is exactly on it, not a hair beyond."""
    graph = Graph()
    x, low, high = nodes = [graph.symbol(name, varies=True) for name in ("x", "low", "high")]
    held = clip(x, low, high)
    for node in nodes:
        (slope,) = tangents([held], {node: graph.constant(1.0)})
        moved = evaluate([slope], {x: value, low: -1.0, high: 2.0})[slope]
        assert moved == (1.0 if node.args[0] == moves_with else 0.0)


@pytest.mark.parametrize("value", [0.3, 1.5, 4.0])
def test_where_the_lower_of_two_gates_passes_the_upper_one_that_one_holds(value):
    graph = Graph()
    x, low, high = nodes = [graph.symbol(name, varies=True) for name in ("x", "low", "high")]
    held, at = clip(x, low, high), {x: value, low: 2.0, high: 1.0}
    assert evaluate([held], at)[held] == 1.0
    slopes = [tangents([held], {node: graph.constant(1.0)})[0] for node in nodes]
    assert [evaluate([slope], at)[slope] for slope in slopes] == [0.0, 0.0, 1.0]


@pytest.mark.parametrize(
    "function",
    [
        lambda x, y: where(x < 0.0, 0.0, sqrt(x) * y),
        lambda x, y: where(x < 0.0, 0.0, sqrt(x) + y),
        lambda x, y: where(x < 0.0, 0.0, sqrt(x)),
        lambda x, y: where(x < 0.0, 3.0 * y, sqrt(x) * y) - 3.0 * y,
        lambda x, y: where(x >= 0.0, log(x) + y, 0.0),
    ],
)
def test_what_is_not_chosen_moves_nothing_even_where_it_is_no_number(function):
    assert derivatives(function, -1.0, 2.0) == [0.0, 0.0]
    assert all(math.isfinite(slope) for slope in derivatives(function, 1.0, 2.0))


def test_a_factor_that_is_zero_needs_no_choice_of_a_zero_tangent():
    slope, _, _ = differentiated(lambda x, y: squared(larger(x - y, 0.0)), 2)
    assert [node.op for node in in_order([slope]) if node.wide] == ["symbol", "symbol", "-", "*"]
    assert derivatives(lambda x, y: squared(larger(x - y, 0.0)), 1.0, 2.0) == [0.0, 0.0]
    assert derivatives(lambda x, y: squared(larger(x - y, 0.0)), 3.0, 2.0) == [2.0, -2.0]


def test_a_chain_on_one_value_multiplies_its_factors_and_one_tangent():
    def chain(x):
        above = where(x < 0.5, 0.0, x - 0.5)
        return sqrt(1.0 + 2.0 * above * above) + exp(-x) / (3.0 + x)

    slope, _, _ = differentiated(chain, 1)
    wide = [node.op for node in in_order([slope]) if node.wide]
    assert wide == ["symbol", "*"]
