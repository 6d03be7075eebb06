"""A machine alone on load until its breaker opens; its field voltage is constant, or recorded."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.models.blocks import modulus
from exfit.models.machines import Axes, Machine
from exfit.models.sheet import WITHIN_10, Sheet, sheet
from exfit.plants import BREAKER, MACHINE, NETWORK, SPEED, VT0, Equipment, PlantKind
from exfit.plants.loaded_machine import (
    Flow,
    Terminals,
    breaker_of,
    connected,
    loaded_at_rest,
    voltage,
)
from exfit.plants.parts import (
    Names,
    motion,
    named_parameters,
    present,
    seconds,
    symbols,
    values_named,
)

OUTPUTS = ("efd", "vt", "ifd", "p", "q", "it", "speed")
LOAD: Sheet = sheet(
    ("P", 0.0, *WITHIN_10, "active power until the breaker opens"),
    ("Q", 0.0, *WITHIN_10, "reactive power until the breaker opens"),
)


@cache
def machine_on_load(machine: Machine, inputs: tuple[str, ...] = (BREAKER,)) -> System:
    """Return a machine at rest with P and Q until its breaker opens, at constant power Pm.

    The inputs are ``breaker``, 1 from the opening on; ``efd``, the change of the field voltage from
    the one that holds P, Q and the parameter ``vt0``; and ``speed``, the recorded change of the
    speed, without which 2H dw/dt = (Pm - D dw) / (1 + dw). All per unit on the machine's base.
    """

    def rest(p: Signals) -> Rest:
        values = named_parameters(p, MACHINE, machine.sheet)
        n, vt = named_parameters(p, NETWORK, LOAD), p[VT0]
        at = Flow(n.P / vt, n.Q / vt, vt, 0.0)
        stator, fluxes, efd = loaded_at_rest(vt, at, machine, values)
        states = {name: getattr(fluxes, name) for name in machine.states}
        held = {"efd": efd, "Pm": n.P, "id": stator.i.d, "iq": stator.i.q}
        return Rest({**states, "dw": 0.0}, held)

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        values, slopes = named_parameters(p, MACHINE, machine.sheet), Names()
        breaker, closed = breaker_of(u, x["dw"]), Axes(r["id"], r["iq"])
        i, factor = breaker.current(closed), breaker.factor
        fluxes = values_named(x, machine.states)
        at, _ = connected(
            machine, lambda: machine.source(fluxes, values), lambda at: i, fluxes, values
        )
        terminals = Terminals(fluxes, voltage(at, i, factor), i, breaker.dw)
        ifd, efd = machine.field(fluxes, i, values), r["efd"] + u.get("efd", 0.0)
        machine.slopes(fluxes, efd, ifd, i, values, slopes)
        machine.q_slopes(fluxes, i, values, slopes)
        torque = (r["Pm"] - values.D * x["dw"]) / (1.0 + x["dw"])
        slopes.dw = 0.0 if SPEED in inputs else torque / (2.0 * values.H)
        # what is recorded until the breaker opens is noise: the machine rests
        d = Names(**{name: breaker.once_open(slope) for name, slope in vars(slopes).items()})
        outputs = {
            "efd": efd,
            "vt": terminals.vt,
            "ifd": ifd,
            "p": terminals.p,
            "q": terminals.q,
            "it": breaker.until_open(modulus(closed.d, closed.q)),
            "speed": 1.0 + breaker.dw,
        }
        return motion(d, (*machine.states, "dw"), {**x, **outputs})

    return System(
        parameters=(*symbols((MACHINE, machine.sheet), (NETWORK, LOAD)), VT0),
        setpoints=("efd", "Pm", "id", "iq"),
        states=(*machine.states, "dw"),
        inputs=inputs,
        outputs=(*OUTPUTS, *machine.states, "dw"),
        time_constants=seconds((MACHINE, machine.sheet)),
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    inputs = tuple(name for name in (BREAKER, "efd", SPEED) if name in equipment.inputs)
    return machine_on_load(present(equipment.machine), inputs)


MACHINE_ON_LOAD = PlantKind(
    name="machine-on-load",
    title="the machine alone, on load until its breaker opens",
    needs=("machine", "network"),
    events=(BREAKER,),
    signals=OUTPUTS,
    driving=("efd",),
    network=lambda given: LOAD,
    network_required=("P",),
    build=_build,
)
