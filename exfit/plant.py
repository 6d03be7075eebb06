"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from collections.abc import Callable, Iterable, Mapping
from functools import cache, partial
from types import SimpleNamespace
from typing import Any

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.errors import ModelError
from exfit.models.blocks import Limited, Saturation, exponential, exponential_se, quadratic
from exfit.models.machines import Machine
from exfit.models.sheet import Model, Sheet

SaturationForm = Callable[..., Saturation]

SATURATION: Mapping[str, SaturationForm] = {
    "quadratic": quadratic,
    "exponential": exponential,
    "exponential-se": exponential_se,
}

MACHINE = "machine."  # how the name of a machine's parameter begins
VT0 = "vt0"


class Names(SimpleNamespace):
    """Values by name, as a model reads and writes them."""

    def __getattr__(self, name: str) -> Any:
        raise ModelError(f"the model uses {name}, which its file does not declare")


def exciter_parameters(p: Signals, model: Model, saturation: SaturationForm) -> Names:
    """Return the parameters of an exciter, with its saturation curve where it has one."""
    values = Names(**{row.symbol: p[row.symbol] for row in model.sheet})
    if {"E1", "SE1", "E2", "SE2"} <= vars(values).keys():
        points = {name: p[name] for name in ("E1", "SE1", "E2", "SE2")}
        values.saturation = partial(saturation, **points)
    return values


def machine_parameters(p: Signals, rows: Sheet) -> Names:
    """Return the parameters of a machine under the names of its data sheet."""
    return Names(**{row.symbol: p[MACHINE + row.symbol] for row in rows})


def seconds(rows: Sheet) -> list[str]:
    """Return the parameters that are times."""
    return [row.symbol for row in rows if row.unit == "s"]


def states_of(x: Signals, names: tuple[str, ...]) -> Names:
    """Return some of the states by name."""
    return Names(**{name: x[name] for name in names})


def refuse_taken(model: Model, taken: Iterable[str]) -> None:
    """Raise ModelError where a state of the model has the name of something else."""
    clash = sorted(set(model.states) & set(taken))
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


def rest_of(model: Model, output: Signal, u: Names, p: Names) -> tuple[Names, Signal]:
    """Return an exciter's states at rest and the reference that holds them."""
    x = Names()
    vref = model.rest(output, u, p, x)
    if vars(x).keys() != set(model.states):
        wrong = ", ".join(sorted(vars(x).keys() ^ set(model.states)))
        raise ModelError(f"states and rest of the model do not match: {wrong}")
    return x, vref


@cache
def open_circuit(model: Model, machine: Machine, saturation: SaturationForm) -> System:
    """Return an exciter on a machine whose breaker is open, at rated speed.

    Parameters are the exciter's, the machine's (``machine.Tpd0``) and the initial voltage ``vt0``;
    the input ``vref`` is the change of the reference from the one that holds ``vt0``. All per
    unit.
    """
    signals = ("vref", "vt", "efd", "ifd")
    refuse_taken(model, (*signals, *machine.states))
    states = (*machine.states, *model.states)

    def rest(p: Signals) -> Rest:
        of_machine = machine_parameters(p, machine.sheet)
        fluxes = Names()
        machine.rest(p[VT0], of_machine, fluxes)
        at = machine.terminals(fluxes, of_machine)
        u = Names(vt=at.vt, ifd=at.ifd, vs=0.0)
        x, vref = rest_of(model, at.ifd, u, exciter_parameters(p, model, saturation))
        return Rest({**vars(fluxes), **vars(x)}, {"vref": vref})

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, fluxes = machine_parameters(p, machine.sheet), states_of(x, machine.states)
        at = machine.terminals(fluxes, of_machine)
        vref = r["vref"] + u["vref"]
        seen = Names(vref=vref, vs=0.0, vt=at.vt, ifd=at.ifd)
        d = Names()
        efd = model.equations(
            states_of(x, model.states), seen, exciter_parameters(p, model, saturation), d
        )
        machine.slopes(fluxes, efd, at.ifd, of_machine, d)
        outputs = {"vref": vref, "vt": at.vt, "efd": efd, "ifd": at.ifd, **x}
        return motion(d, states, outputs)

    return System(
        parameters=(
            *(row.symbol for row in model.sheet),
            *(MACHINE + row.symbol for row in machine.sheet),
            VT0,
        ),
        setpoints=("vref",),
        states=states,
        inputs=("vref",),
        outputs=(*signals, *states),
        time_constants=(
            *seconds(model.sheet),
            *(MACHINE + name for name in seconds(machine.sheet)),
        ),
        rest=rest,
        motion=course,
    )


@cache
def alone(model: Model) -> System:
    """Return a model without a plant: its output is ``vt``."""
    refuse_taken(model, ("vref", "vt"))

    def rest(p: Signals) -> Rest:
        values = exciter_parameters(p, model, quadratic)
        x, vref = rest_of(model, p[VT0], Names(vt=p[VT0], ifd=0.0, vs=0.0), values)
        return Rest(vars(x), {"vref": vref})

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        vref = r["vref"] + u["vref"]
        values, seen, d = exciter_parameters(p, model, quadratic), Names(vref=vref, vs=0.0), Names()
        output = model.equations(states_of(x, model.states), seen, values, d)
        return motion(d, model.states, {"vref": vref, "vt": output, **x})

    return System(
        parameters=(*(row.symbol for row in model.sheet), VT0),
        setpoints=("vref",),
        states=model.states,
        inputs=("vref",),
        outputs=("vref", "vt", *model.states),
        time_constants=tuple(seconds(model.sheet)),
        rest=rest,
        motion=course,
    )
