"""What the plants share: names of values, and an exciter as a part of a system."""

from collections.abc import Iterable, Mapping
from functools import partial
from math import inf
from types import SimpleNamespace
from typing import Any, TypeVar

from exfit.engine.system import Motion, Rest, Signals
from exfit.engine.trace import Signal
from exfit.errors import ModelError
from exfit.models.blocks import Limited
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet
from exfit.plants import SaturationForm

Component = TypeVar("Component", Model, Machine)
Part = tuple[str, Sheet]  # how the names of its parameters begin, and its data sheet
# what an exciter sees of limiters where none acts
UNLIMITED: Mapping[str, float] = {
    "vsum": 0.0,
    "vuel": -inf,
    "voel": inf,
    "vuel_out": -inf,
    "voel_out": inf,
}


class Names(SimpleNamespace):
    """Values by name, as a model reads and writes them."""

    def __getattr__(self, name: str) -> Any:
        raise ModelError(f"the model uses {name}, which its file does not declare")


def present(component: Component | None) -> Component:
    """Return a part of the equipment; raises ModelError where it is missing."""
    if component is None:
        raise ModelError("the plant lacks its exciter or its machine")
    return component


def initial(signal: str) -> str:
    """Return the parameter that holds a recorded signal's level at the start."""
    return f"{signal}0"


def exciter_inputs(**given: Signal) -> Names:
    """Inputs of an exciter, per unit: one that is not given does not act.

    ``vt`` terminal voltage, ``vc1`` the same with load compensation, ``ifd`` field current, ``p``
    and ``q`` active and reactive power of the machine, ``speed`` of the machine, ``vref``
    reference, ``vs`` stabiliser. Of the limiters: ``vsum`` what those of the summation kind add to
    the voltage error (under- and overexcitation and stator current), ``vuel`` and ``voel`` the
    takeover gates of under- and overexcitation, ``vuel_out`` and ``voel_out`` the gates that some
    models draw instead at the output of the regulator. A limiter of the stator current uses the
    gate of the side on which it acts.
    """
    still = {"vs": 0.0, "p": 0.0, "q": 0.0, "speed": 1.0}
    compensated = {"vc1": given["vt"]} if "vt" in given else {}
    return Names(**{**still, **UNLIMITED, **compensated, **given})


def exciter_parameters(p: Signals, model: Model, saturation: SaturationForm) -> Names:
    """Return the parameters of an exciter, with its saturation curve where it has one."""
    values = named_parameters(p, "", model.sheet)
    if {"E1", "SE1", "E2", "SE2"} <= vars(values).keys():
        points = {name: p[name] for name in ("E1", "SE1", "E2", "SE2")}
        values.saturation = partial(saturation, **points)
    return values


def named_parameters(p: Signals, prefix: str, rows: Sheet) -> Names:
    """Return the parameters of a part under the names of its data sheet."""
    return Names(**{row.symbol: p[prefix + row.symbol] for row in rows})


def symbols(*parts: Part) -> list[str]:
    """Return the parameters of parts."""
    return [prefix + row.symbol for prefix, rows in parts for row in rows]


def seconds(*parts: Part) -> tuple[str, ...]:
    """Return those of them that are time constants.

    A time that may be negative is a coefficient of a numerator, which has no motion of its own.
    """
    return tuple(
        prefix + row.symbol
        for prefix, rows in parts
        for row in rows
        if row.is_time and row.low >= 0.0
    )


def values_named(source: Signals, names: Iterable[str]) -> Names:
    """Return some values by name."""
    return Names(**{name: source[name] for name in names})


def output_of(prefix: str, model: Model, u: Names, p: Signals, state: Signals, d: Names) -> Signal:
    """Write the slopes of a stabiliser, governor or limiter into ``d`` and return its output.

    ``state`` holds its states and setpoints, which have the ``prefix`` in the system as its
    parameters have.
    """
    slopes = Names()
    s = Names(**{name: state[prefix + name] for name in (*model.states, *model.setpoints)})
    output = model.equations(s, u, named_parameters(p, prefix, model.sheet), slopes)
    vars(d).update({prefix + name: slope for name, slope in vars(slopes).items()})
    return output


def states_at_rest(
    prefix: str, model: Model, output: Signal, u: Names, p: Signals
) -> tuple[Signal, dict[str, Signal]]:
    """Return the reference of a stabiliser, governor or limiter, and its states in the system."""
    x = Names()
    reference = model.rest(output, u, named_parameters(p, prefix, model.sheet), x)
    return reference, {prefix + name: value for name, value in vars(x).items()}


def refuse_taken(model: Model, taken: Iterable[str]) -> None:
    """Raise ModelError where a state of the model has the name of something else."""
    clash = sorted({*model.states, *model.setpoints} & set(taken))
    if clash:
        raise ModelError(f"model {model.name}: STATES: {', '.join(clash)} is taken by the plant")


def motion(written: Names, states: tuple[str, ...], outputs: Signals) -> Motion:
    """Return slopes, limits and outputs from what a model wrote into its slopes."""
    slopes = vars(written)
    if slopes.keys() != set(states):
        wrong = ", ".join(sorted(slopes.keys() ^ set(states)))
        raise ModelError(f"states and slopes of the model do not match: {wrong}")
    return Motion(
        {name: s.slope if isinstance(s, Limited) else s for name, s in slopes.items()},
        {name: (s.low, s.high) for name, s in slopes.items() if isinstance(s, Limited)},
        outputs,
    )


def rest_of(model: Model, output: Signal, u: Names, p: Names) -> Rest:
    """Return an exciter's states that hold an output, and its setpoints with the reference."""
    x = Names()
    vref, written = model.rest(output, u, p, x), vars(x)
    if written.keys() != {*model.states, *model.setpoints}:
        wrong = ", ".join(sorted(written.keys() ^ {*model.states, *model.setpoints}))
        raise ModelError(f"states and rest of the model do not match: {wrong}")
    setpoints = {name: written[name] for name in model.setpoints}
    return Rest({name: written[name] for name in model.states}, {"vref": vref, **setpoints})


def exciter_output(
    model: Model, saturation: SaturationForm, u: Names, p: Signals, held: Signals, d: Names
) -> Signal:
    """Write the slopes of an exciter into ``d`` and return its output.

    ``held`` are its states, and the setpoints that it found at the start.
    """
    s = values_named(held, (*model.states, *model.setpoints))
    return model.equations(s, u, exciter_parameters(p, model, saturation), d)
