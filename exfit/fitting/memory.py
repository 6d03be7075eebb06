"""The memory that all tests of a command take together, compared with the limit of the case."""

from collections.abc import Iterable, Sequence

from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.fitting.experiment import Experiment
from exfit.simulation.memory import HALVED, NUMBER, OF_SAMPLE, OF_STEP, OWN, RunSize, check
from exfit.util.processes import processors

SIDE_BY_SIDE = 32  # numbers of a compared output: of sets in lanes, or with its derivatives
OF_JACOBIAN = 10  # numbers of each derivative: Jacobians, their factors, what is compressed
WRITTEN = 200  # numbers of a sample of a compared output in a result that is written as a text
MOST_WRITTEN = 20_000  # samples of a record; a result holds no more


def check_memory(
    case: Case, fitted: Sequence[Experiment], unseen: Sequence[Experiment] = ()
) -> None:
    """Raise CaseError where tests need more memory together than a command may take."""
    free = len(case.free()) + sum(len(each.nuisances) for each in fitted)
    runs = [(each.simulator, len(each.channels)) for each in fitted]
    runs += [(each.simulator, 0) for each in unseen]
    sizes = [
        RunSize(run.steps, len(run.times), len(run.system.outputs), n, run.located)
        for run, n in runs
    ]
    try:
        check_fit(sizes, free, case.simulation.memory)
    except SimulationError as fault:
        raise CaseError(f"{case.path}: {fault}") from None


def check_fit(sizes: Iterable[RunSize], free: int, memory: float) -> None:
    """Raise SimulationError where a fit of free parameters to records needs more than memory, GB.

    The records of a command stay in memory together, those that are only compared too; their runs
    follow one another in each thread.
    """
    sizes = tuple(sizes)
    kept = sum(
        OF_STEP * each.steps + (OF_SAMPLE + OF_JACOBIAN * free * bool(each.compared)) * each.samples
        for each in sizes
    )
    whole = max(HALVED[each.located] * each.outputs * each.steps for each in sizes)
    written = sum(WRITTEN * each.compared * min(each.samples, MOST_WRITTEN) for each in sizes)
    blocks = -(-free // SIDE_BY_SIDE)
    side_by_side = max((each.steps + each.samples) * each.compared for each in sizes)
    runs = processors() * SIDE_BY_SIDE * blocks * side_by_side
    needed = OWN + NUMBER * (kept + max(whole, written) + runs)
    steps, samples = (sum(getattr(each, name) for each in sizes) for name in ("steps", "samples"))
    to = f"a fit of {free} parameters to " if any(each.compared for each in sizes) else ""
    check(needed, memory, f"{to}{samples} samples by {steps:.3g} steps (simulation.step)")
