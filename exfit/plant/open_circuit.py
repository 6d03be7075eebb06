"""A machine whose breaker is open, at rated speed."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.machines import Axes, Machine
from exfit.models.sheet import Model
from exfit.plant.parts import (
    MACHINE,
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

SIGNALS = ("vref", "vt", "efd", "ifd")
NO_CURRENT = Axes(0.0, 0.0)


@cache
def open_circuit(
    model: Model,
    machine: Machine,
    saturation: SaturationForm,
    inputs: tuple[str, ...] = ("vref",),
) -> System:
    """Return an exciter on a machine whose breaker is open, at rated speed.

    Parameters are the exciter's, the machine's (``machine.Tpd0``) and the initial voltage ``vt0``;
    of the inputs, ``vref`` is the change of the reference from the one that holds ``vt0``, and
    ``vs`` a signal in place of a stabiliser. All per unit.
    """
    refuse_taken(model, (*SIGNALS, *machine.d_axis))
    states = (*machine.d_axis, *model.states)

    def rest(p: Signals) -> Rest:
        of_machine, fluxes = named_parameters(p, MACHINE, machine.sheet), Names()
        machine.rest(Axes(0.0, p[VT0]), NO_CURRENT, of_machine, fluxes)
        ifd = machine.field(fluxes, NO_CURRENT, of_machine)
        u = exciter_inputs(vt=p[VT0], ifd=ifd)
        found = rest_of(model, ifd, u, exciter_parameters(p, model, saturation))
        return Rest({**values_of(fluxes, machine.d_axis), **found.states}, found.setpoints)

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, d = named_parameters(p, MACHINE, machine.sheet), Names()
        fluxes = values_named({**x, **dict.fromkeys(machine.q_axis, 0.0)}, machine.states)
        vt = machine.source(fluxes, of_machine).voltage.q
        ifd = machine.field(fluxes, NO_CURRENT, of_machine)
        vref = r["vref"] + u["vref"]
        seen = exciter_inputs(vref=vref, vt=vt, ifd=ifd, vs=u.get("vs", 0.0))
        efd = model.equations(
            state_of(model, x, r), seen, exciter_parameters(p, model, saturation), d
        )
        machine.slopes(fluxes, efd, ifd, NO_CURRENT, of_machine, d)
        outputs = {"vref": vref, "vt": vt, "efd": efd, "ifd": ifd, **x}
        return motion(d, states, outputs)

    return System(
        parameters=(*symbols("", model.sheet), *symbols(MACHINE, machine.sheet), VT0),
        setpoints=("vref", *model.setpoints),
        states=states,
        inputs=inputs,
        outputs=(*SIGNALS, *states),
        time_constants=(*seconds("", model.sheet), *seconds(MACHINE, machine.sheet)),
        rest=rest,
        motion=course,
    )
