"""Recorded signals in place of the plant: they drive the exciter alone."""

from collections.abc import Callable
from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.models.sheet import Model
from exfit.plants.limiting import (
    limited_inputs,
    limiters_rest,
    limiting,
    seconds_of,
    signals_of,
    states_of,
    symbols_of,
)
from exfit.plants.parts import (
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
    initial,
    motion,
    refuse_taken,
    rest_of,
    seconds,
    state_of,
    symbols,
)
from exfit.plants.plant import OF_EXCITER, Attached, Equipment, PlantKind, present

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
    limiters: tuple[Attached, ...] = (),
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
        waiting = limiters_rest(limiters, u, p)
        if not vref_known:
            exciter = rest_of(model, p[EFD0], u, values)
            return Rest({**exciter.states, **waiting}, exciter.setpoints)
        efd = held_by(
            p[VREF0], p[EFD0], lambda efd: rest_of(model, efd, u, values).setpoints["vref"]
        )
        exciter = rest_of(model, efd, u, values)
        return Rest({**exciter.states, **waiting}, {**exciter.setpoints, "vref": p[VREF0]})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        recorded = {signal: p[initial(signal)] + u[signal] for signal in driving}
        vref, vs, d = r["vref"] + u["vref"], u.get("vs", 0.0), Names()
        u_exciter = exciter_inputs(vref=vref, vs=vs, **recorded)
        signals = limiting(limiters, u_exciter, p, x, d)
        u_exciter = exciter_inputs(**{**vars(u_exciter), **limited_inputs(limiters, signals)})
        values = exciter_parameters(p, model, saturation)
        efd = model.equations(state_of(model, x, r), u_exciter, values, d)
        outputs = {"vref": vref, "vs": vs, **recorded, "efd": efd, **signals}
        return motion(d, states, {**outputs, **x})

    return System(
        parameters=(
            *symbols("", model.sheet),
            *levels,
            EFD0,
            *((VREF0,) if vref_known else ()),
            *symbols_of(limiters),
        ),
        setpoints=("vref", *model.setpoints),
        states=states,
        inputs=(*setpoints, *driving),
        outputs=(*recorded_outputs, *states, *signals_of(limiters)),
        time_constants=(*seconds("", model.sheet), *seconds_of(limiters)),
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
