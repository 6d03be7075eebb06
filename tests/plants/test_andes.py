"""Units on load against another simulator: exciters, stabilisers and governors in a voltage dip.

``tests/studies/andes_on_load.py`` writes the references, with all values.
"""

import csv
import json

import numpy as np
import pytest
from places import REFERENCE
from references import MACHINE_NAMES

from exfit.features.events.grid_playback import grid_playback
from exfit.models import GOVERNORS, MODELS, STABILISERS
from exfit.models.governor_parts import PLAIN
from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.models.speed_multiplier import times_speed
from exfit.plants import GOVERNOR, MACHINE, NETWORK, SATURATION, STABILISER, VT0, Stabilised
from exfit.plants.infinite_bus import infinite_bus
from exfit.plants.unit import UnitOnLoad
from exfit.simulation.inputs import Inputs, InputStep, SplinedInput
from exfit.simulation.simulator import Simulator


def named(kind):
    """Return the names of the references of a kind."""
    return sorted(path.stem.removeprefix(kind) for path in REFERENCE.glob(f"{kind}*.csv"))


def long_but(chosen, names):
    """Return names of which the default run takes one: each has machine code of its own."""
    return [
        name if name == chosen else pytest.param(name, marks=pytest.mark.long) for name in names
    ]


UNITS, EVENTS = named("andes_load_"), named("andes_playback_")
MACHINE_ON_LOAD = MACHINE_NAMES | {
    "Tq10": "Tpq0", "Tq20": "Tppq0", "xq": "Xq", "xq1": "Xpq", "D": "D",
}  # fmt: skip
EXCITERS = {"ESST1A": "ST1A", "ESST3A": "ST3A", "ESST4B": "ST4B"}
TIMES_SPEED = ("EXDC2",)  # the program multiplies efd there
OF_GOVERNOR = {"Tw": "TW", "Dt": "Dturb"}  # names of HYGOV and GAST
OF_EXCITER = {"KF1": "KF"}
INPUTS = {0: "none", 1: "speed", 3: "p", 4: "pa", 5: "vt"}
FIELD = ("efd", "ifd")
COMPARED = ("vt", "p", "q", *FIELD, "speed")


def known(values, model):
    """Return the values of a model's sheet that a reference gives."""
    return {row.symbol: values[row.symbol] for row in model.sheet if row.symbol in values}


def stabilised(part):
    codes = [part["values"][key] for key in ("MODE", "MODE2") if key in part["values"]]
    return Stabilised(STABILISERS[part["model"]], tuple(INPUTS[code] for code in codes))


def read(name):
    """Return what a reference says of its unit, and the columns of its table."""
    with (REFERENCE / f"{name}.csv").open() as file:
        header, *rows = csv.reader(file)
    columns = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    return json.loads((REFERENCE / f"{name}.json").read_text()), columns


def unit_of(told):
    """Return the unit of a reference, and the values of all but its network."""
    machine, exciter = MACHINES["GENROU"], told["exciter"]
    model = MODELS[EXCITERS.get(exciter["model"], exciter["model"])]
    renamed = {OF_EXCITER.get(name, name): value for name, value in exciter["values"].items()}
    values = typical(model.sheet) | known(renamed, model)
    given = {ours: told["generator"][theirs] for theirs, ours in MACHINE_ON_LOAD.items()}
    of_machine = typical(machine.sheet) | given | {"H": told["generator"]["M"] / 2.0}
    values |= {MACHINE + symbol: value for symbol, value in of_machine.items()}
    stabiliser, governor = None, None
    if "stabiliser" in told:
        stabiliser = stabilised(told["stabiliser"])
        of_stabiliser = known(told["stabiliser"]["values"], stabiliser.model)
        values |= {STABILISER + symbol: value for symbol, value in of_stabiliser.items()}
    if "governor" in told:
        governor = GOVERNORS[told["governor"]["model"]]
        theirs = told["governor"]["values"]
        renamed = {OF_GOVERNOR.get(name, name): value for name, value in theirs.items()}
        of_governor = known(PLAIN | renamed | theirs, governor)
        values |= {GOVERNOR + symbol: value for symbol, value in of_governor.items()}
    multiplied = times_speed(model) if exciter["model"] in TIMES_SPEED else model
    quadratic = SATURATION["quadratic"]
    unit = UnitOnLoad(multiplied, machine, quadratic, stabiliser, "andes", governor)
    return unit, values


def apart(system, inputs, values, columns, step):
    """Return by how much each signal of a response differs from that of a reference."""
    assert values.keys() == set(system.parameters)
    got = Simulator(system, inputs, columns["t"], step).response(values, COMPARED).signals
    return {signal: np.abs(got[signal] - columns[signal]).max() for signal in COMPARED}


def in_a_dip(name):
    """Return the differences of a unit whose source dips, and the reference's columns."""
    told, columns = read(f"andes_load_{name}")
    unit, values = unit_of(told)
    network = {"Ra": 0.0, "Rc": 0.0, "Xc": 0.0} | told["network"]
    values |= {VT0: network.pop("vt0")}
    values |= {NETWORK + symbol: value for symbol, value in network.items()}
    system = infinite_bus(
        unit.exciter, unit.machine, unit.saturation, ("vref", "E"), "Q",
        unit.stabiliser, unit.dialect, unit.governor,
    )  # fmt: skip
    # the other one's rule averages over the short step behind a jump
    late = 0.5 * told["provenance"]["first_step_after_event"]
    steps = tuple(InputStep(at + late, size, signal) for at, size, signal in told["steps"])
    times = columns["t"]
    # the leads of ST2CUT take its output to the limit within 1 ms of a jump
    return apart(system, Inputs(times[0], times[-1], steps), values, columns, 2.5e-4), columns


@pytest.mark.parametrize("name", long_but("ieeet3", UNITS))
def test_a_voltage_dip_is_that_of_another_simulator(name):
    """Within 1e-5 pu, and efd and ifd, which move by some pu, within 2e-5 of their way.

    What remains is the other one's trapezoidal rule: swings whose phase lags by (step w)^2 / 12.
    """
    differences, columns = in_a_dip(name)
    assert np.ptp(columns["speed"]) > 5e-3
    assert_near(differences, columns)


def assert_near(differences, columns):
    for signal, difference in differences.items():
        way = max(1.0, np.ptp(columns[signal])) if signal in FIELD else 1.0
        assert difference < (2e-5 if signal in FIELD else 1e-5) * way, signal


def played_back(name, every=1):
    """Return the differences of a unit that its record drives, of every so many samples."""
    told, columns = read(f"andes_playback_{name}")
    columns = {signal: column[::every] for signal, column in columns.items()}
    unit, values = unit_of(told)
    f0 = told["network"]["f0"]
    values |= {NETWORK + "f0": f0} | {NETWORK + key: 0.0 for key in ("R", "X", "Ra", "Rc", "Xc")}
    values |= {f"{signal}0": columns[signal][0] for signal in ("vt", "p", "q", "speed")}
    time, vt, angle = columns["t"], columns["vt"], columns["angle"]
    driving = {"vt": SplinedInput(time, vt - vt[0]), "angle": SplinedInput(time, angle - angle[0])}
    inputs = Inputs(time[0], time[-1], (), driving)
    return apart(grid_playback(unit), inputs, values, columns, 5e-4), columns


@pytest.mark.parametrize("name", long_but("exst1", EVENTS))
@pytest.mark.parametrize("every", [1, 2])
def test_an_event_played_back_is_that_of_another_simulator(name, every):
    differences, columns = played_back(name, every)
    assert np.ptp(columns["p"]) > 0.03
    assert_near(differences, columns)
