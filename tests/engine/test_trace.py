"""The graph: functions on numbers and nodes, simplification."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exfit.engine.trace import (
    Graph,
    clip,
    evaluate,
    exp,
    in_order,
    larger,
    log,
    smaller,
    sqrt,
    where,
)
from exfit.errors import ModelError

numbers = st.floats(-1e3, 1e3)


def formula(x, y):
    """Use every operation, on numbers inside all domains."""
    a = 1.0 + x * x
    b = exp(-(y / (10.0 + abs_(y)))) + log(a) - 2.0 / a
    c = where((x < y) & (x <= 1.0) | (y > 5.0), sqrt(a) * b, b - y)
    return clip(c, -50.0, 50.0) + larger(x, y) - smaller(b, 3.0 * +x) + where(x >= y, 0.5, x)


def abs_(x):
    return where(x < 0.0, -x, x)


def traced(function, *values):
    """Return the value of a function by its graph, the node and the nodes it is of."""
    graph = Graph()
    symbols = [graph.symbol(f"x{k}", varies=True) for k in range(len(values))]
    node = graph.lift(function(*symbols))
    return evaluate([node], dict(zip(symbols, values, strict=True)))[node], node, symbols


@settings(deadline=None)
@given(numbers, numbers)
def test_a_graph_evaluates_to_what_its_function_gives(x, y):
    assert traced(formula, x, y)[0] == pytest.approx(formula(x, y), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize(
    "unlimited",
    [
        lambda x: clip(x, -math.inf, math.inf),
        lambda x: larger(x, -math.inf),
        lambda x: smaller(x, math.inf),
        lambda x: where((x >= math.inf) & (x > 0.0) | (x <= -math.inf), 0.0, x),
    ],
)
def test_a_limit_at_infinity_leaves_nothing_behind(unlimited):
    _, node, symbols = traced(unlimited, 2.0)
    assert node is symbols[0]


@settings(deadline=None)
@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=5))
def test_arrays_give_what_their_elements_give(points):
    x, y = np.array(points).T
    # a power of an array may differ from a scalar's in the last bit
    expected = [formula(a, b) for a, b in points]
    assert formula(x, y) == pytest.approx(np.array(expected), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("condition", ["x < y", "x > y", "x <= y", "x >= y"])
def test_a_comparison_means_the_same_on_nodes_and_numbers(condition):
    compare = eval(f"lambda x, y: where({condition}, 1.0, 2.0)", {"where": where})
    for x, y in ((0.0, 1.0), (1.0, 0.0), (1.0, 1.0), (math.nan, 1.0), (1.0, math.nan)):
        assert traced(compare, x, y)[0] == compare(x, y)


def test_branching_on_a_value_is_refused_with_a_hint():
    def branches(x):
        return x if x > 0.0 else -x

    with pytest.raises(ModelError, match=r"where\(condition, a, b\)"):
        traced(branches, 1.0)
    with pytest.raises(ModelError, match="where"):
        traced(lambda x: max(x, 0.0), 1.0)
    with pytest.raises(ModelError, match="where"):
        traced(lambda x: where(0.0 < x < 1.0, 1.0, 2.0), 1.0)


def test_asking_whether_two_values_are_equal_is_refused():
    with pytest.raises(ModelError, match="=="):
        traced(lambda x: where(x == 0.0, 1.0, x), 1.0)
    with pytest.raises(ModelError, match="=="):
        traced(lambda x: where(x != 0.0, 1.0, x), 1.0)


def test_a_not_a_number_is_not_hidden_by_limits():
    nan = math.nan
    for limited in (
        lambda x: clip(x, -1.0, 1.0),
        lambda x: larger(x, 0.0),
        lambda x: smaller(x, 0.0),
    ):
        assert math.isnan(limited(nan))
        assert math.isnan(traced(limited, nan)[0])
        assert np.isnan(limited(np.array([nan]))).all()


def test_outside_their_domain_functions_are_not_a_number():
    for function, x in ((sqrt, -1.0), (log, -1.0)):
        assert math.isnan(function(x))
        assert math.isnan(traced(lambda _, f=function, v=x: f(_ * 0.0 + v), 1.0)[0])
    assert log(0.0) == -math.inf
    assert exp(1000.0) == math.inf


def test_equal_expressions_are_one_node():
    def twice(x, y):
        return (x + y) * exp(x * y) - (y + x) * exp(y * x)

    _, node, _ = traced(twice, 1.0, 2.0)
    kinds = [n.op for n in in_order([node])]
    assert [kinds.count(op) for op in ("+", "exp")] == [1, 1]


def test_what_is_known_while_tracing_leaves_no_operation():
    graph = Graph()
    x = graph.symbol("x", varies=True)
    assert (x + 0.0) is x
    assert (0.0 + x) is x
    assert (x - 0.0) is x
    assert (1.0 * x) is x
    assert (0.0 * x).constant == 0.0
    assert (0.0 / x).constant == 0.0
    assert (graph.constant(2.0) * 3.0 / 4.0 - 1.0).constant == 0.5
    assert exp(graph.constant(0.0)).constant == 1.0
    assert where(True, x, 1.0) is x


def test_a_divisor_that_stays_is_inverted_outside_the_loop():
    graph = Graph()
    x, T = graph.symbol("x", varies=True), graph.symbol("T", varies=False)
    quotient = x / T
    assert quotient.op == "*"
    assert sum(node.op == "/" and not node.varies for node in in_order([quotient])) == 1


def test_zero_and_minus_zero_are_different_constants():
    graph = Graph()
    assert graph.constant(0.0) is not graph.constant(-0.0)
    assert graph.constant(0.0) is graph.constant(0.0)
