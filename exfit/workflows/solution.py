"""The solution of a search, and what follows from it: responses, uncertainty, notes."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.case.parts import MEANINGS
from exfit.case.schema import SINGLE
from exfit.fitting.channel_weights import balanced, weight_notes
from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import FreeParameter, scaled_values
from exfit.fitting.problem import FitProblem, robust_of
from exfit.fitting.program import Program
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import names_of_records
from exfit.fitting.shown_instants import instants_of, with_shown_instants
from exfit.fitting.uncertainty import UncertaintyAnalysis
from exfit.inference.confidence import Uncertainty
from exfit.results.acceptance import judged
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import AsFound, Comparison, PhaseEnd
from exfit.results.description import Behaviour
from exfit.results.influences import RecorderAverages, TypicalValue, WindowSpread, by_weight
from exfit.results.intervals.averages import allowing_for_averages, recorder_averages
from exfit.results.intervals.determination import Determination
from exfit.results.intervals.value_errors import (
    allowing_for,
    allowing_for_bias,
    errors_of_values,
    given_error_notes,
    influence_of_typical_values,
)
from exfit.results.intervals.windows import spread_over_windows, with_spread
from exfit.results.model import FittedParameter, Iteration
from exfit.verdict.causes import Evidence, FittedRecord, Pace
from exfit.verdict.diagnostics import notes, outlier_notes, reference_notes, tolerance_notes
from exfit.verdict.run_quality import speed_notes, switching_notes
from exfit.workflows.behaviour import behaviour_of
from exfit.workflows.given_values import given_value_notes
from exfit.workflows.iteration_responses import skipped_response_notes, with_iteration_responses
from exfit.workflows.other_values import as_found_of, phase_ends

Array = NDArray[np.float64]
Values = Mapping[str, float]

INTERRUPTED_AFTERWARDS = (
    "interrupted after the search: intervals, or comparisons with records that were not fitted, "
    "are missing"
)
NOTHING_TO_ACCEPT = (
    "accept: this case has no record under validate to judge; `exfit validate CASE --record FILE` "
    "judges one"
)


class Analysis(NamedTuple):
    """What follows from a solution; ``interrupted`` where it, or the search before, is not whole.

    ``unfinished`` where the interruption came after the search: what was done by then is valid.
    """

    uncertainty: UncertaintyAnalysis | None
    validation: tuple[Comparison, ...]
    behaviour: Behaviour | None
    phase_ends: tuple[PhaseEnd, ...]
    interrupted: bool
    unfinished: bool
    typical_values: Mapping[str, TypicalValue]
    as_found: AsFound | None
    windows: WindowSpread | None = None
    averages: RecorderAverages | None = None

    @property
    def why(self) -> str:
        """Why there is no uncertainty, where there is none."""
        return "the search was interrupted" if self.interrupted else "no finite derivatives"


def analysed(
    case: Case,
    problem: FitProblem,
    best: estimate.Result,
    determined: Determination,
    setups: Sequence[ExperimentSetup],
    fitted: Sequence[Comparison],
    unseen: Sequence[ExperimentSetup],
    program: Program | None = None,
    history: Sequence[Iteration] = (),
) -> Analysis:
    """Analyse the best point: its uncertainty, its response to ``unseen`` records, and more.

    ``setups`` have sub-steps enough, ``fitted`` are the comparisons with their records. An
    interruption ends it with what was done by then.
    """
    values = problem.residuals.values(best.x)
    unfinished = determined.interrupted
    interrupted = unfinished or best.stop is estimate.Stop.INTERRUPTED
    uncertainty, behaviour, validation = determined.uncertainty, None, list[Comparison]()
    ends, typical = list[PhaseEnd](), dict[str, TypicalValue]()
    as_found: AsFound | None = None
    windows: WindowSpread | None = None
    averages: RecorderAverages | None = None
    try:
        ends += phase_ends(case, setups, problem.residuals, history)
        validated = [aligned(case, setup, values) for setup in unseen]
        validation += [validation_of(case, fitted, *pair) for pair in validated]
        if not case.has_no_equations:
            behaviour = behaviour_of([(setup, values) for setup in setups], validated)
        tests = [*((setup, values) for setup in setups), *validated]
        as_found = as_found_of(case, tests, program)
        if uncertainty is not None:
            at = problem, best.x, names_of_records(setups)
            uncertainty = allowing_for_bias(uncertainty, *at)
            errors = errors_of_values(case, problem, best.x)
            wider = allowing_for(errors, uncertainty, *at)
            typical = influence_of_typical_values(case, problem.compressed, best.x, wider)
            windows = spread_over_windows(case, setups, problem.residuals, values, uncertainty)
            uncertainty = allowing_for(errors, with_spread(uncertainty, windows), *at)
            averages = recorder_averages(case, problem.residuals, best.x, uncertainty)
            uncertainty = allowing_for_averages(uncertainty, problem.residuals, averages)
    except KeyboardInterrupt:  # what the search came to stays
        interrupted = unfinished = True
    return Analysis(
        uncertainty,
        tuple(validation),
        behaviour,
        tuple(ends),
        interrupted,
        unfinished,
        typical,
        as_found,
        windows,
        averages,
    )


def without_intervals(analysis: Analysis, why: str) -> Analysis:
    """Take the intervals out of an analysis, for a reason; it stays without one."""
    if not why:
        return analysis
    known = analysis.uncertainty
    uncertainty = None if known is None else known.without_intervals(why)
    return analysis._replace(uncertainty=uncertainty)


def fitted_parameters(
    case: Case,
    residuals: Residuals,
    values: Values,
    uncertainty: UncertaintyAnalysis | None,
    why: str,
) -> dict[str, FittedParameter]:
    """Return the free parameters with their fitted values, in the parameters' own units.

    ``why`` is the reason where there is no ``uncertainty``.
    """
    rows = case.rows()
    described = {name: (row.unit, row.meaning) for name, row in rows.items()}
    of_records = {
        nuisance.name: (nuisance.unit, nuisance.meaning)
        for experiment in residuals.experiments
        for nuisance in experiment.nuisances
    }

    def fitted(parameter: FreeParameter) -> FittedParameter:
        name = parameter.name
        unit, meaning = (of_records | described).get(name, ("", MEANINGS.get(name, "used by ties")))
        unknown = Uncertainty(None, None, None, why)
        own = unknown if uncertainty is None else uncertainty.confidence.parameters[name]
        return FittedParameter(
            value=values[name],
            start=parameter.start,
            min=parameter.low,
            max=parameter.high,
            at_bound=parameter.bound(values[name]),
            of_record=name in of_records,
            std_error=own.std_error,
            interval=own.interval,
            interval_method=own.method,
            why=own.why,
            unit=unit,
            meaning=meaning,
            physical=name not in rows or rows[name].is_physical(values[name]),
        )

    return {parameter.name: fitted(parameter) for parameter in residuals.free}


def iteration_of(line: estimate.SolverIteration, residuals: Residuals) -> Iteration:
    """Return a line of the log with the parameters' own values for the scaled ones."""
    values = residuals.values(line.x)
    figures = {name: value for name, value in vars(line).items() if name != "x"}
    free = {parameter.name: values[parameter.name] for parameter in residuals.free}
    return Iteration(**figures, values=free)


def comparisons_of(
    fine: Iterable[ExperimentSetup],
    residuals: Residuals,
    values: Values,
    history: Sequence[Iteration],
) -> tuple[Comparison, ...]:
    """Return the fitted response beside each record, with the iterations that led to it.

    The tests, ``fine``, have sub-steps enough for it.
    """
    start = residuals.values(residuals.start)
    moves = residuals.moves(scaled_values(residuals.free, values))
    return tuple(
        with_iteration_responses(
            compare_with_record(setup, setup.name, values, start, moves=moves),
            setup,
            residuals,
            history,
        )
        for setup in fine
    )


def fit_notes(
    case: Case,
    residuals: Residuals,
    best: estimate.Result,
    setups: Sequence[ExperimentSetup],
    comparisons: Sequence[Comparison],
    analysis: Analysis,
) -> Iterator[str]:
    """Yield notes beside the numbers of a fit."""
    if case.accept is not None and not case.validations:
        yield NOTHING_TO_ACCEPT
    if not best.success:
        yield "the search did not end at a minimum: the errors and intervals assume that it did"
    yield from given_value_notes(case)
    yield from tolerance_notes(residuals, best)
    yield from weight_notes(residuals)
    yield from notes(case, residuals, best, comparisons)
    for recording, setup in zip(case.recordings, setups, strict=True):
        yield from setup.record.notes
        yield from outlier_notes(setup.record.source.name, setup.channels)
        yield from switching_notes(setup)
        yield from reference_notes(recording.test, setup)
        experiment = setup.experiment
        yield from speed_notes(
            experiment.simulator.inputs, experiment.parameters(residuals.values(best.x))
        )
    if analysis.uncertainty is not None:
        yield from given_error_notes(analysis.uncertainty, names_of_records(setups))
    if analysis.windows is not None:
        yield analysis.windows.sentence
    for match in comparisons:
        where = "" if match.name == SINGLE else f"{match.name}: "
        yield from (f"{where}{action.sentence}" for action in match.limiters)
    yield from skipped_response_notes(comparisons)
    if analysis.unfinished:
        yield INTERRUPTED_AFTERWARDS


def aligned(case: Case, setup: ExperimentSetup, values: Values) -> tuple[ExperimentSetup, Values]:
    """Return a test that was not fitted, and the values with what is found about its record.

    The instants of its steps are those that the values have, or else those that the record shows:
    fitted, they would absorb errors of the model. What that record leaves open about itself
    otherwise (its levels) is fitted to it, with the parameters of the unit as they are; so is a
    periodic disturbance that stands out of what is left then. The test has sub-steps enough, and
    bounds within which the record allows the instants. Raises KeyboardInterrupt at an interruption.
    """
    from exfit.fitting.sines import with_found_lines

    fine, held = setup.with_enough_substeps(values), frozenset[str]()
    if not case.has_no_equations:  # whose every response is a run
        fine, held = with_shown_instants(fine, values), instants_of(fine)
    own = fitted_to_record(case, fine, values, held)
    if not setup.automatic_sines:
        return fine, own
    residuals = Residuals([fine.experiment], fine.free, own)
    (disturbed,), _ = with_found_lines([fine], residuals, scaled_values(fine.free, own))
    fine = disturbed.with_enough_substeps(values)
    return fine, fitted_to_record(case, fine, values, held)


def fitted_to_record(
    case: Case, setup: ExperimentSetup, values: Values, held: Collection[str] = ()
) -> Values:
    """Return the values with what a record leaves open about itself, fitted to it.

    What is ``held`` stays where the values have it, or at its start. Raises KeyboardInterrupt at
    an interruption.
    """
    values = {**{each.name: each.start for each in setup.free if each.name in held}, **values}
    free = tuple(each for each in setup.free if each.name not in held)
    if not free:
        return values
    residuals = Residuals([setup.experiment], free, values, robust=robust_of(case))
    if case.estimate.weights == "balanced":
        residuals = balanced(FitProblem(residuals, residuals), residuals.start).residuals
    return residuals.values(descent_near(residuals, residuals.start).x)


def validation_of(
    case: Case, fitted: Sequence[Comparison], setup: ExperimentSetup, values: Values
) -> Comparison:
    """Judge `aligned` values on a record that was not fitted, by the ``fitted`` ones."""
    of_record = {parameter.name: values[parameter.name] for parameter in setup.free}
    comparison = compare_with_record(setup, setup.name, values, of_record=of_record)
    accept = None if case.accept is None else case.accept.rmse
    return judged(comparison, fitted, setup.channels, accept)


def evidence_of(
    case: Case,
    residuals: Residuals,
    best: estimate.Result,
    setups: Sequence[ExperimentSetup],
    comparisons: Sequence[Comparison],
    analysis: Analysis,
    interrupted: bool,
    pace: Pace,
) -> Evidence:
    """Collect the evidence for the verdict on a fit and for the causes of a poor one."""
    return Evidence(
        case=case,
        residuals=residuals,
        solution=best,
        records=tuple(
            FittedRecord(recording.test, setup, comparison)
            for recording, setup, comparison in zip(
                case.recordings, setups, comparisons, strict=True
            )
        ),
        uncertainty=analysis.uncertainty,
        validation=analysis.validation,
        typical_values=by_weight(analysis.typical_values),
        averages=analysis.averages,
        interrupted=interrupted,
        pace=pace,
    )
