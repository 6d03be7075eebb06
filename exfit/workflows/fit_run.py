"""A fit from its case to its result: what `exfit.fit` and the command do."""

import time as clock
from collections.abc import Callable

from exfit import estimate
from exfit.case.case import Case
from exfit.case.schema import Estimate
from exfit.fitting.build import build_experiment
from exfit.fitting.program import Program
from exfit.fitting.search import fitted
from exfit.results.intervals.minima import minima_notes, minima_of
from exfit.results.model import FitResult, Iteration
from exfit.util.versions import versions
from exfit.verdict.causes import Pace
from exfit.verdict.causes.evidence import time_for_causes
from exfit.verdict.rule import verdict_of
from exfit.workflows.case_description import (
    criteria_of,
    fixed_values,
    identified_values,
    input_hashes,
    input_names,
    of_limiters,
    other_program_of,
    parts_of,
    tests_of,
    text_of,
    values_by_part,
)
from exfit.workflows.case_search import STAGES, SearchState, in_turn
from exfit.workflows.given_values import given_values
from exfit.workflows.iteration_responses import LiveResponse, live_response
from exfit.workflows.solution import (
    analysed,
    comparisons_of,
    evidence_of,
    fit_notes,
    fitted_parameters,
    iteration_of,
    without_intervals,
)

LINEAR_ALONE = "no twin: intervals are those of linear theory, by quotients at the result"


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
    start = case.values()
    setups, problem = fitted(case, program)
    unseen = tuple(build_experiment(case, recording, start) for recording in case.validations)
    if program is not None:
        unseen = program.simulated(unseen)
    used = [*setups, *unseen]
    # before the search: whoever edits the case meanwhile changes nothing of this fit
    hashes, case_text = input_hashes(case, used), text_of(case)

    def announce(state: SearchState, line: estimate.SolverIteration) -> None:
        residuals = state.problem.residuals
        if live is not None:
            response = live_response(state.setups[0], residuals, line.x)
            if response is not None:
                live(response)
        progress(iteration_of(line, residuals))

    began_with = case, setups, unseen, problem, method, options, program
    state = in_turn(STAGES, SearchState(*began_with, announce, search_progress))
    problem, setups, unseen, found = state.problem, state.fitted, state.unseen, state.found
    residuals = problem.residuals
    best = found.best
    history = [iteration_of(line, residuals) for line in found.history]
    values = residuals.values(best.x)
    fine = [setup.with_enough_substeps(values) for setup in setups]
    comparisons = comparisons_of(fine, residuals, values, history)
    analysis = analysed(
        case, problem, best, state.determined, fine, comparisons, unseen, program, history
    )
    walked = problem.compressed if program is None else None
    minima = minima_of(residuals, found, analysis.uncertainty, walked)
    interrupted = analysis.interrupted or found.interrupted
    pace = Pace(time_for_causes(options.causes, timer() - search_began), search_progress, timer)
    evidence = evidence_of(case, residuals, best, fine, comparisons, analysis, interrupted, pace)
    verdict = verdict_of(evidence)
    noted = [*minima_notes(residuals, found, minima, analysis.uncertainty)]
    analysis = without_intervals(analysis, verdict.no_interval)
    own_values = values_by_part(case, values)
    models = {part.kind: part.name for part in case.parts.all}
    parameters = fitted_parameters(case, residuals, values, analysis.uncertainty, analysis.why)
    identified = identified_values(parameters, analysis.validation)
    return FitResult(
        case=case.path,
        about=case.about,
        model=case.subject,
        strategy=method,
        saturation=case.saturation,
        parameters=parameters,
        ties={name: tie.text for name, tie in case.ties.by_name.items()},
        fixed=fixed_values(case, values),
        machine=own_values.get("machine", {}),
        machine_model=models.get("machine"),
        network=own_values.get("network", {}),
        network_model=models.get("network"),
        stabiliser=own_values.get("stabiliser", {}),
        stabiliser_model=models.get("stabiliser"),
        governor=own_values.get("governor", {}),
        governor_model=models.get("governor"),
        limiters=of_limiters(case, own_values),
        limiter_models=of_limiters(case, models),
        cost=best.cost,
        comparisons=comparisons,
        knowledge=analysis.uncertainty,
        minima=minima,
        status=best.status,
        message=best.message,
        success=best.success,
        interrupted=interrupted or pace.interrupted,
        phase_ends=analysis.phase_ends,
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
            *fit_notes(case, residuals, best, setups, comparisons, analysis),
            *([] if program is None else program.notes([*setups, *unseen])),
            *([LINEAR_ALONE] if case.has_no_equations else []),
            *filter(None, [pace.sentence]),
        ),
        validation=analysis.validation,
        versions=versions(),
        inputs=hashes,
        verdict=verdict,
        given_values=given_values(case),
        typical_values=analysis.typical_values,
        windows=analysis.windows,
        sources=case.sources(fitted=[parameter.name for parameter in residuals.free]),
        strategy_given=method != case.estimate.strategy,
        parts=tuple(parts_of(case)),
        tests=tuple(tests_of(case, used, identified)),
        behaviour=analysis.behaviour,
        files=input_names(case, used),
        case_text=case_text,
        as_found=analysis.as_found,
        criteria=criteria_of(case),
        other_program=other_program_of(case, program, [*setups, *unseen]),
    )
