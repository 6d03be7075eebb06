"""From a traced system to LLVM IR: two functions, ``rest`` and ``run``.

The value of a node is ``lanes`` numbers side by side, one per parameter set. With tangents there is
one set, and a wide node holds one number per direction of differentiation. All arrays that the
functions take are rows of such values; ``run`` is the classical Runge-Kutta method of order four.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.functions import functions as inlined
from exfit.engine.system import Tangents, Trace
from exfit.engine.trace import Node, in_order
from exfit.engine.writer import INTRINSICS, Shape, Values, Writer


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
        text for shape in shapes for name, text in inlined(shape).items() if f"{name}(" in bodies
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
