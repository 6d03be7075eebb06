"""A traced system whose limits, gates and bypasses are decided before a step, not within it.

Every choice that varies becomes a bit, its mode. Between two crossings all modes stay, so that the
equations are smooth and a Runge-Kutta step has its full order; the guard tells when one does not
hold any more. A state at a limit that moves follows that limit, and so does the integral of a PID
that would otherwise hunt along its limit: both are then functions of the other states.
"""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial, reduce
from itertools import groupby
from math import inf
from typing import NamedTuple

from exfit.engine.system import Trace
from exfit.engine.tangents import tangents
from exfit.engine.trace import Graph, Node, Signal

NEVER = 1e30  # the margin of a condition that does not vary
NEAR = 1e-9  # pu: a signal so near to its limit is on it


class Hold(NamedTuple):
    """What holds a state x: its slope ``free`` is zero while ``y`` is beyond ``low`` or ``high``.

    ``y`` is the state itself where a limit puts it back, else the output that it is part of.
    """

    x: Node
    free: Node
    y: Node
    low: Node | None
    high: Node | None


class LimitSide(NamedTuple):
    """One limit of a state: its modes, of which at most one is set, and how they are decided.

    ``sign`` is 1 for an upper limit. ``follows`` is the mode in which the state moves with its
    limit, ``waits`` that in which the integral of a PID stands still beyond it.
    """

    sign: float
    state: int
    stop: Hold
    limit: Node
    follows: Node
    waits: Node | None


class Modes(NamedTuple):
    """The modes of a system: bits, and what each is after a crossing, from bits ``before``."""

    bits: tuple[Node, ...]
    first: tuple[Node, ...]  # from the natural equations
    final: tuple[Node, ...]  # from the equations with the first ones


class LocatedTrace(NamedTuple):
    """A trace with modes: the nodes that a run with located crossings computes.

    ``v`` are the slopes of the inputs, ``w`` those of the states at a sample; ``states`` are the
    states with those that follow a limit put there, ``guard`` is positive once a mode is wrong.
    """

    traced: Trace
    v: tuple[Node, ...]
    w: tuple[Node, ...]
    modes: Modes
    signs: tuple[Node, ...]
    states: tuple[Node, ...]
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    guard: Node
    guard_rate: Node
    rates: tuple[Node, ...]  # of the states, also of those that follow a limit
    output_rates: tuple[Node, ...]
    clamp_rates: tuple[Node, ...]  # of the clamped states, as the inputs move


class _Frozen:
    """Rewrites nodes so that every choice that varies is made by a mode."""

    def __init__(self, choices: "_Choices", states: Mapping[Node, Node]) -> None:
        self.choices, self.graph = choices, choices.graph
        self.known: dict[Node, Node] = dict(states)

    def __call__(self, node: Node) -> Node:
        if not node.varies or node.op == "symbol":
            return self.known.get(node, node)
        if node not in self.known:
            self.known[node] = self._rewritten(node)
        return self.known[node]

    def _rewritten(self, node: Node) -> Node:
        if node.op == "clip":
            return self(_within(node, self.choices.limits))
        if node.op == "select":
            condition, a, b = node.operands
            if condition.varies:
                condition = self.choices.mode(condition)
            return self.graph.select(condition, self(a), self(b))
        return self.graph.apply(node.op, *(self(operand) for operand in node.operands))


class _Choices:
    """The conditions that vary, each with its mode, in the order in which they are met."""

    def __init__(self, graph: Graph, traced: Trace) -> None:
        self.graph = graph
        self.modes: dict[Node, Node] = {}
        self.limits = {  # of the states that are put back
            x: (held.operands[1], held.operands[2])
            for x, held in zip(traced.x, traced.clamped, strict=True)
            if held is not x
        }

    def mode(self, condition: Node) -> Node:
        if condition not in self.modes:
            name = f"mode.{len(self.modes)}"
            self.modes[condition] = self.graph.symbol(name, varies=True)
        return self.modes[condition]


def located(traced: Trace, inputs: Sequence[str], names: Sequence[str]) -> LocatedTrace:
    """Give a trace modes; ``inputs`` and ``names`` are those of its inputs and states."""
    graph = traced.x[0].graph
    v = tuple(graph.symbol(f"v.{name}", varies=True) for name in inputs)
    w = tuple(graph.symbol(f"w.{name}", varies=True) for name in names)
    stops = [
        _of_limits(stop_of(x, slope), x, held, slope)
        for x, slope, held in zip(traced.x, traced.slopes, traced.clamped, strict=True)
    ]
    sides = _sides(stops, names)
    choices = _Choices(graph, traced)
    frozen, gains = _projected(choices, traced, sides)
    slopes = tuple(
        frozen(slope) if stop is None else _held_slope(frozen(stop.free), k, sides)
        for k, (slope, stop) in enumerate(zip(traced.slopes, stops, strict=True))
    )
    outputs = tuple(frozen(output) for output in traced.outputs)
    driven = dict(zip(traced.u, v, strict=True))
    motion = dict(zip(traced.x, slopes, strict=True)) | driven
    decide = _Decisions(frozen, motion, gains)
    first: dict[Node, Node] = {}
    final: dict[Node, Node] = {}
    for side in sides:
        first |= decide.first(side)
        final |= decide.final(side)
    guards = [decide.guard(own) for own in _by_state(sides)]
    signs = _guard_conditions(choices, frozen, guards)
    first = {mode: condition for condition, mode in choices.modes.items()} | first
    final = {mode: mode for mode in choices.modes.values()} | final
    guard = reduce(_larger, guards, graph.constant(-NEVER))
    return LocatedTrace(
        traced=traced,
        v=v,
        w=w,
        modes=Modes(tuple(first), tuple(first.values()), tuple(final[bit] for bit in first)),
        signs=signs,
        states=tuple(frozen(x) for x in traced.x),
        slopes=slopes,
        outputs=outputs,
        guard=guard,
        guard_rate=decide.rate(guard),
        rates=_rates(traced, slopes, sides, decide),
        output_rates=tuple(tangents(outputs, dict(zip(traced.x, w, strict=True)) | driven)),
        clamp_rates=tuple(tangents(traced.clamped, driven)),
    )


def _rates(
    traced: Trace, slopes: Sequence[Node], sides: Sequence[LimitSide], decide: "_Decisions"
) -> tuple[Node, ...]:
    """How fast the states move, also those that follow a limit."""
    following = {side.state for side in sides if _moves(side)}
    return tuple(
        decide.rate(decide.frozen(x)) if k in following else slope
        for k, (x, slope) in enumerate(zip(traced.x, slopes, strict=True))
    )


def _sides(stops: Sequence[Hold | None], names: Sequence[str]) -> list[LimitSide]:
    """The limits of the states, each with symbols for its modes."""
    sides = []
    for k, stop in enumerate(stops):
        for sign, limit in ((1.0, stop.high), (-1.0, stop.low)) if stop else ():
            if limit is not None and stop is not None:
                symbol = partial(limit.graph.symbol, varies=True)
                name = f"{'high' if sign > 0.0 else 'low'}.{names[k]}"
                waits = None if stop.y is stop.x else symbol(f"waits.{name}")
                sides.append(LimitSide(sign, k, stop, limit, symbol(f"follows.{name}"), waits))
    return sides


def _by_state(sides: Sequence[LimitSide]) -> Iterator[list[LimitSide]]:
    for _, own in groupby(sides, key=lambda side: side.state):
        yield list(own)


def _projected(
    choices: "_Choices", traced: Trace, sides: Sequence[LimitSide]
) -> "tuple[_Frozen, dict[LimitSide, Node]]":
    """What rewrites nodes, with the states that follow a limit put there, and the PIDs' gains."""
    frozen = _Frozen(choices, dict(zip(traced.x, traced.x, strict=True)))
    gains = {
        side: tangents([frozen(side.stop.y)], {side.stop.x: side.limit.graph.constant(1.0)})[0]
        for side in sides
        if side.waits is not None
    }
    for _ in range(2 if any(_moves(side) for side in sides) else 0):
        # a limit that depends on its own state is met by the second Newton step
        put = _put(frozen, traced, sides, gains)
        frozen = _Frozen(choices, dict(zip(traced.x, put, strict=True)))
    return frozen, gains


def _guard_conditions(
    choices: "_Choices", frozen: "_Frozen", guards: list[Node]
) -> tuple[Node, ...]:
    """Add the margins of all conditions to the guards, and return the symbols of their signs."""
    signs: dict[Node, Node] = {}
    while pending := [each for each in choices.modes if each not in signs]:
        # the margins of some conditions have conditions themselves
        for condition in pending:
            graph = condition.graph
            signs[condition] = graph.symbol(f"sign.{len(signs)}", varies=True)
            guards.append(graph.multiply(signs[condition], _margin(condition, frozen)))
    return tuple(signs.values())


def stop_of(x: Node, slope: Node) -> Hold | None:
    """Recognise ``where(outward, 0, free)`` as the blocks with limits write it."""
    if slope.op != "select" or slope.operands[1].constant != 0.0:
        return None
    outward, _, free = slope.operands
    low: Node | None = None
    high: Node | None = None
    signals = set[Node]()
    for term in outward.operands if outward.op == "|" else (outward,):
        if term.op != "&" or [part.op for part in term.operands] != ["<=", "<"]:
            return None
        (a, b), pushes = term.operands[0].operands, term.operands[1].operands
        if pushes[1] is free and pushes[0].constant == 0.0:
            high, y = a, b
        elif pushes[0] is free and pushes[1].constant == 0.0:
            y, low = a, b
        else:
            return None
        signals.add(y)
    return Hold(x, free, signals.pop(), low, high) if len(signals) == 1 else None


def _of_limits(stop: Hold | None, x: Node, held: Node, slope: Node) -> Hold | None:
    """Hold of a state that has limits, also where its slope does not tell it."""
    if held is x or (stop is not None and stop.y is x):
        return stop
    low, high = (None if limit.constant in (-inf, inf) else limit for limit in held.operands[1:])
    return Hold(x, slope, x, low, high)


def _within(clip: Node, limits: Mapping[Node, tuple[Node, Node]]) -> Node:
    """A clip as choices; a state within its own limits needs none, where it is not bypassed."""
    graph, (x, *bounds) = clip.graph, clip.operands
    if x.op == "select" and not x.operands[0].varies:
        condition, *branches = x.operands
        clips = (graph.clip(branch, *bounds) for branch in branches)
        return graph.select(
            condition, *(_within(each, limits) if each.op == "clip" else each for each in clips)
        )
    own = limits.get(x)
    if own is not None and own[0] is bounds[0] and own[1] is bounds[1]:
        return x
    return _expanded(clip)


def _expanded(clip: Node) -> Node:
    """A clip as two choices."""
    graph, (x, low, high) = clip.graph, clip.operands
    raised = graph.select(graph.compare("<", x, low), low, x)
    return graph.select(graph.compare("<", high, raised), high, raised)


def _moves(side: LimitSide) -> bool:
    return side.limit.varies or side.waits is not None


def _put(
    frozen: _Frozen, traced: Trace, sides: Sequence[LimitSide], gains: Mapping[LimitSide, Node]
) -> list[Node]:
    """Put the states that follow a limit there."""
    states = [frozen(x) for x in traced.x]
    for side in sides:
        if _moves(side):
            x, limit = states[side.state], frozen(side.limit)
            there = limit
            if side.waits is not None:
                there = x + (limit - frozen(side.stop.y)) / gains[side]
            states[side.state] = x.graph.select(side.follows, there, x)
    return states


def _held_slope(free: Node, state: int, sides: Sequence[LimitSide]) -> Node:
    for side in sides:
        if side.state == state:
            for bit in (side.follows, side.waits):
                if bit is not None:
                    free = free.graph.select(bit, 0.0, free)
    return free


class _Decisions:
    """How modes of states are decided, and when they do not hold any more."""

    def __init__(
        self, frozen: _Frozen, motion: Mapping[Node, Node], gains: Mapping[LimitSide, Node]
    ) -> None:
        self.frozen, self.motion, self.gains = frozen, motion, gains

    def rate(self, node: Node) -> Node:
        """Derivative of a node to time."""
        return tangents([node], self.motion)[0]

    def first(self, side: LimitSide) -> dict[Node, Node]:
        """Decide by the natural equations: at a limit, and pushed beyond it."""
        graph, stop = side.limit.graph, side.stop
        pushed = _positive(side.sign * stop.free)
        if side.waits is None:
            there = side.limit <= stop.y if side.sign > 0.0 else stop.y <= side.limit
            return {side.follows: there & pushed}
        never = graph.compare("<", 1.0, graph.lift(0.0))
        return {
            side.follows: never,
            side.waits: graph.compare("<", -NEAR, self._beyond(side)) & pushed,
        }

    def final(self, side: LimitSide) -> dict[Node, Node]:
        """Decide by how the state and its limit move, with the modes that were decided first."""
        stop = side.stop
        if side.waits is None:
            if not side.limit.varies:
                return {side.follows: side.follows}
            away = self.frozen(stop.free) - self.rate(self.frozen(side.limit))
            there = side.limit <= stop.y if side.sign > 0.0 else stop.y <= side.limit
            return {side.follows: there & _positive(side.sign * away)}
        graph, beyond = side.limit.graph, self._beyond(side)
        active = graph.compare("<", -NEAR, beyond) & _positive(side.sign * stop.free)
        waiting, moving = self._drift(side)
        return {
            side.follows: active & (beyond < NEAR) & (waiting <= 0.0) & (moving >= 0.0),
            side.waits: active & ((beyond >= NEAR) | _positive(waiting)),
        }

    def guard(self, sides: Sequence[LimitSide]) -> Node:
        """Positive once a state is beyond a limit, or leaves one that held it."""
        graph, stop = sides[0].limit.graph, sides[0].stop
        y, free = self.frozen(stop.y), self.frozen(stop.free)
        passed = []
        for side in sides:
            beyond = side.sign * (y - self.frozen(side.limit))
            waits = side.waits is not None
            passed.append(_smaller(beyond, side.sign * free) if waits else beyond)
        guard = reduce(_larger, passed)
        for side in sides:
            limit = self.frozen(side.limit)
            if side.waits is None:
                moved = self.rate(limit) if limit.varies else 0.0
                guard = graph.select(side.follows, side.sign * (moved - free), guard)
            else:
                waiting, moving = self._drift(side)
                back = _larger(side.sign * (limit - y), -(side.sign * free))
                guard = graph.select(side.waits, back, guard)
                guard = graph.select(side.follows, _larger(waiting, -moving), guard)
        return guard

    @staticmethod
    def _beyond(side: LimitSide) -> Node:
        return side.sign * (side.stop.y - side.limit)

    def _drift(self, side: LimitSide) -> tuple[Node, Node]:
        """How fast a PID's output passes its limit while its integral waits, and while it moves."""
        y, limit, x = (self.frozen(node) for node in (side.stop.y, side.limit, side.stop.x))
        gain = self.gains[side]
        waits = side.sign * (self.rate(y) - gain * self.rate(x) - self.rate(limit))
        return waits, waits + side.sign * gain * self.frozen(side.stop.free)


def _margin(condition: Node, frozen: _Frozen) -> Node:
    """A number that is positive where a condition holds, and crosses zero where that changes."""
    graph = condition.graph
    if not condition.varies:
        return graph.select(condition, NEVER, -NEVER)
    a, b = condition.operands
    if condition.op in ("<", "<="):
        return graph.subtract(frozen(b), frozen(a))
    first, second = _margin(a, frozen), _margin(b, frozen)
    return _smaller(first, second) if condition.op == "&" else _larger(first, second)


def _larger(a: Node, b: Node) -> Node:
    """The larger of two numbers, without a mode or a branch."""
    return a.graph.apply("larger", a, b)


def _smaller(a: Node, b: Node) -> Node:
    return -_larger(-a, -b)


def _positive(x: Signal) -> Signal:
    return x > 0.0
