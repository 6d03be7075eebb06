"""Recorded signals in place of the plant, which drive the exciter alone, or of the exciter."""

from collections.abc import Callable
from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.plants import (
    DRIVING_SCALE,
    GATE,
    GOVERNOR,
    MACHINE,
    OF_EXCITER,
    SPEED,
    VT0,
    Equipment,
    PlantKind,
    SaturationForm,
)
from exfit.plants.controls import gate
from exfit.plants.limiting import (
    Limiters,
    limited_exciter,
    limiters_rest,
    sheets_of,
    signals_of,
    states_of,
)
from exfit.plants.open_circuit import NO_CURRENT, at_rest, without_current
from exfit.plants.parts import (
    Names,
    exciter_inputs,
    exciter_parameters,
    initial,
    motion,
    named_parameters,
    output_of,
    present,
    refuse_taken,
    rest_of,
    seconds,
    states_at_rest,
    symbols,
)

EFD0, VREF0 = "efd0", "vref0"
DRIVING = ("vt", "ifd", "p", "q", "speed")  # what may drive an exciter
NEWTON_STEPS = 6  # to the efd that a reference holds; each costs two rests
DIFFERENCE = 1e-6  # pu of efd, for its slope


def held_by(vref: Signal, efd: Signal, reference: Callable[[Signal], Signal]) -> Signal:
    """Return the efd near ``efd`` that a given reference holds, by Newton's steps."""
    for _ in range(NEWTON_STEPS):
        held = reference(efd)
        slope = (reference(efd + DIFFERENCE) - held) / DIFFERENCE
        efd = efd + (vref - held) / slope
    return efd


@cache
def playback(
    model: Model,
    saturation: SaturationForm,
    driving: tuple[str, ...],
    vref_known: bool = False,
    stabilised: bool = False,
    limiters: Limiters = (),
) -> System:
    """Return an exciter that recorded signals drive: ``driving`` of vt, ifd, p, q, speed.

    Its inputs are the changes of ``vref``, of ``vs`` where it is ``stabilised``, and of those
    signals from the levels at the start, which are the parameters ``vt0``, ``ifd0`` ...; ``efd0``
    is that of its output. The reference is the one that holds efd0 there; if it is known, it is the
    parameter ``vref0``, and holds an efd that is found from near efd0. All per unit.
    """
    setpoints = ("vref", "vs") if stabilised else ("vref",)
    recorded_outputs = tuple(dict.fromkeys((*setpoints, "vt", *driving, "efd")))
    refuse_taken(model, recorded_outputs)
    states = (*model.states, *states_of(limiters))
    levels = tuple(initial(signal) for signal in driving)

    def rest(p: Signals) -> Rest:
        values = exciter_parameters(p, model, saturation)
        u = exciter_inputs(**{signal: p[initial(signal)] for signal in driving})
        efd = p[EFD0]
        if vref_known:
            efd = held_by(
                p[VREF0], efd, lambda efd: rest_of(model, efd, u, values).setpoints["vref"]
            )
        exciter, held = rest_of(model, efd, u, values)
        known = {"vref": p[VREF0]} if vref_known else {}
        return Rest({**exciter, **limiters_rest(limiters, u, p)}, {**held, **known})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        recorded = {signal: p[initial(signal)] + u[signal] for signal in driving}
        vref, vs, d = r["vref"] + u["vref"], u.get("vs", 0.0), Names()
        seen = exciter_inputs(vref=vref, vs=vs, **recorded)
        efd, signals = limited_exciter(model, saturation, limiters, seen, p, {**r, **x}, d)
        outputs = {"vref": vref, "vs": vs, **recorded, "efd": efd, **signals}
        return motion(d, states, {**outputs, **x})

    return System(
        parameters=(
            *symbols(("", model.sheet)),
            *levels,
            EFD0,
            *((VREF0,) if vref_known else ()),
            *symbols(*sheets_of(limiters)),
        ),
        setpoints=("vref", *model.setpoints),
        states=states,
        inputs=(*setpoints, *driving),
        outputs=(*recorded_outputs, *states, *signals_of(limiters)),
        time_constants=seconds(("", model.sheet), *sheets_of(limiters)),
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    driving = tuple(signal for signal in DRIVING if signal in equipment.recorded)
    return playback(
        present(equipment.exciter),
        equipment.saturation,
        driving,
        vref_known="vref" in equipment.given,
        stabilised="vs" in equipment.inputs,
        limiters=equipment.limiters,
    )


PLAYBACK = PlantKind(
    name="playback",
    title="the exciter alone, driven by recorded signals",
    needs=("exciter",),
    events=OF_EXCITER,
    signals=(*OF_EXCITER, *DRIVING, "efd"),
    driving=(*OF_EXCITER, *DRIVING),
    required=("vt", "efd"),
    required_if_used=("ifd", "speed"),
    levels=(*DRIVING, "efd"),
    build=_build,
)


OF_MACHINE = ("efd", "vt", "ifd")


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
        fluxes, vt, ifd = without_current(machine, x, values)
        efd = r["efd"] + p[DRIVING_SCALE] * u["efd"]
        machine.slopes(fluxes, efd, ifd, NO_CURRENT, values, d)
        return motion(d, machine.d_axis, {"efd": efd, "vt": vt, "ifd": ifd, **x})

    return System(
        parameters=(*symbols((MACHINE, machine.sheet)), VT0, DRIVING_SCALE),
        setpoints=("efd",),
        states=machine.d_axis,
        inputs=("efd",),
        outputs=(*OF_MACHINE, *machine.d_axis),
        time_constants=seconds((MACHINE, machine.sheet)),
        rest=rest,
        motion=equations,
    )


MACHINE_PLAYBACK = PlantKind(
    name="machine-playback",
    title="the machine alone, driven by the recorded field voltage",
    needs=("machine",),
    events=(),
    signals=OF_MACHINE,
    driving=("efd",),
    required=("efd",),
    scaled=("efd",),
    build=lambda equipment: machine_playback(present(equipment.machine)),
)


@cache
def governor_playback(model: Model) -> System:
    """Return a governor with its turbine that the recorded speed drives.

    The inputs are the changes of the ``speed`` from the start, where it counts as rated, and of the
    reference ``pref``. The parameter ``p0`` is the power there. The power ``p`` that is shown, and
    that the governor measures, is that of the turbine: what accelerates the rotor is left out.
    """
    names = tuple(GOVERNOR + name for name in (*model.states, *model.setpoints))
    gates = tuple(gate(model, dict.fromkeys(names, 0.0)))
    reference, states = GOVERNOR + "pref", names[: len(model.states)]

    def rest(p: Signals) -> Rest:
        power = p[initial("p")]
        pref, found = states_at_rest(GOVERNOR, model, power, Names(dw=0.0, p=power), p)
        kept = {name: found.pop(name) for name in names[len(states) :]}
        return Rest(found, {reference: pref, **kept})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        state, d = {**r, **x}, Names()
        seen = Names(dw=u[SPEED], p=p[initial("p")], pref=r[reference] + u.get("pref", 0.0))
        # no model has a way from the measured power to its output but through its states
        seen.p = output_of(GOVERNOR, model, seen, p, state, Names())
        output_of(GOVERNOR, model, seen, p, state, d)
        shown = {SPEED: 1.0 + u[SPEED], "p": seen.p, **gate(model, state)}
        return motion(d, states, {**x, **shown})

    return System(
        parameters=(*symbols((GOVERNOR, model.sheet)), initial("p")),
        setpoints=(reference, *names[len(states) :]),
        states=states,
        inputs=(SPEED, "pref"),
        outputs=(SPEED, "p", *gates, *states),
        time_constants=seconds((GOVERNOR, model.sheet)),
        rest=rest,
        motion=equations,
    )


GOVERNOR_PLAYBACK = PlantKind(
    name="governor-playback",
    title="the governor alone, driven by the recorded speed",
    needs=("governor",),
    events=("pref",),
    signals=(SPEED, "pref", "p", GATE),
    driving=(SPEED, "pref"),
    required=(SPEED, "p"),
    levels=("p",),
    build=lambda equipment: governor_playback(present(equipment.governor)),
)
