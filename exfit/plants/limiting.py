"""Limiters as parts of a plant: what they see, how they wait, where they act on the exciter."""

from collections.abc import Iterable, Sequence
from functools import cache

from exfit.engine.system import Signals
from exfit.engine.trace import Graph, Node, Signal, in_order, larger, smaller
from exfit.models.blocks import Limited, quadratic
from exfit.models.sheet import Model, Sheet
from exfit.plants.parts import (
    UNLIMITED,
    Names,
    exciter_inputs,
    exciter_parameters,
    named_parameters,
    output_of,
    seconds,
    symbols,
)
from exfit.plants.plant import Attached

GATES = {"takeover": "", "takeover-output": "_out"}  # how the inputs of an exciter end
SUMMING = "summing"
PLACES = (*GATES, SUMMING)


def acts_without_load(limiter: Attached) -> bool:
    """Test whether a limiter has something to limit on open circuit: the field current."""
    return limiter.model.inputs == ("ifd",)


def inputs_at(limiter: Attached) -> dict[str, str]:
    """Return the inputs of an exciter on which the outputs of a limiter act, by their names."""
    return {signal: _input_at(limiter.place, side) for side, signal in limiter.signals.items()}


def _input_at(place: str, side: str) -> str:
    return "vsum" if place == SUMMING else f"v{side}{GATES[place]}"


def states_of(limiters: Iterable[Attached]) -> tuple[str, ...]:
    """Return the states of limiters by their names in the system."""
    return tuple(at.prefix + name for at in limiters for name in at.model.states)


def signals_of(limiters: Iterable[Attached]) -> tuple[str, ...]:
    """Return the names of the outputs of limiters in the system."""
    return tuple(name for limiter in limiters for name in limiter.signals.values())


def sheets_of(limiters: Iterable[Attached]) -> tuple[tuple[str, Sheet], ...]:
    """Return the data sheets of limiters by how their parameters begin."""
    return tuple((limiter.prefix, limiter.model.sheet) for limiter in limiters)


def symbols_of(limiters: Iterable[Attached]) -> list[str]:
    """Return the parameters of limiters."""
    return [name for prefix, rows in sheets_of(limiters) for name in symbols(prefix, rows)]


def seconds_of(limiters: Iterable[Attached]) -> list[str]:
    """Return those of them that are time constants."""
    return [name for prefix, rows in sheets_of(limiters) for name in seconds(prefix, rows)]


def limiters_rest(limiters: Iterable[Attached], seen: Names, p: Signals) -> dict[str, Signal]:
    """Return the states of limiters that wait, under their names in the system."""
    states: dict[str, Signal] = {}
    for limiter in limiters:
        x = Names()
        limiter.model.rest(0.0, seen, named_parameters(p, limiter.prefix, limiter.model.sheet), x)
        states |= {limiter.prefix + name: value for name, value in vars(x).items()}
    return states


def limiting(
    limiters: Sequence[Attached], seen: Names, p: Signals, x: Signals, d: Names
) -> dict[str, Signal]:
    """Write the slopes of limiters into ``d`` and return their outputs by name in the system."""
    signals: dict[str, Signal] = {}
    for limiter in limiters:
        output = output_of(limiter.prefix, limiter.model, seen, p, x, d)
        outputs = output if isinstance(output, tuple) else (output,)
        signals |= zip(limiter.signals.values(), outputs, strict=True)
    return signals


def limited_inputs(limiters: Iterable[Attached], signals: Signals) -> dict[str, Signal]:
    """Inputs of an exciter by limiters whose outputs are given.

    At a gate of overexcitation the smaller of two acts, at one of underexcitation the larger.
    """
    inputs: dict[str, Signal] = {}
    for limiter in limiters:
        for output, name in inputs_at(limiter).items():
            signal = signals[output]
            inputs[name] = _both(name, inputs[name], signal) if name in inputs else signal
    return inputs


def _both(name: str, a: Signal, b: Signal) -> Signal:
    """Combine two limiters at one input of an exciter."""
    if name == "vsum":
        return a + b
    return smaller(a, b) if name.startswith("voel") else larger(a, b)


@cache
def inputs_for_limiters(exciter: Model) -> frozenset[str]:
    """Return the inputs for limiters that the equations of an exciter read."""
    graph = Graph()

    def symbols_named(names: Iterable[str]) -> dict[str, Node]:
        return {name: graph.symbol(name, varies=True) for name in names}

    given = symbols_named(("vref", "vt", "ifd"))
    limited = symbols_named(UNLIMITED)
    d, values = Names(), symbols_named(row.symbol for row in exciter.sheet)
    states = Names(**symbols_named((*exciter.states, *exciter.setpoints)))
    u, p = exciter_inputs(**given, **limited), exciter_parameters(values, exciter, quadratic)
    efd = exciter.equations(states, u, p, d)
    slopes = (slope.slope if isinstance(slope, Limited) else slope for slope in vars(d).values())
    used = set(in_order([graph.lift(signal) for signal in (efd, *slopes)]))
    return frozenset(name for name, node in limited.items() if node in used)
