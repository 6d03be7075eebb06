"""The response of a case to values that someone tries, again and again, beside its records."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.dsp.features import Features
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import build_experiment, recordings_to_fit
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.problem import residuals_of
from exfit.fitting.program import Program
from exfit.fitting.residuals import UNREACHABLE, Residuals
from exfit.records.record import Record
from exfit.results.compare_with_record import compare_with_record, overlays_of
from exfit.results.comparisons import Comparison
from exfit.util.arrays import Array, Places
from exfit.workflows.given_values import outside

Values = Mapping[str, float]

MOST_SAMPLES = 10_000  # of a record, all of which are looked at
STRETCHES = 1200  # of a longer one, of which each shows its extremes


class Looked(NamedTuple):
    """A test at the samples that give its figures, and at those that are drawn, None for the same.

    ``times`` as many samples have the cost.
    """

    setup: ExperimentSetup
    drawn: ExperimentSetup | None = None
    times: float = 1.0

    def with_enough_substeps(self, values: Values) -> "Looked":
        """Make it with sub-steps enough all along the response to the values."""
        drawn = self.drawn and self.drawn.with_enough_substeps(values)
        return Looked(self.setup.with_enough_substeps(values), drawn, self.times)

    def response(self, values: Values, measured: Features | None = None) -> Comparison:
        """Simulate it beside its record; raises SimulationError where there is no response."""
        found = compare_with_record(self.setup, values, measured=measured)
        if self.drawn is None:
            return found
        time, overlays = self.drawn.record.time, overlays_of(self.drawn, values)
        return replace(found, cost=self.times * found.cost, time=time, overlays=overlays)


@dataclass(frozen=True)
class Explorer:
    """The tests of a case, ready to be simulated at values of its free parameters.

    ``start`` are the responses to the start values, one for each record; ``measured`` the features
    that were read in the records.
    """

    case: Case
    looked: tuple[Looked, ...]
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
        Raises CaseError for values that the equations exclude, SimulationError where there is no
        response, and for ties without a value.
        """
        faults = [*outside(self.case.rows(), values)]
        if faults:
            raise CaseError(f"values: {fault}" for fault in faults)
        starts = {each.name: each.start for each in self.residuals.free}
        try:
            whole = self.residuals.completed({**starts, **values})
            return tuple(
                (each if quick else each.with_enough_substeps(whole)).response(whole, measured)
                for each, measured in zip(self.looked, self.measured, strict=True)
            )
        except UNREACHABLE as fault:
            if quick:
                return self.at(values)
            raise SimulationError(str(fault)) from fault


def explorer(case: Case, program: Program | None) -> Explorer:
    """Read the records of a case and simulate them at its start values.

    A record of very many samples is looked at through some of them: its notes say how many.

    Raises ExfitError for a case without a record or a free parameter, or one that cannot be read.
    """
    start = case.values()
    setups = (build_experiment(case, recording, start) for recording in recordings_to_fit(case))
    looked = tuple(
        (_looked(each) if program is None else Looked(each)).with_enough_substeps(start)
        for each in setups
    )
    if program is not None:
        looked = tuple(map(Looked, program.simulated([each.setup for each in looked])))
    residuals = residuals_of(case, [each.setup for each in looked], start)
    values = residuals.values(residuals.start)
    responses = tuple(each.response(values) for each in looked)
    measured = tuple(response.features.measured for response in responses)
    return Explorer(case, looked, residuals, responses, measured)


def _looked(setup: ExperimentSetup) -> Looked:
    """Choose samples of a test: every so many of a long record, and the extremes between them."""
    count = len(setup.record.time)
    every = -(-count // MOST_SAMPLES)
    places = np.arange(0, count, every)
    plain = all(each.plain and each.kept[places].any() for each in setup.channels)
    if every == 1 or not plain or setup.experiment.sines:
        return Looked(setup)
    note = f"of {count} samples every {every}th gives the figures; drawn are the extremes"
    noted = replace(setup, record=replace(setup.record, notes=(*setup.record.notes, note)))
    extremes = (place for each in setup.channels for place in _extremes(each.measured))
    drawn = np.union1d([0, count - 1], [*extremes])
    return Looked(_at_samples(noted, places), _at_samples(setup, drawn), count / len(places))


def _at_samples(setup: ExperimentSetup, places: Places) -> ExperimentSetup:
    """Take a test at some of its samples alone; its channels are plain."""

    def some(record: Record) -> Record:
        signals = {name: samples[places] for name, samples in record.signals.items()}
        return replace(record, time=record.time[places], signals=signals)

    experiment = setup.experiment
    channels = tuple(
        replace(
            each,
            measured=each.measured[places],
            filtering=each.filtering
            and replace(each.filtering, time=each.filtering.time[places], kept=each.kept[places]),
        )
        for each in experiment.channels
    )
    simulator = experiment.simulator.at_times(experiment.simulator.times[places])
    return replace(
        setup,
        record=some(setup.record),
        whole=setup.whole and some(setup.whole),
        experiment=replace(experiment, simulator=simulator, channels=channels),
    )


def _extremes(samples: Array) -> Iterator[int]:
    """Find the least and the largest of each stretch of samples (M,) that has any."""
    ends = np.linspace(0, len(samples), STRETCHES + 1).astype(int)
    for first, last in pairwise(ends):
        own = samples[first:last]
        if np.isfinite(own).any():
            yield first + int(np.nanargmin(own))
            yield first + int(np.nanargmax(own))
