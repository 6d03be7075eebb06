"""A fit from its case to its result: what `exfit.fit` and the command do."""

import time as clock
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from exfit import estimate
from exfit.case.case import Case
from exfit.case.given_errors import given_std_errors
from exfit.case.parts import MEANINGS
from exfit.case.schema import SINGLE, Estimate
from exfit.fitting.build import build_unseen
from exfit.fitting.channel_weights import weight_notes
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import LARGEST_FACTOR, freed_within, scaled_values
from exfit.fitting.program import Program
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import fitted, names_of_records
from exfit.fitting.uncertainty import UncertaintyAnalysis, free_values
from exfit.inference.confidence import NORMAL, Uncertainty
from exfit.plants import FURTHER, GOVERNOR
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import AsFound, Comparison, PhaseEnd
from exfit.results.description import Behaviour, values_of_part, versions
from exfit.results.influences import RecorderAverages, WindowSpread, first_of
from exfit.results.intervals.averages import (
    allowing_for_averages,
    holding,
    recorder_averages,
)
from exfit.results.intervals.value_errors import (
    ErrorsOfValues,
    allowing_for,
    allowing_for_bias,
    errors_of_values,
    given_error_notes,
)
from exfit.results.model import FitResult, FittedParameter, Iteration, Minima
from exfit.results.verdict import Verdict
from exfit.util.vocabulary import REFINING_VALUES, Criteria
from exfit.verdict.causes import Evidence, FittedRecord, Pace
from exfit.verdict.causes.evidence import time_for_causes
from exfit.verdict.diagnostics import notes, outlier_notes, reference_notes, tolerance_notes
from exfit.verdict.rule import verdict_of
from exfit.verdict.run_quality import speed_notes, switching_notes
from exfit.workflows.case_description import (
    fixed_values,
    identified_values,
    inputs_of,
    other_program_of,
    parts_of,
    tests_of,
    text_of,
)
from exfit.workflows.case_search import STAGES
from exfit.workflows.given_values import given_value_notes, given_values
from exfit.workflows.responses import (
    LiveResponse,
    as_found_of,
    behaviour_of,
    judged_on,
    live_response,
    phase_ends,
    skipped_response_notes,
    with_iteration_responses,
)
from exfit.workflows.search_state import SearchState, in_turn

Values = Mapping[str, float]

MOST_CAUSES = 2  # the likeliest, whose values intervals hold, too
LINEAR_ALONE = "no twin: intervals are those of linear theory, by finite differences at the result"
INTERRUPTED_AFTERWARDS = (
    "interrupted after the search: intervals, or comparisons with records that were not fitted, "
    "are missing"
)


def fit_result(
    case: Case,
    method: str,
    options: Estimate,
    program: Program | None,
    progress: Callable[[Iteration], None],
    search_progress: Callable[[estimate.Progress], None],
    live: Callable[[LiveResponse], None] | None,
) -> FitResult:
    """Fit a case, simulated by a program where one is given, as `exfit.fit` says."""
    began = clock.perf_counter()
    # of the processor, but for a program that runs beside it
    timer = clock.process_time if program is None else clock.perf_counter
    search_began = timer()
    setups, problem = fitted(case, program)
    unseen = _unseen(case, setups, program)
    used = [*setups, *unseen]
    # before the search: whoever edits the case meanwhile changes nothing of this fit
    (hashes, names), case_text = inputs_of(case, used), text_of(case)

    announce = partial(_announce, progress, live)
    began_with = case, setups, unseen, problem, method, options, program
    state = in_turn(STAGES, SearchState(*began_with, announce, search_progress))
    problem, found, best = state.problem, state.found, state.found.best
    residuals, values = problem.residuals, problem.residuals.values(best.x)
    given = state.refined.given
    fine = [setup.with_enough_substeps(values) for setup in state.fitted]
    history = [*_iterations(found.history, residuals, given)]
    comparisons = _comparisons(fine, residuals, values, history, case.criteria, given)
    analysis = _analysed(state, values, fine, comparisons, history)
    uncertainty = analysis.uncertainty
    minima = _minima(state, values, uncertainty)
    interrupted = analysis.interrupted or found.interrupted
    pace = Pace(time_for_causes(options.causes, timer() - search_began), search_progress, timer)
    tests = zip(case.recordings, fine, comparisons, strict=True)
    evidence = Evidence(
        case=case,
        residuals=residuals,
        solution=best,
        records=tuple(FittedRecord(each.test, setup, match) for each, setup, match in tests),
        uncertainty=uncertainty,
        validation=analysis.validation,
        averages=analysis.averages,
        refined=state.refined,
        interrupted=interrupted,
        pace=pace,
    )
    verdict = verdict_of(evidence)
    uncertainty = _holding_causes(analysis.uncertainty, residuals, values, verdict)
    analysis.uncertainty = uncertainty
    noted = _minima_notes(state, minima, uncertainty)
    if uncertainty is not None and verdict.no_interval:
        uncertainty = analysis.uncertainty = uncertainty.without_intervals(verdict.no_interval)
    own_values, models, limiters = _of_parts(case, values)
    parameters = _parameters(case, residuals, values, uncertainty, analysis.why)
    of_given = dict(_refined(case, given, values, analysis.errors, verdict.no_interval))
    refined = _within_errors(of_given)
    parameters |= {name: of_given[name] for name in given if name not in refined}
    identified = identified_values(parameters, analysis.validation)
    simulated = [*state.fitted, *state.unseen]
    return FitResult(
        case=case.path,
        about=case.about,
        model=case.subject,
        strategy=method,
        saturation=case.saturation,
        parameters=parameters,
        ties={name: tie.text for name, tie in case.ties.by_name.items()},
        fixed=fixed_values(case, values, parameters),
        machine=own_values.get("machine", {}),
        machine_model=models.get("machine"),
        network=own_values.get("network", {}),
        network_model=models.get("network"),
        stabiliser=own_values.get("stabiliser", {}),
        stabiliser_model=models.get("stabiliser"),
        governor=values_of_part(values, GOVERNOR),
        governor_model=models.get("governor"),
        limiters={kind: own_values[kind] for kind in limiters},
        limiter_models={kind: models[kind] for kind in limiters},
        units=_of_units(own_values),
        unit_models=_of_units(models),
        cost=best.cost,
        comparisons=comparisons,
        knowledge=uncertainty,
        minima=minima,
        status=best.status,
        message=best.message,
        success=best.success,
        interrupted=interrupted or pace.interrupted,
        phase_ends=tuple(analysis.phase_ends),
        history=tuple(history),
        nfev=best.nfev,
        njev=best.njev,
        simulations=state.counter.simulations if program is None else program.runs,
        substeps=state.counter.substeps,
        seconds=clock.perf_counter() - began,
        notes=(
            *found.notes,
            *state.line_notes,
            *noted,
            *_notes(state, comparisons, analysis),
            *_refined_notes(refined),
            *filter(None, [pace.sentence]),
        ),
        validation=tuple(analysis.validation),
        versions=versions(),
        inputs=hashes,
        verdict=verdict,
        freed=case.freed,
        given_values=given_values(case),
        refined=refined,
        windows=analysis.windows,
        sources=case.sources(fitted=parameters),
        strategy_given=method != case.estimate.strategy,
        search_given=options.search * (options is not case.estimate),
        parts=tuple(parts_of(case)),
        tests=tuple(tests_of(case, used, identified)),
        behaviour=analysis.behaviour,
        files=names,
        case_text=case_text,
        as_found=analysis.as_found,
        criteria=case.criteria,
        other_program=other_program_of(case, program, simulated),
    )


def _minima(
    state: SearchState, values: Values, uncertainty: UncertaintyAnalysis | None
) -> Minima | None:
    if state.found.minima is None:
        return None
    from exfit.results.intervals.minima import minima_of

    walked = state.problem.compressed if state.program is None else None
    refined = {name: values[name] for name in state.refined.given}
    return minima_of(state.problem.residuals, state.found, uncertainty, walked, refined)


def _minima_notes(
    state: SearchState, minima: Minima | None, uncertainty: UncertaintyAnalysis | None
) -> Sequence[str]:
    if state.found.minima is None:
        return ()
    from exfit.results.intervals.minima import minima_notes

    return (*minima_notes(state.problem.residuals, state.found, minima, uncertainty),)


def _holding_causes(
    uncertainty: UncertaintyAnalysis | None, residuals: Residuals, values: Values, verdict: Verdict
) -> UncertaintyAnalysis | None:
    """Return intervals that hold the values of likely causes where residuals are no noise."""
    if uncertainty is None or verdict.explained or not verdict.matches:
        return uncertainty
    for cause in verdict.causes[:MOST_CAUSES]:
        uncertainty = holding(uncertainty, residuals, values, cause.values, "causes")
    return uncertainty


@dataclass
class Analysis:
    """What follows from a solution, as far as no interruption ended it.

    ``interrupted`` where it, or the search before, is not whole; ``unfinished`` where the
    interruption came after the search: what was done by then is valid.
    """

    uncertainty: UncertaintyAnalysis | None
    interrupted: bool
    unfinished: bool
    validation: list[Comparison] = field(default_factory=list)
    behaviour: Behaviour | None = None
    phase_ends: list[PhaseEnd] = field(default_factory=list)
    as_found: AsFound | None = None
    windows: WindowSpread | None = None
    averages: RecorderAverages | None = None
    errors: ErrorsOfValues | None = None

    @property
    def why(self) -> str:
        """Why there is no uncertainty, where there is none."""
        return "the search was interrupted" if self.interrupted else "no finite derivatives"


def _announce(
    progress: Callable[[Iteration], None],
    live: Callable[[LiveResponse], None] | None,
    state: SearchState,
    line: estimate.SolverIteration,
) -> None:
    residuals = state.problem.residuals
    if live is not None:
        response = live_response(state.setups[0], residuals, line.x)
        if response is not None:
            live(response)
    progress(_iteration(line, free_values(residuals, line.x)))


def _unseen(
    case: Case, setups: Sequence[ExperimentSetup], program: Program | None
) -> tuple[ExperimentSetup, ...]:
    unseen = build_unseen(case, case.validations, case.values(), setups)
    return unseen if program is None else program.simulated(unseen)


def _comparisons(
    fine: Sequence[ExperimentSetup],
    residuals: Residuals,
    values: Values,
    history: Sequence[Iteration],
    criteria: Criteria,
    given: Values,
) -> tuple[Comparison, ...]:
    """Return the fitted response beside each record, with the iterations that led to it."""
    start = residuals.completed({**residuals.values(residuals.start), **given})
    moves = residuals.moves(scaled_values(residuals.free, values))
    return tuple(
        with_iteration_responses(
            compare_with_record(setup, values, start, moves=moves, criteria=criteria),
            setup,
            residuals,
            history,
        )
        for setup in fine
    )


def _of_units(by_kind: dict[str, Any]) -> dict[str, Any]:
    """Return what belongs to parts of further units."""
    return {kind: own for kind, own in by_kind.items() if kind.startswith(FURTHER)}


def _of_parts(
    case: Case, values: Values
) -> tuple[dict[str, dict[str, float]], dict[str, str], list[str]]:
    """Return the values of each part by its kind and their symbols, its model, the limiters."""
    own = {
        part.kind: {symbol: values[part.prefix + symbol] for symbol in part.symbols}
        for part in case.parts.all
    }
    limiters = [limiter.kind for limiter in case.parts.limiters]
    return own, {part.kind: part.name for part in case.parts.all}, limiters


def _analysed(
    state: SearchState,
    values: Values,
    fine: Sequence[ExperimentSetup],
    fitted: Sequence[Comparison],
    history: Sequence[Iteration],
) -> Analysis:
    """Analyse the best point: ``fine`` tests have sub-steps enough, ``fitted`` are matches."""
    case, problem, best = state.case, state.problem, state.found.best
    uncertainty, unfinished = state.determined.uncertainty, state.determined.interrupted
    interrupted = unfinished or best.stop is estimate.Stop.INTERRUPTED
    analysis = Analysis(uncertainty, interrupted, unfinished)
    try:
        analysis.phase_ends.extend(phase_ends(case, fine, problem.residuals, history, fitted))
        unseen = [judged_on(case, fitted, setup, values) for setup in state.unseen]
        analysis.validation = [match for _, match in unseen]
        tests = [(setup, values) for setup in fine]
        if not case.has_no_equations:
            others = [test for test, match in unseen if match.overlays]
            analysis.behaviour = behaviour_of(tests, others)
        every = [*tests, *(test for test, _ in unseen)], [*fitted, *analysis.validation]
        analysis.as_found = as_found_of(case, *every, state.program)
        if uncertainty is not None:
            at = problem, best.x, names_of_records(fine)
            uncertainty = allowing_for_bias(uncertainty, *at)
            noises = uncertainty.confidence.noise
            errors = errors_of_values(case, problem, best.x, noises, fine, state.refined)
            analysis.errors = errors
            if case.kind.plays_back and not case.kind.has_exciter:
                from exfit.results.intervals.windows import spread_over_windows, with_spread

                windows = spread_over_windows(case, fine, problem.residuals, values, uncertainty)
                analysis.windows, uncertainty = windows, with_spread(uncertainty, windows)
            uncertainty = allowing_for(errors, uncertainty, *at)
            if state.refined.given:
                from exfit.results.intervals import many_values

                analysis.errors = many_values.errors_beyond_linear(errors)
                uncertainty = many_values.beyond_linear(uncertainty, problem.residuals, values)
            averages = recorder_averages(case, problem.residuals, best.x, uncertainty)
            analysis.averages = averages
            uncertainty = allowing_for_averages(uncertainty, problem.residuals, averages)
    except KeyboardInterrupt:  # what the search came to stays
        analysis.interrupted = analysis.unfinished = True
    analysis.uncertainty = uncertainty
    return analysis


def _parameters(
    case: Case,
    residuals: Residuals,
    values: Values,
    uncertainty: UncertaintyAnalysis | None,
    why: str,
) -> dict[str, FittedParameter]:
    """Return the fitted parameters in their own units; ``why`` there is no ``uncertainty``."""
    rows, asked, fitted = case.rows(), case.free(), dict[str, FittedParameter]()
    of_records = residuals.of_records
    described = {name: (own.unit, own.meaning) for name, own in of_records.items()}
    described |= {name: (row.unit, row.meaning) for name, row in rows.items()}
    for parameter in residuals.free:
        name, value = parameter.name, values[parameter.name]
        unit, meaning = described.get(name, ("", MEANINGS.get(name, "used by ties")))
        own = Uncertainty(None, None, None, why)
        if uncertainty is not None:
            own = uncertainty.confidence.parameters[name]
        fitted[name] = FittedParameter(
            value=value,
            start=parameter.start,
            min=parameter.low,
            max=parameter.high,
            at_bound=parameter.bound(value),
            of_record=name in of_records,
            std_error=own.std_error,
            interval=own.interval,
            interval_method=own.method,
            why=own.why,
            unit=unit,
            meaning=meaning,
            physical=name not in rows or rows[name].is_physical(value),
            noise_interval=own.by_noise,
            given_error=None if name in asked or parameter.prior is None else parameter.prior.std,
        )
    return fitted


def _refined(
    case: Case, given: Values, values: Values, errors: ErrorsOfValues | None, why: str
) -> Iterator[tuple[str, FittedParameter]]:
    """Yield the given values that were moved, with what the records leave of their errors.

    ``why`` they have no interval, if none of the fit has one.
    """
    rows, std_errors = case.rows(), given_std_errors(case)
    for name, start in given.items():
        free = freed_within(name, start, LARGEST_FACTOR)
        left = None if why or errors is None else errors.left.get(name)
        own = dict[str, Any](why=why or "the search was interrupted")
        if left is not None and errors is not None:
            down, up = (max(NORMAL * left, side) for side in errors.sides.get(name, (0.0, 0.0)))
            within = max(values[name] - down, free.low), min(values[name] + up, free.high)
            own = {"std_error": left, "interval": within, "interval_method": "linear"}
        yield (
            name,
            FittedParameter(
                value=values[name],
                start=start,
                min=free.low,
                max=free.high,
                at_bound=free.bound(values[name]),
                unit=rows[name].unit,
                meaning=rows[name].meaning,
                physical=rows[name].is_physical(values[name]),
                given_error=std_errors[name],
                **own,
            ),
        )


def _within_errors(of_given: Mapping[str, FittedParameter]) -> dict[str, float]:
    """Return given values that were moved no farther than their errors, and are not listed."""
    return {name: each.start for name, each in of_given.items() if each.as_given}


def _refined_notes(refined: Values) -> Iterator[str]:
    if refined:
        yield f"moved within their errors, as is likeliest: {first_of([*refined])}"


def _iterations(
    lines: Iterable[estimate.SolverIteration], residuals: Residuals, given: Values
) -> Iterator[Iteration]:
    """Yield the lines of the log with values; given ones are as ``given`` until they are moved."""
    at = given
    for line in lines:
        if line.phase == REFINING_VALUES:
            at = {name: residuals.fixed[name] for name in given}
        yield _iteration(line, {**free_values(residuals, line.x), **at})


def _iteration(line: estimate.SolverIteration, values: Values) -> Iteration:
    """Return a line of the log with the parameters' own values for the scaled ones."""
    figures = {name: value for name, value in line._asdict().items() if name != "x"}
    return Iteration(**figures, values=values)


def _notes(
    state: SearchState, comparisons: Sequence[Comparison], analysis: Analysis
) -> Iterator[str]:
    case, residuals, best = state.case, state.problem.residuals, state.found.best
    if not best.success:
        yield "the search did not end at a minimum: the errors and intervals assume that it did"
    yield from given_value_notes(case)
    yield from tolerance_notes(residuals, best)
    yield from weight_notes(residuals)
    yield from notes(case, residuals, best, comparisons)
    for recording, setup in zip(case.recordings, state.fitted, strict=True):
        yield from setup.record.notes
        yield from outlier_notes(setup.record.source.name, setup.channels)
        yield from switching_notes(setup)
        yield from reference_notes(recording.test, setup)
        at = setup.experiment.parameters(residuals.values(best.x))
        yield from speed_notes(setup.experiment.simulator.inputs, at)
    if analysis.uncertainty is not None:
        yield from given_error_notes(analysis.uncertainty, names_of_records(state.fitted))
    if analysis.windows is not None:
        yield analysis.windows.sentence
    for match in comparisons:
        where = "" if match.name == SINGLE else f"{match.name}: "
        yield from (f"{where}{action.sentence}" for action in match.limiters)
    yield from skipped_response_notes(comparisons)
    if analysis.unfinished:
        yield INTERRUPTED_AFTERWARDS
    if state.program is not None:
        yield from state.program.notes([*state.fitted, *state.unseen])
    if case.has_no_equations:
        yield LINEAR_ALONE
