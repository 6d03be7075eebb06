"""Time a simulation of every exciter of the catalogue, per state, against AC1A's.

Run it as ``python tests/benchmarks/catalogue.py``. The machine code of all models runs in one
process, taking turns; every step of 1 ms counts as one, so models that need sub-steps are named.
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))

from oracle import WITHOUT_PLANT, system_of, typical_values, vector
from simulate import bump, timed

from exfit.engine.kernel import Kernel
from exfit.models import MODELS
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.simulator import Simulator

ROUNDS = 100
NAMES = ["AC1A", *(name for name in MODELS if name not in ("AC1A", *WITHOUT_PLANT))]


def run_of(name):
    """Return a run of a model's machine code through a bump of 10 s at 1 ms."""
    system = system_of(name)
    code, p, spans = Kernel(system, ("vt",)), vector(system, typical_values(name))[:, None], bump()
    return lambda: code.run(p, code.start(p), spans)


def substeps(name):
    """Return the sub-steps that the model's typical data ask for at 1 ms."""
    course, values = Inputs(0.0, 10.0, (InputStep(1.0, 0.05),)), typical_values(name)
    simulator = Simulator(system_of(name), course, np.linspace(0.0, 10.0, 101), 1e-3)
    return simulator.with_enough_substeps(values).substeps(values)


def main():
    ways = [run_of(name) for name in NAMES]
    timed(ways, 5)
    medians = np.median(timed(ways, ROUNDS), axis=0)
    states = np.array([len(system_of(name).states) for name in NAMES])
    per_state = medians / states
    table = Table(title=f"10 s at 1 ms, one set ({ROUNDS} rounds, medians)")
    table.add_column("model")
    for heading in ("states", "ms", "per state : AC1A", "sub-steps"):
        table.add_column(heading, justify="right")
    for name, count, ms, each in zip(NAMES, states, medians, per_state, strict=True):
        ratio = f"{each / per_state[0]:.2f}"
        table.add_row(name, str(count), f"{ms:.3f}", ratio, str(substeps(name)))
    Console(width=80).print(table)
    print(f"largest: {(per_state / per_state[0]).max():.2f}")


if __name__ == "__main__":
    main()
