"""The memory that simulations of a test take, worked out before them and compared with a limit.

Its numbers were measured: peaks of `simulate` and `fit` lie below what is worked out here.
"""

from typing import NamedTuple

from exfit.errors import SimulationError

GIGABYTE = 1e9
OWN = 0.25e9  # bytes, of Python and the libraries
NUMBER = 8  # bytes of a float64
OF_STEP, OF_SAMPLE = 20, 50  # numbers that each of them takes, beside those of outputs
# outputs of a step and of half of it, and with located crossings of where limits are looked for
HALVED = (6, 16)
SHOWN = 4  # outputs of a sample: computed, kept, written


class RunSize(NamedTuple):
    """What the memory of the runs of a test follows from; of a fit it has ``compared`` outputs."""

    steps: float
    samples: int
    outputs: int
    compared: int = 0
    located: bool = False


def check_run(size: RunSize, step: float, memory: float) -> None:
    """Raise SimulationError where a run, and one with half its step, needs more than memory, GB."""
    steps = size.steps * (OF_STEP + HALVED[size.located] * size.outputs)
    samples = size.samples * (OF_SAMPLE + SHOWN * size.outputs)
    needed = OWN + NUMBER * (steps + samples)
    what = f"{size.steps:.3g} steps of {step:g} s (simulation.step) and {size.samples} samples"
    check(needed, memory, what)


def check(needed: float, memory: float, what: str) -> None:
    """Raise SimulationError where more bytes are needed than the memory, GB, has."""
    if needed > GIGABYTE * memory:
        raise SimulationError(
            f"{what}: about {needed / GIGABYTE:.3g} GB of memory, the limit is {memory:g} GB; "
            "simulation.memory raises it"
        )
