"""A machine on load: behind R + jX to a stiff source of constant voltage and frequency."""

from collections.abc import Mapping
from functools import cache
from math import pi
from typing import Literal, NamedTuple

from exfit.engine.system import Motion, Rest, Signals, System
from exfit.engine.trace import Signal, cos, sin, sqrt
from exfit.models.machines import Axes, Machine, Source
from exfit.models.phasors import angle, modulus
from exfit.models.sheet import Model, Sheet, sheet
from exfit.plants.breaker import BREAKER, breaker_of
from exfit.plants.parts import (
    MACHINE,
    MEASURED,
    NETWORK,
    STABILISER,
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
    values_named,
    values_of,
)
from exfit.plants.plant import Equipment, PlantKind, Stabilised, compared, present

OUTPUTS = ("vref", "vt", "efd", "ifd", "p", "q", "it", "delta", "speed")
# the rotor's angle to where the source is at the start (rad), its speed less 1 (pu)
SWING = ("delta", "dw")

FLOW: Sheet = sheet(
    ("f0", 60.0, "Hz", (1.0, 400.0), "rated frequency"),
    ("R", 0.0, "pu", (0.0, 10.0), "resistance to the source"),
    ("X", 0.3, "pu", (0.0, 10.0), "reactance to the source"),
    ("Rc", 0.0, "pu", (-10.0, 10.0), "resistance of the load compensation"),
    ("Xc", 0.0, "pu", (-10.0, 10.0), "reactance of the load compensation"),
    ("P", 0.8, "pu", (-10.0, 10.0), "active power at the start"),
)
REACTIVE: Sheet = sheet(("Q", 0.0, "pu", (-10.0, 10.0), "reactive power at the start"))
SOURCE: Sheet = sheet(("E", 1.0, "pu", (0.01, 10.0), "voltage of the source"))

ROUNDING_AT_REST = 1e-9  # pu
Given = Literal["Q", "E"]  # what sets the start beside vt0 and P
# what a stabiliser may listen to; pa is the accelerating power, none an input that is not in use
HEARD = ("speed", "p", "vt", "pa", "none")


class Flow(NamedTuple):
    """The terminals at the start, vt as the real axis: current i_p - j i_q, source ex + j ey."""

    i_p: Signal
    i_q: Signal
    ex: Signal
    ey: Signal


class Stator(NamedTuple):
    """A machine's terminals by the axes of its rotor, which is turned by delta."""

    v: Axes
    i: Axes
    delta: Signal


def flow_sheet(given: Given) -> Sheet:
    """Return the network's data sheet where the start is given by P and Q, or by P and E."""
    return (*FLOW, *(REACTIVE if given == "Q" else SOURCE))


def reactive_power(vt: Signal, n: Names) -> Signal:
    """Return the Q at which a source E holds vt and P behind R + jX: the smaller current of two.

    From |vt^2 - (R + jX)(P - jQ)| = E vt, a quadratic equation in Q.
    """
    square, reach = n.R * n.R + n.X * n.X, vt * vt
    real, imaginary = reach - n.R * n.P, n.X * n.P
    rest = real * real + imaginary * imaginary - n.E * n.E * reach
    return (n.X * reach - sqrt(n.X * n.X * reach * reach - square * rest)) / square


def flow(vt: Signal, n: Names, given: Given) -> Flow:
    """Return the terminals at the start."""
    i_p, i_q = n.P / vt, (n.Q if given == "Q" else reactive_power(vt, n)) / vt
    return Flow(i_p, i_q, vt - n.R * i_p - n.X * i_q, n.R * i_q - n.X * i_p)


def rotor_frame(vt: Signal, at: Flow, machine: Machine, p: Names) -> Stator:
    """Return the terminals by the axes of the rotor: q lies along vt + jXq it."""
    xq = machine.quadrature(vt, at.i_p, at.i_q, p)
    x, y = vt + xq * at.i_q, xq * at.i_p
    size = modulus(x, y)
    c, s = x / size, y / size
    return Stator(
        v=Axes(vt * s, vt * c),
        i=Axes(at.i_p * s + at.i_q * c, at.i_p * c - at.i_q * s),
        delta=angle(c * at.ex + s * at.ey, s * at.ex - c * at.ey),
    )


class LoadedMachine(NamedTuple):
    """A machine at rest on load: its terminals, the states that hold them, its field current."""

    stator: Stator
    fluxes: Names
    ifd: Signal


def loaded_at_rest(vt: Signal, at: Flow, machine: Machine, p: Names) -> LoadedMachine:
    """Return the machine that holds vt and a current at rest; efd is then its field current."""
    stator, fluxes = rotor_frame(vt, at, machine, p), Names()
    machine.rest(stator.v, stator.i, p, fluxes)
    return LoadedMachine(stator, fluxes, machine.field(fluxes, stator.i, p))


def current(at: Source, E: Signal, R: Signal, X: Signal, delta: Signal) -> Axes:
    """Return the current that a machine drives into E behind R + jX."""
    drop_d, drop_q = at.voltage.d - E * sin(delta), at.voltage.q - E * cos(delta)
    xd, xq = at.xd + X, at.xq + X
    scale = 1.0 / (R * R + xd * xq)
    return Axes((R * drop_d + xq * drop_q) * scale, (R * drop_q - xd * drop_d) * scale)


def compensated(v: Axes, i: Axes, n: Names) -> Signal:
    """Return VC1 = |vt + (Rc + jXc) it| (IEEE Std 421.5-2005, 4): a positive Xc is a droop."""
    return modulus(v.d + n.Rc * i.d - n.Xc * i.q, v.q + n.Rc * i.q + n.Xc * i.d)


def listening(stabiliser: Stabilised, heard: Names) -> Names:
    """Return what a stabiliser sees, ``vsi1`` and ``vsi2``; of the speed, what it deviates."""
    return Names(**{f"vsi{k}": getattr(heard, of) for k, of in enumerate(stabiliser.inputs, 1)})


def rests_with_output(stabiliser: Stabilised, values: Mapping[str, float]) -> bool:
    """Return whether a stabiliser with these values has an output while its unit is at rest."""
    model, p, x = stabiliser.model, Names(**values), Names()
    seen = listening(stabiliser, Names(speed=0.0, p=1.0, vt=1.0, pa=0.0, none=0.0))
    model.rest(0.0, seen, p, x)
    return bool(abs(model.equations(x, seen, p, Names())) > ROUNDING_AT_REST)


def stabiliser_rest(stabiliser: Stabilised, heard: Names, p: Signals) -> dict[str, Signal]:
    """Return the states of a stabiliser that waits, under their names in the system."""
    model, x = stabiliser.model, Names()
    values = named_parameters(p, STABILISER, model.sheet)
    model.rest(0.0, listening(stabiliser, heard), values, x)
    return {STABILISER + name: value for name, value in vars(x).items()}


def stabilising(stabiliser: Stabilised, heard: Names, p: Signals, x: Signals, d: Names) -> Signal:
    """Write the slopes of a stabiliser into ``d`` and return its signal vs."""
    model, slopes = stabiliser.model, Names()
    states = Names(**{name: x[STABILISER + name] for name in model.states})
    values = named_parameters(p, STABILISER, model.sheet)
    vs = model.equations(states, listening(stabiliser, heard), values, slopes)
    for name, slope in vars(slopes).items():
        setattr(d, STABILISER + name, slope)
    return vs


@cache
def infinite_bus(
    model: Model,
    machine: Machine,
    saturation: SaturationForm,
    inputs: tuple[str, ...] = ("vref",),
    given: Given = "Q",
    stabiliser: Stabilised | None = None,
) -> System:
    """Return an exciter on a machine behind R + jX to a stiff source, at constant power Pm.

    2H dw/dt = (Pm - D dw) / (1 + dw) - Te, as in PSS/E. Parameters are the exciter's, those of
    machine, network and stabiliser under their prefixes (``network.X``), and the initial voltage
    ``vt0``. The inputs are changes: of the reference ``vref``, of ``vs`` beside the stabiliser, of
    ``vc1``, the voltage that the exciter measures, of ``E`` and its ``angle`` (rad), of ``R`` and
    ``X``. With the input
    ``breaker`` a breaker opens where that is 1: p, q and it are zero from then on, delta stays, and
    vt follows the speed, which is the simulated one, or 1 and the input ``speed``. All per unit on
    the machine's base; ``delta``, to the source as it is, in rad, ``speed`` 1 when rated.
    """
    of_stabiliser = () if stabiliser is None else stabiliser.model.states
    own = tuple(STABILISER + name for name in of_stabiliser)
    refuse_taken(model, (*OUTPUTS, MEASURED, *SWING, *machine.states))
    states = (*machine.states, *SWING, *model.states, *own)
    network = flow_sheet(given)
    stabiliser_sheet = () if stabiliser is None else stabiliser.model.sheet

    def rest(p: Signals) -> Rest:
        of_machine = named_parameters(p, MACHINE, machine.sheet)
        n, vt = named_parameters(p, NETWORK, network), p[VT0]
        at = flow(vt, n, given)
        stator, fluxes, ifd = loaded_at_rest(vt, at, machine, of_machine)
        vc1 = compensated(stator.v, stator.i, n)
        u = exciter_inputs(vt=vt, vc1=vc1, ifd=ifd, p=n.P, q=vt * at.i_q)
        exciter = rest_of(model, ifd, u, exciter_parameters(p, model, saturation))
        waiting = {**values_of(fluxes, machine.states), "delta": stator.delta, "dw": 0.0}
        if stabiliser is not None:
            waiting |= stabiliser_rest(
                stabiliser, Names(speed=0.0, p=n.P, vt=vt, pa=0.0, none=0.0), p
            )
        return Rest(
            {**waiting, **exciter.states},
            {**exciter.setpoints, "Pm": n.P, "source": modulus(at.ex, at.ey)},
        )

    def equations(p: Signals, r: Signals, x: Signals, u: Signals) -> Motion:
        of_machine, d = named_parameters(p, MACHINE, machine.sheet), Names()
        n = named_parameters(p, NETWORK, network)
        changed = Names(**{name: u.get(name, 0.0) for name in ("E", "R", "X", "angle", "vs")})
        fluxes = values_named(x, machine.states)
        at = machine.source(fluxes, of_machine)
        E, R, X = r["source"] + changed.E, n.R + changed.R, n.X + changed.X
        delta, dw, factor = x["delta"] - changed.angle, x["dw"], 1.0
        closed = current(at, E, R, X, delta)
        i = closed
        breaker = breaker_of(u, dw) if BREAKER in inputs else None
        if breaker is not None:
            i, dw, factor = breaker.current(closed), breaker.dw, breaker.factor
        v = Axes(factor * (at.voltage.d + at.xq * i.q), factor * (at.voltage.q - at.xd * i.d))
        vt, it = modulus(v.d, v.q), modulus(closed.d, closed.q)
        power, reactive = v.d * i.d + v.q * i.q, v.q * i.d - v.d * i.q
        ifd = machine.field(fluxes, i, of_machine)
        vs = changed.vs
        if stabiliser is not None:
            heard = Names(speed=dw, p=power, vt=vt, pa=r["Pm"] - power, none=0.0)
            vs = vs + stabilising(stabiliser, heard, p, x, d)
        vref = r["vref"] + u["vref"]
        vc1 = compensated(v, i, n)
        measured = vc1 + u.get(MEASURED, 0.0)
        u_exciter = exciter_inputs(
            vref=vref, vs=vs, vt=vt, vc1=measured, ifd=ifd, p=power, q=reactive
        )
        efd = model.equations(
            state_of(model, x, r), u_exciter, exciter_parameters(p, model, saturation), d
        )
        machine.slopes(fluxes, efd, ifd, i, of_machine, d)
        machine.q_slopes(fluxes, i, of_machine, d)
        speed = 1.0 + x["dw"]
        d.delta = 2.0 * pi * n.f0 * x["dw"]
        d.dw = ((r["Pm"] - of_machine.D * x["dw"]) / speed - power) / (2.0 * of_machine.H)
        if breaker is not None:
            it, d.delta = breaker.until_open(it), breaker.until_open(d.delta)
        outputs = dict(
            zip(
                OUTPUTS,
                (vref, vt, efd, ifd, power, reactive, it, delta, 1.0 + dw),
                strict=True,
            )
        )
        return motion(d, states, {**x, **outputs, MEASURED: vc1})

    return System(
        parameters=(
            *symbols("", model.sheet),
            *symbols(MACHINE, machine.sheet),
            *symbols(NETWORK, network),
            *symbols(STABILISER, stabiliser_sheet),
            VT0,
        ),
        setpoints=("vref", *model.setpoints, "Pm", "source"),
        states=states,
        inputs=inputs,
        outputs=tuple(dict.fromkeys((*OUTPUTS, *states))),
        time_constants=(
            *seconds("", model.sheet),
            *seconds(MACHINE, machine.sheet),
            *seconds(STABILISER, stabiliser_sheet),
        ),
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
    )


INFINITE_BUS = PlantKind(
    name="infinite-bus",
    title="on load, behind R + jX to a stiff source",
    needs=("exciter", "machine", "network"),
    events=("vref", "vs", "E", "angle", "network", BREAKER),
    signals=compared(OUTPUTS),
    network=lambda given: flow_sheet("E" if "E" in given else "Q"),
    build=_build,
)
