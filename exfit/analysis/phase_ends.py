"""Where each phase of a search handed over to the next: the thesis' P_LM, with its responses."""

from collections.abc import Iterator, Sequence
from itertools import pairwise, takewhile
from math import isnan

from exfit.analysis.case_description import fixed_values
from exfit.case.case import Case
from exfit.errors import SimulationError
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup
from exfit.results.compare_with_record import compare_with_record
from exfit.results.model import Iteration, PhaseEnd
from exfit.util.strategies import FROM_FURTHER_STARTS


def phase_ends(
    case: Case,
    setups: Sequence[ExperimentSetup],
    residuals: Residuals,
    history: Sequence[Iteration],
) -> Iterator[PhaseEnd]:
    """Yield where the phases ended of the descent from the start of the case, but for the last one.

    Where a descent before that one was given up, its phases are not among them, and an end without
    a finite response is left out.
    """
    whole = [*takewhile(lambda line: line.phase != FROM_FURTHER_STARTS, history)]
    starts = [k for k, line in enumerate(whole) if isnan(line.damping)]
    own = whole[starts[-1] :] if starts else whole
    start = residuals.values(residuals.start)
    for line, following in pairwise(own):
        if line.phase == following.phase:
            continue
        values = residuals.completed(line.values)
        try:
            comparisons = tuple(
                compare_with_record(setup.with_enough_substeps(values), setup.name, values, start)
                for setup in setups
            )
        except SimulationError:
            continue
        yield PhaseEnd(
            phase=line.phase,
            next_phase=following.phase,
            iteration=line.number,
            cost=line.cost,
            values={**fixed_values(case, values), **line.values},
            comparisons=comparisons,
        )
