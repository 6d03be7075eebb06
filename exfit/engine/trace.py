"""Run a model once on symbolic nodes: what remains is a straight-line graph, to differentiate.

The functions ``where``, ``exp`` ... below also take floats and NumPy arrays, and so does every
model written with them: that run is what the compiled one is tested against.
"""

import math
import operator
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Self

import numpy as np

from exfit.errors import ModelError

Signal = Any  # a Node while tracing, else a float or a NumPy array: the operators are the same
Key = tuple[Any, ...]

ARITHMETIC = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}
TRUTHS = {"<": operator.lt, "<=": operator.le, "&": operator.and_, "|": operator.or_}


class Node:
    """One value of the graph: an operation on earlier nodes.

    ``varies`` says whether it changes during a run (else it is computed once, before the loop);
    ``wide`` whether it is a tangent, one number per direction, rather than the value itself.
    """

    __slots__ = ("args", "graph", "index", "op", "varies", "wide")

    def __init__(self, graph: "Graph", op: str, args: Key, varies: bool, wide: bool) -> None:
        self.graph, self.op, self.args = graph, op, args
        self.varies, self.wide = varies, wide
        self.index = len(graph.nodes)

    def __str__(self) -> str:
        """Return the operation, its operands by their places in the graph."""
        return f"{self.op} {[arg.index if isinstance(arg, Node) else arg for arg in self.args]}"

    @property
    def constant(self) -> float | None:
        """The number this node always is, or None."""
        return self.args[0] if self.op == "constant" else None

    @property
    def operands(self) -> tuple["Node", ...]:
        """The nodes it is computed from."""
        return () if self.op in ("constant", "symbol") else self.args

    def __add__(self, other: Signal) -> "Node":
        return self.graph.add(self, other)

    def __radd__(self, other: Signal) -> "Node":
        return self.graph.add(other, self)

    def __sub__(self, other: Signal) -> "Node":
        return self.graph.subtract(self, other)

    def __rsub__(self, other: Signal) -> "Node":
        return self.graph.subtract(other, self)

    def __mul__(self, other: Signal) -> "Node":
        return self.graph.multiply(self, other)

    def __rmul__(self, other: Signal) -> "Node":
        return self.graph.multiply(other, self)

    def __truediv__(self, other: Signal) -> "Node":
        return self.graph.divide(self, other)

    def __rtruediv__(self, other: Signal) -> "Node":
        return self.graph.divide(other, self)

    def __neg__(self) -> "Node":
        return self.graph.subtract(0.0, self)

    def __pos__(self) -> Self:
        return self

    def __lt__(self, other: Signal) -> Signal:
        return self.graph.compare("<", self, other)

    def __gt__(self, other: Signal) -> Signal:
        return self.graph.compare("<", other, self)

    def __le__(self, other: Signal) -> Signal:
        return self.graph.compare("<=", self, other)

    def __ge__(self, other: Signal) -> Signal:
        return self.graph.compare("<=", other, self)

    def __and__(self, other: Signal) -> Signal:
        if isinstance(other, bool):
            return self if other else False
        return self.graph.apply("&", self, other)

    def __or__(self, other: Signal) -> Signal:
        if isinstance(other, bool):
            return True if other else self
        return self.graph.apply("|", self, other)

    __rand__, __ror__ = __and__, __or__

    __hash__ = object.__hash__

    def __eq__(self, other: object) -> bool:
        raise ModelError("a model must not use == or !=: compare values with <, <=, > or >=")

    def __bool__(self) -> bool:
        raise ModelError(
            "a model may not branch on a value: write where(condition, a, b), not `if`"
        )


class Graph:
    """All nodes of a trace in the order of computation, each different one once."""

    def __init__(self) -> None:
        self.nodes: list[Node] = []
        self._known: dict[Key, Node] = {}

    def symbol(self, name: str, *, varies: bool, wide: bool = False) -> Node:
        """Return the node of a value that comes from outside."""
        return self._node("symbol", (name,), varies, wide)

    def constant(self, value: float) -> Node:
        """Return the node of a fixed number."""
        return self._node("constant", (float(value),), False, False)

    def apply(self, op: str, *operands: Signal) -> Node:
        """Return the node of an operation, not simplified."""
        args = tuple(self.lift(operand) for operand in operands)
        varies, wide = any(a.varies for a in args), any(a.wide for a in args)
        return self._node(op, args, varies, wide)

    def lift(self, value: Signal) -> Node:
        """Return a number as a node, a node as it is."""
        return value if isinstance(value, Node) else self.constant(value)

    def add(self, a: Signal, b: Signal) -> Node:
        """Return a + b."""
        x, y = self.lift(a), self.lift(b)
        if x.constant == 0.0:
            return y
        if y.constant == 0.0:
            return x
        return self._fold("+", *sorted((x, y), key=lambda node: node.index))

    def subtract(self, a: Signal, b: Signal) -> Node:
        """Return a - b."""
        x, y = self.lift(a), self.lift(b)
        return x if y.constant == 0.0 else self._fold("-", x, y)

    def multiply(self, a: Signal, b: Signal) -> Node:
        """Return a * b."""
        x, y = self.lift(a), self.lift(b)
        if x.constant == 0.0 or y.constant == 0.0:
            return self.constant(0.0)
        if x.constant == 1.0:
            return y
        if y.constant == 1.0:
            return x
        return self._fold("*", *sorted((x, y), key=lambda node: node.index))

    def divide(self, a: Signal, b: Signal) -> Node:
        """Return a / b; a divisor that stays the same all run long is inverted once, before it."""
        x, y = self.lift(a), self.lift(b)
        if x.constant == 0.0:
            return x
        if x.varies and not y.varies:
            return self.multiply(x, self.divide(1.0, y))
        return self._fold("/", x, y)

    def compare(self, op: str, a: Signal, b: Signal) -> Signal:
        """Return a < b or a <= b; nothing finite lies beyond infinity: such a limit costs nothing.

        A value that is not finite passes such a limit; it ends a run anyway.
        """
        x, y = self.lift(a), self.lift(b)
        never = x.constant == math.inf or y.constant == -math.inf
        return False if never else self.apply(op, x, y)

    def clip(self, x: Signal, low: Signal, high: Signal) -> Node:
        """Return x held between two limits."""
        bounds = self.lift(low), self.lift(high)
        free = bounds[0].constant == -math.inf and bounds[1].constant == math.inf
        return self.lift(x) if free else self.apply("clip", x, *bounds)

    def select(self, condition: Signal, a: Signal, b: Signal) -> Node:
        """Return a where the condition holds, else b."""
        if isinstance(condition, bool | np.bool_):
            return self.lift(a if condition else b)
        x, y = self.lift(a), self.lift(b)
        return x if x is y else self.apply("select", condition, x, y)

    def _fold(self, op: str, a: Node, b: Node) -> Node:
        if a.constant is None or b.constant is None or (op == "/" and b.constant == 0.0):
            return self.apply(op, a, b)
        return self.constant(ARITHMETIC[op](a.constant, b.constant))

    def _node(self, op: str, args: Key, varies: bool, wide: bool) -> Node:
        # repr keeps 0.0 and -0.0 apart
        key = (op, *(a.index if isinstance(a, Node) else repr(a) for a in args))
        if key not in self._known:
            self._known[key] = Node(self, op, args, varies, wide)
            self.nodes.append(self._known[key])
        return self._known[key]


def graph_of(*values: Signal) -> Graph | None:
    """Return the graph that any of the values belongs to, None outside a trace."""
    return next((value.graph for value in values if isinstance(value, Node)), None)


def is_zero(value: Signal) -> bool:
    """Test for the number zero as it stands, whatever the run brings."""
    if isinstance(value, Node):
        return value.constant == 0.0
    return isinstance(value, float) and value == 0.0


def where(condition: Signal, a: Signal, b: Signal) -> Signal:
    """Return a where the condition holds, else b."""
    graph = graph_of(condition, a, b)
    if graph is not None:
        return graph.select(condition, a, b)
    if isinstance(condition, np.ndarray):
        return np.where(condition, a, b)
    return a if condition else b


def function(name: str, x: Signal) -> Signal:
    """Return an elementary function of x; outside its domain it is NaN, which no fit accepts."""
    graph = graph_of(x)
    if graph is None:
        with np.errstate(all="ignore"):
            return getattr(np, name)(x)
    if graph.lift(x).constant is not None:
        return graph.constant(function(name, x.constant))
    return graph.apply(name, x)


def exp(x: Signal) -> Signal:
    """Return e to the power x."""
    return function("exp", x)


def log(x: Signal) -> Signal:
    """Return the natural logarithm of x."""
    return function("log", x)


def sqrt(x: Signal) -> Signal:
    """Return the square root of x."""
    return function("sqrt", x)


def sin(x: Signal) -> Signal:
    """Return the sine of x in radians."""
    return function("sin", x)


def cos(x: Signal) -> Signal:
    """Return the cosine of x in radians."""
    return function("cos", x)


def larger(a: Signal, b: Signal) -> Signal:
    """Return the larger of two values; NaN as the first one stays NaN."""
    return where(a < b, b, a)


def smaller(a: Signal, b: Signal) -> Signal:
    """Return the smaller of two values; NaN as the first one stays NaN."""
    return where(b < a, b, a)


def clip(x: Signal, low: Signal, high: Signal) -> Signal:
    """Return x held between low and high; NaN stays NaN."""
    graph = graph_of(x, low, high)
    if graph is not None:
        return graph.clip(x, low, high)
    raised = where(x < low, low, x)
    return where(raised > high, high, raised)


def in_order(targets: Iterable[Node]) -> Iterator[Node]:
    """Yield every node that the targets need, each after its operands."""
    needed: set[int] = set()
    pending = list(targets)
    nodes = pending[0].graph.nodes if pending else []
    while pending:
        node = pending.pop()
        if node.index not in needed:
            needed.add(node.index)
            pending.extend(node.operands)
    return (nodes[index] for index in sorted(needed))


def evaluate(targets: Iterable[Node], values: Mapping[Node, Any]) -> dict[Node, Any]:
    """Return the value of every node that the targets need, given those of the symbols.

    They may be arrays, which broadcast: the instants of a run, or the directions of a tangent.
    """
    computed: dict[Node, Any] = dict(values)
    for node in in_order(targets):
        if node in computed:
            continue
        args = [computed[operand] for operand in node.operands]
        if node.constant is not None:
            computed[node] = node.constant
        elif node.op in ARITHMETIC:
            with np.errstate(all="ignore"):
                computed[node] = ARITHMETIC[node.op](np.float64(args[0]), args[1])
        elif node.op in TRUTHS:
            computed[node] = TRUTHS[node.op](*args)
        elif node.op == "select":
            computed[node] = where(*args)
        elif node.op == "clip":
            computed[node] = clip(*args)
        else:
            computed[node] = function(node.op, *args)
    return computed
