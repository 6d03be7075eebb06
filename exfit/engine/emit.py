"""From a traced system to LLVM IR: two functions, ``rest`` and ``run``.

The value of a node is ``lanes`` numbers side by side, one per parameter set. With tangents there is
one set, and a wide node holds one number per direction of differentiation. All arrays that the
functions take are rows of such values; ``run`` is the classical Runge-Kutta method of order four.
"""

import math
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.system import Tangents, Trace
from exfit.engine.trace import Node, in_order

Values = dict[Node | tuple[Node, str], str]

BINARY = {"+": "fadd", "-": "fsub", "*": "fmul", "/": "fdiv"}
LOGIC = {"&": "and", "|": "or"}
COMPARISON = {"<": "olt", "<=": "ole"}
INTRINSICS = ("sqrt", "log")

LOG2_E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # ln 2 in two parts
ROUNDER = 1.5 * 2.0**52  # adding it leaves the nearest integer in the low bits
EXP_TERMS = 13
EXP_LIMIT = 700.0
QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417, 6.07710050650619224932e-11  # pi / 2 in two
SINE_TERMS = 10  # of either series, up to a rounding within an eighth of a turn
TRANSCENDENTAL = ("exp", "sin", "cos")


@dataclass(frozen=True)
class Shape:
    """How many numbers one value holds, and how LLVM writes that."""

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
        """How an intrinsic of this type is named."""
        return "f64" if self.lanes == 1 else f"v{self.lanes}f64"


class Writer:
    """Instructions of one function, as they are written."""

    def __init__(self, narrow: Shape, wide: Shape) -> None:
        self.narrow, self.wide = narrow, wide
        self.lines: list[str] = []

    def put(self, text: str) -> None:
        """Write an instruction without a result."""
        self.lines.append(f"  {text}")

    def label(self, name: str) -> None:
        """Begin a basic block."""
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
        """Write a floating-point operation; products may contract into a following sum."""
        return self.let(f"{op} nsz contract {shape.type} {a}, {b}")

    def add_product(self, shape: Shape, x: str, a: str, b: str) -> str:
        """Write x + a b."""
        return self.arithmetic("fadd", shape, x, self.arithmetic("fmul", shape, a, b))

    def spread(self, scalar: str, shape: Shape) -> str:
        """Write a scalar into every lane."""
        if shape.lanes == 1:
            return scalar
        one = self.let(f"insertelement {shape.type} poison, double {scalar}, i64 0")
        mask = f"<{shape.lanes} x i32> zeroinitializer"
        return self.let(f"shufflevector {shape.type} {one}, {shape.type} poison, {mask}")

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

    def compute(self, targets: Sequence[Node], values: Values, shape: Shape) -> list[str]:
        """Write what the targets need beyond ``values`` (which grows), and return theirs."""
        self.prepare(targets, values)
        return [self._operand(node, shape, values) for node in targets]

    def prepare(self, targets: Sequence[Node], values: Values) -> None:
        """Write what the targets need beyond ``values``, which grows."""
        for node in in_order(targets):
            if node not in values and node.constant is None:
                values[node] = self._instruction(node, values)

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
        if node.op in LOGIC:
            a, b = (values[operand] for operand in node.operands)
            return self.let(f"{LOGIC[node.op]} {shape.of('i1')} {a}, {b}")
        if node.op == "select":
            condition, *branches = node.operands
            a, b = (self._operand(branch, shape, values) for branch in branches)
            truth = self.shape(condition).of("i1")
            return self.let(
                f"select {truth} {values[condition]}, {shape.type} {a}, {shape.type} {b}"
            )
        if node.op == "clip":
            return self._clip(node, shape, values)
        args = [self._operand(operand, shape, values) for operand in node.operands]
        if node.op in BINARY:
            return self.arithmetic(BINARY[node.op], shape, *args)
        if node.op in COMPARISON:
            return self.let(f"fcmp {COMPARISON[node.op]} {shape.type} {args[0]}, {args[1]}")
        if node.op in INTRINSICS:
            return self.let(
                f"call {shape.type} @llvm.{node.op}.{shape.suffix}({shape.type} {args[0]})"
            )
        if node.op in TRANSCENDENTAL:
            return self.let(f"call {shape.type} @{node.op}_{shape.suffix}({shape.type} {args[0]})")
        raise KeyError(f"{node.op} {node.args}")

    def _clip(self, node: Node, shape: Shape, values: Values) -> str:
        x, *limits = node.operands
        result = self._operand(x, shape, values)
        for comparison, limit in zip(("olt", "ogt"), limits, strict=True):
            if limit.constant is None or math.isfinite(limit.constant):
                edge = self._operand(limit, shape, values)
                result = self.held(shape, result, comparison, edge)
        return result

    def held(self, shape: Shape, x: str, comparison: str, limit: str) -> str:
        """Write x, or the limit where x compares with it as told."""
        outside = self.let(f"fcmp {comparison} {shape.type} {x}, {limit}")
        return self.let(
            f"select {shape.of('i1')} {outside}, {shape.type} {limit}, {shape.type} {x}"
        )


def exponential(shape: Shape) -> str:
    """Return the function e^x: a power of two times a polynomial, without a branch."""
    w = Writer(shape, shape)

    def strict(op: str, a: str, b: str) -> str:
        return w.let(f"{op} {shape.type} {a}, {b}")

    x = w.held(shape, "%x", "olt", shape.number(-EXP_LIMIT))
    x = w.held(shape, x, "ogt", shape.number(EXP_LIMIT))
    shifted = strict("fadd", strict("fmul", x, shape.number(LOG2_E)), shape.number(ROUNDER))
    power = strict("fsub", shifted, shape.number(ROUNDER))
    rest = _without(w, shape, x, power, (LN2_HIGH, LN2_LOW))
    series = _polynomial(w, shape, rest, [1.0 / math.factorial(k) for k in range(EXP_TERMS)])
    whole = shape.of("i64")
    bits = w.let(f"bitcast {shape.type} {shifted} to {whole}")
    biased = w.let(f"add {whole} {bits}, {shape.integer(1023)}")
    exponent = w.let(f"shl {whole} {biased}, {shape.integer(52)}")
    scale = w.let(f"bitcast {whole} {exponent} to {shape.type}")
    return _inlined("exp", shape, w, w.arithmetic("fmul", shape, series, scale))


def sine(shape: Shape, name: str) -> str:
    """Return the function sin, or cos, which is sin a quarter of a turn on.

    The angle is reduced to the nearest quarter of a turn; which one decides series and sign. Exact
    to rounding up to thousands of turns.
    """
    w = Writer(shape, shape)
    turns = w.let(f"fmul {shape.type} %x, {shape.number(2.0 / math.pi)}")
    shifted = w.let(f"fadd {shape.type} {turns}, {shape.number(ROUNDER)}")
    quarters = w.let(f"fsub {shape.type} {shifted}, {shape.number(ROUNDER)}")
    rest = _without(w, shape, "%x", quarters, (QUARTER_HIGH, QUARTER_LOW))
    square = w.arithmetic("fmul", shape, rest, rest)
    series = [(-1.0) ** k / math.factorial(2 * k + 1) for k in range(SINE_TERMS)]
    odd = w.arithmetic("fmul", shape, rest, _polynomial(w, shape, square, series))
    series = [(-1.0) ** k / math.factorial(2 * k) for k in range(SINE_TERMS)]
    even = _polynomial(w, shape, square, series)
    whole = shape.of("i64")
    bits = w.let(f"bitcast {shape.type} {shifted} to {whole}")
    number = w.let(f"add {whole} {bits}, {shape.integer(1 if name == 'cos' else 0)}")

    def has(bit: int) -> str:
        part = w.let(f"and {whole} {number}, {shape.integer(bit)}")
        return w.let(f"icmp ne {whole} {part}, {shape.integer(0)}")

    truth = shape.of("i1")
    chosen = w.let(f"select {truth} {has(1)}, {shape.type} {even}, {shape.type} {odd}")
    opposite = w.let(f"fneg {shape.type} {chosen}")
    result = w.let(f"select {truth} {has(2)}, {shape.type} {opposite}, {shape.type} {chosen}")
    return _inlined(name, shape, w, result)


def _without(w: Writer, shape: Shape, x: str, count: str, unit: Sequence[float]) -> str:
    """Write x less a whole number of units, each unit given as a sum of exact parts."""
    for part in unit:
        x = w.add_product(shape, x, count, shape.number(-part))
    return x


def _polynomial(w: Writer, shape: Shape, x: str, coefficients: Sequence[float]) -> str:
    """Write a polynomial in Estrin's form, whose chain of operations is short."""
    terms = [shape.number(one) for one in coefficients]
    while len(terms) > 1:
        pairs = [terms[k : k + 2] for k in range(0, len(terms), 2)]
        terms = [p[0] if len(p) == 1 else w.add_product(shape, p[0], p[1], x) for p in pairs]
        x = w.arithmetic("fmul", shape, x, x)
    return terms[0]


def _inlined(name: str, shape: Shape, w: Writer, result: str) -> str:
    head = f"define internal {shape.type} @{name}_{shape.suffix}({shape.type} %x) alwaysinline"
    return "\n".join([f"{head} {{", *w.lines, f"  ret {shape.type} {result}", "}", ""])


def _functions(shape: Shape) -> dict[str, str]:
    """Return what is not an instruction of LLVM, by name."""
    return {
        f"@exp_{shape.suffix}": exponential(shape),
        **{f"@{name}_{shape.suffix}": sine(shape, name) for name in ("sin", "cos")},
    }


@dataclass(frozen=True)
class Part:
    """The values of a trace, or their tangents: the same arrays and steps for either."""

    shape: Shape
    mark: str  # of the names of its arrays
    p: tuple[Node | None, ...]
    r: tuple[Node, ...]
    x: tuple[Node, ...]
    rest: tuple[Node, ...]
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    clamped: tuple[Node, ...]


def simulation(traced: Trace, lanes: int) -> str:
    """Return the IR of ``rest`` and ``run`` for parameter sets side by side."""
    parts = [Part(Shape(lanes), "", *_fields(traced))]
    return _module(parts, {"rest": _rest(parts), "run": _run(parts, traced.u)})


def simulation_with_tangents(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``run`` for one parameter set and its derivatives."""
    parts = _with_tangents(traced, derived, directions)
    return _module(parts, {"rest": _rest(parts), "run": _run(parts, traced.u)})


def linearisation(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``motion``, the slopes at given states, with derivatives."""
    parts = _with_tangents(traced, derived, directions)
    return _module(parts, {"rest": _rest(parts), "motion": _motion(parts, traced.u)})


def _with_tangents(traced: Trace, derived: Tangents, directions: int) -> list[Part]:
    return [Part(Shape(1), "", *_fields(traced)), Part(Shape(directions), "d", *_fields(derived))]


EXTRA = {
    "rest": [],
    "motion": ["ptr noalias %u"],
    "run": ["ptr noalias %u", "double %h", "i64 %n", "i64 %m"],
}


def _module(parts: Sequence[Part], functions: Mapping[str, Writer]) -> str:
    shapes = dict.fromkeys(part.shape for part in parts)
    declarations = [
        f"declare {shape.type} @llvm.{name}.{shape.suffix}({shape.type})\n"
        for shape in shapes
        for name in INTRINSICS
    ]
    bodies = "".join(_function(name, body, parts) for name, body in functions.items())
    called = [
        text for shape in shapes for name, text in _functions(shape).items() if f"{name}(" in bodies
    ]
    return "".join([*declarations, *called, bodies])


def _fields(source: Trace | Tangents) -> tuple[tuple[Node, ...], ...]:
    names = ("p", "r", "x", "rest", "slopes", "outputs", "clamped")
    return tuple(getattr(source, name) for name in names)


def _function(name: str, body: Writer, parts: Sequence[Part]) -> str:
    arrays = [
        f"ptr noalias %{part.mark}{array}" for part in parts for array in ("p", "r", "x", "out")
    ]
    arguments = ", ".join([*arrays, *EXTRA[name]])
    head = f'define void @{name}({arguments}) "prefer-vector-width"="512" {{'
    return "\n".join([head, "entry:", *body.lines, "  ret void", "}", ""])


def _writer(parts: Sequence[Part]) -> Writer:
    return Writer(parts[0].shape, parts[-1].shape)


def _rest(parts: Sequence[Part]) -> Writer:
    w = _writer(parts)
    values: Values = {}
    for part in parts:
        values.update(_read(w, part, "p", part.p))
    for part in parts:
        results = w.compute(part.rest, values, part.shape)
        for row, result in enumerate(results):
            states = len(part.x)
            array, offset = ("x", 0) if row < states else ("r", states)
            w.store(result, f"%{part.mark}{array}", row - offset, part.shape)
    return w


def _motion(parts: Sequence[Part], inputs: Sequence[Node]) -> Writer:
    w = _writer(parts)
    values: Values = {}
    for part in parts:
        for array, nodes in (("p", part.p), ("r", part.r), ("x", part.x)):
            values.update(_read(w, part, array, nodes))
    values.update(_read(w, parts[0], "u", inputs))
    for part in parts:
        for row, slope in enumerate(w.compute(part.slopes, values, part.shape)):
            w.store(slope, f"%{part.mark}out", row, part.shape)
    return w


def _read(w: Writer, part: Part, array: str, nodes: Sequence[Node | None]) -> Values:
    return {
        node: w.load(f"%{part.mark}{array}", row, part.shape)
        for row, node in enumerate(nodes)
        if node is not None
    }


def _run(parts: Sequence[Part], inputs: Sequence[Node]) -> Writer:
    w = _writer(parts)
    fixed: Values = {}
    for part in parts:
        fixed.update(_read(w, part, "p", part.p))
        fixed.update(_read(w, part, "r", part.r))
    every = [node for part in parts for node in (*part.slopes, *part.outputs, *part.clamped)]
    w.prepare([n for n in in_order(every) if not n.varies and n.op != "symbol"], fixed)
    fractions = {
        name: _fraction(w, parts, divisor)
        for name, divisor in (("h", 1), ("2", 2), ("3", 3), ("6", 6))
    }
    slots = _slots(w, parts)
    count = w.let("sitofp i64 %m to double")
    share = w.let(f"fdiv double {Shape(1).number(1.0)}, {count}")
    w.put("br label %outer")

    w.label("outer")
    w.put("%k = phi i64 [0, %entry], [%k.next, %next]")
    now, change = _inputs(w, "%k", len(inputs), share)
    w.put("br label %inner")

    w.label("inner")
    w.put("%j = phi i64 [0, %outer], [%j.next, %inner]")
    at = w.let("sitofp i64 %j to double")
    later = w.let("icmp sgt i64 %j, 0")
    # what a later sub-step writes, the next step writes over: no branch is needed
    row = w.let(f"add i64 %k, {w.let(f'zext i1 {later} to i64')}")
    begin = [w.add_product(Shape(1), u, du, at) for u, du in zip(now, change, strict=True)]
    half = [
        w.add_product(Shape(1), u, du, Shape(1).number(0.5))
        for u, du in zip(begin, change, strict=True)
    ]
    end = [w.arithmetic("fadd", Shape(1), u, du) for u, du in zip(begin, change, strict=True)]
    levels = [_spread_inputs(w, inputs, u) for u in (begin, half, end)]
    x = _states(w, parts, slots)
    moved = _runge_kutta(w, parts, fixed, levels, x, fractions, row)
    clamped = {**fixed, **levels[2], **moved}
    for part in parts:
        for node, result in zip(part.x, w.compute(part.clamped, clamped, part.shape), strict=True):
            w.put(f"store {part.shape.type} {result}, ptr {slots[node]}, align 64")
    w.put("%j.next = add i64 %j, 1")
    w.put(f"br i1 {w.let('icmp slt i64 %j.next, %m')}, label %inner, label %next")

    w.label("next")
    w.put("%k.next = add i64 %k, 1")
    w.put(f"br i1 {w.let('icmp slt i64 %k.next, %n')}, label %outer, label %done")

    w.label("done")
    last, _ = _inputs(w, "%n", len(inputs), None)
    final = _states(w, parts, slots)
    values = {**fixed, **_spread_inputs(w, inputs, last), **final}
    for part in parts:
        _write_outputs(w, part, values, "%n")
        for row_, node in enumerate(part.x):
            w.store(final[node], f"%{part.mark}x", row_, part.shape)
    return w


def _fraction(w: Writer, parts: Sequence[Part], divisor: int) -> Mapping[Shape, str]:
    value = w.let(f"fdiv double %h, {Shape(1).number(divisor)}")
    return {part.shape: w.spread(value, part.shape) for part in parts}


def _slots(w: Writer, parts: Sequence[Part]) -> dict[Node, str]:
    slots = {}
    for part in parts:
        for row, node in enumerate(part.x):
            slots[node] = w.let(f"alloca {part.shape.type}, align 64")
            value = w.load(f"%{part.mark}x", row, part.shape)
            w.put(f"store {part.shape.type} {value}, ptr {slots[node]}, align 64")
    return slots


def _states(w: Writer, parts: Sequence[Part], slots: Mapping[Node, str]) -> Values:
    return {
        node: w.let(f"load {part.shape.type}, ptr {slots[node]}, align 64")
        for part in parts
        for node in part.x
    }


def _inputs(w: Writer, step: str, count: int, share: str | None) -> tuple[list[str], list[str]]:
    """Read the inputs at a step, and by how much they change over one of its sub-steps."""
    one = Shape(1)
    base = w.address("%u", w.let(f"mul i64 {step}, {count}"))
    now = [w.load(base, row, one) for row in range(count)]
    if share is None:
        return now, []
    then = [w.load(base, count + row, one) for row in range(count)]
    differences = [w.arithmetic("fsub", one, b, a) for a, b in zip(now, then, strict=True)]
    return now, [w.arithmetic("fmul", one, difference, share) for difference in differences]


def _spread_inputs(w: Writer, inputs: Sequence[Node], scalars: Sequence[str]) -> Values:
    return {node: w.spread(u, w.narrow) for node, u in zip(inputs, scalars, strict=True)}


def _write_outputs(w: Writer, part: Part, values: Values, row: str) -> None:
    offset = w.let(f"mul i64 {row}, {len(part.outputs) * part.shape.lanes}")
    base = w.address(f"%{part.mark}out", offset)
    for column, result in enumerate(w.compute(part.outputs, values, part.shape)):
        w.store(result, base, column, part.shape)


def _runge_kutta(
    w: Writer,
    parts: Sequence[Part],
    fixed: Values,
    levels: Sequence[Values],
    x: Values,
    fractions: Mapping[str, Mapping[Shape, str]],
    row: str,
) -> Values:
    """Write one step of the classical method and return the states after it."""
    total, stage = dict(x), dict(x)
    for weight, advance, level in (("6", "2", 0), ("3", "2", 1), ("3", "h", 1), ("6", None, 2)):
        values = {**fixed, **levels[level], **stage}
        if level == 0:
            for part in parts:
                _write_outputs(w, part, values, row)
        for part in parts:
            slopes = w.compute(part.slopes, values, part.shape)
            for node, slope in zip(part.x, slopes, strict=True):
                shape = part.shape
                total[node] = w.add_product(shape, total[node], fractions[weight][shape], slope)
                if advance is not None:
                    stage[node] = w.add_product(shape, x[node], fractions[advance][shape], slope)
    return total
