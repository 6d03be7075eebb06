"""Exact derivatives of a graph in several directions at once, by the chain rule.

A derivative is kept as a factor, one number, times a tangent, one number per direction, wherever
it can be: a chain of operations on one value then multiplies factors, which is cheap, and a sum of
two derivatives is the product of a sum where their tangents are the same.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from exfit.engine.trace import TRUTHS, Node, in_order

PARTIAL = ("/", "sqrt", "log", "exp")  # what makes infinity or no number of a number


class Slope(NamedTuple):
    """A derivative that is not zero."""

    factor: Node
    tangent: Node

    @property
    def product(self) -> Node:
        """The derivative as one node."""
        return self.factor.graph.multiply(self.factor, self.tangent)

    def times(self, factor: Node) -> "Slope":
        """Return a multiple of the derivative."""
        multiple = self.factor.graph.multiply(factor, _needed(self.factor, factor))
        return Slope(multiple, _needed(self.tangent, factor))


def tangents(targets: Iterable[Node], seeds: Mapping[Node, Node]) -> list[Node]:
    """Return the exact derivative of each target, given the tangents of the symbols."""
    targets = list(targets)
    slopes = {node: _whole(tangent) for node, tangent in seeds.items()}
    for node in list(in_order(targets)):
        if node not in slopes and node.op not in TRUTHS:
            slope = _slope(node, [slopes.get(operand) for operand in node.operands])
            if slope is not None:
                slopes[node] = slope
    return [
        slopes[node].product if node in slopes else node.graph.constant(0.0) for node in targets
    ]


def _slope(node: Node, inner: Sequence[Slope | None]) -> Slope | None:
    """Return the chain rule for one node; ``inner`` holds the derivatives of its operands."""
    if not any(inner):
        return None
    graph, args = node.graph, node.operands
    match node.op:
        case "+":
            return _sum(*inner)
        case "-":
            return _difference(*inner)
        case "*":
            return _sum(_times(inner[0], args[1]), _times(inner[1], args[0]))
        case "/":
            inverse = graph.divide(1.0, args[1])
            return _difference(_times(inner[0], inverse), _times(inner[1], node * inverse))
        case "select":
            return _chosen(args[0], inner[1], inner[2])
        case "clip":
            return _clipped(args, inner)
        case op:
            return _times(inner[0], _derivative(op, node, args[0]))


def _clipped(args: Sequence[Node], inner: Sequence[Slope | None]) -> Slope | None:
    """Return the derivative of a clip; a state put back on its limit moves with the limit.

    Where both limits move, as two gates do, the lower one may pass the upper one, which then holds.
    """
    x, low, high = args
    if low.varies and high.varies:
        above = x.graph.compare("<=", high, x) | x.graph.compare("<=", high, low)
        return _chosen(above, inner[2], _chosen(x.graph.compare("<=", x, low), inner[1], inner[0]))
    inside = _chosen(x.graph.compare("<=", high, x), inner[2], inner[0])
    return _chosen(x.graph.compare("<=", x, low), inner[1], inside)


def _derivative(op: str, node: Node, x: Node) -> Node:
    """Return the derivative of an elementary function at x, where it is ``node``."""
    graph = node.graph
    match op:
        case "exp":
            return node
        case "log":
            return graph.divide(1.0, x)
        case "sqrt":
            return graph.divide(0.5, node)
        case "sin":
            return graph.apply("cos", x)
        case "cos":
            return graph.subtract(0.0, graph.apply("sin", x))
        case _:
            raise KeyError(op)


def _times(slope: Slope | None, factor: Node) -> Slope | None:
    return None if slope is None else slope.times(factor)


def _sum(a: Slope | None, b: Slope | None) -> Slope | None:
    if a is None or b is None:
        return a or b
    if a.tangent is b.tangent:
        return a._replace(factor=a.factor + b.factor)
    if a.factor is b.factor:
        return a._replace(tangent=a.tangent + b.tangent)
    return _whole(a.product + b.product)


def _difference(a: Slope | None, b: Slope | None) -> Slope | None:
    if b is None:
        return a
    if a is None:
        return b._replace(factor=0.0 - b.factor)
    if a.tangent is b.tangent:
        return a._replace(factor=a.factor - b.factor)
    if a.factor is b.factor:
        return a._replace(tangent=a.tangent - b.tangent)
    return _whole(a.product - b.product)


def _chosen(condition: Node | bool, a: Slope | None, b: Slope | None) -> Slope | None:
    """Return a where the condition holds, else b; what is not chosen may be no number."""
    if isinstance(condition, bool):
        return a if condition else b
    if a is None or b is None:
        return _switched(condition, a, b)
    graph = condition.graph
    if a.tangent is b.tangent:
        return a._replace(factor=graph.select(condition, a.factor, b.factor))
    if a.factor is b.factor:
        return a._replace(tangent=graph.select(condition, a.tangent, b.tangent))
    return _whole(graph.select(condition, a.product, b.product))


def _switched(condition: Node, a: Slope | None, b: Slope | None) -> Slope | None:
    """Return a choice between a derivative and none."""
    slope = a or b
    if slope is None:
        return None
    # zero times a symbol is zero; a tangent that is computed may be no number where not chosen
    symbol = slope.tangent.op == "symbol"
    taken = slope.factor if symbol else slope.product
    chosen = condition.graph.select(condition, *(taken if s else 0.0 for s in (a, b)))
    return slope._replace(factor=chosen) if symbol else _whole(chosen)


def _needed(value: Node, factor: Node) -> Node:
    """Return a value without the choice of zero that a factor makes as well."""
    if value.op != "select" or not value.operands[0].varies:
        return value
    condition, *branches = value.operands
    for position, zero in enumerate(branches):
        other = branches[1 - position]
        if zero.constant == 0.0 and _switched_off(factor, condition, position) and _finite(other):
            return other
    return value


def _switched_off(node: Node, condition: Node, position: int) -> bool:
    """Test for a product with zero where a condition chooses one branch."""
    if node.op == "*":
        return any(_switched_off(factor, condition, position) for factor in node.operands)
    return (
        node.op == "select"
        and node.operands[0] is condition
        and node.operands[1 + position].constant == 0.0
    )


def _finite(node: Node) -> bool:
    """Test for a value that is a number whenever the states are."""
    return not any(part.op in PARTIAL and part.varies for part in in_order([node]))


def _whole(tangent: Node) -> Slope:
    return Slope(tangent.graph.constant(1.0), tangent)
