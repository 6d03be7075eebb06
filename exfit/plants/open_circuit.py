"""A machine whose breaker is open, at rated speed."""

from collections.abc import Callable
from functools import cache
from typing import NamedTuple

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.models.machines import Axes, Machine
from exfit.models.sheet import Model
from exfit.plants.limiting import (
    acts_without_load,
    limited_inputs,
    limiters_rest,
    limiting,
    seconds_of,
    signals_of,
    states_of,
    symbols_of,
)
from exfit.plants.parts import (
    MACHINE,
    MEASURED,
    VT0,
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
    motion,
    named_parameters,
    refuse_taken,
    rest_of,
    seconds,
    state_of,
    symbols,
    values_named,
    values_of,
)
from exfit.plants.plant import Attached, Equipment, PlantKind, compared, present

OUTPUTS = ("vref", "vt", "efd", "ifd")
NO_CURRENT = Axes(0.0, 0.0)


class OpenMachine(NamedTuple):
    """A machine on open circuit at one instant; ``slopes(efd, d)`` writes those of its states."""

    vt: Signal
    ifd: Signal
    slopes: Callable[[Signal, Names], None]


def machine_on_open_circuit(machine: Machine, x: Signals, p: Names) -> OpenMachine:
    """Signals of a machine without stator current; the fluxes of its q axis are zero."""
    states = values_named({**x, **dict.fromkeys(machine.q_axis, 0.0)}, machine.states)
    ifd = machine.field(states, NO_CURRENT, p)

    def slopes(efd: Signal, d: Names) -> None:
        machine.slopes(states, efd, ifd, NO_CURRENT, p, d)

    return OpenMachine(machine.source(states, p).voltage.q, ifd, slopes)


def at_rest(machine: Machine, vt: Signal, p: Names) -> tuple[dict[str, Signal], Signal]:
    """States that hold vt without stator current, and the field current."""
    fluxes = Names()
    machine.rest(Axes(0.0, vt), NO_CURRENT, p, fluxes)
    return values_of(fluxes, machine.d_axis), machine.field(fluxes, NO_CURRENT, p)


@cache
def open_circuit(
    model: Model,
    machine: Machine,
    saturation: SaturationForm,
    inputs: tuple[str, ...] = ("vref",),
    limiters: tuple[Attached, ...] = (),
) -> System:
    """Return an exciter on a machine whose breaker is open, at rated speed.

    Parameters are the exciter's, the machine's (``machine.Tpd0``) and the initial voltage ``vt0``;
    of the inputs, ``vref`` is the change of the reference from the one that holds ``vt0``, and
    ``vs`` a signal in place of a stabiliser; ``vc1`` is added to the voltage that the exciter
    measures. The ``limiters`` are those that see the field current: without stator current the
    others do nothing. All per unit.
    """
    refuse_taken(model, (*OUTPUTS, MEASURED, *machine.d_axis))
    states = (*machine.d_axis, *model.states, *states_of(limiters))

    def rest(p: Signals) -> Rest:
        fluxes, ifd = at_rest(machine, p[VT0], named_parameters(p, MACHINE, machine.sheet))
        u = exciter_inputs(vt=p[VT0], ifd=ifd)
        exciter = rest_of(model, ifd, u, exciter_parameters(p, model, saturation))
        waiting = limiters_rest(limiters, u, p)
        return Rest({**fluxes, **exciter.states, **waiting}, exciter.setpoints)

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        d = Names()
        at = machine_on_open_circuit(machine, x, named_parameters(p, MACHINE, machine.sheet))
        vref = r["vref"] + u["vref"]
        measured = at.vt + u.get(MEASURED, 0.0)
        u_exciter = exciter_inputs(
            vref=vref, vt=at.vt, vc1=measured, ifd=at.ifd, vs=u.get("vs", 0.0)
        )
        signals = limiting(limiters, u_exciter, p, x, d)
        u_exciter = exciter_inputs(**{**vars(u_exciter), **limited_inputs(limiters, signals)})
        values = exciter_parameters(p, model, saturation)
        efd = model.equations(state_of(model, x, r), u_exciter, values, d)
        at.slopes(efd, d)
        outputs = {"vref": vref, "vt": at.vt, MEASURED: at.vt, "efd": efd, "ifd": at.ifd, **x}
        return motion(d, states, {**outputs, **signals})

    return System(
        parameters=(
            *symbols("", model.sheet),
            *symbols(MACHINE, machine.sheet),
            VT0,
            *symbols_of(limiters),
        ),
        setpoints=("vref", *model.setpoints),
        states=states,
        inputs=inputs,
        outputs=(*OUTPUTS, *states, *signals_of(limiters)),
        time_constants=(
            *seconds("", model.sheet),
            *seconds(MACHINE, machine.sheet),
            *seconds_of(limiters),
        ),
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    exciter, machine = present(equipment.exciter), present(equipment.machine)
    limiters = tuple(limiter for limiter in equipment.limiters if acts_without_load(limiter))
    return open_circuit(exciter, machine, equipment.saturation, equipment.inputs, limiters)


OPEN_CIRCUIT = PlantKind(
    name="open-circuit",
    title="breaker open, rated speed",
    needs=("exciter", "machine"),
    events=("vref", "vs"),
    signals=compared(OUTPUTS),
    build=_build,
)
