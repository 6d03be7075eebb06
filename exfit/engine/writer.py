"""Instructions of LLVM as they are written, for values of one number or several side by side.

And the order in which a graph is computed, with branches: what only one needs is in it alone.
"""

import heapq
import math
import struct
from collections import Counter
from collections.abc import Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.trace import TRUTHS, Node, in_order

Values = dict[Node | tuple[Node, str], str]

BINARY = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
LOGIC = {"&": "and", "|": "or"}
COMPARISON = {"<": "olt", "<=": "ole"}
INTRINSICS = ("sqrt", "log")
TRANSCENDENTAL = ("exp", "sin", "cos")
FUNCTIONS = {name: f"llvm.{name}." for name in INTRINSICS}
FUNCTIONS |= {name: f"{name}_" for name in TRANSCENDENTAL}
SUMS = ("+", "-")
COSTLY = ("/", *INTRINSICS, *TRANSCENDENTAL)
UNLIKELY, WEIGHTS = ", !prof !0", '!0 = !{!"branch_weights", i32 1, i32 100}\n'


Branch = tuple[int, int]  # of which choice, and the position of what it chooses: 1 or 2
OUTSIDE: Branch = (-1, 0)


@dataclass(frozen=True)
class Choice:
    """Values that one condition chooses together, and what is computed before in either case."""

    nodes: tuple[Node, ...]
    branches: tuple["Plan", "Plan"]

    @property
    def condition(self) -> Node:
        """The condition that they share."""
        return self.nodes[0].operands[0]


Plan = tuple[Node | Choice, ...]


def plan(targets: Sequence[Node], known: Container[object]) -> Plan:
    """Return the order in which to compute what the targets need beyond the known nodes."""
    needed = dict.fromkeys(targets, True)
    for node in reversed(list(in_order(targets))):
        if node in needed and (node in known or node.constant is not None):
            del needed[node]
        elif node in needed:
            needed.update(dict.fromkeys(node.operands, True))
    return _plan(sorted(needed, key=lambda node: node.index), targets)


def _plan(nodes: Sequence[Node], targets: Iterable[Node]) -> Plan:
    """Return the order of some nodes, which come after their operands.

    A choice that varies is a branch: what one of its sides alone needs is computed there.
    """
    selects = {node: node.index for node in nodes if node.op == "select" and node.varies}
    if not selects:
        return tuple(nodes)
    places = _places(nodes, targets, selects)
    choices = _choices(nodes, {node for node in selects if places[node] == OUTSIDE})
    places = _places(nodes, targets, choices)
    contents: dict[Branch, list[Node]] = {}
    for node in nodes:
        contents.setdefault(places[node], []).append(node)
    members: dict[int, list[Node]] = {}
    for node in contents[OUTSIDE]:
        if node in choices:
            members.setdefault(choices[node], []).append(node)

    def branch(choice: int, position: int) -> Plan:
        chosen = [node.operands[position] for node in members[choice]]
        return _plan(contents.get((choice, position), ()), chosen)

    at = {node.index: node for node in contents[OUTSIDE]}
    order = _order(_followers(nodes, places, choices))
    return tuple(
        Choice(tuple(members[unit]), (branch(unit, 1), branch(unit, 2)))
        if unit in members
        else at[unit]
        for unit in order
    )


def _places(
    nodes: Sequence[Node], targets: Iterable[Node], choices: Mapping[Node, int]
) -> dict[Node, Branch]:
    """Return the branch that alone needs a node, or OUTSIDE."""
    places = dict.fromkeys(targets, OUTSIDE)
    for node in reversed(nodes):
        place = places[node]
        apart = place == OUTSIDE and node in choices
        for position, operand in enumerate(node.operands):
            here = (choices[node], position) if apart and position else place
            places[operand] = here if places.get(operand, here) == here else OUTSIDE
    return places


def _choices(nodes: Sequence[Node], selects: Container[Node]) -> dict[Node, int]:
    """Put selects of the same condition into one choice if none needs another's value.

    A choice is named by the index of its first node; sets of choices are the bits of a number.
    """
    choices: dict[Node, int] = {}
    needs: dict[int, int] = {}
    alike: dict[Node, list[int]] = {}
    before: dict[Node, int] = {}
    for node in nodes:
        needed = 0
        for operand in node.operands:
            needed |= before.get(operand, 0)
        if node in selects:
            for choice, others in needs.items():
                needed |= others if needed >> choice & 1 else 0
            same = alike.setdefault(node.operands[0], [])
            choice = next((c for c in same if not needed >> c & 1), node.index)
            if choice == node.index:
                same.append(choice)
            needs[choice] = needs.get(choice, 0) | needed
            for other, others in needs.items():
                needs[other] |= needed if others >> choice & 1 else 0
            choices[node], needed = choice, 1 << choice
        before[node] = needed
    return choices


def _followers(
    nodes: Sequence[Node], places: Mapping[Node, Branch], choices: Mapping[Node, int]
) -> dict[int, set[int]]:
    """Return, for each node and choice outside by its index, those that need it."""
    units = {
        node: choices.get(node, node.index) if places[node] == OUTSIDE else places[node][0]
        for node in nodes
    }
    followers: dict[int, set[int]] = {unit: set() for unit in units.values()}
    for node, unit in units.items():
        for operand in node.operands:
            if operand in units and units[operand] != unit:
                followers[units[operand]].add(unit)
    return followers


def _order(followers: Mapping[int, set[int]]) -> list[int]:
    waits = Counter(unit for after in followers.values() for unit in after)
    ready = sorted(followers.keys() - waits.keys())
    order = []
    while ready:
        order.append(heapq.heappop(ready))
        for unit in followers[order[-1]]:
            waits[unit] -= 1
            if not waits[unit]:
                heapq.heappush(ready, unit)
    return order


@dataclass(frozen=True)
class Shape:
    """The numbers that one value holds, and LLVM's type for them."""

    lanes: int

    def of(self, scalar: str) -> str:
        """Return the type whose elements are of the scalar type."""
        return scalar if self.lanes == 1 else f"<{self.lanes} x {scalar}>"

    def number(self, value: float) -> str:
        """Return a constant, the same in every lane."""
        bits = f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"
        return bits if self.lanes == 1 else f"splat (double {bits})"

    def integer(self, value: int) -> str:
        """Return an integer constant, the same in every lane."""
        return str(value) if self.lanes == 1 else f"splat (i64 {value})"

    @property
    def type(self) -> str:
        """The type of a value."""
        return self.of("double")

    @property
    def suffix(self) -> str:
        """The ending of an intrinsic's name for this type."""
        return "f64" if self.lanes == 1 else f"v{self.lanes}f64"


class Writer:
    """Instructions of one function, as they are written."""

    def __init__(self, narrow: Shape, wide: Shape) -> None:
        self.narrow, self.wide = narrow, wide
        self.lines: list[str] = []
        self.block = "entry"

    def put(self, text: str) -> None:
        """Write an instruction without a result."""
        self.lines.append(f"  {text}")

    def label(self, name: str) -> None:
        """Begin a basic block."""
        self.block = name
        self.lines.append(f"{name}:")

    def let(self, text: str) -> str:
        """Write an instruction and return the name of its result."""
        name = f"%v{len(self.lines)}"
        self.lines.append(f"  {name} = {text}")
        return name

    def shape(self, node: Node) -> Shape:
        """Return the shape of a node's value."""
        return self.wide if node.wide else self.narrow

    def arithmetic(self, op: str, shape: Shape, a: str, b: str) -> str:
        """Write a floating-point operation."""
        return self.let(f"{op} nsz {shape.type} {a}, {b}")

    def add_product(self, shape: Shape, x: str, a: str, b: str) -> str:
        """Write x + a b, rounded once where the processor does that."""
        factors = f"{shape.type} {a}, {shape.type} {b}, {shape.type} {x}"
        return self.let(f"call nsz {shape.type} @llvm.fmuladd.{shape.suffix}({factors})")

    def negative(self, shape: Shape, x: str) -> str:
        """Write -x."""
        return self.let(f"fneg nsz {shape.type} {x}")

    def spread(self, scalar: str, shape: Shape) -> str:
        """Write a scalar into every lane."""
        if shape.lanes == 1:
            return scalar
        first = self.let(f"insertelement {shape.type} poison, double {scalar}, i64 0")
        mask = f"<{shape.lanes} x i32> zeroinitializer"
        return self.let(f"shufflevector {shape.type} {first}, {shape.type} poison, {mask}")

    def address(self, base: str, row: int | str, lanes: int = 1) -> str:
        """Write the address of a row of an array."""
        offset = row * lanes if isinstance(row, int) else row
        return self.let(f"getelementptr double, ptr {base}, i64 {offset}")

    def load(self, base: str, row: int | str, shape: Shape) -> str:
        """Read a row of an array."""
        return self.let(f"load {shape.type}, ptr {self.address(base, row, shape.lanes)}, align 8")

    def store(self, value: str, base: str, row: int, shape: Shape) -> None:
        """Write a row of an array."""
        where = self.address(base, row, shape.lanes)
        self.put(f"store {shape.type} {value}, ptr {where}, align 8")

    def prepare(self, targets: Sequence[Node], values: Values) -> None:
        """Write the values of the targets into ``values``, with all that they need."""
        self.follow(plan(targets, values), values)

    def results(self, targets: Sequence[Node], values: Values, shape: Shape) -> list[str]:
        """Return the values of targets that are prepared, in a shape."""
        return [self._operand(node, shape, values) for node in targets]

    def follow(self, steps: Plan, values: Values) -> None:
        """Write the steps of a plan; ``values`` grows."""
        for step in steps:
            if not isinstance(step, Choice):
                values[step] = self._instruction(step, values)
            elif self.narrow.lanes == 1:
                self._branch(step, values)
            else:
                self._blend(step, values)

    def _branch(self, choice: Choice, values: Values) -> None:
        """Write both branches of a choice: a processor foresees it, and waits for nothing."""
        mark, ends = len(self.lines), {node: list[str]() for node in choice.nodes}
        self._jump(choice.condition, f"branch1.{mark}", f"branch2.{mark}", values)
        for position, steps in enumerate(choice.branches, 1):
            self.label(f"branch{position}.{mark}")
            inside = dict(values)
            self.follow(steps, inside)
            for node, end in ends.items():
                result = self._operand(node.operands[position], self.shape(node), inside)
                end.append(f"[{result}, %{self.block}]")
            self.put(f"br label %after.{mark}")
        self.label(f"after.{mark}")
        for node, end in ends.items():
            values[node] = self.let(f"phi {self.shape(node).type} {', '.join(end)}")

    def _blend(self, choice: Choice, values: Values) -> None:
        """Write both branches of a choice, and which of their results each set takes."""
        sides = []
        for position, steps in enumerate(choice.branches, 1):
            wanted = [node.operands[position] for node in choice.nodes]
            if _costly(steps):
                sides.append(self._where_any(choice, position, values))
            else:
                self.follow(steps, values)
                sides.append([self._operand(node, self.narrow, values) for node in wanted])
        truth = f"{self.narrow.of('i1')} {values[choice.condition]}"
        for node, a, b in zip(choice.nodes, *sides, strict=True):
            values[node] = self.let(
                f"select {truth}, {self.narrow.type} {a}, {self.narrow.type} {b}"
            )

    def _where_any(self, choice: Choice, position: int, values: Values) -> list[str]:
        """Write the values of one branch, computed only where any of the sets takes it."""
        shape, mark, before = self.narrow, len(self.lines), self.block
        bits = f"i{shape.lanes}"
        taken = self.let(f"bitcast {shape.of('i1')} {values[choice.condition]} to {bits}")
        some = self.let(f"icmp ne {bits} {taken}, {0 if position == 1 else -1}")
        self.put(f"br i1 {some}, label %some.{mark}, label %after.{mark}")
        self.label(f"some.{mark}")
        inside = dict(values)
        self.follow(choice.branches[position - 1], inside)
        results = [self._operand(n.operands[position], shape, inside) for n in choice.nodes]
        end = self.block
        self.put(f"br label %after.{mark}")
        self.label(f"after.{mark}")
        return [
            self.let(f"phi {shape.type} [{result}, %{end}], [poison, %{before}]")
            for result in results
        ]

    def _jump(self, condition: Node, yes: str, no: str, values: Values) -> None:
        """Write a jump to either label, as soon as a condition is decided."""
        if condition.op in LOGIC and condition.varies:
            first, second = condition.operands
            between = f"{no}.{condition.index}"
            labels = (between, no) if condition.op == "&" else (yes, between)
            self._jump(first, *labels, values)
            self.label(between)
            self._jump(second, yes, no, values)
        else:
            # what is below a limit or bypassed is the exception
            hint = UNLIKELY if condition.op == "<" or not condition.varies else ""
            self.put(f"br i1 {values[condition]}, label %{yes}, label %{no}{hint}")

    def _operand(self, node: Node, shape: Shape, values: Values) -> str:
        if node.constant is not None:
            return shape.number(node.constant)
        if self.shape(node) == shape:
            return values[node]
        key = (node, "spread")
        if key not in values:
            values[key] = self.spread(values[node], shape)
        return values[key]

    def _instruction(self, node: Node, values: Values) -> str:
        shape = self.shape(node)
        if node.op in TRUTHS:
            return self._truth(node, shape, values)
        if node.op == "select":
            condition, *branches = node.operands
            a, b = (self._operand(branch, shape, values) for branch in branches)
            truth = self.shape(condition).of("i1")
            return self.let(
                f"select {truth} {values[condition]}, {shape.type} {a}, {shape.type} {b}"
            )
        if node.op == "clip":
            return self._clip(node, shape, values)
        if node.op in SUMS:
            # in one operation with a product; which one, the graph alone decides: code for one set
            # and for many rounds alike
            products = [each for each in node.operands if each.op == "*"]
            products = [p for p in products if (p.varies, p.wide) == (node.varies, node.wide)]
            if products:
                return self._sum_with(products[0], node, shape, values)
        args = [self._operand(operand, shape, values) for operand in node.operands]
        if node.op == "larger":
            return self.held(shape, args[0], "olt", args[1])  # what is no number is not larger
        if node.op in BINARY:
            return self.arithmetic(BINARY[node.op], shape, *args)
        name = FUNCTIONS[node.op] + shape.suffix
        return self.let(f"call {shape.type} @{name}({shape.type} {args[0]})")

    def _sum_with(self, product: Node, node: Node, shape: Shape, values: Values) -> str:
        """Write a sum or difference and a product in it as one operation."""
        first, second = node.operands
        a, b = (self._operand(factor, shape, values) for factor in product.operands)
        x = self._operand(second if product is first else first, shape, values)
        if node.op == "-" and product is first:
            x = self.negative(shape, x)
        elif node.op == "-":
            a = self.negative(shape, a)
        return self.add_product(shape, x, a, b)

    def _truth(self, node: Node, shape: Shape, values: Values) -> str:
        if node.op in LOGIC:
            a, b = (values[operand] for operand in node.operands)
            truth = self.let(f"{LOGIC[node.op]} {shape.of('i1')} {a}, {b}")
        else:
            a, b = (self._operand(operand, shape, values) for operand in node.operands)
            truth = self.let(f"fcmp {COMPARISON[node.op]} {shape.type} {a}, {b}")
        # frozen: what stays is a bit that is kept, else it is compared again at each branch
        return truth if node.varies else self.let(f"freeze {shape.of('i1')} {truth}")

    def _clip(self, node: Node, shape: Shape, values: Values) -> str:
        x, *limits = node.operands
        result = self._operand(x, shape, values)
        for comparison, limit in zip(("olt", "ogt"), limits, strict=True):
            if limit.constant is None or math.isfinite(limit.constant):
                edge = self._operand(limit, shape, values)
                result = self.held(shape, result, comparison, edge)
        return result

    def held(self, shape: Shape, x: str, comparison: str, limit: str) -> str:
        """Write x, or the limit where the comparison of x with it holds."""
        outside = self.let(f"fcmp {comparison} {shape.type} {x}, {limit}")
        return self.let(
            f"select {shape.of('i1')} {outside}, {shape.type} {limit}, {shape.type} {x}"
        )


def _costly(steps: Plan) -> bool:
    """Look for a step that takes long."""
    return any(
        any(map(_costly, step.branches)) if isinstance(step, Choice) else step.op in COSTLY
        for step in steps
    )
