"""Recorded signals in place of the plant: they drive the exciter, or the machine, alone."""

from collections.abc import Callable
from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.plants.open_circuit import at_rest, machine_on_open_circuit
from exfit.plants.parts import (
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
)

EFD0, VREF0 = "efd0", "vref0"
DRIVING = ("vt", "ifd", "p", "q")  # what may drive an exciter
NEWTON_STEPS = 6  # to the efd that a reference holds; each costs two rests
DIFFERENCE = 1e-6  # pu of efd, for its slope


def initial(signal: str) -> str:
    """Return the parameter that holds a recorded signal's level at the start."""
    return f"{signal}0"


def held_by(vref: Signal, efd: Signal, reference: Callable[[Signal], Signal]) -> Signal:
    """Return the efd near ``efd`` that a given reference holds, by Newton's steps."""
    for _ in range(NEWTON_STEPS):
        there = reference(efd)
        slope = (reference(efd + DIFFERENCE) - there) / DIFFERENCE
        efd = efd + (vref - there) / slope
    return efd


@cache
def playback(
    model: Model,
    saturation: SaturationForm,
    driving: tuple[str, ...],
    vref_known: bool = False,
) -> System:
    """Return an exciter that recorded signals drive: ``driving`` of vt, ifd, p and q.

    Its inputs are the changes of ``vref`` and of those signals from the levels at the start, which
    are the parameters ``vt0``, ``ifd0`` ...; ``efd0`` is that of its output. The reference is the
    one that holds efd0 there; if it is known, it is the parameter ``vref0``, and holds an efd that
    is found from near efd0. All per unit.
    """
    signals = tuple(dict.fromkeys(("vref", "vt", *driving, "efd")))
    refuse_taken(model, signals)
    levels = tuple(initial(signal) for signal in driving)

    def rest(p: Signals) -> Rest:
        values = exciter_parameters(p, model, saturation)
        u = exciter_inputs(**{signal: p[initial(signal)] for signal in driving})
        if not vref_known:
            found = rest_of(model, p[EFD0], u, values)
            return Rest(found.states, found.setpoints)
        efd = held_by(
            p[VREF0], p[EFD0], lambda efd: rest_of(model, efd, u, values).setpoints["vref"]
        )
        found = rest_of(model, efd, u, values)
        return Rest(found.states, {**found.setpoints, "vref": p[VREF0]})

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        recorded = {signal: p[initial(signal)] + u[signal] for signal in driving}
        vref, d = r["vref"] + u["vref"], Names()
        seen = exciter_inputs(vref=vref, **recorded)
        values = exciter_parameters(p, model, saturation)
        efd = model.equations(state_of(model, x, r), seen, values, d)
        return motion(d, model.states, {"vref": vref, **recorded, "efd": efd, **x})

    return System(
        parameters=(
            *symbols("", model.sheet),
            *levels,
            EFD0,
            *((VREF0,) if vref_known else ()),
        ),
        setpoints=("vref", *model.setpoints),
        states=model.states,
        inputs=("vref", *driving),
        outputs=(*signals, *model.states),
        time_constants=tuple(seconds("", model.sheet)),
        rest=rest,
        motion=course,
    )


@cache
def machine_playback(machine: Machine) -> System:
    """Return a machine on open circuit that a recorded field voltage drives.

    Its input is the change of ``efd`` from the start, where it holds the parameter ``vt0``; so an
    offset of the recorder does no harm. All per unit.
    """

    def rest(p: Signals) -> Rest:
        fluxes, ifd = at_rest(machine, p[VT0], named_parameters(p, MACHINE, machine.sheet))
        return Rest(fluxes, {"efd": ifd})

    def course(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        values, d = named_parameters(p, MACHINE, machine.sheet), Names()
        at = machine_on_open_circuit(machine, x, values)
        efd = r["efd"] + u["efd"]
        at.moved(efd, d)
        return motion(d, machine.d_axis, {"efd": efd, "vt": at.vt, "ifd": at.ifd, **x})

    return System(
        parameters=(*symbols(MACHINE, machine.sheet), VT0),
        setpoints=("efd",),
        states=machine.d_axis,
        inputs=("efd",),
        outputs=("efd", "vt", "ifd", *machine.d_axis),
        time_constants=tuple(seconds(MACHINE, machine.sheet)),
        rest=rest,
        motion=course,
    )
