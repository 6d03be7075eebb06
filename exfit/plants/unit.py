"""A unit on load: exciter, stabiliser and governor on a machine whose speed follows the power."""

from collections.abc import Callable, Sequence
from math import pi
from typing import NamedTuple

from exfit.engine.system import Rest, Signals
from exfit.engine.trace import Signal
from exfit.models.machines import Axes, Machine, Source
from exfit.models.sheet import Model
from exfit.plants import (
    GOVERNOR,
    MACHINE,
    STABILISER,
    Dialect,
    Equipment,
    SaturationForm,
    Stabilised,
)
from exfit.plants.controls import gate, listening, turbine_power
from exfit.plants.limiting import Limiters, limited_exciter, limiters_rest, sheets_of, states_of
from exfit.plants.loaded_machine import (
    Flow,
    Terminals,
    compensated,
    compensated_angle,
    connected,
    loaded_at_rest,
    losses,
)
from exfit.plants.parts import (
    Names,
    Part,
    exciter_inputs,
    exciter_parameters,
    named_parameters,
    output_of,
    present,
    rest_of,
    seconds,
    states_at_rest,
    symbols,
)

REFERENCE = GOVERNOR + "pref"  # the setpoint of a governor that holds the power at the start
# the rotor's angle to where the voltage behind R + jX is at the start (rad), its speed less 1 (pu)
ROTOR = ("delta", "dw")
ANGLE = STABILISER + "angle"  # the state behind the compensated frequency


class UnitOnLoad(NamedTuple):
    """The models of a unit on load, and the program whose equations connect them."""

    exciter: Model
    machine: Machine
    saturation: SaturationForm
    stabiliser: Stabilised | None = None
    dialect: Dialect = "standard"
    governor: Model | None = None
    limiters: Limiters = ()

    @classmethod
    def of(cls, equipment: Equipment) -> "UnitOnLoad":
        """Return the unit of a case's equipment."""
        return cls(
            present(equipment.exciter),
            present(equipment.machine),
            equipment.saturation,
            equipment.stabiliser,
            equipment.dialect,
            equipment.governor,
            equipment.limiters,
        )

    @property
    def speed_in_stator(self) -> bool:
        """Whether the voltage behind the stator follows the speed."""
        return self.dialect == "powerworld" or self.machine.speed == "voltage"

    def connected(
        self, fluxes: Names, dw: Signal, p: Names, Ra: Signal, drives: Callable[[Source], Axes]
    ) -> tuple[Source, Axes]:
        """Return the voltage behind the stator, and the current that it ``drives``."""
        speed = 1.0 + dw if self.speed_in_stator else 1.0

        def source() -> Source:
            at = self.machine.source(fluxes, p)
            voltage = Axes(speed * at.voltage.d, speed * at.voltage.q)
            return at._replace(voltage=voltage, ra=Ra)

        return connected(self.machine, source, drives, fluxes, p, speed)

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
        limiting = (*((ANGLE,) if self.hears_frequency else ()), *states_of(self.limiters))
        return (*self.machine.states, *ROTOR, *self.exciter.states, *added, *limiting)

    @property
    def hears_frequency(self) -> bool:
        """Whether the stabiliser listens to the compensated frequency."""
        return self.stabiliser is not None and "fc" in self.stabiliser.inputs

    @property
    def shown(self) -> tuple[str, ...]:
        """What it shows beside the signals of its plant: the gate of the governor, the states."""
        return (*gate(self.governor, dict.fromkeys(self.states, 0.0)), *self.states)

    @property
    def setpoints(self) -> tuple[str, ...]:
        """Setpoints that hold the unit at rest."""
        held = ("vref", *self.exciter.setpoints)
        if self.governor is None:
            return (*held, "Pm")
        return (*held, REFERENCE, *(GOVERNOR + name for name in self.governor.setpoints))

    @property
    def sheets(self) -> tuple[list[Part], list[Part]]:
        """Data sheets by how their parameters begin: before those of the network, and behind."""
        added = [(prefix, model.sheet) for prefix, model in self.added]
        unit = [("", self.exciter.sheet), (MACHINE, self.machine.sheet)]
        return unit, [*added, *sheets_of(self.limiters)]

    def parameters(self, network: Sequence[str]) -> tuple[str, ...]:
        """Return all parameters, with those of the network in their place."""
        unit, added = self.sheets
        return (*symbols(*unit), *network, *symbols(*added))

    @property
    def time_constants(self) -> tuple[str, ...]:
        """Parameters that are times."""
        unit, added = self.sheets
        return seconds(*unit, *added)


class Controls(NamedTuple):
    """Inputs of a unit beside its terminals: reference, vs, and the voltage added to vc1.

    ``pref`` is the change of the governor's reference, ``fs`` is added to the speed it measures.
    """

    vref: Signal
    vs: Signal = 0.0
    measured: Signal = 0.0
    pref: Signal = 0.0
    fs: Signal = 0.0


class Excited(NamedTuple):
    """Signals of a unit beside its terminals; the gate and the outputs of its limiters by name."""

    efd: Signal
    ifd: Signal
    vc1: Signal
    others: Signals


def unit_at_rest(
    unit: UnitOnLoad, vt: Signal, power: Signal, at: Flow, p: Signals, network: Names
) -> Rest:
    """Return the unit at rest at vt and a power, with the current and the source of ``at``.

    Of the ``network`` Rc and Xc compensate the load, and Ra is that of the stator.
    """
    of_machine = named_parameters(p, MACHINE, unit.machine.sheet)
    stator, fluxes, ifd = loaded_at_rest(vt, at, unit.machine, of_machine, network.Ra)
    vc1 = compensated(stator.v, stator.i, network)
    u = exciter_inputs(vt=vt, vc1=vc1, ifd=ifd, p=power, q=vt * at.i_q)
    exciter = rest_of(unit.exciter, ifd, u, exciter_parameters(p, unit.exciter, unit.saturation))
    states = {name: getattr(fluxes, name) for name in unit.machine.states}
    states |= {"delta": stator.delta, "dw": 0.0, **limiters_rest(unit.limiters, u, p)}
    if unit.stabiliser is not None:
        signals = Names(speed=0.0, p=power, vt=vt, pa=0.0, fc=0.0, none=0.0)
        heard = listening(unit.stabiliser, signals)
        states |= states_at_rest(STABILISER, unit.stabiliser.model, 0.0, heard, p)[1]
    if unit.hears_frequency:
        states[ANGLE] = compensated_angle(stator.v, stator.i, p[STABILISER + "XCOMP"])
    mechanical = power + losses(stator.i, network.Ra)
    held = {"Pm": mechanical}
    if unit.governor is not None:
        pref, found = states_at_rest(GOVERNOR, unit.governor, mechanical, Names(dw=0.0, p=power), p)
        kept = [GOVERNOR + name for name in unit.governor.setpoints]
        held = {REFERENCE: pref, **{name: found.pop(name) for name in kept}}
        states |= found
    return Rest({**states, **exciter.states}, {**exciter.setpoints, **held})


def compensated_frequency(
    at: Terminals, p: Signals, state: Signals, network: Names
) -> tuple[Signal, Signal]:
    """Return fc, the frequency of vt + jXCOMP it behind a lag TCOMP, less 1, and a state's slope.

    (1 + sTCOMP) fc is the change of speed and the slope of its angle to the rotor over 2 pi f0. Of
    that PSS/E 36.7 shows the part of the compensation, to the rounding of its states; which lag it
    gives the frequency of the bus, which its curves leave out, is not public.
    """
    rated = 2.0 * pi * network.f0
    ahead = compensated_angle(at.v, at.i, p[STABILISER + "XCOMP"])
    fc = (ahead - state[ANGLE]) / (rated * p[STABILISER + "TCOMP"])
    return fc, rated * (fc - at.dw)


def unit_motion(
    unit: UnitOnLoad,
    at: Terminals,
    controls: Controls,
    p: Signals,
    state: Signals,
    network: Names,
    d: Names,
) -> Excited:
    """Write the slopes of a unit's states but delta into ``d``, and return what it shows.

    ``state`` holds its states, and the setpoints that held it at rest. The speed follows from
    2H d(dw)/dt = (Pm - D dw) / (1 + dw) - Te, Te the power of the air gap, which has the losses of
    the stator; in ANDES Pm is a torque, not divided, and in PowerWorld, where the stator's voltage
    follows the speed, Te is that power by the speed.
    """
    of_machine = named_parameters(p, MACHINE, unit.machine.sheet)
    ifd = unit.machine.field(at.fluxes, at.i, of_machine)
    power, vt, vs = at.p, at.vt, controls.vs
    braking = power + losses(at.i, network.Ra)
    if unit.governor is None:
        Pm = state["Pm"]
    else:
        seen = Names(dw=at.dw, p=power, pref=state[REFERENCE] + controls.pref)
        Pm = turbine_power(unit.governor, seen, controls.fs, p, state, d)
    if unit.stabiliser is not None:
        heard = Names(speed=at.dw, p=power, vt=vt, pa=Pm - braking, none=0.0)
        if unit.hears_frequency:
            heard.fc, slope = compensated_frequency(at, p, state, network)
            setattr(d, ANGLE, slope)
        seen = listening(unit.stabiliser, heard)
        vs = vs + output_of(STABILISER, unit.stabiliser.model, seen, p, state, d)
    vc1 = compensated(at.v, at.i, network)
    terminals = {"vt": vt, "vc1": vc1 + controls.measured, "ifd": ifd, "p": power, "q": at.q}
    u = exciter_inputs(vref=controls.vref, vs=vs, speed=1.0 + at.dw, **terminals)
    efd, signals = limited_exciter(unit.exciter, unit.saturation, unit.limiters, u, p, state, d)
    unit.machine.slopes(at.fluxes, efd, ifd, at.i, of_machine, d)
    unit.machine.q_slopes(at.fluxes, at.i, of_machine, d)
    driving = Pm - of_machine.D * state["dw"]
    if unit.dialect != "andes":
        driving = driving / (1.0 + state["dw"])
    if unit.speed_in_stator or unit.machine.speed:
        braking = braking / (1.0 + state["dw"])
    d.dw = (driving - braking) / (2.0 * of_machine.H)
    return Excited(efd, ifd, vc1, {**signals, **gate(unit.governor, state)})
