"""Limiters as parts of a plant: what they see, how they wait, where they act on the exciter."""

from collections.abc import Iterable
from functools import cache
from operator import add

from exfit.engine.system import Signals
from exfit.engine.trace import Graph, Node, Signal, in_order, larger, smaller
from exfit.models.blocks import Limited, quadratic
from exfit.models.sheet import Model
from exfit.plants import Attached, SaturationForm, inputs_at
from exfit.plants.parts import (
    UNLIMITED,
    Names,
    Part,
    exciter_inputs,
    exciter_output,
    output_of,
    states_at_rest,
)

Limiters = tuple[Attached, ...]


def states_of(limiters: Limiters) -> tuple[str, ...]:
    """Return the states of limiters by their names in the system."""
    return tuple(at.prefix + name for at in limiters for name in at.model.states)


def signals_of(limiters: Limiters) -> tuple[str, ...]:
    """Return the names of the outputs of limiters in the system."""
    return tuple(name for limiter in limiters for name in limiter.signals.values())


def sheets_of(limiters: Limiters) -> list[Part]:
    """Return the data sheets of limiters by how their parameters begin."""
    return [(limiter.prefix, limiter.model.sheet) for limiter in limiters]


def limiters_rest(limiters: Limiters, seen: Names, p: Signals) -> dict[str, Signal]:
    """Return the states of limiters that wait, under their names in the system."""
    states: dict[str, Signal] = {}
    for limiter in limiters:
        states |= states_at_rest(limiter.prefix, limiter.model, 0.0, seen, p)[1]
    return states


def limited_exciter(
    model: Model,
    saturation: SaturationForm,
    limiters: Limiters,
    seen: Names,
    p: Signals,
    state: Signals,
    d: Names,
) -> tuple[Signal, dict[str, Signal]]:
    """Write the slopes of an exciter and its limiters into ``d``.

    Return its output, and theirs by name in the system. At a gate of overexcitation the smaller of
    two limiters acts, at one of underexcitation the larger.
    """
    signals: dict[str, Signal] = {}
    inputs: dict[str, Signal] = {}
    for limiter in limiters:
        shown = output_of(limiter.prefix, limiter.model, seen, p, state, d)
        outputs = shown if isinstance(shown, tuple) else (shown,)
        signals |= zip(limiter.signals.values(), outputs, strict=True)
        for signal, name in inputs_at(limiter).items():
            both = add if name == "vsum" else smaller if name.startswith("voel") else larger
            inputs[name] = (
                both(inputs[name], signals[signal]) if name in inputs else signals[signal]
            )
    u = exciter_inputs(**{**vars(seen), **inputs})
    return exciter_output(model, saturation, u, p, state, d), signals


@cache
def inputs_for_limiters(exciter: Model) -> frozenset[str]:
    """Return the inputs for limiters that the equations of an exciter read."""
    graph = Graph()

    def symbols_named(names: Iterable[str]) -> dict[str, Node]:
        return {name: graph.symbol(name, varies=True) for name in names}

    limited = symbols_named(UNLIMITED)
    u = exciter_inputs(**symbols_named(("vref", "vt", "ifd")), **limited)
    values, d = symbols_named(row.symbol for row in exciter.sheet), Names()
    held = symbols_named((*exciter.states, *exciter.setpoints))
    efd = exciter_output(exciter, quadratic, u, values, held, d)
    slopes = (slope.slope if isinstance(slope, Limited) else slope for slope in vars(d).values())
    used = set(in_order([graph.lift(signal) for signal in (efd, *slopes)]))
    return frozenset(name for name, node in limited.items() if node in used)
