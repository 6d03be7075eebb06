"""What the instant of a switching between two samples is worth to the fit of a grid event.

    python tests/studies/switchings.py [EVENTS]

A unit behind X = 0.3 pu to a source that falls by 0.05 pu and 0.1 rad at 2 s, and rises by 0.03 pu
at 5 s, both at some instant between two of 60 samples a second; noise 1e-4 on the voltage (pu) and
its angle (rad), 2e-4 pu on P and Q. Prints how far H and KPR are off, in percent, rms.
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from on_load import system, values_on_load

import exfit
from exfit.models.machines import MACHINES
from exfit.plants import MACHINE
from exfit.records.record import Record
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

X, RATE = 0.3, 60.0
TIME = np.arange(int(10 * RATE) + 1) / RATE
LINE = {"network_R": 0.0, "network_X": X, "network_Rc": 0.0, "network_Xc": 0.0}
FREE = {"KPR": (50.0, 10.0, 300.0), "KIR": (8.0, 0.5, 50.0), "TE": (0.8, 0.1, 4.0)}


def event(seed: int) -> tuple[dict[str, float], Record, tuple[float, float]]:
    """Return the values of the unit, a record of its terminals, and the instants (s)."""
    generator = np.random.default_rng(seed)
    first, second = (at + generator.uniform(0.0, 1.0 / RATE) for at in (2.0, 5.0))
    values = values_on_load(MACHINES["GENROU"], **LINE)
    steps = (
        InputStep(first, -0.05, "E"),
        InputStep(first, -0.1, "angle"),
        InputStep(second, 0.03, "E"),
    )
    bus = Simulator(system(MACHINES["GENROU"]), Inputs(0.0, 10.0, steps), TIME, 1e-3)
    got = bus.response(values).signals
    angle = np.arctan2(got["p"] * X, got["vt"] ** 2 - got["q"] * X) - 0.1 * (first < TIME)
    noises = {"vt": 1e-4, "angle": 1e-4, "p": 2e-4, "q": 2e-4}
    signals = {**got, "angle": angle}
    noisy = {k: signals[k] + generator.normal(0.0, s, len(TIME)) for k, s in noises.items()}
    return values, Record.from_arrays(TIME, noisy), (first, second)


def fitted(values: dict[str, float], record: Record, switchings: str) -> dict[str, float]:
    """Return what a local fit finds."""
    of_machine = {k.removeprefix(MACHINE): v for k, v in values.items() if k.startswith(MACHINE)}
    del of_machine["H"]
    own = {k: v for k, v in values.items() if "." not in k and k != "vt0" and k not in FREE}
    content = {
        "model": "AC8B",
        "plant": {
            "type": "grid-playback",
            "machine": "GENROU",
            "network": {"f0": 60.0},
            "parameters": of_machine,
            "free": {"H": {"start": 3.0, "min": 2.0, "max": 8.0}},
        },
        "record": {"channels": {k: k for k in record.signals}, "switchings": switchings},
        "parameters": {
            "fixed": own,
            "free": {
                k: dict(zip(("start", "min", "max"), v, strict=True)) for k, v in FREE.items()
            },
        },
        "estimate": {"search": "local"},
    }
    result = exfit.fit(exfit.Case.from_dict(content, record))
    return {name: parameter.value for name, parameter in result.parameters.items()}


def main(events: int) -> None:
    """Print the errors of each way."""
    errors: dict[str, list[list[float]]] = {}
    for seed in range(events):
        values, record, instants = event(seed)
        for way in ("compare", "mask", "find"):
            found = fitted(values, record, way)
            row = [100 * (found["machine.H"] / values["machine.H"] - 1)]
            row.append(100 * (found["KPR"] / values["KPR"] - 1))
            names = ("switching.at", "switching2.at")
            row += [
                1e3 * (found[n] - at) for n, at in zip(names, instants, strict=True) if n in found
            ]
            errors.setdefault(way, []).append(row)
    for way, rows in errors.items():
        rms = np.sqrt(np.mean(np.array(rows) ** 2, axis=0))
        print(f"{way:8}", "  ".join(f"{x:.3f}" for x in rms))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
