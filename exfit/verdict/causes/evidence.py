"""What is known of a fit when its causes are looked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import BumpTest, Unknown
from exfit.fitting.residuals import Residuals, noise_of
from exfit.fitting.setup import ExperimentSetup
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.results.comparisons import Comparison
from exfit.results.intervals.determination import NEEDS_PROFILE
from exfit.results.recorder_averages import RecorderAverages
from exfit.results.typical_values import TypicalValue
from exfit.verdict.causes.pace import Pace


@dataclass(frozen=True, eq=False)
class FittedRecord:
    """A record of a fit: its test as the case has it and as simulated, and the match with it."""

    test: BumpTest
    setup: ExperimentSetup
    comparison: Comparison

    @property
    def begins_at_rest(self) -> bool:
        """Whether the simulation starts where the record does, from rest."""
        return self.setup.test.begin is None

    @property
    def steady_until(self) -> float | None:
        """The instant (s) until which the record should be at rest; None where it never is."""
        return self.setup.test.steady if self.begins_at_rest else None

    @property
    def given_vt0(self) -> float | None:
        """The voltage (pu) before the first step that the case gives; None where it is fitted."""
        vt0 = self.setup.test.vt0 if self.begins_at_rest else None
        return None if isinstance(vt0, Unknown) else vt0


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a fit came to, as the recognisers of causes get it.

    ``solution`` is where the search ended, in scaled parameters; ``records`` are those of the fit,
    ``validation`` the comparisons with those of none. ``uncertainty`` is None where it is not
    known; ``typical_values`` are those that matter, with what they would move, the weightiest
    first; ``averages`` are those of the recorder that it does not exclude. ``interrupted``: the
    search, or what follows it, was cut short. ``pace`` watches the search for causes.
    """

    case: Case
    residuals: Residuals
    solution: estimate.Result
    records: Sequence[FittedRecord]
    uncertainty: UncertaintyAnalysis | None
    validation: Sequence[Comparison] = ()
    typical_values: Mapping[str, TypicalValue] = field(default_factory=dict)
    averages: RecorderAverages | None = None
    interrupted: bool = False
    pace: Pace = field(default_factory=Pace)

    @cached_property
    def values(self) -> Mapping[str, float]:
        """Every value by name, the fitted ones as they ended."""
        return self.residuals.values(self.solution.x)

    @property
    def weighted_by_noise(self) -> bool:
        """Whether the noise of what drives the simulations weighs the errors."""
        return any(each.whitening is not None for each in self.residuals.experiments)

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """The matches with the records of the fit."""
        return tuple(record.comparison for record in self.records)

    @property
    def cost(self) -> float:
        """What the fit made small, where it ended."""
        return self.solution.cost

    @cached_property
    def noise_cost(self) -> float:
        """The cost that the noise of the records alone would have, as they scatter.

        Errors that are weighted by the noise of what drives them are as large as that foretells.
        """
        if any(each.whitening is not None for each in self.residuals.experiments):
            return 0.5 * self.residuals.count * self.residuals.noise**2
        squares = (
            channel.samples * (channel.weight * noise_of(channel)) ** 2
            for channel in self.residuals.channels
        )
        return 0.5 * sum(squares)

    def name_of(self, number: int) -> str:
        """Return how a sentence names a record of several, "" where there is only one."""
        return f" of {self.records[number].setup.name}" if len(self.records) > 1 else ""

    @property
    def own(self) -> tuple[str, ...]:
        """The free parameters of the unit, without what belongs to a record."""
        of_records = {
            nuisance.name
            for experiment in self.residuals.experiments
            for nuisance in experiment.nuisances
        }
        return tuple(free.name for free in self.residuals.free if free.name not in of_records)

    @property
    def undetermined(self) -> tuple[str, ...]:
        """The parameters of the unit that the records do not limit on both sides."""
        if self.uncertainty is None:
            return self.own
        parameters, profiled = self.uncertainty.confidence.parameters, {*self.own}
        profiled -= {*self.without_profile}
        return tuple(n for n in self.own if n in profiled and not parameters[n].determined)

    @property
    def without_profile(self) -> tuple[str, ...]:
        """The parameters of the unit whose intervals only a profile shows, which was not run."""
        if self.uncertainty is None:
            return ()
        parameters = self.uncertainty.confidence.parameters
        return tuple(name for name in self.own if parameters[name].why == NEEDS_PROFILE)
