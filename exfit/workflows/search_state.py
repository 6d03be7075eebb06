"""How far the search of a case is: what its stages take further."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import Estimate
from exfit.fitting.channel_weights import as_fitted
from exfit.fitting.descents import Announce
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.global_search import Judge, SearchResult, continued, judged_again
from exfit.fitting.problem import FitProblem
from exfit.fitting.program import Program
from exfit.fitting.residuals import SimulationCounter
from exfit.fitting.search import CaseSearches
from exfit.results.intervals.determination import Determination
from exfit.results.intervals.value_errors import NONE_REFINED, RefinedValues
from exfit.util.arrays import Array
from exfit.util.vocabulary import FROM_FURTHER_STARTS

UNKNOWN = Determination(None)


def ignore(*_: object) -> None:
    """Ignore how far a search is."""


@dataclass(frozen=True)
class SearchState:
    """How far the search of a case is.

    ``setups`` are its tests, ``unseen`` those of the validations. ``problem`` has the weights that
    were found until now; ``found`` is the search of it, ``determined`` how well the records
    determine what it found. ``line_notes`` say which periodic disturbances are fitted.
    ``announce(state, line)`` is called with each line of the path to the result, ``watch`` with how
    far the rest is.
    """

    case: Case
    setups: tuple[ExperimentSetup, ...]
    unseen: tuple[ExperimentSetup, ...]
    problem: FitProblem
    method: str
    options: Estimate
    program: Program | None = None
    announce: "Callable[[SearchState, estimate.SolverIteration], None]" = ignore
    watch: Callable[[estimate.Progress], None] = ignore
    counter: SimulationCounter = field(default_factory=SimulationCounter)
    searched: SearchResult | None = None
    determined: Determination = UNKNOWN
    line_notes: tuple[str, ...] = ()
    refined: RefinedValues = NONE_REFINED

    @property
    def found(self) -> SearchResult:
        """The search until now."""
        assert self.searched is not None
        return self.searched

    @property
    def interrupted(self) -> bool:
        """Whether an interruption ended the search."""
        return self.found.interrupted or self.found.best.stop is estimate.Stop.INTERRUPTED

    @property
    def fitted(self) -> tuple[ExperimentSetup, ...]:
        """The tests with the weights of the problem."""
        return as_fitted(self.setups, self.problem)

    @property
    def on_line(self) -> Announce:
        """What is called with each line of the path."""
        return partial(self.announce, self)

    def continued(
        self,
        problem: FitProblem,
        found: SearchResult,
        point: Array,
        phase: str = FROM_FURTHER_STARTS,
        judge: Judge | None = None,
    ) -> SearchResult:
        """Search on from a point (N,) with a lower cost than the best one found.

        With a ``judge`` its end is the result only if validations do not hold on another alone.
        """
        searches = CaseSearches(problem, self.options, ignore, self.counter)
        found = continued(searches, found, point, self.on_line, phase)
        return found if judge is None else judged_again(searches, found, judge, self.on_line)


Stage = Callable[[SearchState], SearchState]


def in_turn(stages: Sequence[Stage], state: SearchState) -> SearchState:
    """Take a state through stages, one after the other."""
    for stage in stages:
        state = stage(state)
    return state
