"""A unit in the network of InterPSS's single-machine cases, as PowerWorld and PSS/E ran them.

Bus 1 with the unit, j0.1 to bus 2 with a load of 1 + j0.5, j0.05 to a stiff source; per unit of 100
MVA, the base of the machine. The disturbance is a fault of j0.2 at bus 1 for 50 ms, or a pulse of
the reference. PowerWorld multiplies the voltage behind the stator by the speed and has a load of
constant admittance, as PSS/E has unless the case says ``"load": "power"``. The plant infinite-bus
has this network.
"""

import csv
import json

import numpy as np
from places import REFERENCE

from exfit.features.planner.units import read_unit
from exfit.models import GOVERNORS
from exfit.models.speed_multiplier import times_speed
from exfit.plants import GOVERNOR, MACHINE, NETWORK, SATURATION, STABILISER, VT0, Stabilised
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput
from exfit.simulation.simulator import Simulator

MACHINE_RECORD = """\
1 'GENROU' 1 6.0 0.033 0.54 0.078 6.4 0.0 0.8958 0.8645 0.1189 0.1969 0.089 0.0521 0.0 0.0 /
"""
P, Q = 0.50001, 0.01251  # at bus 1, whose voltage is 1
LINE, SOURCE, SHUNT, LOAD = 0.1, 0.05, 0.2, (1.0, 0.5)  # X, X, X, P and Q
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


class TwoBuses:
    """The unit of a case, with the values that its records are imported as, or some changed."""

    def __init__(self, told, **changes):
        records = told["records"] if "machine" in told else [MACHINE_RECORD, *told["records"]]
        parts = read_unit("\n".join(records), "case.dyr")
        values = {**parts.exciter.values, **prefixed(MACHINE, parts.machine.values)}
        dialect = {"PowerWorld": "powerworld", "PSS/E": "psse"}[told["program"]]
        stabiliser, governor = None, None
        if (part := parts.stabiliser) is not None:
            model = part.definition.model
            heard = Stabilised(model, part.inputs or model.inputs)
            stabiliser = heard.in_dialect(dialect)
            values |= prefixed(STABILISER, part.values)
        if added := told.get("governor"):
            governor = GOVERNORS[added["model"]]
            values |= prefixed(GOVERNOR, added["parameters"])
        exciter = parts.exciter.definition.model.in_dialect(dialect)
        self.unit = UnitOnLoad(
            times_speed(exciter) if "efd_times_speed" in told else exciter,
            parts.machine.definition.model,
            SATURATION["quadratic"],
            stabiliser,
            governor=governor,
            dialect=dialect,
        )
        network = {"f0": 60.0, "R": 0.0, "X": LINE, "Ra": 0.0, "Rc": 0.0, "Xc": 0.0, "P": P, "Q": Q}
        network |= {"Rs": 0.0, "Xs": SOURCE}
        if "load" in told:
            load = {"PL": LOAD[0], "QL": LOAD[1]}
        else:
            square = abs(1.0 - 1j * LINE * (P - 1j * Q)) ** 2
            load = {"YP": LOAD[0] / square, "YQ": -LOAD[1] / square}
        self.values = values | prefixed(NETWORK, network | load) | {VT0: 1.0} | changes
        self.load, self.pulse, self.boost = frozenset(load), told.get("vref"), told.get("boost")

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

    def shown(self, times):
        """Return what the unit shows at some instants."""
        unit, inputs = self.unit, self.inputs(max(times) + STEP)
        moved = ("vref", "vs") if self.boost else ("vref",)
        system = infinite_bus(
            unit.exciter,
            unit.machine,
            unit.saturation,
            moved if self.pulse else (*moved, "fault_B"),
            "Q",
            unit.stabiliser,
            unit.dialect,
            unit.governor,
            load=self.load,
        )
        simulator = Simulator(system, inputs, np.array(times, dtype=float), STEP)
        signals = simulator.response(self.values).signals
        return [{name: x[k] for name, x in signals.items()} for k in range(len(times))]


def differences(name, signals, **changes):
    """Return the largest differences from a reference's signals, with some values changed."""
    told, rows = reference(name)
    got = TwoBuses(told, **changes).shown([row["t"] for row in rows])
    pairs = list(zip(got, rows, strict=True))
    return {s: max(abs(ours[s] - theirs[s]) for ours, theirs in pairs) for s in signals}
