"""Simulate AC1A in ANDES with values of the thesis, and write sample_data/andes.

Run it as ``python tests/studies/andes_curves.py`` where ANDES 2.0.0 is installed; nothing else
here needs it. The machine and the values that the thesis does not give are those of
tests/reference/reference_ac1a.json, with which it repeats that trajectory to 6e-9 pu in vt.
"""

import json
import sys
from collections.abc import Mapping
from pathlib import Path

import andes
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from places import ROOT
from thesis_numbers import CURVES, RESULTS

FOLDER = ROOT / "sample_data" / "andes"
REFERENCE = json.loads((ROOT / "tests" / "reference" / "reference_ac1a.json").read_text("utf-8"))
MACHINE_KEYS = (
    "xd", "xq", "xd1", "xq1", "xd2", "xq2", "xl", "ra", "Td10", "Td20", "Tq10", "Tq20", "S10", "S12"
)  # fmt: skip
STEP, AT, END = 0.05, 1.0, 10.0  # pu, s, s
INTEGRATION, FIRST = 1e-3, 1e-6  # s; the rule averages over a step, so the first one is short
CLOCK = np.arange(1001) / 100.0  # s, that of the records
KV = 20.0
SETTINGS = {
    "fixt": 1, "shrinkt": 1, "tol": 1e-9, "max_iter": 30, "criteria": 0, "honest": 0,
    "g_scale": 0, "linesearch": 0, "no_tqdm": 1,
}  # fmt: skip


def system(values: Mapping[str, float]) -> andes.System:
    """Return a machine on open circuit at rest, whose EXAC1 has some values of its own."""
    unit = andes.System(default_config=True, no_output=True)
    for number in (1, 2):
        unit.add("Bus", {"idx": number, "Vn": KV, "v0": 1.0, "a0": 0.0})
    unit.add("Line", {"bus1": 1, "bus2": 2, "r": 0.0, "x": 0.1, "b": 0.0, "Vn1": KV, "Vn2": KV})
    unit.add("Slack", {"idx": 1, "bus": 1, "Vn": KV, "v0": 1.0, "a0": 0.0})
    machine = {key: REFERENCE["generator"][key] for key in MACHINE_KEYS}
    unit.add("GENROU", {"idx": "G", "bus": 1, "gen": 1, "Vn": KV, "M": 8.0, "D": 0.0, **machine})
    given = {key: value for key, value in REFERENCE["params_in_effect"].items() if key != "bus"}
    unit.add("EXAC1", {"syn": "G", **given, **values})
    unit.setup()
    unit.PFlow.run()
    for key, value in SETTINGS.items():
        setattr(unit.TDS.config, key, value)
    return unit


def simulated(values: Mapping[str, float]) -> np.ndarray:
    """Return vt (1001,) on the clock of the records, for a step of the reference at 1 s."""
    unit = system(values)
    run(unit, AT, INTEGRATION)
    unit.EXAC1.vref0.v[0] += STEP
    unit.TDS.custom_event = True
    run(unit, AT + FIRST, FIRST)
    run(unit, END, INTEGRATION)
    voltage = unit.dae.ts.y[:, unit.Bus.v.a[0]]
    return np.interp(CLOCK, unit.dae.ts.t, voltage)


def run(unit: andes.System, until: float, step: float) -> None:
    """Go on until an instant with steps of one size, s."""
    unit.TDS.config.tf, unit.TDS.config.tstep = until, step
    unit.TDS.h = unit.TDS.deltat = step
    unit.TDS.run()


if __name__ == "__main__":
    for name, key in CURVES.items():
        table = np.column_stack([CLOCK, simulated(RESULTS[key])])
        path = FOLDER / f"{name}.csv"
        np.savetxt(path, table, ("%.2f", "%.7f"), ",", header="t,vt", comments="")
        print(path.relative_to(ROOT))
