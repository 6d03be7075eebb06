"""What simulated the records of a case in place of exfit, as its report names it."""

from collections.abc import Sequence

from exfit.case.case import Case
from exfit.fitting.program import Program
from exfit.fitting.setup import ExperimentSetup
from exfit.results.description import OtherProgram


def other_program_of(
    case: Case, program: Program | None, setups: Sequence[ExperimentSetup]
) -> OtherProgram | None:
    """Describe what simulated settled tests, with its runs until now; None where exfit did."""
    section = case.external
    if section is None or program is None:
        return None
    differences = program.differences(setups)
    return OtherProgram(section.simulator, section.twin, program.runs, program.failed, differences)
