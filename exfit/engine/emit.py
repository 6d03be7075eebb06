"""From a traced system to LLVM IR: two functions, ``rest`` and ``run``.

The value of a node is ``lanes`` numbers side by side, one per parameter set. With tangents there is
one set, and a wide node holds one number per direction of differentiation. All arrays that the
functions take are rows of such values; ``run`` is the classical Runge-Kutta method of order four.
What LLVM has no instruction for is written inline, without a branch.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.driver import along, at_rest, sampled
from exfit.engine.system import Trace
from exfit.engine.tangents import Tangents
from exfit.engine.trace import Node, in_order
from exfit.engine.writer import INTRINSICS, WEIGHTS, Shape, Values, Writer, plan

STEPS = {"rest": [], "motion": [], "run": ["double %h", "i64 %n", "i64 %m"]}

LOG2_E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # ln 2 in two parts
ROUNDER = 1.5 * 2.0**52  # adding it leaves the nearest integer in the low bits
EXP_TERMS = 13
EXP_LIMIT = 700.0
QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417, 6.07710050650619224932e-11  # pi / 2 in two
SINE_TERMS = 10  # of either series, up to a rounding within an eighth of a turn


@dataclass(frozen=True)
class TracePart:
    """The values of a trace, or their tangents: the same arrays and steps for either."""

    nodes: Trace | Tangents
    shape: Shape
    mark: str = ""  # of the names of its arrays

    @property
    def inputs(self) -> tuple[Node, ...]:
        """The inputs that the arrays of a run hold: of tangents, those that move."""
        return tuple(node for node in self.nodes.u if node is not None)

    @property
    def input_shape(self) -> Shape:
        """The shape of an input: all parameter sets have the same, each direction its own."""
        return self.shape if self.mark else Shape(1)

    def read(self, w: Writer, arrays: str) -> Values:
        """Read what some arrays of this part hold, "pr" of parameters and setpoints."""
        return {
            node: w.load(f"%{self.mark}{array}", row, self.shape)
            for array in arrays
            for row, node in enumerate(getattr(self.nodes, array))
            if node is not None
        }


Parts = Sequence[TracePart]


def simulation(traced: Trace, lanes: int) -> str:
    """Return the IR of ``rest`` and ``run`` for parameter sets side by side."""
    parts = [TracePart(traced, Shape(lanes))]
    around = sampled(lanes, len(traced.outputs), 0, 0)
    return module(parts, {"rest": rest_function(parts), "run": _run(parts)}, around)


def simulation_with_tangents(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``run`` for one parameter set and its derivatives."""
    parts = [TracePart(traced, Shape(1)), TracePart(derived, Shape(directions), "d")]
    around = sampled(1, len(traced.outputs), directions, len(parts[1].inputs))
    return module(parts, {"rest": rest_function(parts), "run": _run(parts)}, around)


def linearisation(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``motion``, the slopes at given states, with derivatives."""
    parts = [TracePart(traced, Shape(1)), TracePart(derived, Shape(directions), "d")]
    states = len(traced.x)
    around = at_rest(len(traced.p), states, directions) + along(states, len(traced.u), directions)
    return module(parts, {"rest": rest_function(parts), "motion": _motion(parts)}, around)


def module(parts: Parts, functions: Mapping[str, Writer], around: str) -> str:
    """Return the functions of a system, with those ``around`` that call them."""
    shapes = dict.fromkeys(part.shape for part in parts)
    declarations = [
        f"declare {shape.type} @llvm.{name}.{shape.suffix}({shape.type})\n"
        for shape in shapes
        for name in INTRINSICS
    ]
    declarations += [
        f"declare {shape.type} @llvm.fmuladd.{shape.suffix}({', '.join([shape.type] * 3)})\n"
        for shape in dict.fromkeys((Shape(1), *shapes))
    ]
    bodies = "".join(_function(name, body, parts) for name, body in functions.items())
    inlined: dict[str, str] = {}
    for shape in shapes:
        inlined[f"@exp_{shape.suffix}("] = exponential(shape)
        inlined |= {f"@{name}_{shape.suffix}(": sine(shape, name) for name in ("sin", "cos")}
    called = [text for name, text in inlined.items() if name in bodies or name in around]
    return "".join([*declarations, *called, bodies, around, WEIGHTS])


def _function(name: str, body: Writer, parts: Parts) -> str:
    arrays = [
        f"ptr noalias %{part.mark}{array}" for part in parts for array in ("p", "r", "x", "out")
    ]
    driven = [part for part in parts if name != "rest" and (part.inputs or not part.mark)]
    inputs = [f"ptr noalias %{part.mark}u" for part in driven]
    arguments = ", ".join([*arrays, *inputs, *STEPS[name]])
    # realigned: a vector of 512 bits on the stack else lies across two lines of the cache
    head = f'define void @{name}({arguments}) "prefer-vector-width"="512" "stackrealign" {{'
    return "\n".join([head, "entry:", *body.lines, "  ret void", "}", ""])


def rest_function(parts: Parts) -> Writer:
    """Write the function of the start at rest."""
    w = Writer(parts[0].shape, parts[-1].shape)
    values = _merged(part.read(w, "p") for part in parts)
    w.prepare([node for part in parts for node in part.nodes.rest], values)
    for part in parts:
        for row, result in enumerate(w.results(part.nodes.rest, values, part.shape)):
            states = len(part.nodes.x)
            array, offset = ("x", 0) if row < states else ("r", states)
            w.store(result, f"%{part.mark}{array}", row - offset, part.shape)
    return w


def _motion(parts: Parts) -> Writer:
    w = Writer(parts[0].shape, parts[-1].shape)
    values = _merged(part.read(w, "prx") for part in parts)
    values.update(parts[0].read(w, "u"))
    w.prepare([node for part in parts for node in part.nodes.slopes], values)
    for part in parts:
        for row, slope in enumerate(w.results(part.nodes.slopes, values, part.shape)):
            w.store(slope, f"%{part.mark}out", row, part.shape)
    return w


def _run(parts: Parts) -> Writer:
    """Write the loop over the steps of a run, and within it that over their sub-steps."""
    w = Writer(parts[0].shape, parts[-1].shape)
    # of a whole run: parameters, setpoints, and what follows from them alone
    fixed = _merged(part.read(w, "pr") for part in parts)
    traces = [part.nodes for part in parts]
    nodes = [node for of in traces for node in (*of.slopes, *of.outputs, *of.clamped)]
    w.prepare([n for n in in_order(nodes) if not n.varies and n.op != "symbol"], fixed)
    fractions = {}
    for name, divisor in (("h", 1), ("2", 2), ("3", 3), ("6", 6)):
        value = w.let(f"fdiv double %h, {Shape(1).number(divisor)}")
        fractions[name] = {part.shape: w.spread(value, part.shape) for part in parts}
    slots = _slots(w, parts)
    count = w.let("sitofp i64 %m to double")
    share = w.let(f"fdiv double {Shape(1).number(1.0)}, {count}")
    w.put("br label %outer")

    w.label("outer")
    w.put("%k = phi i64 [0, %entry], [%k.next, %next]")
    inputs = [_inputs(w, part, "%k", share) for part in parts]
    w.put("br label %inner")

    w.label("inner")
    w.put("%j = phi i64 [0, %outer], [%j.next, %again]")
    _write_substep(w, parts, fixed, inputs, slots, fractions)
    w.put("br label %again")

    w.label("again")
    w.put("%j.next = add i64 %j, 1")
    w.put(f"br i1 {w.let('icmp slt i64 %j.next, %m')}, label %inner, label %next")

    w.label("next")
    w.put("%k.next = add i64 %k, 1")
    w.put(f"br i1 {w.let('icmp slt i64 %k.next, %n')}, label %outer, label %done")

    w.label("done")
    last = [_inputs(w, part, "%n", None)[0] for part in parts]
    final = _states(w, parts, slots)
    levels = [_in_every_lane(w, part, u) for part, u in zip(parts, last, strict=True)]
    _write_outputs(w, parts, {**fixed, **_merged(levels), **final}, "%n")
    for part in parts:
        for row, node in enumerate(part.nodes.x):
            w.store(final[node], f"%{part.mark}x", row, part.shape)
    return w


def _slots(w: Writer, parts: Parts) -> dict[Node, str]:
    slots: dict[Node, str] = {}
    for part in parts:
        for row, node in enumerate(part.nodes.x):
            slots[node] = w.let(f"alloca {part.shape.type}, align 64")
            value = w.load(f"%{part.mark}x", row, part.shape)
            w.put(f"store {part.shape.type} {value}, ptr {slots[node]}, align 64")
    return slots


def _write_substep(
    w: Writer,
    parts: Parts,
    fixed: Values,
    inputs: Sequence[tuple[list[str], list[str]]],
    slots: Mapping[Node, str],
    fractions: Mapping[str, Mapping[Shape, str]],
) -> None:
    """Write one sub-step of the classical method: the outputs before it, the states after it."""
    at = w.let("sitofp i64 %j to double")
    later = w.let("icmp sgt i64 %j, 0")
    # what a later sub-step writes, the next step writes over: no branch is needed
    row = w.let(f"add i64 %k, {w.let(f'zext i1 {later} to i64')}")
    driving = [_levels(w, part, *read, at) for part, read in zip(parts, inputs, strict=True)]
    levels = [_merged(at_once) for at_once in zip(*driving, strict=True)]
    x = _states(w, parts, slots)
    total, stage = dict(x), dict(x)
    steps = plan([n for part in parts for n in part.nodes.slopes], fixed | levels[0] | x)
    for weight, advance, level in (("6", "2", 0), ("3", "2", 1), ("3", "h", 1), ("6", None, 2)):
        values = {**fixed, **levels[level], **stage}
        w.follow(steps, values)
        if level == 0:
            _write_outputs(w, parts, values, row)
        for part in parts:
            shape, slopes = part.shape, w.results(part.nodes.slopes, values, part.shape)
            for node, slope in zip(part.nodes.x, slopes, strict=True):
                total[node] = w.add_product(shape, total[node], fractions[weight][shape], slope)
                if advance is not None:
                    stage[node] = w.add_product(shape, x[node], fractions[advance][shape], slope)
    values = {**fixed, **levels[2], **total}
    w.prepare([node for part in parts for node in part.nodes.clamped], values)
    for part in parts:
        results = w.results(part.nodes.clamped, values, part.shape)
        for node, result in zip(part.nodes.x, results, strict=True):
            w.put(f"store {part.shape.type} {result}, ptr {slots[node]}, align 64")


def _states(w: Writer, parts: Parts, slots: Mapping[Node, str]) -> Values:
    return {
        node: w.let(f"load {part.shape.type}, ptr {slots[node]}, align 64")
        for part in parts
        for node in part.nodes.x
    }


def _inputs(
    w: Writer, part: TracePart, step: str, share: str | None
) -> tuple[list[str], list[str]]:
    """Read the inputs at a step, and by how much they change over one of its sub-steps."""
    shape, count = part.input_shape, len(part.inputs)
    if not count:
        return [], []
    base = w.address(f"%{part.mark}u", w.let(f"mul i64 {step}, {count * shape.lanes}"))
    now = [w.load(base, row, shape) for row in range(count)]
    if share is None:
        return now, []
    then = [w.load(base, count + row, shape) for row in range(count)]
    differences = [w.arithmetic("fsub", shape, b, a) for a, b in zip(now, then, strict=True)]
    shares = w.spread(share, shape)
    return now, [w.arithmetic("fmul", shape, difference, shares) for difference in differences]


def _levels(
    w: Writer, part: TracePart, now: Sequence[str], change: Sequence[str], at: str
) -> list[Values]:
    """Write the inputs where a sub-step begins, in its middle and where it ends."""
    shape = part.input_shape
    count, middle = w.spread(at, shape) if now else at, shape.number(0.5)
    begin = [w.add_product(shape, u, du, count) for u, du in zip(now, change, strict=True)]
    half = [w.add_product(shape, u, du, middle) for u, du in zip(begin, change, strict=True)]
    end = [w.arithmetic("fadd", shape, u, du) for u, du in zip(begin, change, strict=True)]
    return [_in_every_lane(w, part, u) for u in (begin, half, end)]


def _in_every_lane(w: Writer, part: TracePart, inputs: Sequence[str]) -> Values:
    one_for_all = part.input_shape != part.shape
    return {
        node: w.spread(u, part.shape) if one_for_all else u
        for node, u in zip(part.inputs, inputs, strict=True)
    }


def _merged(parts: Iterable[Values]) -> Values:
    return {node: name for values in parts for node, name in values.items()}


def _write_outputs(w: Writer, parts: Parts, values: Values, row: str) -> None:
    w.prepare([node for part in parts for node in part.nodes.outputs], values)
    for part in parts:
        offset = w.let(f"mul i64 {row}, {len(part.nodes.outputs) * part.shape.lanes}")
        base = w.address(f"%{part.mark}out", offset)
        for column, result in enumerate(w.results(part.nodes.outputs, values, part.shape)):
            w.store(result, base, column, part.shape)


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
    terms = [shape.number(coefficient) for coefficient in coefficients]
    while len(terms) > 1:
        pairs = [terms[k : k + 2] for k in range(0, len(terms), 2)]
        terms = [p[0] if len(p) == 1 else w.add_product(shape, p[0], p[1], x) for p in pairs]
        x = w.arithmetic("fmul", shape, x, x)
    return terms[0]


def _inlined(name: str, shape: Shape, w: Writer, result: str) -> str:
    head = f"define internal {shape.type} @{name}_{shape.suffix}({shape.type} %x) alwaysinline"
    return "\n".join([f"{head} {{", *w.lines, f"  ret {shape.type} {result}", "}", ""])
