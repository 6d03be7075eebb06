"""What the engine simulates: a closed set of equations, and its trace."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

from exfit.engine.trace import Graph, Node, Signal, in_order

Signals = Mapping[str, Signal]


class Rest(NamedTuple):
    """The start of a run: the states at rest, and the setpoints that keep them there."""

    states: Signals
    setpoints: Signals


class Motion(NamedTuple):
    """The slopes and signals of one instant; ``limits`` holds (low, high) of non-windup states."""

    slopes: Signals
    limits: Mapping[str, tuple[Signal, Signal]]
    outputs: Signals


@dataclass(frozen=True)
class System:
    """Equations with the names of all that enters and leaves them.

    ``rest(p)`` starts a run; ``motion(p, r, x, u)`` gives its slopes, from parameters,
    setpoints, states and inputs by name.
    """

    parameters: tuple[str, ...]
    setpoints: tuple[str, ...]
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    time_constants: tuple[str, ...]  # the parameters in seconds
    rest: Callable[[Signals], Rest]
    motion: Callable[[Signals, Signals, Signals, Signals], Motion]


class Trace(NamedTuple):
    """The graph of a system: its symbols, and what is computed from them."""

    p: tuple[Node, ...]
    r: tuple[Node, ...]
    x: tuple[Node, ...]
    u: tuple[Node, ...]
    rest: tuple[Node, ...]  # states, then setpoints
    slopes: tuple[Node, ...]
    outputs: tuple[Node, ...]
    clamped: tuple[Node, ...]  # the states after a step, back within their limits

    @property
    def text(self) -> str:
        """The graph in full, and which of its nodes these are; before it is differentiated."""
        lines = [str(node) for node in self.x[0].graph.nodes]
        groups = [[node.index for node in group] for group in self]
        return "\n".join([*lines, *map(str, groups)])


def trace(system: System, outputs: Sequence[str]) -> Trace:
    """Run the equations of a system once on symbols; ``outputs`` are those wanted of it."""
    graph = Graph()
    p = {name: graph.symbol(f"p.{name}", varies=False) for name in system.parameters}
    r = {name: graph.symbol(f"r.{name}", varies=False) for name in system.setpoints}
    x = {name: graph.symbol(f"x.{name}", varies=True) for name in system.states}
    u = {name: graph.symbol(f"u.{name}", varies=True) for name in system.inputs}
    start = system.rest(p)
    motion = system.motion(p, r, x, u)
    clamped = [
        graph.clip(x[name], *motion.limits[name]) if name in motion.limits else x[name]
        for name in system.states
    ]
    return Trace(
        p=tuple(p.values()),
        r=tuple(r.values()),
        x=tuple(x.values()),
        u=tuple(u.values()),
        rest=(
            *(graph.lift(start.states[name]) for name in system.states),
            *(graph.lift(start.setpoints[name]) for name in system.setpoints),
        ),
        slopes=tuple(graph.lift(motion.slopes[name]) for name in system.states),
        outputs=tuple(graph.lift(motion.outputs[name]) for name in outputs),
        clamped=tuple(clamped),
    )


@cache
def whole_trace(system: System) -> Trace:
    """Return the trace of a system with all its outputs, to be read: nobody adds to its graph."""
    return trace(system, system.outputs)


def traced_for(system: System, outputs: Sequence[str]) -> Trace:
    """Return the same trace with some of the outputs alone."""
    whole = whole_trace(system)
    nodes = dict(zip(system.outputs, whole.outputs, strict=True))
    return whole._replace(outputs=tuple(nodes[name] for name in outputs))


@cache
def parameters_used(system: System, outputs: tuple[str, ...] | None = None) -> frozenset[str]:
    """Name parameters on which a response of the system, or of some outputs, can depend."""
    of = traced_for(system, system.outputs if outputs is None else outputs)
    targets = [*of.rest, *of.slopes, *of.outputs, *of.clamped]
    reached = {node.index for node in in_order(targets)}
    pairs = zip(system.parameters, of.p, strict=True)
    return frozenset(name for name, node in pairs if node.index in reached)


@cache
def time_constants(system: System) -> tuple[str, ...]:
    """Return the parameters in seconds that matter to the response."""
    used = parameters_used(system)
    return tuple(name for name in system.time_constants if name in used)
