"""Grid events of a unit with known data: the record, its file, and the case that reads it."""

from pathlib import Path

import numpy as np
import yaml
from pmu_records import F0, Course

from exfit import workflows
from exfit.case.load import load_case

MACHINE = {
    "Tpd0": 6.27, "Tppd0": 0.059, "Tpq0": 0.7, "Tppq0": 0.096, "H": 4.471, "D": 0.0, "Xd": 2.014,
    "Xq": 1.96, "Xpd": 0.331, "Xpq": 0.466, "Xppd": 0.2059, "Xl": 0.129, "S10": 0.14, "S12": 0.56,
}  # fmt: skip
P0, Q0 = 0.8, 0.13  # pu, before the event
REST = 2.0  # s


def driving(rate=60, seconds=16.0, size=1.0, swings=0.8, damping=0.35, fall=1.0):
    """Return time, voltage and angle of a grid in which a line trips: a swing, and a slow fall.

    The swing has the frequency ``swings`` (Hz) and decays by ``damping`` (1/s).
    """
    time = np.arange(0.0, seconds, 1.0 / rate)
    after = np.maximum(time - REST, 0.0)
    begun = 1.0 - np.exp(-((after / 0.06) ** 2))  # a filtered jump, as a PMU shows it
    swing = np.exp(-damping * after) * np.sin(2.0 * np.pi * swings * after)
    slow = 1.0 - np.exp(-after / 2.5)
    vt = 1.0 + size * (-0.015 * begun + 0.012 * swing + 0.008 * slow)
    angle = 0.3 + size * (-0.05 * begun + 0.07 * swing - fall * 0.25 * slow)
    return time, vt, angle


def content(record, model="AC8B", parameters=None, machine=None, **plant):
    """Return the case of the unit with a section ``record``; what is fitted is KPR and KIR."""
    return {
        "model": model,
        "given": "exact",
        "plant": {
            "type": "grid-playback",
            "machine": "GENROU",
            "parameters": machine or MACHINE,
            "network": {"f0": F0, **plant},
        },
        "record": record,
        **({} if parameters is None else {"parameters": parameters}),
    }


def case_of(given, folder: Path, name="case.yaml"):
    """Write a case and load it."""
    path = folder / name
    path.write_text(yaml.safe_dump(given, sort_keys=False))
    return load_case(path)


def simulated(folder, model="AC8B", parameters=None, machine=None, start=(P0, Q0), **course):
    """Return the Course of the unit: its p and q are those of its own simulation.

    ``start`` are p and q before the event.
    """
    time, vt, angle = driving(**course)
    path = folder / "driving.csv"
    table = np.column_stack([time, vt, angle, *(np.full_like(vt, level) for level in start)])
    np.savetxt(path, table, delimiter=",", header="t,vt,angle,p,q", comments="")
    channels = {"vt": "vt", "angle": {"column": "angle", "unit": "rad"}, "p": "p", "q": "q"}
    record = {"file": str(path), "time": "t", "channels": channels}
    given = {**content(record, model, parameters, machine), "test": {"steady_until": REST}}
    signals = workflows.simulate(case_of(given, folder, "driving.yaml"), {}).response.signals
    return Course(time, vt, angle, signals["p"], signals["q"])
