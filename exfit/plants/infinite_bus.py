"""A machine on load: behind R + jX to a stiff source of constant voltage and frequency."""

from collections.abc import Collection
from functools import cache
from math import pi
from typing import Literal

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal, sqrt
from exfit.models.blocks import modulus
from exfit.models.machines import Axes, Machine, Source
from exfit.models.sheet import UP_TO_10, WITHIN_10, Model, Sheet, sheet
from exfit.plants import (
    BREAKER,
    FAULT,
    GATE,
    MACHINE,
    MEASURED,
    NETWORK,
    VT0,
    Dialect,
    Equipment,
    PlantKind,
    SaturationForm,
    Stabilised,
    compared,
)
from exfit.plants.far_bus import (
    BEHIND_LOAD,
    LOAD,
    FaultedLine,
    machine_current,
    source_behind,
    switched,
)
from exfit.plants.limiting import Limiters, signals_of
from exfit.plants.loaded_machine import Terminals, behind, breaker_of, current, voltage
from exfit.plants.parts import (
    Names,
    motion,
    named_parameters,
    present,
    refuse_taken,
    symbols,
    values_named,
)
from exfit.plants.unit import ROTOR, Controls, UnitOnLoad, unit_at_rest, unit_motion

OUTPUTS = ("vref", "vt", "efd", "ifd", "p", "q", "it", "delta", "speed")

FLOW: Sheet = sheet(
    ("f0", 60.0, "Hz", (1.0, 400.0), "rated frequency"),
    ("R", 0.0, *UP_TO_10, "resistance to the source"),
    ("X", 0.3, *UP_TO_10, "reactance to the source"),
    ("Ra", 0.0, *UP_TO_10, "resistance of the stator"),
    ("Rc", 0.0, *WITHIN_10, "resistance of the load compensation"),
    ("Xc", 0.0, *WITHIN_10, "reactance of the load compensation"),
    ("P", 0.8, *WITHIN_10, "active power at the start"),
)
REACTIVE: Sheet = sheet(("Q", 0.0, *WITHIN_10, "reactive power at the start"))
SOURCE: Sheet = sheet(("E", 1.0, "pu", (0.01, 10.0), "voltage of the source"))

OFTEN_STILL = (
    "E",
    "R",
    "X",
    "angle",
    "vs",
    "pref",
    "fs",
    *FAULT,
)  # inputs that are there where they change
AT_FAR_BUS = frozenset(row.symbol for row in (*LOAD, *BEHIND_LOAD))
Given = Literal["Q", "E"]  # what sets the start beside vt0 and P


def flow_sheet(given: Given, load: Collection[str] = ()) -> Sheet:
    """Return the network's data sheet where the start is given by P and Q, or by P and E.

    With a load at the far bus, of which these values are given, it has what is beyond it too.
    """
    loaded = (*(row for row in LOAD if row.symbol in load), *(BEHIND_LOAD if load else ()))
    return (*FLOW, *(REACTIVE if given == "Q" else SOURCE), *loaded)


def reactive_power(vt: Signal, n: Names) -> Signal:
    """Return the Q at which a source E holds vt and P behind R + jX: the smaller current of two.

    From |vt^2 - (R + jX)(P - jQ)| = E vt, a quadratic equation in Q.
    """
    square, reach = n.R * n.R + n.X * n.X, vt * vt
    real, imaginary = reach - n.R * n.P, n.X * n.P
    rest = real * real + imaginary * imaginary - n.E * n.E * reach
    return (n.X * reach - sqrt(n.X * n.X * reach * reach - square * rest)) / square


@cache
def infinite_bus(
    model: Model,
    machine: Machine,
    saturation: SaturationForm,
    inputs: tuple[str, ...] = ("vref",),
    given: Given = "Q",
    stabiliser: Stabilised | None = None,
    dialect: Dialect = "standard",
    governor: Model | None = None,
    limiters: Limiters = (),
    load: frozenset[str] = frozenset(),
) -> System:
    """Return an exciter on a machine behind R + jX to a stiff source.

    Its power Pm is constant unless there is a governor. 2H dw/dt = (Pm - D dw) / (1 + dw) - Te,
    as in PSS/E; another ``dialect`` has it otherwise. Parameters are the exciter's, those of
    machine, network, stabiliser and governor under their prefixes (``network.X``), and the
    initial voltage ``vt0``. The inputs are changes: of the references ``vref`` and ``pref``, of
    ``vs`` beside the stabiliser, of ``fs``, added to the speed that the governor measures, of
    ``vc1``, the voltage that the exciter measures, of ``E`` and its ``angle`` (rad), of ``R``
    and ``X``, of ``fault_G`` and ``fault_B``, the admittance of a fault at the terminals. With
    the input ``breaker`` a breaker opens where that is 1: p, q and it are zero from then on,
    delta stays, and vt follows the speed, which is the simulated one, or 1 and the input
    ``speed``. ``load`` names the given values of a load at the far bus (`far_bus`). All per
    unit on the machine's base; ``delta``, to the source as it is, in rad, ``speed`` 1 when
    rated.
    """
    refuse_taken(model, (*OUTPUTS, MEASURED, *ROTOR, *machine.states))
    unit = UnitOnLoad(model, machine, saturation, stabiliser, dialect, governor, limiters)
    network, far = flow_sheet(given, load), ("far",) if load else ()
    meshed = bool(load) or not {*FAULT}.isdisjoint(inputs)
    unloaded = dict.fromkeys((row.symbol for row in LOAD), 0.0)

    def rest(p: Signals) -> Rest:
        n, vt = named_parameters(p, NETWORK, network), p[VT0]
        reactive = n.Q if given == "Q" else reactive_power(vt, n)
        at = behind(vt, n.P, reactive, n.R, n.X)
        held = {}
        if load:
            held = {"far": modulus(at.ex, at.ey)}
            at = source_behind(at, Names(**{**unloaded, **vars(n)}))
        states, setpoints = unit_at_rest(unit, vt, n.P, at, p, n)
        return Rest(states, {**setpoints, **held, "source": modulus(at.ex, at.ey)})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, d = named_parameters(p, MACHINE, machine.sheet), Names()
        n = switched(named_parameters(p, NETWORK, network), u)
        changed = Names(**{name: u.get(name, 0.0) for name in OFTEN_STILL})
        fluxes = values_named(x, machine.states)
        E, R, X = r["source"] + changed.E, n.R + changed.R, n.X + changed.X
        delta, dw, factor = x["delta"] - changed.angle, x["dw"], 1.0
        breaker = breaker_of(u, dw) if BREAKER in inputs else None
        if breaker is not None:
            dw = breaker.dw
            factor = 1.0 if unit.speed_in_stator else breaker.factor  # which the source has

        def drives(at: Source) -> Axes:
            if not meshed:
                return current(at, E, R, X, delta)
            line = FaultedLine(R, X, changed.fault_G, changed.fault_B)
            drawing = Names(**{**unloaded, **vars(n)}) if load else None
            return machine_current(at, line, E, delta, drawing, r.get("far", 1.0))

        def flowing(at: Source) -> Axes:
            return drives(at) if breaker is None else breaker.current(drives(at))

        at, i = unit.connected(fluxes, dw, of_machine, n.Ra, flowing)
        closed = i if breaker is None else drives(at)
        terminals = Terminals(fluxes, voltage(at, i, factor), i, dw)
        it = modulus(closed.d, closed.q)
        vref = r["vref"] + u["vref"]
        controls = Controls(vref, changed.vs, u.get(MEASURED, 0.0), changed.pref, changed.fs)
        efd, ifd, vc1, signals = unit_motion(unit, terminals, controls, p, {**r, **x}, n, d)
        d.delta = 2.0 * pi * n.f0 * x["dw"]
        if breaker is not None:
            it, d.delta = breaker.until_open(it), breaker.until_open(d.delta)
        shown = (vref, terminals.vt, efd, ifd, terminals.p, terminals.q, it, delta, 1.0 + dw)
        outputs = dict(zip(OUTPUTS, shown, strict=True))
        return motion(d, unit.states, {**x, **outputs, **signals, MEASURED: vc1})

    return System(
        parameters=(*unit.parameters(symbols((NETWORK, network))), VT0),
        setpoints=(*unit.setpoints, "source", *far),
        states=unit.states,
        inputs=inputs,
        outputs=tuple(dict.fromkeys((*OUTPUTS, *unit.shown, *signals_of(unit.limiters)))),
        time_constants=unit.time_constants,
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    return infinite_bus(
        present(equipment.exciter),
        present(equipment.machine),
        equipment.saturation,
        equipment.inputs,
        "E" if "E" in equipment.given else "Q",
        equipment.stabiliser,
        equipment.dialect,
        equipment.governor,
        equipment.limiters,
        equipment.given & AT_FAR_BUS,
    )


INFINITE_BUS = PlantKind(
    name="infinite-bus",
    title="on load, behind R + jX to a stiff source",
    needs=("exciter", "machine", "network"),
    events=("vref", "vs", "pref", "fs", "E", "angle", "network", "fault", BREAKER),
    signals=(*compared(OUTPUTS), GATE),
    network=lambda given: flow_sheet("E" if "E" in given else "Q", AT_FAR_BUS.intersection(given)),
    network_required=("f0", "X", "P"),
    build=_build,
)
