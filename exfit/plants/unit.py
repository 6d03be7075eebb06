"""A unit on load: exciter, stabiliser and governor on a machine whose speed follows the power."""

from collections.abc import Sequence
from typing import NamedTuple

from exfit.engine.system import Signals
from exfit.engine.trace import Signal
from exfit.models.machines import Axes, Machine
from exfit.models.phasors import modulus
from exfit.models.sheet import Model
from exfit.plants.controls import REFERENCE, governing, governor_rest, stabiliser_rest, stabilising
from exfit.plants.limiting import (
    limited_inputs,
    limiters_rest,
    limiting,
    seconds_of,
    states_of,
    symbols_of,
)
from exfit.plants.loaded_machine import Flow, compensated, loaded_at_rest
from exfit.plants.parts import (
    GOVERNOR,
    MACHINE,
    STABILISER,
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
    named_parameters,
    rest_of,
    seconds,
    state_of,
    symbols,
    values_of,
)
from exfit.plants.plant import Attached, Stabilised, Swing

# the rotor's angle to where the voltage behind R + jX is at the start (rad), its speed less 1 (pu)
ROTOR = ("delta", "dw")


class UnitOnLoad(NamedTuple):
    """The models of a unit on load, and the form of its swing equation."""

    exciter: Model
    machine: Machine
    saturation: SaturationForm
    stabiliser: Stabilised | None = None
    swing: Swing = "power"
    governor: Model | None = None
    limiters: tuple[Attached, ...] = ()

    @property
    def added(self) -> tuple[tuple[str, Model], ...]:
        """The stabiliser and the governor, those that there are, by how their names begin."""
        stabiliser = None if self.stabiliser is None else self.stabiliser.model
        models = ((STABILISER, stabiliser), (GOVERNOR, self.governor))
        return tuple((prefix, model) for prefix, model in models if model is not None)

    @property
    def states(self) -> tuple[str, ...]:
        """All states by their names in the system."""
        added = (prefix + name for prefix, model in self.added for name in model.states)
        limiting = states_of(self.limiters)
        return (*self.machine.states, *ROTOR, *self.exciter.states, *added, *limiting)

    @property
    def setpoints(self) -> tuple[str, ...]:
        """Setpoints that hold the unit at rest."""
        held = ("vref", *self.exciter.setpoints)
        if self.governor is None:
            return (*held, "Pm")
        return (*held, REFERENCE, *(GOVERNOR + name for name in self.governor.setpoints))

    def parameters(self, network: Sequence[str]) -> tuple[str, ...]:
        """Return all parameters, with those of the network in their place."""
        return (
            *symbols("", self.exciter.sheet),
            *symbols(MACHINE, self.machine.sheet),
            *network,
            *(name for prefix, model in self.added for name in symbols(prefix, model.sheet)),
            *symbols_of(self.limiters),
        )

    @property
    def time_constants(self) -> tuple[str, ...]:
        """Parameters that are times."""
        return (
            *seconds("", self.exciter.sheet),
            *seconds(MACHINE, self.machine.sheet),
            *(name for prefix, model in self.added for name in seconds(prefix, model.sheet)),
            *seconds_of(self.limiters),
        )


class UnitRest(NamedTuple):
    """A unit at rest: its states, and what holds them."""

    states: dict[str, Signal]
    setpoints: dict[str, Signal]


class Terminals(NamedTuple):
    """A unit's terminals at one instant: voltage and current by the axes of its rotor.

    ``fluxes`` are the machine's states, ``dw`` the speed less 1 that is heard and shown.
    """

    fluxes: Names
    v: Axes
    i: Axes
    dw: Signal

    @property
    def vt(self) -> Signal:
        """The terminal voltage."""
        return modulus(self.v.d, self.v.q)

    @property
    def p(self) -> Signal:
        """The active power."""
        return self.v.d * self.i.d + self.v.q * self.i.q

    @property
    def q(self) -> Signal:
        """The reactive power."""
        return self.v.q * self.i.d - self.v.d * self.i.q


class Controls(NamedTuple):
    """Inputs of a unit beside its terminals: reference, vs, and the voltage added to vc1.

    ``pref`` is the change of the governor's reference.
    """

    vref: Signal
    vs: Signal = 0.0
    measured: Signal = 0.0
    pref: Signal = 0.0


class UnitState(NamedTuple):
    """The parameters of a system, what held it at rest, and its states at one instant."""

    p: Signals
    r: Signals
    x: Signals


class Excited(NamedTuple):
    """Signals of a unit beside its terminals; the outputs of its limiters by name."""

    efd: Signal
    ifd: Signal
    vc1: Signal
    limiters: Signals


def unit_at_rest(
    unit: UnitOnLoad, vt: Signal, power: Signal, at: Flow, p: Signals, network: Names
) -> UnitRest:
    """Return the unit at rest at vt and a power, with the current and the source of ``at``.

    Of the ``network`` Rc and Xc compensate the load.
    """
    of_machine = named_parameters(p, MACHINE, unit.machine.sheet)
    stator, fluxes, ifd = loaded_at_rest(vt, at, unit.machine, of_machine)
    vc1 = compensated(stator.v, stator.i, network)
    u = exciter_inputs(vt=vt, vc1=vc1, ifd=ifd, p=power, q=vt * at.i_q)
    values = exciter_parameters(p, unit.exciter, unit.saturation)
    exciter = rest_of(unit.exciter, ifd, u, values)
    states = {**values_of(fluxes, unit.machine.states), "delta": stator.delta, "dw": 0.0}
    states |= limiters_rest(unit.limiters, u, p)
    if unit.stabiliser is not None:
        heard = Names(speed=0.0, p=power, vt=vt, pa=0.0, none=0.0)
        states |= stabiliser_rest(unit.stabiliser, heard, p)
    held: Signals = {"Pm": power}
    if unit.governor is not None:
        turbine = governor_rest(unit.governor, power, p)
        states, held = {**states, **turbine.states}, turbine.setpoints
    return UnitRest({**states, **exciter.states}, {**exciter.setpoints, **held})


def mechanical_power(
    unit: UnitOnLoad, at: Terminals, pref: Signal, given: UnitState, d: Names
) -> Signal:
    """Return the power Pm of the turbine: its governor's, or the one that held the unit at rest."""
    p, r, x = given
    if unit.governor is None:
        return r["Pm"]
    return governing(unit.governor, Names(dw=at.dw, p=at.p, pref=pref), p, r, x, d)


def acceleration(swing: Swing, Pm: Signal, power: Signal, dw: Signal, machine: Names) -> Signal:
    """Return d(dw)/dt, 1/s, of 2H d(dw)/dt = (Pm - D dw) / (1 + dw) - Te, Te the power.

    As a ``torque`` Pm is not divided by the speed.
    """
    driving = Pm - machine.D * dw
    if swing == "power":
        driving = driving / (1.0 + dw)
    return (driving - power) / (2.0 * machine.H)


def unit_motion(
    unit: UnitOnLoad, at: Terminals, controls: Controls, given: UnitState, network: Names, d: Names
) -> Excited:
    """Write the slopes of a unit's states but delta into ``d``, and return what it shows."""
    p, r, x = given
    of_machine = named_parameters(p, MACHINE, unit.machine.sheet)
    ifd = unit.machine.field(at.fluxes, at.i, of_machine)
    power, reactive, vt = at.p, at.q, at.vt
    Pm, vs = mechanical_power(unit, at, controls.pref, given, d), controls.vs
    if unit.stabiliser is not None:
        heard = Names(speed=at.dw, p=power, vt=vt, pa=Pm - power, none=0.0)
        vs = vs + stabilising(unit.stabiliser, heard, p, x, d)
    vc1 = compensated(at.v, at.i, network)
    u = exciter_inputs(
        vref=controls.vref,
        vs=vs,
        vt=vt,
        vc1=vc1 + controls.measured,
        ifd=ifd,
        p=power,
        q=reactive,
        speed=1.0 + at.dw,
    )
    signals = limiting(unit.limiters, u, p, x, d)
    u = exciter_inputs(**{**vars(u), **limited_inputs(unit.limiters, signals)})
    values = exciter_parameters(p, unit.exciter, unit.saturation)
    efd = unit.exciter.equations(state_of(unit.exciter, x, r), u, values, d)
    unit.machine.slopes(at.fluxes, efd, ifd, at.i, of_machine, d)
    unit.machine.q_slopes(at.fluxes, at.i, of_machine, d)
    d.dw = acceleration(unit.swing, Pm, power, x["dw"], of_machine)
    return Excited(efd, ifd, vc1, signals)
