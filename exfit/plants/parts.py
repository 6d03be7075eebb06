"""What the plants share: names of values, and an exciter as a part of a system."""

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from math import inf
from types import SimpleNamespace
from typing import Any, NamedTuple

from exfit.engine.system import Motion, Signals
from exfit.engine.trace import Signal
from exfit.errors import ModelError
from exfit.models.blocks import Limited, Saturation, exponential, exponential_se, quadratic
from exfit.models.sheet import Model, Sheet

SaturationForm = Callable[..., Saturation]

SATURATION: Mapping[str, SaturationForm] = {
    "quadratic": quadratic,
    "exponential": exponential,
    "exponential-se": exponential_se,
}

# how the names of parameters begin, and the states of a stabiliser and a governor
MACHINE = "machine."
NETWORK = "network."
STABILISER = "stabiliser."
GOVERNOR = "governor."
VT0 = "vt0"
DRIVING_SCALE = "driving_scale"  # what a recorded input is multiplied by

MEASURED = "vc1"  # the voltage that the exciter measures: an output, and an input added to it

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
    values = Names(**{row.symbol: p[row.symbol] for row in model.sheet})
    if {"E1", "SE1", "E2", "SE2"} <= vars(values).keys():
        points = {name: p[name] for name in ("E1", "SE1", "E2", "SE2")}
        values.saturation = partial(saturation, **points)
    return values


def named_parameters(p: Signals, prefix: str, rows: Sheet) -> Names:
    """Return the parameters of a part under the names of its data sheet."""
    return Names(**{row.symbol: p[prefix + row.symbol] for row in rows})


def symbols(prefix: str, rows: Sheet) -> list[str]:
    """Return the parameters of a part."""
    return [prefix + row.symbol for row in rows]


def seconds(prefix: str, rows: Sheet) -> list[str]:
    """Return those of them that are time constants.

    A time that may be negative is a coefficient of a numerator, which has no motion of its own.
    """
    return [prefix + row.symbol for row in rows if row.is_time and row.low >= 0.0]


def values_named(source: Signals, names: Iterable[str]) -> Names:
    """Return some values by name."""
    return Names(**{name: source[name] for name in names})


def values_of(written: Names, names: Iterable[str]) -> dict[str, Signal]:
    """Return some of the values that were written."""
    return {name: getattr(written, name) for name in names}


def state_of(model: Model, x: Signals, r: Signals) -> Names:
    """Return an exciter's states, and the setpoints that it found at the start."""
    return Names(**vars(values_named(x, model.states)), **vars(values_named(r, model.setpoints)))


def output_of(prefix: str, model: Model, u: Names, p: Signals, state: Signals, d: Names) -> Signal:
    """Write the slopes of a stabiliser or governor into ``d`` and return its output.

    ``state`` holds its states and setpoints, which have the ``prefix`` in the system as its
    parameters have.
    """
    slopes = Names()
    s = Names(**{name: state[prefix + name] for name in (*model.states, *model.setpoints)})
    output = model.equations(s, u, named_parameters(p, prefix, model.sheet), slopes)
    for name, slope in vars(slopes).items():
        setattr(d, prefix + name, slope)
    return output


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


class ExciterRest(NamedTuple):
    """Rest of an exciter that holds its output: states, and setpoints with the reference."""

    states: Signals
    setpoints: Signals


def rest_of(model: Model, output: Signal, u: Names, p: Names) -> ExciterRest:
    """Return an exciter's states at rest, and the setpoints that hold them."""
    x = Names()
    vref = model.rest(output, u, p, x)
    written = vars(x)
    if written.keys() != {*model.states, *model.setpoints}:
        wrong = ", ".join(sorted(written.keys() ^ {*model.states, *model.setpoints}))
        raise ModelError(f"states and rest of the model do not match: {wrong}")
    setpoints = {name: written[name] for name in model.setpoints}
    return ExciterRest({name: written[name] for name in model.states}, {"vref": vref, **setpoints})
