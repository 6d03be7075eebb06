"""The response of a case to values that someone tries, again and again, beside its records."""

from collections.abc import Mapping
from dataclasses import dataclass

from exfit.case.case import Case
from exfit.dsp.features import Features
from exfit.errors import SimulationError
from exfit.fitting.build import build_experiments
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import residuals_of
from exfit.fitting.program import Program
from exfit.fitting.residuals import UNREACHABLE, Residuals
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison

Values = Mapping[str, float]


@dataclass(frozen=True)
class Explorer:
    """The tests of a case, ready to be simulated at values of its free parameters.

    ``start`` are the responses to the start values, one for each record; ``measured`` the features
    that were read in the records.
    """

    case: Case
    setups: tuple[ExperimentSetup, ...]
    residuals: Residuals
    start: tuple[Comparison, ...]
    measured: tuple[Features | None, ...]

    @property
    def free(self) -> tuple[FreeParameter, ...]:
        """The free parameters of the unit: those of the records stay at their starts."""
        own = self.case.free()
        return tuple(each for each in self.residuals.free if each.name in own)

    def at(self, values: Values, quick: bool = False) -> tuple[Comparison, ...]:
        """Simulate each record's test at values of free parameters; others are at their starts.

        ``quick`` takes the steps that suffice at the start values, where these give a response.
        Raises SimulationError where there is no response, and for ties without a value.
        """
        starts = {each.name: each.start for each in self.residuals.free}
        try:
            whole = self.residuals.completed({**starts, **values})
            return tuple(
                compare_with_record(
                    setup if quick else setup.with_enough_substeps(whole), whole, measured=measured
                )
                for setup, measured in zip(self.setups, self.measured, strict=True)
            )
        except UNREACHABLE as fault:
            if quick:
                return self.at(values)
            raise SimulationError(str(fault)) from fault


def explorer(case: Case, program: Program | None) -> Explorer:
    """Read the records of a case and simulate them at its start values.

    Raises ExfitError for a case without a record or a free parameter, or one that cannot be read.
    """
    start = case.values()
    setups = tuple(setup.with_enough_substeps(start) for setup in build_experiments(case, start))
    if program is not None:
        setups = program.simulated(setups)
    residuals = residuals_of(case, setups, start)
    values = residuals.values(residuals.start)
    responses = tuple(compare_with_record(setup, values) for setup in setups)
    measured = tuple(response.features.measured for response in responses)
    return Explorer(case, setups, residuals, responses, measured)
