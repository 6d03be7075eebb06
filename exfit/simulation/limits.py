"""The limits in a system's equations: what each holds, and the parameter that sets it."""

from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

from exfit.engine.system import System, Trace, trace
from exfit.engine.trace import Node, Signal, evaluate, in_order, larger, smaller
from exfit.plants import LIMITER_KINDS

Values = Mapping[str, float]

LIMITER_PREFIXES = tuple(f"{kind}." for kind in LIMITER_KINDS)  # of what belongs to a limiter
ROUNDING_AT_REST = 1e-9  # pu


class EquationLimit(NamedTuple):
    """A value of the graph that stops at a limit: a ceiling where ``sign`` is 1, a floor at -1.

    ``limit`` is the parameter that sets it, "0" for a state that cannot become negative; ``signal``
    is the state that is held or cut, "" where the value is none. A ``clamped`` value is never
    beyond its limit, as a state; any other is what the limited one would be without it.
    """

    limit: str
    signal: str
    sign: float
    value: Node
    bound: Node
    clamped: bool


@cache
def traced(system: System) -> Trace:
    """Return the graph of a system, with all its outputs."""
    return trace(system, system.outputs)


def at_rest(of: Trace, values: Values) -> dict[Node, Any]:
    """Values of the symbols of a graph at rest."""
    p = {node: values[_name(node)] for node in of.p}
    start = evaluate(of.rest, p)
    starts = zip((*of.x, *of.r), (start[node] for node in of.rest), strict=True)
    return {**p, **dict(starts), **dict.fromkeys(of.u, 0.0)}


def limits_passed(system: System, values: Values) -> str:
    """Name the limits that the start would have to pass, with both values."""
    of = traced(system)
    everything = evaluate([*of.slopes, *of.outputs, *of.clamped], at_rest(of, values))
    faults = []
    for node in [node for node in everything if node.op == "clip"]:
        x, low, high = (everything[operand] for operand in node.operands)
        for passed, limit, side in ((x > high, 2, "above"), (x < low, 1, "below")):
            name = limit_name(node.operands[limit])
            if passed and name and not name.startswith(LIMITER_PREFIXES):
                faults.append(
                    f"the start needs {x:.6g}, {side} {name} = {(low, high)[limit - 1]:.6g}"
                )
    return "; ".join(dict.fromkeys(faults))


def limit_name(node: Node) -> str:
    """Name the parameter that gives a limit: of all from which it is computed, the one named so."""
    symbols = [n for n in in_order([node]) if n.op == "symbol" and not n.varies]
    limits = [_name(n) for n in symbols if _is_limit(n)]
    return ", ".join(limits or map(_name, symbols))


@cache
def equation_limits(system: System) -> tuple[EquationLimit, ...]:
    """Return every limit of a system that is not infinite, in the order of the signal.

    They are its states' non-windup limits, its clamps, gates to a fixed parameter, and contacts
    that force a value to one; neither the arcs of a rectifier nor what only cannot be negative. A
    limiter of excitation is one limit by the name of its output, oel.OEL2C, whatever it has inside.
    """
    of = traced(system)
    states = {node: node for node in of.x}
    clamps = [(node, held) for node, held in zip(of.x, of.clamped, strict=True) if node is not held]
    found: list[EquationLimit | None] = []
    for state, held in clamps:
        _, low, high = held.operands
        found += [_limiter(state, bound, sign, state) for bound, sign in ((low, -1.0), (high, 1.0))]
    ours = {held for _, held in clamps}
    for node in in_order([*of.slopes, *of.outputs, *of.clamped]):
        if node not in ours:
            found += list(_clamp(node, states))
    limits = [limit for limit in found if limit is not None and not _inside_limiter(limit)]
    limits += _of_limiters(system)
    return tuple(sorted(dict.fromkeys(limits), key=lambda limit: limit.value.index))


def limiter_outputs(system: System) -> dict[str, Node]:
    """Return the outputs of a system's limiters by name."""
    names, of = set(system.states), traced(system)
    return {
        name: node
        for name, node in zip(system.outputs, of.outputs, strict=True)
        if name.startswith(LIMITER_PREFIXES) and name not in names
    }


def acting_at_rest(system: System, values: Values) -> str:
    """Name the limiters of excitation that act at the start already, and by how much."""
    rest = at_rest(traced(system), values)
    faults: dict[str, str] = {}
    for name, output in limiter_outputs(system).items():
        for limit in _gates_of(system, name, output):
            numbers = evaluate([limit.value, limit.bound], rest)
            value, bound = float(numbers[limit.value]), float(numbers[limit.bound])
            if limit.sign * (value - bound) > ROUNDING_AT_REST:
                own = f"with {value:.4g} pu" if limit.value is output else f"at {bound:.4g} pu"
                gate = "" if limit.value is output else f", where its gate has {value:.4g} pu"
                faults.setdefault(name, f"{name} acts at the start already, {own}{gate}")
    return "; ".join(faults.values())


def _of_limiters(system: System) -> Iterator[EquationLimit]:
    """Find limits that are limiters of excitation."""
    for name, output in limiter_outputs(system).items():
        yield from _gates_of(system, name, output)


def _gates_of(system: System, name: str, output: Node) -> Iterator[EquationLimit]:
    """Yield the gates at which a limiter takes over; the sum where it is added."""
    # an overexcitation limiter is a ceiling
    ceiling = "oel" in name.split(".")
    sign = 1.0 if ceiling else -1.0
    values = _values_at_gates(system, output, smaller if ceiling else larger)
    for value in values:
        yield EquationLimit(name, "", sign, value, output, False)
    if not values:
        zero = output.graph.constant(0.0)
        yield EquationLimit(name, "", -sign, output, zero, False)


def _values_at_gates(
    system: System, output: Node, nearer: Callable[[Signal, Signal], Signal]
) -> list[Node]:
    """Values in place of which a limiter acts: another's at its gate and the regulator's both."""
    of, limiters = traced(system), set(limiter_outputs(system).values())
    gates = {node: _gated(node, output) for node in in_order([*of.slopes, *of.outputs])}
    values: dict[Node, None] = {}
    for gate, value in gates.items():
        if value in limiters:
            others = _values_at_gates(system, gate, nearer)
            values |= dict.fromkeys(output.graph.lift(nearer(value, other)) for other in others)
        elif value is not None:
            values[value] = None
    return list(values)


def _gated(node: Node, output: Node) -> Node | None:
    """Node in place of which a node takes the output of a limiter; None where it does not."""
    if not any(operand is output for operand in node.operands[1:]):
        return None
    if node.op == "clip":
        return node.operands[0]
    condition, chosen, other = node.operands if node.op == "select" else (node, node, node)
    if condition.op != "<" or {*condition.operands} != {chosen, other}:
        return None
    return other if chosen is output else chosen


def _inside_limiter(limit: EquationLimit) -> bool:
    """Test whether a limit belongs to the equations of a limiter."""
    return limit.limit.startswith(LIMITER_PREFIXES) or limit.signal.startswith(LIMITER_PREFIXES)


def _clamp(node: Node, states: Mapping[Node, Node]) -> Iterator[EquationLimit | None]:
    """Yield the limits of a node that is a clamp, or a choice between a limit and a value."""
    if node.op == "clip":
        x, low, high = node.operands
        for bound, sign in ((low, -1.0), (high, 1.0)):
            clamped_there = x.op == "clip" and any(bound is operand for operand in x.operands)
            if limit_name(bound) and not clamped_there:
                yield _limiter(x, bound, sign, _state_in(x, states))
    elif node.op == "select" and node.operands[0].varies:
        yield from _choice(node, states)


def _choice(node: Node, states: Mapping[Node, Node]) -> Iterator[EquationLimit | None]:
    """Yield the limits of the higher or lower of two values, or of one forced by a contact."""
    condition, chosen, other = node.operands
    gate = condition.op == "<" and {*condition.operands} == {chosen, other}
    for bound, x in ((chosen, other), (other, chosen)):
        if gate and not bound.varies and any(_is_limit(n) for n in in_order([bound])):
            ceiling = chosen is condition.operands[0]
            yield _limiter(x, bound, 1.0 if ceiling else -1.0, _state_in(x, states))
        elif not gate and _is_limit(bound):
            yield EquationLimit(
                _given(bound), "", 1.0 if "MAX" in _name(bound) else -1.0, node, bound, True
            )


def _limiter(value: Node, bound: Node, sign: float, state: Node | None) -> EquationLimit | None:
    """Return a limit, None where it is infinite."""
    fixed = bound.constant
    if fixed is not None and abs(fixed) == float("inf"):
        return None
    name = _given(bound) if fixed is None else f"{fixed:g}"
    signal = "" if state is None else _name(state)
    return EquationLimit(name, signal, sign, value, bound, value is state)


def _given(bound: Node) -> str:
    """Parameter of a limit, also where it is computed at the start.

    Where a parameter may select that by being 0, the setpoint has its name with a 0 behind it.
    """
    computed = any(n.op == "symbol" and n.args[0].startswith("r.") for n in in_order([bound]))
    return limit_name(bound).removesuffix("0") if computed else limit_name(bound)


def _state_in(node: Node, states: Mapping[Node, Node]) -> Node | None:
    """State that a node is, or is unless its lag is bypassed."""
    if node.op == "select":
        branch_states = (_state_in(branch, states) for branch in node.operands[1:])
        return next((state for state in branch_states if state is not None), None)
    return states.get(node)


def _is_limit(node: Node) -> bool:
    return (
        node.op == "symbol" and not node.varies and ("MAX" in _name(node) or "MIN" in _name(node))
    )


def _name(symbol: Node) -> str:
    """Return the name of what a symbol of a trace stands for."""
    return str(symbol.args[0]).partition(".")[2]
