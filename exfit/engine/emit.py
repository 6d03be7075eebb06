"""From a traced system to LLVM IR: two functions, ``rest`` and ``run``.

The value of a node is ``lanes`` numbers side by side, one per parameter set. With tangents there is
one set, and a wide node holds one number per direction of differentiation. All arrays that the
functions take are rows of such values; ``run`` is the classical Runge-Kutta method of order four.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.driver import along, at_rest, sampled
from exfit.engine.functions import functions as inlined
from exfit.engine.system import Tangents, Trace
from exfit.engine.trace import Node, in_order
from exfit.engine.writer import INTRINSICS, WEIGHTS, Shape, Values, Writer


@dataclass(frozen=True)
class TracePart:
    """The values of a trace, or their tangents: the same arrays and steps for either."""

    shape: Shape
    mark: str  # of the names of its arrays
    p: tuple[Node | None, ...]
    r: tuple[Node, ...]
    x: tuple[Node, ...]
    u: tuple[Node | None, ...]
    rest: tuple[Node, ...]
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    clamped: tuple[Node, ...]

    @property
    def inputs(self) -> tuple[Node, ...]:
        """The inputs that the arrays of a run hold: of tangents, those that move."""
        return tuple(node for node in self.u if node is not None)

    @property
    def input_shape(self) -> Shape:
        """The shape of an input: all parameter sets have the same, each direction its own."""
        return self.shape if self.mark else Shape(1)


def simulation(traced: Trace, lanes: int) -> str:
    """Return the IR of ``rest`` and ``run`` for parameter sets side by side."""
    parts = [TracePart(Shape(lanes), "", *_fields(traced))]
    around = sampled(lanes, len(traced.outputs), 0, 0)
    return _module(parts, {"rest": _rest(parts), "run": _run(parts)}, around)


def simulation_with_tangents(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``run`` for one parameter set and its derivatives."""
    parts = _with_tangents(traced, derived, directions)
    around = sampled(1, len(traced.outputs), directions, len(parts[1].inputs))
    return _module(parts, {"rest": _rest(parts), "run": _run(parts)}, around)


def linearisation(traced: Trace, derived: Tangents, directions: int) -> str:
    """Return the IR of ``rest`` and ``motion``, the slopes at given states, with derivatives."""
    parts = _with_tangents(traced, derived, directions)
    states = len(traced.x)
    around = at_rest(len(traced.p), states, directions) + along(states, len(traced.u), directions)
    return _module(parts, {"rest": _rest(parts), "motion": _motion(parts)}, around)


def _with_tangents(traced: Trace, derived: Tangents, directions: int) -> list[TracePart]:
    return [
        TracePart(Shape(1), "", *_fields(traced)),
        TracePart(Shape(directions), "d", *_fields(derived)),
    ]


STEPS = {"rest": [], "motion": [], "run": ["double %h", "i64 %n", "i64 %m"]}


def _module(parts: Sequence[TracePart], functions: Mapping[str, Writer], around: str) -> str:
    """Return the functions of a system, with those ``around`` that call them."""
    shapes = dict.fromkeys(part.shape for part in parts)
    declarations = [
        f"declare {shape.type} @llvm.{name}.{shape.suffix}({shape.type})\n"
        for shape in shapes
        for name in INTRINSICS
    ]
    declarations += [
        f"declare {t} @llvm.fmuladd.{suffix}({t}, {t}, {t})\n"
        for t, suffix in dict.fromkeys((shape.type, shape.suffix) for shape in (Shape(1), *shapes))
    ]
    bodies = "".join(_function(name, body, parts) for name, body in functions.items())
    called = [
        text for shape in shapes for name, text in inlined(shape).items() if f"{name}(" in bodies
    ]
    return "".join([*declarations, *called, bodies, around, WEIGHTS])


def _fields(source: Trace | Tangents) -> tuple[tuple[Node, ...], ...]:
    names = ("p", "r", "x", "u", "rest", "slopes", "outputs", "clamped")
    return tuple(getattr(source, name) for name in names)


def _function(name: str, body: Writer, parts: Sequence[TracePart]) -> str:
    arrays = [
        f"ptr noalias %{part.mark}{array}" for part in parts for array in ("p", "r", "x", "out")
    ]
    driven = [part for part in parts if name != "rest" and (part.inputs or not part.mark)]
    inputs = [f"ptr noalias %{part.mark}u" for part in driven]
    arguments = ", ".join([*arrays, *inputs, *STEPS[name]])
    # realigned: a vector of 512 bits on the stack else lies across two lines of the cache
    head = f'define void @{name}({arguments}) "prefer-vector-width"="512" "stackrealign" {{'
    return "\n".join([head, "entry:", *body.lines, "  ret void", "}", ""])


def _writer(parts: Sequence[TracePart]) -> Writer:
    return Writer(parts[0].shape, parts[-1].shape)


def _rest(parts: Sequence[TracePart]) -> Writer:
    w = _writer(parts)
    values: Values = {}
    for part in parts:
        values.update(_read(w, part, "p", part.p))
    w.prepare([node for part in parts for node in part.rest], values)
    for part in parts:
        for row, result in enumerate(w.results(part.rest, values, part.shape)):
            states = len(part.x)
            array, offset = ("x", 0) if row < states else ("r", states)
            w.store(result, f"%{part.mark}{array}", row - offset, part.shape)
    return w


def _motion(parts: Sequence[TracePart]) -> Writer:
    w = _writer(parts)
    values: Values = {}
    for part in parts:
        for array, nodes in (("p", part.p), ("r", part.r), ("x", part.x)):
            values.update(_read(w, part, array, nodes))
    values.update(_read(w, parts[0], "u", parts[0].u))
    w.prepare([node for part in parts for node in part.slopes], values)
    for part in parts:
        for row, slope in enumerate(w.results(part.slopes, values, part.shape)):
            w.store(slope, f"%{part.mark}out", row, part.shape)
    return w


def _read(w: Writer, part: TracePart, array: str, nodes: Sequence[Node | None]) -> Values:
    return {
        node: w.load(f"%{part.mark}{array}", row, part.shape)
        for row, node in enumerate(nodes)
        if node is not None
    }


def _run(parts: Sequence[TracePart]) -> Writer:
    """Write the loop over the steps of a run, and within it that over their sub-steps."""
    w = _writer(parts)
    fixed = _fixed_values(w, parts)
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
    _write_end(w, parts, fixed, slots)
    return w


def _fixed_values(w: Writer, parts: Sequence[TracePart]) -> Values:
    """Write the values of a whole run: parameters, setpoints, and what follows from them alone."""
    fixed: Values = {}
    for part in parts:
        fixed.update(_read(w, part, "p", part.p))
        fixed.update(_read(w, part, "r", part.r))
    nodes = [node for part in parts for node in (*part.slopes, *part.outputs, *part.clamped)]
    w.prepare([n for n in in_order(nodes) if not n.varies and n.op != "symbol"], fixed)
    return fixed


def _write_substep(
    w: Writer,
    parts: Sequence[TracePart],
    fixed: Values,
    inputs: Sequence[tuple[list[str], list[str]]],
    slots: Mapping[Node, str],
    fractions: Mapping[str, Mapping[Shape, str]],
) -> None:
    """Write one sub-step: the outputs before it, and the states after it, within their limits."""
    at = w.let("sitofp i64 %j to double")
    later = w.let("icmp sgt i64 %j, 0")
    # what a later sub-step writes, the next step writes over: no branch is needed
    row = w.let(f"add i64 %k, {w.let(f'zext i1 {later} to i64')}")
    driving = [_levels(w, part, *read, at) for part, read in zip(parts, inputs, strict=True)]
    levels = [_merged(at_once) for at_once in zip(*driving, strict=True)]
    x = _states(w, parts, slots)
    stepped = _runge_kutta(w, parts, fixed, levels, x, fractions, row)
    values = {**fixed, **levels[2], **stepped}
    w.prepare([node for part in parts for node in part.clamped], values)
    for part in parts:
        for node, result in zip(part.x, w.results(part.clamped, values, part.shape), strict=True):
            w.put(f"store {part.shape.type} {result}, ptr {slots[node]}, align 64")


def _write_end(
    w: Writer, parts: Sequence[TracePart], fixed: Values, slots: Mapping[Node, str]
) -> None:
    """Write the outputs at the last point of the grid, and the states there."""
    last = [_inputs(w, part, "%n", None)[0] for part in parts]
    final = _states(w, parts, slots)
    levels = [_in_every_lane(w, part, u) for part, u in zip(parts, last, strict=True)]
    values = {**fixed, **_merged(levels), **final}
    _write_outputs(w, parts, values, "%n")
    for part in parts:
        for row, node in enumerate(part.x):
            w.store(final[node], f"%{part.mark}x", row, part.shape)


def _fraction(w: Writer, parts: Sequence[TracePart], divisor: int) -> Mapping[Shape, str]:
    value = w.let(f"fdiv double %h, {Shape(1).number(divisor)}")
    return {part.shape: w.spread(value, part.shape) for part in parts}


def _slots(w: Writer, parts: Sequence[TracePart]) -> dict[Node, str]:
    slots = {}
    for part in parts:
        for row, node in enumerate(part.x):
            slots[node] = w.let(f"alloca {part.shape.type}, align 64")
            value = w.load(f"%{part.mark}x", row, part.shape)
            w.put(f"store {part.shape.type} {value}, ptr {slots[node]}, align 64")
    return slots


def _states(w: Writer, parts: Sequence[TracePart], slots: Mapping[Node, str]) -> Values:
    return {
        node: w.let(f"load {part.shape.type}, ptr {slots[node]}, align 64")
        for part in parts
        for node in part.x
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


def _write_outputs(w: Writer, parts: Sequence[TracePart], values: Values, row: str) -> None:
    w.prepare([node for part in parts for node in part.outputs], values)
    for part in parts:
        offset = w.let(f"mul i64 {row}, {len(part.outputs) * part.shape.lanes}")
        base = w.address(f"%{part.mark}out", offset)
        for column, result in enumerate(w.results(part.outputs, values, part.shape)):
            w.store(result, base, column, part.shape)


def _runge_kutta(
    w: Writer,
    parts: Sequence[TracePart],
    fixed: Values,
    levels: Sequence[Values],
    x: Values,
    fractions: Mapping[str, Mapping[Shape, str]],
    row: str,
) -> Values:
    """Write one step of the classical method and return the states after it."""
    total, stage = dict(x), dict(x)
    slopes = [node for part in parts for node in part.slopes]
    steps = w.plan(slopes, _merged([fixed, levels[0], x]))
    for weight, advance, level in (("6", "2", 0), ("3", "2", 1), ("3", "h", 1), ("6", None, 2)):
        values = {**fixed, **levels[level], **stage}
        w.follow(steps, values)
        if level == 0:
            _write_outputs(w, parts, values, row)
        for part in parts:
            shape = part.shape
            for node, slope in zip(part.x, w.results(part.slopes, values, shape), strict=True):
                total[node] = w.add_product(shape, total[node], fractions[weight][shape], slope)
                if advance is not None:
                    stage[node] = w.add_product(shape, x[node], fractions[advance][shape], slope)
    return total
