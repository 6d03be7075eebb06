"""What simulated the records of a case in place of exfit, as its report names it."""

from collections.abc import Sequence

from exfit.case.case import Case
from exfit.features.external.program import ExternalProgram
from exfit.features.external.setups import differences_from_twin
from exfit.fitting.setup import ExperimentSetup
from exfit.results.description import OtherProgram


def other_program_of(
    case: Case, program: ExternalProgram | None, setups: Sequence[ExperimentSetup]
) -> OtherProgram | None:
    """Return what simulated settled tests, with its runs until now; None where exfit did."""
    section = case.external
    if section is None or program is None:
        return None
    counts, differences = program.counts, differences_from_twin(setups)
    return OtherProgram(section.simulator, section.twin, counts.runs, counts.failed, differences)
