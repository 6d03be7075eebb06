"""The memory that simulations of a test take, worked out before them and compared with a limit.

Its numbers were measured: peaks of `simulate` and `fit` lie below what is worked out here.
"""

from collections.abc import Iterable
from typing import NamedTuple

from exfit.errors import SimulationError

GIGABYTE = 1e9
OWN = 0.25e9  # bytes, of Python and the libraries
NUMBER = 8  # bytes of a float64
OF_STEP, OF_SAMPLE = 20, 50  # numbers that each of them takes, beside those of outputs
HALVED = 6  # outputs of a step: those of a run, and of one with half the step
SHOWN = 4  # outputs of a sample: computed, kept, written
SIDE_BY_SIDE = 32  # numbers of a compared output: of sets in lanes, or with its derivatives
OF_JACOBIAN = 10  # numbers of each derivative: Jacobians, their factors, what is compressed


class RunSize(NamedTuple):
    """What the memory of the runs of a test follows from; of a fit it has ``compared`` outputs."""

    steps: float
    samples: int
    outputs: int
    compared: int = 0


def check_run(size: RunSize, step: float, memory: float) -> None:
    """Raise SimulationError where a run, and one with half its step, needs more than memory, GB."""
    steps = size.steps * (OF_STEP + HALVED * size.outputs)
    samples = size.samples * (OF_SAMPLE + SHOWN * size.outputs)
    needed = OWN + NUMBER * (steps + samples)
    what = f"{size.steps:.3g} steps of {step:g} s (simulation.step) and {size.samples} samples"
    check(needed, memory, what)


def check_fit(sizes: Iterable[RunSize], free: int, memory: float) -> None:
    """Raise SimulationError where a fit of free parameters to records needs more than memory, GB.

    The records of a command stay in memory together, those that are only compared too; their runs
    follow one another in each thread.
    """
    from exfit.util.processes import processors

    sizes = tuple(sizes)
    kept = sum(
        OF_STEP * each.steps + (OF_SAMPLE + OF_JACOBIAN * free * bool(each.compared)) * each.samples
        for each in sizes
    )
    whole = max(HALVED * each.outputs * each.steps for each in sizes)
    blocks = -(-free // SIDE_BY_SIDE)
    side_by_side = max((each.steps + each.samples) * each.compared for each in sizes)
    runs = processors() * SIDE_BY_SIDE * blocks * side_by_side
    needed = OWN + NUMBER * (kept + whole + runs)
    steps, samples = (sum(getattr(each, name) for each in sizes) for name in ("steps", "samples"))
    to = f"a fit of {free} parameters to " if any(each.compared for each in sizes) else ""
    check(needed, memory, f"{to}{samples} samples by {steps:.3g} steps (simulation.step)")


def check(needed: float, memory: float, what: str) -> None:
    """Raise SimulationError where more bytes are needed than the memory, GB, has."""
    if needed > GIGABYTE * memory:
        raise SimulationError(
            f"{what}: about {needed / GIGABYTE:.3g} GB of memory, the limit is {memory:g} GB; "
            "simulation.memory raises it"
        )
