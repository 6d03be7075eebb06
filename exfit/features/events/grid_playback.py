"""A unit on load in whose place of measurement the grid's recorded voltage and angle are played."""

from functools import cache
from math import pi
from typing import NamedTuple

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal, cos, sin, sqrt
from exfit.models.blocks import modulus
from exfit.models.machines import Axes
from exfit.models.sheet import Sheet, sheet
from exfit.plants import (
    GATE,
    MACHINE,
    MEASURED,
    NETWORK,
    REFERENCES,
    VT0,
    Equipment,
    PlantKind,
    PowerAt,
)
from exfit.plants.further import FurtherUnit
from exfit.plants.limiting import signals_of
from exfit.plants.loaded_machine import Flow, Terminals, behind, current, voltage
from exfit.plants.parts import (
    Names,
    initial,
    motion,
    named_parameters,
    refuse_taken,
    symbols,
    values_named,
)
from exfit.plants.unit import (
    ROTOR,
    Controls,
    UnitOnLoad,
    unit_at_rest,
    unit_motion,
)

OUTPUTS = ("vref", "vt", "efd", "ifd", "p", "q", "it", "delta", "speed")
DRIVING_ANGLE = ("angle", "frequency")  # of which one drives, beside vt
LEVELS = ("p", "q", "speed")

TRANSFORMER: Sheet = sheet(
    ("f0", 60.0, "Hz", (1.0, 400.0), "rated frequency"),
    ("R", 0.0, "pu", (0.0, 10.0), "resistance from the terminals to the recorded voltage"),
    ("X", 0.0, "pu", (0.0, 10.0), "reactance from the terminals to the recorded voltage"),
    ("Ra", 0.0, "pu", (0.0, 10.0), "resistance of the stator"),
    ("Rc", 0.0, "pu", (-10.0, 10.0), "resistance of the load compensation"),
    ("Xc", 0.0, "pu", (-10.0, 10.0), "reactance of the load compensation"),
)
BESIDE: Sheet = (
    *TRANSFORMER[1:],
    *sheet(
        ("base", 1.0, "pu", (0.001, 1000.0), "its MVA over those of the case's unit"),
        ("share_P", 0.5, "pu", (-10.0, 10.0), "its share of the active power at the start"),
        ("share_Q", 0.5, "pu", (-10.0, 10.0), "its share of the reactive power at the start"),
    ),
)
AT_START: Sheet = sheet(
    ("P", 0.8, "pu", (-10.0, 10.0), "active power at the start"),
    ("Q", 0.0, "pu", (-10.0, 10.0), "reactive power at the start"),
)


def transformer_sheet(given: frozenset[str]) -> Sheet:
    """Return the network's data sheet; P and Q are in it where the case gives them."""
    return (*TRANSFORMER, *(row for row in AT_START if row.symbol in given))


def voltage_behind(v: Signal, p: Signal, q: Signal, R: Signal, X: Signal) -> Signal:
    """Return the voltage behind R + jX at which p and q leave, where v is recorded.

    From v = |vt - (R + jX)(p - jq) / vt|, a quadratic equation in vt^2: the larger one.
    """
    sum_of_both = v * v + 2.0 * (R * p + X * q)
    drop = (R * R + X * X) * (p * p + q * q)
    return sqrt(0.5 * (sum_of_both + sqrt(sum_of_both * sum_of_both - 4.0 * drop)))


def terminals_at_rest(
    v: Signal, p: Signal, q: Signal, n: Names, power_at: PowerAt
) -> tuple[Signal, Signal, Flow]:
    """Return the terminals' voltage and active power, and their flow to the recorded voltage v."""
    if power_at == "terminals":
        vt = voltage_behind(v, p, q, n.R, n.X)
        return vt, p, behind(vt, p, q, n.R, n.X)
    square = (p * p + q * q) / (v * v)
    vt = modulus(v + (n.R * p + n.X * q) / v, (n.X * p - n.R * q) / v)
    power = p + n.R * square
    return vt, power, behind(vt, power, q + n.X * square, n.R, n.X)


class InGrid(NamedTuple):
    """What a unit shows at one instant, its current by the axes of its rotor, and their angle."""

    outputs: dict[str, Signal]
    i: Axes
    delta: Signal

    @property
    def current(self) -> tuple[Signal, Signal]:
        """The current along the recorded voltage, and across it."""
        s, c = sin(self.delta), cos(self.delta)
        return self.i.d * s + self.i.q * c, self.i.d * c - self.i.q * s


def in_grid(
    unit: UnitOnLoad,
    network: Sheet,
    power_at: PowerAt,
    p: Signals,
    state: Signals,
    u: Signals,
    d: Names,
) -> InGrid:
    """Write the slopes of a unit behind R + jX to the recorded voltage into ``d``."""
    of_machine = named_parameters(p, MACHINE, unit.machine.sheet)
    n = named_parameters(p, NETWORK, network)
    fluxes = values_named(state, unit.machine.states)
    recorded, delta = p[VT0] + u["vt"], state["delta"]
    delta = delta - u["angle"]
    at, i = unit.connected(
        fluxes, state["dw"], of_machine, n.Ra, lambda at: current(at, recorded, n.R, n.X, delta)
    )
    terminals = Terminals(fluxes, voltage(at, i), i, state["dw"])
    vref = state["vref"] + u["vref"]
    changed = {name: u.get(name, 0.0) for name in ("vs", "pref", "fs")}
    controls = Controls(vref, **changed)
    efd, ifd, vc1, signals = unit_motion(unit, terminals, controls, p, state, n, d)
    d.delta = 2.0 * pi * n.f0 * state["dw"]
    measured = terminals
    if power_at == "recorded-voltage":
        measured = terminals._replace(v=Axes(recorded * sin(delta), recorded * cos(delta)))
    powers, it = (measured.p, measured.q), modulus(i.d, i.q)
    speed = p[initial("speed")] + state["dw"]
    shown = (vref, recorded, efd, ifd, *powers, it, delta, speed)
    outputs = {**dict(zip(OUTPUTS, shown, strict=True)), MEASURED: vc1, **signals}
    return InGrid(outputs, i, delta)


def own_values(
    each: FurtherUnit, values: Signals, shared: tuple[str, ...] = ()
) -> dict[str, Signal]:
    """Return a further unit's values under the names of the case's unit; some it shares with it."""
    own = {
        name.removeprefix(each.prefix): value
        for name, value in values.items()
        if name.startswith(each.prefix)
    }
    return own | {name: values[name] for name in shared}


def prefixed(each: FurtherUnit, values: Signals) -> dict[str, Signal]:
    """Return the values of a further unit under their names in the system."""
    return {each.prefix + name: value for name, value in values.items()}


def as_unit(each: FurtherUnit, beside: UnitOnLoad) -> UnitOnLoad:
    """Return a further unit with what it shares with the case's."""
    return beside._replace(
        exciter=each.exciter.in_dialect(beside.dialect),
        machine=each.machine,
        stabiliser=each.stabiliser and each.stabiliser.in_dialect(beside.dialect),
        governor=each.governor,
        limiters=(),
    )


@cache
def grid_playback(
    unit: UnitOnLoad,
    inputs: tuple[str, ...] = ("vref", "vt", "angle"),
    given: frozenset[str] = frozenset(),
    power_at: PowerAt = "recorded-voltage",
    further: tuple[FurtherUnit, ...] = (),
) -> System:
    """Return a unit behind R + jX to a recorded voltage.

    Its inputs are the changes of the recorded voltage ``vt`` and its ``angle`` (rad) from what they
    are at the start, where the angle may grow evenly; and of ``vref``, ``vs``, ``pref``, ``fs``.
    The parameters are those of the unit and the network, and the levels at the start: ``vt0`` of
    the recorded voltage, ``p0`` and ``q0`` unless the network has P or Q, ``speed0``. The powers,
    and the current, are those at the recorded voltage or at the ``terminals``. All per unit on the
    machine's base; ``delta``, to the recorded voltage, in rad.

    ``further`` units behind an R + jX of their own add their powers and currents, times their base;
    at the start they have their shares of the powers. All else is that of the first one.
    """
    refuse_taken(unit.exciter, (*OUTPUTS, MEASURED, *ROTOR, *unit.machine.states))
    network = transformer_sheet(given)
    levels = tuple(
        initial(signal)
        for signal in LEVELS
        if signal.upper() not in {row.symbol for row in network}
    )
    others = [(each, as_unit(each, unit)) for each in further]
    f0 = TRANSFORMER[:1]
    shared = (VT0, initial("speed"), *(NETWORK + row.symbol for row in f0))

    def started(which: UnitOnLoad, p: Signals, n: Names, power: Signal, reactive: Signal) -> Rest:
        vt, at_terminals, at = terminals_at_rest(p[VT0], power, reactive, n, power_at)
        return unit_at_rest(which, vt, at_terminals, at, p, n)

    def rest(p: Signals) -> Rest:
        n = named_parameters(p, NETWORK, network)
        power, reactive = (
            p[NETWORK + name] if name in given else p[initial(name.lower())] for name in ("P", "Q")
        )
        own_power, own_reactive = power, reactive
        states, setpoints = dict[str, Signal](), dict[str, Signal]()
        for each, other in others:
            own = own_values(each, p, shared)
            at = named_parameters(own, NETWORK, BESIDE)
            part, reactive_part = at.share_P * power, at.share_Q * reactive
            own_power, own_reactive = own_power - part, own_reactive - reactive_part
            found = started(other, own, at, part / at.base, reactive_part / at.base)
            states |= prefixed(each, found.states)
            setpoints |= prefixed(each, found.setpoints)
        first = started(unit, p, n, own_power, own_reactive)
        return Rest({**first.states, **states}, {**first.setpoints, **setpoints})

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        d, state = Names(), {**r, **x}
        first = in_grid(unit, network, power_at, p, state, u, d)
        outputs, currents = first.outputs, [first.current] if others else []
        for each, other in others:
            own, slopes = own_values(each, p, shared), Names()
            still = {"vt": u["vt"], "angle": u["angle"], "vref": 0.0}
            held = own_values(each, state)
            added = in_grid(other, (*f0, *BESIDE), power_at, own, held, still, slopes)
            vars(d).update(prefixed(each, vars(slopes)))
            base = own[NETWORK + "base"]
            for name in ("p", "q"):
                outputs[name] = outputs[name] + base * added.outputs[name]
            currents.append(tuple(base * part for part in added.current))
        if others:
            outputs["it"] = modulus(*map(sum, zip(*currents, strict=True)))
        return motion(d, states, {**x, **outputs})

    states = (*unit.states, *(e.prefix + name for e, other in others for name in other.states))
    return System(
        parameters=(
            *unit.parameters(symbols((NETWORK, network))),
            VT0,
            *levels,
            *(
                each.prefix + name
                for each, other in others
                for name in other.parameters(symbols((NETWORK, BESIDE)))
            ),
        ),
        setpoints=(*unit.setpoints, *(e.prefix + name for e, o in others for name in o.setpoints)),
        states=states,
        inputs=inputs,
        outputs=tuple(dict.fromkeys((*OUTPUTS, *unit.shown, *states, *signals_of(unit.limiters)))),
        time_constants=(
            *unit.time_constants,
            *(each.prefix + name for each, other in others for name in other.time_constants),
        ),
        rest=rest,
        motion=equations,
    )


def _build(equipment: Equipment) -> System:
    inputs = tuple(name for name in REFERENCES if name in equipment.inputs)
    given = equipment.given & {row.symbol for row in AT_START}
    return grid_playback(
        UnitOnLoad.of(equipment),
        (*inputs, "vt", "angle"),
        given,
        equipment.power_at,
        equipment.further,
    )


GRID_PLAYBACK = PlantKind(
    name="grid-playback",
    title="on load, driven by the grid's recorded voltage and angle",
    needs=("exciter", "machine", "network"),
    events=REFERENCES,
    signals=("vt", *DRIVING_ANGLE, *REFERENCES, "efd", "ifd", "p", "q", "it", "speed", GATE),
    driving=("vt", *DRIVING_ANGLE, *REFERENCES),
    required=("vt",),
    required_one_of=DRIVING_ANGLE,
    levels=LEVELS,
    beside=BESIDE,
    network=lambda given: transformer_sheet(frozenset(given)),
    network_required=("f0",),
    finds_rest=True,
    build=_build,
)
