"""A unit alone on its load: its speed is held by its governor, its voltage by its exciter."""

from functools import cache

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import sqrt
from exfit.models.sheet import Sheet
from exfit.plants import GATE, MACHINE, MEASURED, NETWORK, VT0, Equipment, PlantKind, compared
from exfit.plants.far_bus import LOAD, isolated_current, load_power, switched
from exfit.plants.infinite_bus import FLOW
from exfit.plants.limiting import signals_of
from exfit.plants.loaded_machine import NO_CURRENT, Flow, Terminals, voltage
from exfit.plants.parts import (
    Names,
    motion,
    named_parameters,
    refuse_taken,
    symbols,
    values_named,
)
from exfit.plants.unit import ROTOR, Controls, UnitOnLoad, unit_at_rest, unit_motion

OUTPUTS = ("vref", "vt", "efd", "ifd", "p", "q", "it", "speed")
# without the line, and without the power at the start, which is that of the load
NETWORK_SHEET: Sheet = (*(row for row in FLOW if row.symbol in ("f0", "Ra", "Rc", "Xc")), *LOAD)


@cache
def isolated(unit: UnitOnLoad, inputs: tuple[str, ...] = ("vref",)) -> System:
    """Return a unit that feeds a load at its terminals, and nothing else.

    The load has parts of constant power, current and admittance (`far_bus`). The inputs are the
    changes of the references ``vref`` and ``pref``, of ``vs``, of ``fs``, which is added to the
    speed that the governor measures, of ``vc1``, and of the values of the load. The
    parameters are those of the unit and of the network, and the initial voltage ``vt0``. All per
    unit on the machine's base. An effect of the frequency on the load is that of the machine's D.
    """
    refuse_taken(unit.exciter, (*OUTPUTS, MEASURED, *ROTOR, *unit.machine.states))

    def rest(p: Signals) -> Rest:
        n, vt = named_parameters(p, NETWORK, NETWORK_SHEET), p[VT0]
        power, reactive = load_power(n, vt)
        return unit_at_rest(unit, vt, power, Flow(power / vt, reactive / vt, vt, 0.0), p, n)

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, d = named_parameters(p, MACHINE, unit.machine.sheet), Names()
        n = switched(named_parameters(p, NETWORK, NETWORK_SHEET), u)
        fluxes, dw = values_named(x, unit.machine.states), x["dw"]
        at, i = unit.connected(
            fluxes, dw, of_machine, n.Ra, lambda at: isolated_current(at, n, p[VT0])
        )
        terminals = Terminals(fluxes, voltage(at, i), i, dw)
        vref = r["vref"] + u["vref"]
        vs, pref, fs = (u.get(name, 0.0) for name in ("vs", "pref", "fs"))
        controls = Controls(vref, vs, u.get(MEASURED, 0.0), pref, fs)
        efd, ifd, vc1, others = unit_motion(unit, terminals, controls, p, {**r, **x}, n, d)
        d.delta = 0.0
        it = sqrt(i.d * i.d + i.q * i.q + NO_CURRENT)
        shown = (vref, terminals.vt, efd, ifd, terminals.p, terminals.q, it, 1.0 + dw)
        outputs = dict(zip(OUTPUTS, shown, strict=True))
        return motion(d, unit.states, {**x, **outputs, **others, MEASURED: vc1})

    return System(
        parameters=(*unit.parameters(symbols((NETWORK, NETWORK_SHEET))), VT0),
        setpoints=unit.setpoints,
        states=unit.states,
        inputs=inputs,
        outputs=tuple(dict.fromkeys((*OUTPUTS, *unit.shown, *signals_of(unit.limiters)))),
        time_constants=unit.time_constants,
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    return isolated(UnitOnLoad.of(equipment), equipment.inputs)


ISOLATED = PlantKind(
    name="isolated",
    title="alone on its load",
    needs=("exciter", "machine", "network"),
    events=("vref", "vs", "pref", "fs", "network"),
    signals=(*compared(OUTPUTS), GATE),
    network=lambda given: NETWORK_SHEET,
    network_required=("f0",),
    build=_build,
)
