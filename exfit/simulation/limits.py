"""The limits in a system's equations: what sets each, and how a response meets it."""

from collections.abc import Callable, Container, Iterator, Mapping
from functools import cache
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.system import System, Trace, trace
from exfit.engine.trace import Node, Signal, evaluate, in_order, larger, smaller
from exfit.models.governor_parts import AT_LIMIT
from exfit.plants import GOVERNOR
from exfit.simulation.limit_hits import LIMITER_PREFIXES, LimitHit
from exfit.simulation.simulator import Run, Simulator
from exfit.util.arrays import Array

Values = Mapping[str, float]
Spans = tuple[tuple[float, float], ...]

ROUNDING_AT_REST = 1e-9  # pu
# of a limit: a state put back on it is that near, one that passes by does not
LIMIT_ROUNDING = 1e-9
POINTS_AT_ONCE = 16384  # of a run: the values of a whole graph along them take 50 MB


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


class Extreme(NamedTuple):
    """Largest move of a signal towards a limit: its ``share`` of the way from zero to it."""

    limit: str
    share: float


class Followed(NamedTuple):
    """A limiter along a run: its value and its bound (n,), and where it is held."""

    limiter: EquationLimit
    value: Array
    bound: Array
    held: NDArray[np.bool_]


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
    faults = [
        f"the start needs {start:.6g}, {side} {name} = {limit:.6g}"
        for name, limit, start, side in governor_limits_passed(system, values)
        if abs(start - limit) > AT_LIMIT
    ]
    for node in [node for node in everything if node.op == "clip"]:
        x, low, high = (everything[operand] for operand in node.operands)
        for passed, limit, side in ((x > high, 2, "above"), (x < low, 1, "below")):
            name = _limit_name(node.operands[limit])
            if passed and name and not name.startswith(LIMITER_PREFIXES):
                faults.append(
                    f"the start needs {x:.6g}, {side} {name} = {(low, high)[limit - 1]:.6g}"
                )
    return "; ".join(dict.fromkeys(faults))


def governor_limits_passed(
    system: System, values: Values
) -> Iterator[tuple[str, float, float, str]]:
    """Yield (limit, its value, that of the start, which side) of what a governor starts beyond."""
    of = traced(system)
    start = at_rest(of, values)
    for node in of.r:
        name = _given(node)
        if name.startswith(GOVERNOR) and name in values and name != _name(node):
            limit, needed = values[name], float(start[node])
            if abs(needed - limit) > ROUNDING_AT_REST:
                yield name, limit, needed, "above" if needed > limit else "below"


def acting_at_rest(system: System, values: Values) -> str:
    """Name the limiters of excitation that act at the start already, and by how much."""
    rest = at_rest(traced(system), values)
    faults: dict[str, str] = {}
    for limit, output in _limiter_gates(system):
        numbers = evaluate([limit.value, limit.bound], rest)
        value, bound = float(numbers[limit.value]), float(numbers[limit.bound])
        if limit.sign * (value - bound) > ROUNDING_AT_REST:
            own = f"with {value:.4g} pu" if limit.value is output else f"at {bound:.4g} pu"
            gate = "" if limit.value is output else f", where its gate has {value:.4g} pu"
            faults.setdefault(limit.limit, f"{limit.limit} acts at the start already, {own}{gate}")
    return "; ".join(faults.values())


@cache
def equation_limits(system: System) -> tuple[EquationLimit, ...]:
    """Return every limit of a system that is not infinite, in the order of the signal.

    They are its states' non-windup limits, its clamps, gates to a fixed parameter, and contacts
    that force a value to one; neither the arcs of a rectifier nor what only cannot be negative, nor
    the lower of two ceilings, which is a bound itself. A limiter of excitation is one limit by the
    name of its output, oel.OEL2C, whatever it has inside.
    """
    limits = [
        limit
        for limit in _of_nodes(traced(system))
        if not limit.limit.startswith(LIMITER_PREFIXES)
        if not limit.signal.startswith(LIMITER_PREFIXES)
    ]
    limits += [limit for limit, _ in _limiter_gates(system)]
    return tuple(sorted(dict.fromkeys(limits), key=lambda limit: limit.value.index))


def _of_nodes(of: Trace) -> Iterator[EquationLimit]:
    states = set(of.x)
    clamps = {held: x for x, held in zip(of.x, of.clamped, strict=True) if x is not held}
    for held, state in clamps.items():
        _, low, high = held.operands
        yield from _limit(state, low, -1.0, state)
        yield from _limit(state, high, 1.0, state)
    nodes = [*in_order([*of.slopes, *of.outputs, *of.clamped])]
    bounds = {bound for node in nodes if node.op == "clip" for bound in node.operands[1:]}
    for node in nodes:
        if node.op == "clip" and node not in clamps:
            yield from _clamp(node, states)
        elif node.op == "select" and node.operands[0].varies and node not in bounds:
            yield from _choice(node, states)


def _clamp(node: Node, states: Container[Node]) -> Iterator[EquationLimit]:
    x, low, high = node.operands
    for bound, sign in ((low, -1.0), (high, 1.0)):
        clamped_there = x.op == "clip" and any(bound is operand for operand in x.operands)
        if _limit_name(bound) and not clamped_there:
            yield from _limit(x, bound, sign, _state_in(x, states))


def _choice(node: Node, states: Container[Node]) -> Iterator[EquationLimit]:
    """Yield the limits of the higher or lower of two values, or of one forced by a contact."""
    condition, chosen, other = node.operands
    gate = condition.op == "<" and {*condition.operands} == {chosen, other}
    for bound, x in ((chosen, other), (other, chosen)):
        if gate and not bound.varies and any(_is_limit(n) for n in in_order([bound])):
            ceiling = chosen is condition.operands[0]
            yield from _limit(x, bound, 1.0 if ceiling else -1.0, _state_in(x, states))
        elif not gate and _is_limit(bound):
            sign = 1.0 if "MAX" in _name(bound) else -1.0
            yield EquationLimit(_given(bound), "", sign, node, bound, True)


def _limit(value: Node, bound: Node, sign: float, state: Node | None) -> Iterator[EquationLimit]:
    fixed = bound.constant
    if fixed is None or isfinite(fixed):
        name = _limit_name(bound) if fixed is None else f"{fixed:g}"
        signal = "" if state is None else _name(state)
        yield EquationLimit(name, signal, sign, value, bound, value is state)


def _limiter_gates(system: System) -> Iterator[tuple[EquationLimit, Node]]:
    """Yield the gates at which a limiter takes over, with its output; the sum where it is added."""
    for name, output in limiter_outputs(system).items():
        # an overexcitation limiter is a ceiling
        ceiling = "oel" in name.split(".")
        sign = 1.0 if ceiling else -1.0
        values = _values_at_gates(system, output, smaller if ceiling else larger)
        for value in values:
            yield EquationLimit(name, "", sign, value, output, False), output
        if not values:
            zero = output.graph.constant(0.0)
            yield EquationLimit(name, "", -sign, output, zero, False), output


def limiter_outputs(system: System) -> dict[str, Node]:
    """Return the outputs of a system's limiters by name."""
    return {
        name: node
        for name, node in zip(system.outputs, traced(system).outputs, strict=True)
        if name.startswith(LIMITER_PREFIXES) and name not in system.states
    }


def _values_at_gates(
    system: System, output: Node, nearer: Callable[[Signal, Signal], Signal]
) -> list[Node]:
    """Values in place of which a limiter acts: another's at its gate and the regulator's both."""
    of, limiters = traced(system), set(limiter_outputs(system).values())
    values: dict[Node, None] = {}
    for gate in in_order([*of.slopes, *of.outputs]):
        value = _gated(gate, output)
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


def _limit_name(node: Node) -> str:
    """Name the parameter that gives a limit: of all from which it is computed, the one named so.

    Of the lower of two ceilings it is the one that is a parameter itself.
    """
    symbols = [n for n in in_order([node]) if n.op == "symbol" and not n.varies]
    gated = [n for n in node.operands if _is_limit(n)] if node.op == "select" else []
    limits = gated or [n for n in symbols if _is_limit(n)]
    return ", ".join(dict.fromkeys(map(_given, limits or symbols)))


def _given(symbol: Node) -> str:
    """Parameter of a limit; a setpoint that takes its place has its name with a 0 behind it."""
    computed = symbol.args[0].startswith("r.")
    return _name(symbol).removesuffix("0") if computed else _name(symbol)


def _state_in(node: Node, states: Container[Node]) -> Node | None:
    """State that a node is, or is unless its lag is bypassed."""
    if node.op == "select":
        branch_states = (_state_in(branch, states) for branch in node.operands[1:])
        return next((state for state in branch_states if state is not None), None)
    return node if node in states else None


def _is_limit(node: Node) -> bool:
    return (
        node.op == "symbol" and not node.varies and ("MAX" in _name(node) or "MIN" in _name(node))
    )


def _name(symbol: Node) -> str:
    return str(symbol.args[0]).partition(".")[2]


def limits_hit(simulator: Simulator, values: Values) -> tuple[LimitHit, ...]:
    """Find the limits that the response to these values meets, in the order of their instants.

    A state is at its non-windup limit while it is on it, within rounding; any other value
    while it would be beyond. Found at every point of the simulation's grid, whose step is how
    exactly the times are known. ``values`` are the parameters of the system; per unit.

    Raises SimulationError where the start is no rest.
    """
    run, followed = _along_run(simulator, values)
    alike: dict[tuple[str, str, float], list[Followed]] = {}
    for each in followed:  # a drawing has once what holds one signal at one limit
        alike.setdefault(each.limiter[:3], []).append(each)
    hits = []
    for (limit, signal, _), same in alike.items():
        held = np.any([each.held for each in same], axis=0)
        if not np.any(held):
            continue
        first = int(np.argmax(held))
        value = next(float(each.bound[first]) for each in same if each.held[first])
        seconds = float(np.trapezoid(held.astype(np.float64), run.time))
        at, share = float(run.time[first]), seconds / float(np.ptp(run.time))
        hits.append(LimitHit(limit, signal, value, seconds, at + simulator.delay, share))
    return tuple(sorted(hits, key=lambda hit: hit.first))


def limiters_held(simulator: Simulator, values: Values) -> Iterator[tuple[str, Spans]]:
    """Yield the limiters of excitation that act, with the first and last instant of each time."""
    run, followed = _along_run(simulator, values)
    time = run.time + simulator.delay
    for name in limiter_outputs(simulator.system):
        held = np.any([side.held for side in followed if side.limiter.limit == name], axis=0)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
        if len(edges):
            ends = time[edges[::2]].tolist(), time[edges[1::2] - 1].tolist()
            yield name, tuple(zip(*ends, strict=True))


def extremes(simulator: Simulator, values: Values) -> tuple[Extreme, ...]:
    """Largest move of the response towards each of its limits, 1 or more where it met them.

    Left out is what was always on the other side of zero. Raises SimulationError where the start
    is no rest.
    """
    reached = []
    for limiter, value, bound, held in _along_run(simulator, values)[1]:
        sides = limiter.sign * bound > 0.0
        if np.any(sides):
            share = float(np.max(value[sides] / bound[sides]))
            if share > 0.0 and np.isfinite(share):
                reached.append(Extreme(limiter.limit, max(share, 1.0) if np.any(held) else share))
    return tuple(reached)


def limits_at_rest(system: System, values: Values) -> tuple[str, ...]:
    """Find limits on which a system rests, so that even a small deviation may meet them.

    ``values`` are the parameters of the system.
    """
    limiters = equation_limits(system)
    targets = [node for limiter in limiters for node in (limiter.value, limiter.bound)]
    rest = evaluate(targets, at_rest(traced(system), values))
    names = []
    for limiter in limiters:
        value, bound = float(rest[limiter.value]), float(rest[limiter.bound])
        near = LIMIT_ROUNDING * max(abs(value), abs(bound))
        if isfinite(bound) and abs(value - bound) <= near:
            names.append(limiter.limit)
    return tuple(dict.fromkeys(names))


def _along_run(simulator: Simulator, values: Values) -> tuple[Run, list[Followed]]:
    """Return a run with every limiter of the system along it."""
    system, run = simulator.system, simulator.run(values)
    of, limiters, count = traced(system), equation_limits(system), len(run.time)
    fixed = at_rest(of, values)
    signals = [run.outputs[name] for name in system.states]
    signals += [run.inputs[name] for name in system.inputs]
    targets = [node for limiter in limiters for node in (limiter.value, limiter.bound)]
    along = np.empty((len(targets), count))
    for first in range(0, count, POINTS_AT_ONCE):
        now = slice(first, first + POINTS_AT_ONCE)
        here = {node: y[now] for node, y in zip((*of.x, *of.u), signals, strict=True)}
        evaluated = evaluate(targets, {**fixed, **here})
        for row, node in zip(along, targets, strict=True):
            row[now] = evaluated[node]
    followed = []
    for limiter, value, bound in zip(limiters, along[::2], along[1::2], strict=True):
        beyond = limiter.sign * (value - bound)
        near = LIMIT_ROUNDING * np.maximum(np.abs(bound), np.abs(value))
        # a limit of zero has no size of its own
        near = np.maximum(near, LIMIT_ROUNDING * np.max(np.abs(value), initial=0.0))
        held = beyond >= -near if limiter.clamped else beyond > near
        followed.append(Followed(limiter, value, bound, held & np.isfinite(bound)))
    return run, followed
