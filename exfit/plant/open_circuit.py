"""A machine whose breaker is open, at rated speed."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.plant.parts import (
    MACHINE,
    VT0,
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
    machine_parameters,
    motion,
    refuse_taken,
    rest_of,
    seconds,
    state_of,
    values_named,
)


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
        u = exciter_inputs(vt=at.vt, ifd=at.ifd)
        found = rest_of(model, at.ifd, u, exciter_parameters(p, model, saturation))
        return Rest({**vars(fluxes), **found.states}, found.setpoints)

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, fluxes = machine_parameters(p, machine.sheet), values_named(x, machine.states)
        at = machine.terminals(fluxes, of_machine)
        vref = r["vref"] + u["vref"]
        seen = exciter_inputs(vref=vref, vt=at.vt, ifd=at.ifd)
        d = Names()
        efd = model.equations(
            state_of(model, x, r), seen, exciter_parameters(p, model, saturation), d
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
        setpoints=("vref", *model.setpoints),
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
