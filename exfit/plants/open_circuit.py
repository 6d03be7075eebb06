"""A machine whose breaker is open."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal
from exfit.models.machines import Axes, Machine
from exfit.models.sheet import Model
from exfit.plants import (
    MACHINE,
    MEASURED,
    SPEED,
    VT0,
    Equipment,
    PlantKind,
    SaturationForm,
    acts_without_load,
    compared,
)
from exfit.plants.limiting import (
    Limiters,
    limited_exciter,
    limiters_rest,
    sheets_of,
    signals_of,
    states_of,
)
from exfit.plants.parts import (
    Names,
    exciter_inputs,
    exciter_parameters,
    initial,
    motion,
    named_parameters,
    present,
    refuse_taken,
    rest_of,
    seconds,
    symbols,
    values_named,
)

OUTPUTS = ("vref", "vt", "efd", "ifd")
NO_CURRENT = Axes(0.0, 0.0)


def without_current(machine: Machine, x: Signals, p: Names) -> tuple[Names, Signal, Signal]:
    """Return the states of a machine, its voltage and its field current; its q axis rests at 0."""
    fluxes = values_named({**x, **dict.fromkeys(machine.q_axis, 0.0)}, machine.states)
    fluxes.SAT = machine.idle_saturation(fluxes, p)
    return fluxes, machine.source(fluxes, p).voltage.q, machine.field(fluxes, NO_CURRENT, p)


def at_rest(machine: Machine, vt: Signal, p: Names) -> tuple[dict[str, Signal], Signal]:
    """States that hold vt without stator current, and the field current."""
    fluxes = Names()
    machine.rest(Axes(0.0, vt), NO_CURRENT, p, fluxes)
    held = {name: getattr(fluxes, name) for name in machine.d_axis}
    return held, machine.field(fluxes, NO_CURRENT, p)


@cache
def open_circuit(
    model: Model,
    machine: Machine,
    saturation: SaturationForm,
    inputs: tuple[str, ...] = ("vref",),
    limiters: Limiters = (),
) -> System:
    """Return an exciter on a machine whose breaker is open.

    Parameters are the exciter's, the machine's (``machine.Tpd0``) and the initial voltage ``vt0``;
    of the inputs, ``vref`` is the change of the reference from the one that holds ``vt0``, and
    ``vs`` a signal in place of a stabiliser; ``vc1`` is added to the voltage that the exciter
    measures. The speed is 1, or ``speed0`` and the change ``speed``; vt is flux times speed
    (Kundur 1994, (3.120) and (3.121)). The ``limiters`` are those that see the field current: no
    other does anything.
    """
    refuse_taken(model, (*OUTPUTS, MEASURED, *machine.d_axis))
    states = (*machine.d_axis, *model.states, *states_of(limiters))
    unit, of_limiters = (("", model.sheet), (MACHINE, machine.sheet)), sheets_of(limiters)
    speed0 = (initial(SPEED),) if SPEED in inputs else ()

    def rest(p: Signals) -> Rest:
        flux = p[VT0] / p[initial(SPEED)] if speed0 else p[VT0]
        fluxes, ifd = at_rest(machine, flux, named_parameters(p, MACHINE, machine.sheet))
        u = exciter_inputs(vt=p[VT0], ifd=ifd)
        exciter = rest_of(model, ifd, u, exciter_parameters(p, model, saturation))
        waiting = limiters_rest(limiters, u, p)
        return Rest({**fluxes, **exciter.states, **waiting}, exciter.setpoints)

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        values, d = named_parameters(p, MACHINE, machine.sheet), Names()
        fluxes, flux, ifd = without_current(machine, x, values)
        vt = (p[initial(SPEED)] + u[SPEED]) * flux if speed0 else flux
        vref, measured = r["vref"] + u["vref"], vt + u.get(MEASURED, 0.0)
        seen = exciter_inputs(vref=vref, vt=vt, vc1=measured, ifd=ifd, vs=u.get("vs", 0.0))
        efd, signals = limited_exciter(model, saturation, limiters, seen, p, {**r, **x}, d)
        machine.slopes(fluxes, efd, ifd, NO_CURRENT, values, d)
        outputs = {"vref": vref, "vt": vt, MEASURED: vt, "efd": efd, "ifd": ifd}
        return motion(d, states, {**outputs, **x, **signals})

    return System(
        parameters=(*symbols(*unit), VT0, *speed0, *symbols(*of_limiters)),
        setpoints=("vref", *model.setpoints),
        states=states,
        inputs=inputs,
        outputs=(*OUTPUTS, *states, *signals_of(limiters)),
        time_constants=seconds(*unit, *of_limiters),
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    exciter, machine = present(equipment.exciter), present(equipment.machine)
    limiters = tuple(limiter for limiter in equipment.limiters if acts_without_load(limiter))
    return open_circuit(exciter, machine, equipment.saturation, equipment.inputs, limiters)


OPEN_CIRCUIT = PlantKind(
    name="open-circuit",
    title="breaker open",
    needs=("exciter", "machine"),
    events=("vref", "vs"),
    signals=compared(OUTPUTS),
    build=_build,
)
