"""A unit in the network of InterPSS's single-machine cases, as PowerWorld and PSS/E ran them.

Bus 1 with the unit, j0.1 to bus 2 with a load of 1 + j0.5, j0.05 to a source; per unit of 100
MVA, the base of the machine. The source is a GENCLS whose H of 99999 s swings against that of the
unit: p is 8e-6 off with a stiff one. The disturbance is a fault of j0.2 at bus 1 for 50 ms, or a
pulse of the reference. PowerWorld multiplies the voltage behind the stator by the speed and has a
load of constant admittance, as PSS/E has unless the case says ``"load": "power"``. The plant
infinite-bus has this network, but for the swing of the source.
"""

import csv
import json
from contextlib import nullcontext
from dataclasses import replace
from itertools import pairwise
from unittest.mock import patch

import numpy as np
from places import REFERENCE

from exfit.features.planner.units import read_unit, with_rating
from exfit.models import GOVERNORS
from exfit.models.blocks import lag
from exfit.models.load_control import controlled
from exfit.models.machines import genqec
from exfit.models.machines.round_rotor import transient_time, unsaturated_q_current
from exfit.models.sheet import typical
from exfit.models.speed_multiplier import times_speed
from exfit.plants import (
    GOVERNOR,
    MACHINE,
    NETWORK,
    SATURATION,
    STABILISER,
    VT0,
    Attached,
    Stabilised,
)
from exfit.plants import unit as loaded
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput
from exfit.simulation.simulator import Simulator

MACHINE_RECORD = """\
1 'GENROU' 1 6.0 0.033 0.54 0.078 6.4 0.0 0.8958 0.8645 0.1189 0.1969 0.089 0.0521 0.0 0.0 /
"""
BASE = 100.0  # MVA of the machine
P, Q = 0.50001, 0.01251  # at bus 1, whose voltage is 1
LINE, SOURCE, SHUNT, LOAD = 0.1, 0.05, 0.2, (1.0, 0.5)  # X, X, X, P and Q
SOURCE_H = 99999.0  # s
FAULT = (0.05, 0.10)  # s
STEP = 5e-4  # s, of both programs too


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


def without_bus_frequency():
    """Leave the frequency of the bus out of the compensated one, as the curves of PSS/E do."""
    whole, ahead = loaded.compensated_frequency, loaded.compensated_angle

    def of_compensation(at, *given):
        return whole(at._replace(dw=0.0), *given)

    def by_compensation(v, i, X):
        return ahead(v, i, X) - ahead(v, i, 0.0)

    return patch.multiple(
        loaded, compensated_frequency=of_compensation, compensated_angle=by_compensation
    )


def genqec_of_powerworld():
    """Return GENQEC with X''d for X''q in the slope of E'd, as PowerWorld 24 has it."""

    def q_slopes(s, i, p, d):
        by, i_q = 1.0 + s.SAT, genqec.unsaturated(s, i).q
        d.EDP = -by * unsaturated_q_current(s, i_q, p.Xppd, p) / transient_time(p)
        _, d.PSIQ = lag(s.EDP + (p.Xpq - p.Xl) * i_q, s.PSIQ, 1.0, p.Tppq0 / by)

    return genqec.GENQEC._replace(q_slopes=q_slopes)


def by_the_last_saturation():
    """Solve the network at the saturation of the solution before, as PowerWorld 24 does.

    The slopes have the saturation at the flux that this shows.
    """
    whole, last = loaded.connected, list[float]()

    def connected(machine, source, drives, fluxes, p, speed):
        if last:
            fluxes.SAT = last.pop()
            at = source()
            i = drives(at)
            gap_d, gap_q = at.voltage.d + (at.xq - p.Xl) * i.q, at.voltage.q - (at.xd - p.Xl) * i.d
            fluxes.SAT = machine.saturated(np.hypot(gap_d, gap_q) / speed, np.hypot(i.d, i.q), p)
        else:
            at, i = whole(machine, source, drives, fluxes, p, speed)
        last.append(fluxes.SAT)
        return at, i

    return patch.object(loaded, "connected", connected)


def swinging(system):
    """Return the system of a unit whose source is a machine of constant power, as GENCLS is."""

    def rest(p):
        at = system.rest(p)
        return at._replace(states={**at.states, "source.dw": 0.0, "source.angle": 0.0})

    def motion(p, r, x, u):
        at = system.motion(p, r, x, {**u, "angle": x["source.angle"]})
        vt, power, reactive = (at.outputs[signal] for signal in ("vt", "p", "q"))
        with_fault = reactive + u.get("fault_B", 0.0) * vt * vt
        ahead, aside = vt - LINE * with_fault / vt, LINE * power / vt
        load = p.get(f"{NETWORK}PL", 0.0)
        load = load + p.get(f"{NETWORK}YP", 0.0) * (ahead * ahead + aside * aside)
        surplus = (LOAD[0] - p[f"{NETWORK}P"]) - (load - power)
        slopes = {"source.dw": surplus / (2.0 * SOURCE_H)}
        slopes["source.angle"] = 2.0 * np.pi * p[f"{NETWORK}f0"] * x["source.dw"]
        return at._replace(slopes={**at.slopes, **slopes})

    return replace(
        system,
        states=(*system.states, "source.dw", "source.angle"),
        inputs=tuple(name for name in system.inputs if name != "angle"),
        rest=rest,
        motion=motion,
    )


class TwoBuses:
    """The unit of a case, with the values that its records are imported as, or some changed."""

    STEP = STEP

    def __init__(self, told, **changes):
        records = told["records"]
        if "GEN" not in records[0]:
            records = [MACHINE_RECORD, *records]
        parts = with_rating(read_unit("\n".join(records), "case.dyr"), BASE)
        values = {**parts.exciter.values, **prefixed(MACHINE, parts.machine.values)}
        dialect = {"PowerWorld": "powerworld", "PSS/E": "psse"}[told["program"]]
        stabiliser, governor = None, None
        if (part := parts.stabiliser) is not None:
            model = part.definition.model
            heard = Stabilised(model, part.inputs or model.inputs)
            stabiliser = heard.in_dialect(dialect)
            values |= prefixed(STABILISER, part.values)
        if (part := parts.governor) is not None:
            governor = part.definition.model
            values |= prefixed(GOVERNOR, {**part.values, **told.get("beside_the_record", {})})
        if (part := parts.load_controller) is not None:
            governor = controlled(governor, part.definition.model)
            values |= prefixed(part.definition.prefix, part.values)
        if added := told.get("governor"):
            governor = GOVERNORS[added["model"]]
            values |= prefixed(GOVERNOR, typical(governor.sheet) | added["parameters"])
        if "form_of_powerworld" in told:  # it was run with this flag
            values[f"{MACHINE}SATFLG"] = 0.0
        limiters = []
        for part in parts.limiters:
            limiters.append(Attached(part.definition.model, part.place))
            values |= prefixed(limiters[-1].prefix, part.values)
        exciter = parts.exciter.definition.model.in_dialect(dialect)
        self.unit = UnitOnLoad(
            times_speed(exciter) if "efd_times_speed" in told else exciter,
            genqec_of_powerworld()
            if "form_of_powerworld" in told
            else parts.machine.definition.model,
            SATURATION["quadratic"],
            stabiliser,
            governor=governor,
            dialect=dialect,
            limiters=tuple(limiters),
        )
        network = {"f0": 60.0, "R": 0.0, "X": LINE, "Ra": 0.0, "Rc": 0.0, "Xc": 0.0, "P": P, "Q": Q}
        network |= {"Rs": 0.0, "Xs": SOURCE} | told.get("compensation", {})
        if "load" in told:
            load = {"PL": LOAD[0], "QL": LOAD[1]}
        else:
            square = abs(1.0 - 1j * LINE * (P - 1j * Q)) ** 2
            load = {"YP": LOAD[0] / square, "YQ": -LOAD[1] / square}
        self.values = values | prefixed(NETWORK, network | load) | {VT0: 1.0} | changes
        self.step = told.get("step")
        self.saturates = by_the_last_saturation if "form_of_powerworld" in told else nullcontext
        self.load, self.pulse, self.boost = frozenset(load), told.get("vref"), told.get("boost")
        boosted, disturbed = self.boost is not None, not self.pulse
        self.moved = ("vref", *(["vs"] if boosted else []), *(["fault_B"] if disturbed else []))

    def inputs(self, end):
        """Return what moves the unit: a fault or a pulse, and the boost that fades."""
        signal, size = ("vref", self.pulse) if self.pulse else ("fault_B", -1.0 / SHUNT)
        steps = tuple(InputStep(at, k * size, signal) for at, k in zip(FAULT, (1, -1), strict=True))
        if not self.boost:
            return Inputs(0.0, end, steps)
        times = np.arange(0.0, end + STEP, STEP)
        fading = self.boost["VK"] * np.exp(-times / self.boost["TD2"])
        within = (times >= FAULT[0]) & (times < FAULT[1])  # vt is 1 - VCUTOFF at most then
        return Inputs(0.0, end, steps, {"vs": RecordedInput(times, np.where(within, 0.0, fading))})

    @property
    def system(self):
        """The unit in its network."""
        return swinging(self.behind_a_source((*self.moved, "angle")))

    def behind_a_source(self, moved):
        """Return the unit in its network, whose source has what these inputs say."""
        unit = self.unit
        return infinite_bus.__wrapped__(
            unit.exciter,
            unit.machine,
            unit.saturation,
            moved,
            "Q",
            unit.stabiliser,
            unit.dialect,
            unit.governor,
            unit.limiters,
            load=self.load,
        )

    def shown(self, times):
        """Return what the unit shows at some instants, in the steps of a case that has some."""
        if self.step:
            with self.saturates():
                return self.stepped(times)
        inputs = self.inputs(max(times) + STEP)
        with without_bus_frequency() if self.unit.hears_frequency else nullcontext():
            simulator = Simulator(self.system, inputs, np.array(times, dtype=float), STEP)
            signals = simulator.response(self.values).signals
        return [{name: x[k] for name, x in signals.items()} for k in range(len(times))]

    def moved_at(self, t):
        """Return the inputs that the disturbance moves, at a time."""
        on = FAULT[0] <= t < FAULT[1]
        size = {"vref": self.pulse} if self.pulse else {"fault_B": -1.0 / SHUNT}
        return {**dict.fromkeys(self.moved, 0.0), **(size if on else {})}

    def stepped(self, times, held=lambda t, states: {}):
        """Return the same by Heun's rule, in steps that a switching divides.

        ``held`` gives further inputs from time and states, for each step anew.
        """
        system, shown = self.system, {}
        states, setpoints = system.rest(self.values)
        ends = np.union1d(np.arange(0.0, max(times) + 2 * self.step, self.step).round(9), FAULT)
        for start, end in pairwise(ends):
            inputs = self.moved_at(start) | held(start, states)
            now = system.motion(self.values, setpoints, states, inputs)
            shown[round(start, 6)] = now.outputs
            ahead = {x: states[x] + (end - start) * now.slopes[x] for x in states}
            then = system.motion(self.values, setpoints, ahead, inputs)
            slopes = {x: 0.5 * (now.slopes[x] + then.slopes[x]) for x in states}
            states = {x: states[x] + (end - start) * slopes[x] for x in states}
        return [shown[t] for t in times]

    def repeated(self, times):
        """Return the same in the steps of PSS/E: x + h (3 f - f of the step before) / 2.

        At a switching f is the mean of before and behind it.
        """
        system, h, shown, last = self.system, self.STEP, {}, None
        instants = [round(t / h) for t in times]
        states, setpoints = system.rest(self.values)
        for k in range(max(instants) + 1):
            before, behind = self.moved_at((k - 0.5) * h), self.moved_at((k + 0.5) * h)
            motions = [
                system.motion(self.values, setpoints, states, inputs)
                for inputs in ([before] if before == behind else [before, behind])
            ]
            slopes = {x: sum(m.slopes[x] for m in motions) / len(motions) for x in states}
            shown[k] = motions[0].outputs
            last = last or slopes
            states = {x: states[x] + h * (1.5 * slopes[x] - 0.5 * last[x]) for x in states}
            for x, (low, high) in motions[0].limits.items():
                states[x] = min(max(states[x], low), high)
            last = slopes
        return [shown[k] for k in instants]


class BehindALine(TwoBuses):
    """A unit behind a line to a stiff source, as PSS/E ran it in steps of 5 ms.

    At 1 s its reference rises to what the case says, or a line opens: that from bus 1, stiff, to
    bus 2, with the unit, of three equal ones that also join them to bus 3, which has a load of
    constant admittance. The unit then sees another source.
    """

    AT, STEP = 1.0, 0.005  # s
    P, Q, V2, V3, LOAD = 1.0, -0.03247, 1.02, 0.99341, 2.5 + 0.3j  # of the .raw, as the next line
    Y, Z1 = 1.0 / (0.01 + 0.12j), 1e-5j  # of a line; of the source at bus 1

    def __init__(self, told, **changes):
        super().__init__(told)
        self.load = frozenset()
        network = {"f0": 60.0, "R": 0.0, "Ra": 0.0, "Rc": 0.0, "Xc": 0.0}
        if "raised" in told:
            self.values |= prefixed(NETWORK, network | told["network"]) | changes
            self.angles, self.moved = (0.0, 0.0), ("vref",)
            before = self.system.rest(self.values).setpoints["vref"]
            self.moves = {"vref": told["raised"] - before}
            return
        before, after = self.sources()
        network |= {"P": self.P, "Q": self.Q, "R": before["R"], "X": before["X"]}
        self.values |= prefixed(NETWORK, network) | {VT0: self.V2} | changes
        self.values["K"] = 1e-5  # below the sheet's 0.01, with which efd moves by 5e-4
        self.moves = {name: after[name] - before[name] for name in before}
        self.angles, self.moved = (before["angle"], after["angle"]), ("vref", *self.moves)

    @property
    def system(self):
        """The unit behind its line."""
        return self.behind_a_source(self.moved)

    def sources(self):
        """Yield E, its angle to bus 1, R and X that bus 2 sees, before the line opens and then."""
        load = np.conj(self.LOAD) / self.V3**2
        current = (self.P - 1j * self.Q) / self.V2 - 2.0 * self.Y * self.V2
        joined = [[-self.Y, -self.Y], [-self.Y, 2.0 * self.Y + load]]
        v1, v3 = np.linalg.solve(joined, [current, self.Y * self.V2])
        stiff = (v1 / self.Z1 + self.Y * (2.0 * v1 - self.V2 - v3)) * abs(v1) / v1
        for between in (self.Y, 0.0):
            admittances = [
                [1.0 / self.Z1 + between + self.Y, -between, -self.Y],
                [-between, between + self.Y, -self.Y],
                [-self.Y, -self.Y, 2.0 * self.Y + load],
            ]
            seen = np.linalg.inv(admittances)[1]
            e, z = seen[0] * stiff, seen[1]
            yield {"E": abs(e), "angle": np.angle(e), "R": z.real, "X": z.imag}

    def moved_at(self, t):
        """Return the inputs that move the unit, at a time."""
        return {**dict.fromkeys(self.moved, 0.0), **(self.moves if t > self.AT else {})}

    def inputs(self, end):
        """Return what moves the unit."""
        moves = self.moves.items()
        return Inputs(0.0, end, tuple(InputStep(self.AT, size, name) for name, size in moves))

    def with_degrees(self, t, signals):
        """Return signals with the angle of the rotor to bus 1, in degrees."""
        return {**signals, "degrees": np.degrees(signals["delta"] + self.angles[t > self.AT])}

    def shown(self, times):
        """Return what the unit shows at some instants."""
        return [self.with_degrees(*row) for row in zip(times, super().shown(times), strict=True)]

    def repeated(self, times):
        """Return the same in the program's own steps."""
        shown = super().repeated(times)
        return [self.with_degrees(*row) for row in zip(times, shown, strict=True)]


def wesgov_of_a_held_error():
    """Return WESGOV as PowerWorld 24 has it between two samples: pref is the error, 0 at rest."""

    def equations(s, u, p, d):
        _, d.PE = lag(u.p, s.PE, 1.0, p.TPE)
        d.INTEG = u.pref / p.TI
        valve, d.VALVE = lag(p.KP * u.pref + s.INTEG, s.VALVE, 1.0, p.T1)
        power, d.PM = lag(valve, s.PM, 1.0, p.T2)
        return power

    def rest(pm, u, p, x):
        x.PE, x.INTEG, x.VALVE, x.PM = u.p, pm, pm, pm
        return 0.0

    states = ("PE", "INTEG", "VALVE", "PM")
    return replace(GOVERNORS["WESGOV"], equations=equations, rest=rest, states=states)


class Sampled(TwoBuses):
    """A unit with WESGOV that samples: the speed each DTC, the power each DTP, from 0 s on."""

    def __init__(self, told):
        super().__init__(told)
        self.unit = self.unit._replace(governor=wesgov_of_a_held_error())
        self.moved, self.step = (*self.moved, "pref"), STEP

    def shown(self, times):
        """Return what the unit shows at some instants."""
        last = {}

        def due(t, period):
            return round(t / STEP) % round(self.values[GOVERNOR + period] / STEP) == 0

        def held(t, states):
            if due(t, "DTP"):
                last["power"] = states["governor.PE"]
            if due(t, "DTC"):
                dw = states["dw"]
                within = min(max(dw, self.values["governor.DBL"]), self.values["governor.DBH"])
                droop = self.values["governor.DROOP"] * (last["power"] - P)
                last["error"] = within - dw - droop
            return {"pref": last["error"]}

        return self.stepped(times, held)


def case_of(told, **changes):
    """Return the unit of a case in its network, some values changed."""
    line = "raised" in told or "line" in told
    return BehindALine(told, **changes) if line else TwoBuses(told, **changes)


def differences(name, signals, shown=None, **changes):
    """Return the largest differences from a reference's signals, with some values changed."""
    told, rows = reference(name)
    case, times = case_of(told, **changes), [row["t"] for row in rows]
    got = case.shown(times) if shown is None else shown(case, times)
    pairs = list(zip(got, rows, strict=True))
    return {s: max(abs(ours[s] - theirs[s]) for ours, theirs in pairs) for s in signals}
