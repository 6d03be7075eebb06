"""A programme checked before its run: what costs nothing is run, every fit is checked with that."""

from collections.abc import Iterator
from dataclasses import dataclass

from exfit import workflows
from exfit.errors import ExfitError
from exfit.features.programme.case.programme import Programme, ProgrammeStep, steps_of
from exfit.features.programme.kept import RESULTS
from exfit.features.programme.result import EnteredValue, FinishedTest
from exfit.features.programme.run import case_of, finished_test, refuse_unreadable
from exfit.features.programme.values import bases_of, values_given, with_values
from exfit.workflows.model_check import Check


@dataclass(frozen=True, eq=False)
class CheckedStep:
    """A test at rest with its result, or a fit with its check; ``fault``: why there is neither."""

    step: ProgrammeStep
    outcome: FinishedTest | Check | None
    fault: str = ""

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against the run of the test."""
        if isinstance(self.outcome, Check):
            return self.outcome.agrees and self.outcome.flat
        return self.outcome is not None and self.outcome.holds


def check_programme(programme: Programme) -> Iterator[CheckedStep]:
    """Yield the tests at rest with their results, and each fit with its check.

    A fit is checked with what the tests at rest give it, and without what other fits will.
    Raises CaseError where a file cannot be read.
    """
    refuse_unreadable(programme)
    values: tuple[EnteredValue, ...] = ()
    for step in steps_of(programme):
        try:
            if step.kind in RESULTS:
                test = finished_test(programme, step, values, None)
                values = (*values, *values_given(test, programme))
                yield CheckedStep(step, test)
            else:
                case = case_of(programme.with_bases(bases_of(values)), step)
                yield CheckedStep(step, workflows.check(with_values(case, values)))
        except ExfitError as fault:
            yield CheckedStep(step, None, str(fault))
