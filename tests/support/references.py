"""Reference trajectories: what another program found, and the values it found it with."""

import csv
import json

import numpy as np
from places import REFERENCE

from exfit.models.machines import MACHINES
from exfit.models.sheet import typical
from exfit.plants import MACHINE, VT0
from exfit.simulation.inputs import Inputs, InputStep

MACHINE_NAMES = {
    "Td10": "Tpd0",
    "Td20": "Tppd0",
    "xd": "Xd",
    "xd1": "Xpd",
    "xd2": "Xppd",
    "xl": "Xl",
    "S10": "S10",
    "S12": "S12",
}
AC8B_NAMES = {
    "kP": "KPR",
    "kI": "KIR",
    "kD": "KDR",
    "Td": "TDR",
    "VPMAX": "VPIDMAX",
    "VPMIN": "VPIDMIN",
}
# the model that another program has under a name
MODEL_NAMES = {"EXAC1": "AC1A", "ESDC2A": "DC2A", "ESAC5A": "AC5A"}
RENAMED = {"AC8B": AC8B_NAMES, "DC2A": {"TF1": "TF"}}
NOT_OURS = ("bus", "Switch")
WITHOUT_LIMITS = {"VAMAX": 9999.0, "VAMIN": -9999.0}


def reference(name):
    """Return the model, the values, the inputs and the columns of a reference trajectory."""
    told = json.loads((REFERENCE / f"{name}.json").read_text())
    model = MODEL_NAMES.get(told["model"], told["model"])
    names, given = RENAMED.get(model, {}), told["params_in_effect"]
    values = {names.get(k, k): v for k, v in given.items() if k not in NOT_OURS}
    if model == "AC1A":
        values |= WITHOUT_LIMITS
    values |= {MACHINE + k: v for k, v in typical(MACHINES["GENROU"].sheet).items()}
    of_machine = told["generator"]
    values |= {MACHINE + ours: of_machine[theirs] for theirs, ours in MACHINE_NAMES.items()}
    with (REFERENCE / f"{name}.csv").open() as file:
        header, *rows = csv.reader(file)
    columns = dict(zip(header, np.array(rows, dtype=float).T, strict=True))
    times = columns["t"]
    steps = tuple(InputStep(*step) for step in told["steps"])
    return model, values | {VT0: 1.0}, Inputs(times[0], times[-1], steps), columns, told
