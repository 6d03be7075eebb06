"""A unit in the network of InterPSS's single-machine cases, as PowerWorld and PSS/E ran them.

Bus 1 with the unit, j0.1 to bus 2 with a load of 1 + j0.5, j0.05 to a stiff source; per unit of 100
MVA, the base of the machine. The disturbance is a fault of j0.2 at bus 1 for 50 ms, or a pulse of
the reference. PowerWorld multiplies the voltage behind the stator by the speed and has a load of
constant admittance, as PSS/E has unless the case says ``"load": "power"``.

All is in plain Python, with the functions of the models: no plant has this network.
"""

import csv
import json
from cmath import exp
from functools import partial
from math import pi

from places import REFERENCE

from exfit.features.planner.units import read_unit
from exfit.models import GOVERNORS
from exfit.models.blocks import Limited
from exfit.models.machines import Axes
from exfit.plants import GOVERNOR, MACHINE, SATURATION, STABILISER, Stabilised
from exfit.plants.loaded_machine import Flow, Terminals
from exfit.plants.parts import Names, named_parameters, values_named
from exfit.plants.unit import Controls, UnitOnLoad, unit_at_rest, unit_motion

MACHINE_RECORD = """\
1 'GENROU' 1 6.0 0.033 0.54 0.078 6.4 0.0 0.8958 0.8645 0.1189 0.1969 0.089 0.0521 0.0 0.0 /
"""
P, Q = 0.50001, 0.01251  # at bus 1, whose voltage is 1
LINE, SOURCE, SHUNT, LOAD = 0.1j, 0.05j, 0.2j, 1.0 + 0.5j
FAULT = (0.05, 0.10)  # s
UNCOMPENSATED = Names(Rc=0.0, Xc=0.0)
STEP = 5e-4  # s, of both programs too
ROUNDS = 8  # to the voltage of a load of constant power: each leaves a twentieth of the error


def cases():
    """Return the names of the references of both programs."""
    names = sorted(path.stem for path in REFERENCE.glob("*.json"))
    return [name for name in names if name.startswith(("powerworld_", "psse_"))]


def reference(name):
    """Return what a reference says of its case, and its rows of numbers."""
    told = json.loads((REFERENCE / f"{name}.json").read_text())
    with (REFERENCE / f"{name}.csv").open() as file:
        return told, [{k: float(x) for k, x in row.items()} for row in csv.DictReader(file)]


def prefixed(prefix, values):
    """Return values under the names that they have in a system."""
    return {prefix + name: value for name, value in values.items()}


class TwoBuses:
    """The unit of a case, with the values that its records are imported as, or some changed."""

    def __init__(self, told, **changes):
        parts = read_unit(MACHINE_RECORD + "\n".join(told["records"]), "case.dyr")
        values = {**parts.exciter.values, **prefixed(MACHINE, parts.machine.values)}
        stabiliser, governor = None, None
        if (part := parts.stabiliser) is not None:
            model = part.definition.model
            stabiliser = Stabilised(model, part.inputs or model.inputs)
            values |= prefixed(STABILISER, part.values)
        if added := told.get("governor"):
            governor = GOVERNORS[added["model"]]
            values |= prefixed(GOVERNOR, added["parameters"])
        dialect = "powerworld" if told["program"] == "PowerWorld" else "standard"
        self.unit = UnitOnLoad(
            parts.exciter.definition.model.in_dialect(dialect),
            parts.machine.definition.model,
            SATURATION["quadratic"],
            stabiliser,
            governor=governor,
            dialect=dialect,
        )
        self.values, self.pulse = values | changes, told.get("vref", 0.0)
        self.draws_power = "load" in told
        current = P - 1j * Q
        at_load = 1.0 - LINE * current
        self.drawn = (LOAD / at_load).conjugate() / at_load
        source = at_load + SOURCE * (self.drawn * at_load - current)
        self.E = abs(source)
        at = Flow(P, Q, source.real, source.imag)
        self.boost = told.get("boost")
        self.rest, self.held = unit_at_rest(self.unit, 1.0, P, at, self.values, UNCOMPENSATED)
        if self.boost:
            self.rest["boost"] = self.boost["VK"]

    def current(self, voltage, x, faulted):
        """Return the current that a voltage behind jx drives, both to the source's angle."""
        behind, z = voltage, 1j * x
        if faulted:
            behind, z = behind * SHUNT / (z + SHUNT), z * SHUNT / (z + SHUNT)
        towards, own = behind / (z + LINE) + self.E / SOURCE, 1.0 / (z + LINE) + 1.0 / SOURCE
        at_load = towards / (own + self.drawn)
        for _ in range(ROUNDS if self.draws_power else 0):
            at_load = (towards - (LOAD / at_load).conjugate()) / own
        return (voltage - behind + z * (behind - at_load) / (z + LINE)) / (1j * x)

    def motion(self, state, disturbed):
        """Return the slopes of all states, and what the unit shows."""
        unit, d = self.unit, Names()
        p = named_parameters(self.values, MACHINE, unit.machine.sheet)
        fluxes, dw = values_named(state, unit.machine.states), state["dw"]
        at = unit.source(fluxes, dw, p)
        turned = exp(1j * state["delta"])
        inner = at.voltage.q - 1j * at.voltage.d
        i = self.current(inner * turned, at.xd, disturbed and not self.pulse) / turned
        v = inner - 1j * at.xd * i
        terminals = Terminals(fluxes, Axes(-v.imag, v.real), Axes(-i.imag, i.real), dw)
        controls = Controls(self.held["vref"] + (self.pulse if disturbed else 0.0))
        if self.boost:
            d.boost = -state["boost"] / self.boost["TD2"]
            cut = 1.0 - terminals.vt > self.boost["VCUTOFF"]
            controls = controls._replace(vs=0.0 if cut else state["boost"])
        held = {**self.held, **state}
        shown = unit_motion(unit, terminals, controls, self.values, held, UNCOMPENSATED, d)
        d.delta = 2.0 * pi * 60.0 * dw
        signals = {"vt": terminals.vt, "p": terminals.p, "q": terminals.q, "efd": shown.efd}
        return vars(d), {**state, **signals, "speed": 1.0 + dw}

    def shown(self, times):
        """Return what the unit shows at some instants, by Runge-Kutta of order four."""
        rows, state, at = {}, self.rest, {round(t / STEP) for t in times}
        for n in range(max(at) + 1):
            motion = partial(self.motion, disturbed=FAULT[0] <= n * STEP < FAULT[1])
            k1, signals = motion(state)
            if n in at:
                rows[n] = signals
            k2, _ = motion(moved(state, k1, 0.5 * STEP))
            k3, _ = motion(moved(state, k2, 0.5 * STEP))
            k4, _ = motion(moved(state, k3, STEP))
            for k, share in ((k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)):
                state = moved(state, k, share * STEP / 6.0)
            state = {name: within(x, k4[name]) for name, x in state.items()}
        return [rows[round(t / STEP)] for t in times]


def moved(state, slopes, h):
    """Return the states a time on."""
    return {name: x + h * getattr(slopes[name], "slope", slopes[name]) for name, x in state.items()}


def within(x, slope):
    """Return a state put back between its limits."""
    return float(min(max(x, slope.low), slope.high) if isinstance(slope, Limited) else x)


def differences(name, signals, **changes):
    """Return the largest differences from a reference's signals, with some values changed."""
    told, rows = reference(name)
    got = TwoBuses(told, **changes).shown([row["t"] for row in rows])
    pairs = list(zip(got, rows, strict=True))
    return {s: max(abs(ours[s] - theirs[s]) for ours, theirs in pairs) for s in signals}
