"""Case files whose plant is the program of the tests, with a record beside them."""

import shutil
import sys
from pathlib import Path

import numpy as np
import yaml

PROGRAM = Path(__file__).with_name("outside_program.py")
MACHINE = {"machine": "ONE_AXIS", "parameters": {"Tpd0": 6.0, "S10": 0.0, "S12": 0.0}}
TRUTH = {"TATB": 0.1, "TB": 10.0, "K": 200.0, "TE": 0.05}
FREE = {
    "K": {"start": 120.0, "min": 20.0, "max": 2000.0},
    "TE": {"start": 0.1, "min": 0.005, "max": 0.5},
}
NOISE = 1e-4  # pu


def written_case(folder, with_twin=True, arguments=(), **sections):
    """Write case.yaml, program.py and bump.csv into a folder; return the path of the case."""
    from outside_program import response

    folder.mkdir(exist_ok=True)
    shutil.copy(PROGRAM, folder / "program.py")
    time = np.arange(0.0, 6.0, 0.04)
    values = {**TRUTH, "K_A": TRUTH["K"], "machine.Tpd0": 6.0, "vt0": 1.0}
    steps = [{"signal": "vref", "at": 1.0, "step": 0.05, "ramp": 0.0}]
    noise = NOISE * np.random.default_rng(3).standard_normal(len(time))
    vt = np.array(response(values, steps, time.tolist())) + noise
    rows = np.column_stack([time, vt])
    np.savetxt(folder / "bump.csv", rows, delimiter=",", header="t,vt", comments="")
    names = {"K": "K_A"} if with_twin else {"K": "K_A", "T": "machine.Tpd0"}
    command = [sys.executable, "program.py", *arguments]
    plant = {"type": "external", "command": command, "names": names, "time_limit": 20.0}
    fixed = {name: value for name, value in TRUTH.items() if name not in FREE}
    if with_twin:
        plant |= {"twin": "open-circuit", **MACHINE}
        fixed |= {"EMIN": -100.0, "EMAX": 100.0}
    else:
        fixed |= {"T": 6.0}
    content = {
        **({"model": "SEXS"} if with_twin else {}),
        "given": "exact",
        "plant": plant,
        "test": {"vt0": 1.0, "vref": [{"at": 1.0, "step": 0.05}]},
        "record": {"file": "bump.csv", "time": "t", "channels": {"vt": "vt"}},
        "parameters": {"fixed": fixed, "free": FREE},
        **sections,
    }
    path = folder / "case.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path
