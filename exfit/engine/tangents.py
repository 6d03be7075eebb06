"""Exact derivatives in several directions at once, by the chain rule, and the code that runs them.

A derivative is kept as a factor, one number, times a tangent, one number per direction, wherever
it can be: a chain of operations on one value then multiplies factors, which is cheap, and a sum of
two derivatives is the product of a sum where their tangents are the same.
"""

import operator
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache, partial
from typing import NamedTuple

import numpy as np

from exfit.engine.kernel import DIRECTIONS, compiled, text_of
from exfit.engine.sampling import Courses, Sampler, Sizes
from exfit.engine.system import System, Trace, trace
from exfit.engine.trace import TRUTHS, Node, in_order
from exfit.util.arrays import Array

PARTIAL = ("/", "sqrt", "log", "exp")  # what makes infinity or no number of a number


class Tangents(NamedTuple):
    """The derivatives of a trace in several directions at once."""

    p: tuple[Node | None, ...]  # the tangent of each parameter; None where it is not free
    r: tuple[Node, ...]
    x: tuple[Node, ...]
    u: tuple[Node | None, ...]  # the tangent of each input; None where it does not move
    rest: tuple[Node, ...]
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    clamped: tuple[Node, ...]


def differentiate(
    traced: Trace, system: System, free: Sequence[str], moving: Sequence[str] = ()
) -> Tangents:
    """Return the derivatives of a trace where the free parameters and the moving inputs move."""
    graph = traced.x[0].graph

    def symbol(node: Node, varies: bool) -> Node:
        return graph.symbol(f"d{node.args[0]}", varies=varies, wide=True)

    def some(
        nodes: Sequence[Node], names: Sequence[str], chosen: Sequence[str], varies: bool
    ) -> tuple[Node | None, ...]:
        pairs = zip(nodes, names, strict=True)
        return tuple(symbol(node, varies) if name in chosen else None for node, name in pairs)

    p = some(traced.p, system.parameters, free, False)
    r, x = (
        tuple(symbol(n, v) for n in nodes) for nodes, v in ((traced.r, False), (traced.x, True))
    )
    u = some(traced.u, system.inputs, moving, True)
    seeds = {node: dp for node, dp in zip(traced.p, p, strict=True) if dp is not None}
    pairs = zip((*traced.r, *traced.x, *traced.u), (*r, *x, *u), strict=True)
    every = seeds | {node: derived for node, derived in pairs if derived is not None}
    return Tangents(
        p=p,
        r=r,
        x=x,
        u=u,
        rest=tuple(tangents(traced.rest, seeds)),
        slopes=tuple(tangents(traced.slopes, every)),
        outputs=tuple(tangents(traced.outputs, every)),
        clamped=tuple(tangents(traced.clamped, every)),
    )


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
        case "larger":
            return _chosen(graph.compare("<", args[1], args[0]), *inner)
        case "exp":
            return _times(inner[0], node)
        case "log":
            return _times(inner[0], graph.divide(1.0, args[0]))
        case "sqrt":
            return _times(inner[0], graph.divide(0.5, node))
        case "sin":
            return _times(inner[0], graph.apply("cos", args[0]))
        case "cos":
            return _times(inner[0], graph.subtract(0.0, graph.apply("sin", args[0])))
        case op:
            raise KeyError(op)


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


def _times(slope: Slope | None, factor: Node) -> Slope | None:
    return None if slope is None else slope.times(factor)


def _sum(a: Slope | None, b: Slope | None) -> Slope | None:
    return a or b if a is None or b is None else _joined(operator.add, a, b)


def _difference(a: Slope | None, b: Slope | None) -> Slope | None:
    if b is None:
        return a
    return b._replace(factor=0.0 - b.factor) if a is None else _joined(operator.sub, a, b)


def _chosen(condition: Node | bool, a: Slope | None, b: Slope | None) -> Slope | None:
    """Return a where the condition holds, else b; what is not chosen may be no number."""
    if isinstance(condition, bool):
        return a if condition else b
    if a is not None and b is not None:
        return _joined(partial(condition.graph.select, condition), a, b)
    slope = a or b
    if slope is None:
        return None
    # zero times a symbol is zero; a tangent that is computed may be no number where not chosen
    symbol = slope.tangent.op == "symbol"
    taken = slope.factor if symbol else slope.product
    chosen = condition.graph.select(condition, *(taken if s else 0.0 for s in (a, b)))
    return slope._replace(factor=chosen) if symbol else _whole(chosen)


def _joined(join: Callable[[Node, Node], Node], a: Slope, b: Slope) -> Slope:
    """Return a sum, a difference or a choice of two derivatives."""
    if a.tangent is b.tangent:
        return a._replace(factor=join(a.factor, b.factor))
    if a.factor is b.factor:
        return a._replace(tangent=join(a.tangent, b.tangent))
    return _whole(join(a.product, b.product))


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


def _blocks(tangents: Array, width: int) -> Array:
    """Return tangents (K, ..., N) as blocks (K, blocks, ..., width) of directions, none missing."""
    given = tangents.shape[-1]
    count = max(1, -(-given // width))
    blocks = np.zeros((len(tangents), count, *tangents.shape[1:-1], width))
    for k in range(count):
        own = tangents[..., k * width : (k + 1) * width]
        blocks[:, k, ..., : own.shape[-1]] = own
    return blocks


class TangentKernel:
    """Simulates one parameter set with its exact derivatives in any directions.

    A direction may move the parameters that are ``free`` and the inputs that are ``moving``; as
    many as ``directions`` run together.
    """

    def __init__(
        self,
        system: System,
        outputs: Sequence[str],
        free: Sequence[str],
        moving: Sequence[str] = (),
        directions: int = DIRECTIONS,
    ) -> None:
        self.system, self.outputs = system, tuple(outputs)
        self.free, self.moving, self.directions = tuple(free), tuple(moving), directions

        def ir() -> str:
            from exfit.engine.emit import simulation_with_tangents

            traced = trace(system, self.outputs)
            derived = differentiate(traced, system, free, moving)
            return simulation_with_tangents(traced, derived, directions)

        traced = text_of(system, self.outputs)
        text = f"tangents {self.free} {self.moving} {directions} {traced}"
        engine = compiled(text, ir)
        counts = (len(system.setpoints), len(system.states), len(self.outputs))
        sizes = Sizes(*counts, directions=directions, moving=len(self.moving))
        self._sampled = Sampler(engine, sizes)

    def samples(
        self, p: Array, dp: Array, courses: Courses, rates: Array | None = None
    ) -> tuple[Array, Array, Array | None]:
        """Return outputs (K, M, ny) of sets p (K, np), their derivatives, and those to time.

        ``dp`` (K, np, N) are the tangents of the parameters in N directions, zero but where these
        are free; the inputs that move have theirs by ``rates`` (K, moving, columns, N) of the
        shapes in their segments. The derivatives are (K, M, ny, N), those to time (K, M, ny) or
        None where the readings have no weights for them. The derivative of the starting state is
        part of the result.
        """
        sets = np.arange(len(p))[:, None]
        moving = None if rates is None else _blocks(rates, self.directions)
        outputs, slopes, change = self._sampled(
            p, courses, sets, _blocks(dp, self.directions), moving
        )
        assert slopes is not None
        flat = slopes[:, 0]
        if slopes.shape[1] > 1:
            flat = np.moveaxis(slopes, 1, -2).reshape(*flat.shape[:-1], -1)
        return outputs, flat[..., : dp.shape[-1]], change


tangent_kernel = cache(TangentKernel)  # made once in a process
