"""What simulates a case in place of exfit, by what is asked of it; a feature opens it."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Protocol, cast

from exfit.case.case import Case
from exfit.errors import CaseError
from exfit.fitting.experiment import ExperimentSetup, Values
from exfit.registry import parts
from exfit.simulation.simulator import Simulator

if TYPE_CHECKING:  # a simulation loads nothing of a fit
    from exfit.estimate import Descent, Functions, Result
    from exfit.fitting.descents import Announce
    from exfit.fitting.residuals import Residuals

Setups = Sequence[ExperimentSetup]
Differences = dict[str, dict[str, float]]  # pu, by record and signal


class Program(Protocol):
    """What simulates the unit of a case in place of exfit.

    Its twin is the plant of exfit that gives derivatives, and all that follows a search.
    """

    @property
    def runs(self) -> int:
        """How many runs it was asked for."""

    @property
    def failed(self) -> int:
        """How many of them failed."""

    @property
    def has_twin(self) -> bool:
        """Whether there is a plant of exfit beside it."""

    def simulator(self, twin: Simulator) -> Simulator:
        """Make the simulator of a test whose signals it gives; raises CaseError as `simulated`."""

    def simulated(self, setups: Setups) -> tuple[ExperimentSetup, ...]:
        """Make tests that it simulates; raises CaseError for one that it cannot."""

    def try_start(self, residuals: "Residuals") -> None:
        """Run the start of a search; raises SimulationError where there is no run."""

    def coarser(self, descent: "Descent") -> "Descent":
        """Give a descent the tolerances that its runs allow."""

    def descend(
        self,
        residuals: "Residuals",
        descent: "Callable[[Functions], Descent]",
        announce: "Announce",
    ) -> "Result":
        """Descend from the start by the derivatives of the twin, corrected."""

    def settled(
        self, setups: Setups, values: Values, moving: "Residuals | None" = None
    ) -> tuple[ExperimentSetup, ...]:
        """Correct the twin of its tests by the difference at the values: no more run follows.

        Without a twin the response is linear in what is free in the residuals ``moving``. Raises
        SimulationError where there is no run at the values.
        """

    def run(self, setup: ExperimentSetup, values: Values) -> None:
        """Run a settled test at other values too; raises SimulationError where there is no run."""

    def deviations(self, setups: Setups, values: Values) -> Differences:
        """Run tests at values: the largest difference from the twin, without one from the record.

        Raises ExfitError where there is no run.
        """

    def differences(self, setups: Setups) -> Differences:
        """Find the largest difference from the twin where tests were settled."""

    def own_value_notes(self) -> Iterator[str]:
        """Name the parameters that it has values of its own of."""

    def response_notes(self, simulator: Simulator, shown: Iterable[str]) -> Iterator[str]:
        """Name the shown signals that its twin gives, without a correction."""

    def notes(self, setups: Setups, followed: str = "intervals and diagnoses") -> Iterator[str]:
        """Report its runs; ``followed`` is what followed the search, by the twin."""


def program_of(case: Case) -> AbstractContextManager[Program | None]:
    """Provide the program that simulates a case, None where exfit does; it ends afterwards.

    Raises CaseError for one that cannot be run.
    """
    if case.external is None:
        return nullcontext()
    opener = parts("PROGRAMS").get(case.external.type)
    if opener is None:
        raise CaseError(
            f"{case.path}: plant.type: {case.external.type}: its feature is not installed"
        )
    return cast(AbstractContextManager[Program | None], opener.load()(case))


def by_program(program: Program | None, setup: ExperimentSetup, values: Values) -> ExperimentSetup:
    """Settle a test as a program simulates it at the values; it stays without a program."""
    if program is None:
        return setup
    (settled,) = program.settled(program.simulated([setup]), values)
    return settled
