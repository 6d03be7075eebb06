"""Functions that are no instruction of LLVM: written inline, without a branch."""

import math
from collections.abc import Sequence

from exfit.engine.writer import Shape, Writer

LOG2_E = 1.0 / math.log(2.0)
LN2_HIGH, LN2_LOW = 6.93147180369123816490e-01, 1.90821492927058770002e-10  # ln 2 in two parts
ROUNDER = 1.5 * 2.0**52  # adding it leaves the nearest integer in the low bits
EXP_TERMS = 13
EXP_LIMIT = 700.0
QUARTER_HIGH, QUARTER_LOW = 1.57079632673412561417, 6.07710050650619224932e-11  # pi / 2 in two
SINE_TERMS = 10  # of either series, up to a rounding within an eighth of a turn


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


def functions(shape: Shape) -> dict[str, str]:
    """Collect by name the functions that LLVM has no instruction for."""
    return {
        f"@exp_{shape.suffix}": exponential(shape),
        **{f"@{name}_{shape.suffix}": sine(shape, name) for name in ("sin", "cos")},
    }
