"""The memory that simulations of a test take, worked out before them and compared with a limit.

Its numbers were measured: peaks of `simulate` and `fit` lie below what is worked out here.
"""

from typing import NamedTuple

from exfit.errors import SimulationError

GIGABYTE = 1e9
OWN = 0.25e9  # bytes, of Python and the libraries
NUMBER = 8  # bytes of a float64
OF_STEP, OF_SAMPLE = 20, 50  # numbers that each of them takes, beside those of outputs
HALVED = 6  # outputs of a step: those of a run, and of one with half the step
READ = 16  # outputs of a step with located crossings, of which five points are read for limits
SHOWN = 4  # outputs of a sample: computed, kept, written


class RunSize(NamedTuple):
    """What the memory of the runs of a test follows from; of a fit it has ``compared`` outputs."""

    steps: float
    samples: int
    outputs: int
    compared: int = 0
    located: bool = False

    @property
    def whole(self) -> float:
        """Numbers of the outputs of a run that is in memory with all of its steps."""
        return self.steps * self.outputs * (READ if self.located else HALVED)


def check_run(size: RunSize, step: float, memory: float) -> None:
    """Raise SimulationError where a run, and one with half its step, needs more than memory, GB."""
    steps = OF_STEP * size.steps + size.whole
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
