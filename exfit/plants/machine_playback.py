"""A recorded field voltage in place of the exciter: it drives the machine alone."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.machines import Machine
from exfit.plants.open_circuit import at_rest, machine_on_open_circuit
from exfit.plants.parts import (
    DRIVING_SCALE,
    MACHINE,
    VT0,
    Names,
    motion,
    named_parameters,
    seconds,
    symbols,
)
from exfit.plants.plant import PlantKind, present

OUTPUTS = ("efd", "vt", "ifd")


@cache
def machine_playback(machine: Machine) -> System:
    """Return a machine on open circuit that a recorded field voltage drives.

    Its input is the change of ``efd`` from the start, where it holds the parameter ``vt0``; so an
    offset of the recorder does no harm. The parameter ``driving_scale`` multiplies that change: the
    base of a recorder may be another. All per unit.
    """

    def rest(p: Signals) -> Rest:
        fluxes, ifd = at_rest(machine, p[VT0], named_parameters(p, MACHINE, machine.sheet))
        return Rest(fluxes, {"efd": ifd})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        values, d = named_parameters(p, MACHINE, machine.sheet), Names()
        at = machine_on_open_circuit(machine, x, values)
        efd = r["efd"] + p[DRIVING_SCALE] * u["efd"]
        at.slopes(efd, d)
        return motion(d, machine.d_axis, {"efd": efd, "vt": at.vt, "ifd": at.ifd, **x})

    return System(
        parameters=(*symbols(MACHINE, machine.sheet), VT0, DRIVING_SCALE),
        setpoints=("efd",),
        states=machine.d_axis,
        inputs=("efd",),
        outputs=(*OUTPUTS, *machine.d_axis),
        time_constants=tuple(seconds(MACHINE, machine.sheet)),
        rest=rest,
        motion=equations,
    )


MACHINE_PLAYBACK = PlantKind(
    name="machine-playback",
    title="the machine alone, driven by the recorded field voltage",
    needs=("machine",),
    events=(),
    signals=OUTPUTS,
    driving=("efd",),
    required=("efd",),
    scaled=("efd",),
    build=lambda equipment: machine_playback(present(equipment.machine)),
)
