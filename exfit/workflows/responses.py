"""The responses to values: beside records, after each iteration, at rest, before the test."""

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise, takewhile
from math import isnan, nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import AsFoundSection
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import build_experiment
from exfit.fitting.channel_weights import balanced
from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import ExperimentSetup, compared
from exfit.fitting.parameters import scaled_values
from exfit.fitting.problem import FitProblem, robust_of
from exfit.fitting.program import Program
from exfit.fitting.residuals import UNREACHABLE, Residuals
from exfit.fitting.system import values_of
from exfit.models import find
from exfit.registry import parts
from exfit.results.acceptance import judged
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import (
    AsFound,
    Comparison,
    IterationResponses,
    PhaseEnd,
    judged_of,
)
from exfit.results.description import Behaviour, FlatRun, HitLimits, SmallSignalView
from exfit.results.model import Iteration
from exfit.simulation.flat_run import FLAT_DRIFT, flat_drift
from exfit.simulation.limits import limits_hit
from exfit.simulation.small_signal import small_signal
from exfit.util.arrays import Array
from exfit.util.vocabulary import PHASES
from exfit.workflows.case_description import fixed_values

Values = Mapping[str, float]
TestWithValues = tuple[ExperimentSetup, Values]

MOST_RESPONSES = 40  # colours that an eye still distinguishes, and columns of a table
MOST_SAMPLES = 20_000  # of a record, 20 s at 1 kHz: a table of 9 MB, written within a second
NOT_NAMED = "the planner's base"  # a model as found whose case does not say where it is from


def aligned(case: Case, setup: ExperimentSetup, values: Values) -> TestWithValues:
    """Return a test that was not fitted, and the values with what is found about its record.

    The instants of its steps are those that the values have, or else those that the record shows:
    fitted, they would absorb errors of the model. What that record leaves open about itself
    otherwise (its levels) is fitted to it, with the parameters of the unit as they are; so is a
    periodic disturbance that stands out of what is left then. The test has sub-steps enough, and
    bounds within which the record allows the instants. Raises KeyboardInterrupt at an interruption.
    """
    fine, held = setup.with_enough_substeps(values), frozenset[str]()
    if not case.has_no_equations:  # whose every response is a run
        from exfit.fitting.shown_instants import instants_of, with_shown_instants

        fine, held = with_shown_instants(fine, values), instants_of(fine)
    own = fitted_to_record(case, fine, values, held)
    if not setup.automatic_sines:
        return fine, own
    from exfit.fitting.sines import with_found_lines

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
    comparison = compare_with_record(setup, values, of_record=of_record, criteria=case.criteria)
    if case.criteria.given:
        return replace(comparison, validation=True)
    driven = comparison.is_event and comparison.judged.describes
    by_noise = parts("INPUT_NOISE")["errors by noise"].load()(setup, values) if driven else None
    return judged(comparison, fitted, setup.channels, by_noise)


def judged_on(
    case: Case, fitted: Sequence[Comparison], setup: ExperimentSetup, values: Values
) -> tuple[TestWithValues, Comparison]:
    """Align a test that was not fitted, and judge it; one without a response is not accepted."""
    try:
        test = aligned(case, setup, values)
        return test, validation_of(case, fitted, *test)
    except SimulationError as fault:
        from exfit.results.no_response import without_response  # what few fits need

        return (setup, setup.with_start_values(values)), without_response(setup, fault)


class LiveResponse(NamedTuple):
    """A signal of a record and the response to the values of now, (M,) each, per unit.

    ``time`` (M,) is in s. What is left out of the comparison is not among them.
    """

    signal: str
    time: Array
    measured: Array
    simulated: Array


def live_response(
    setup: ExperimentSetup, residuals: Residuals, theta: Array
) -> LiveResponse | None:
    """Return the judged signal of the first setup at scaled parameters theta (N,).

    It costs a simulation. None where there is no response, and where the record has more than
    MOST_SAMPLES.
    """
    experiment = setup.experiment
    if len(setup.record.time) > MOST_SAMPLES:
        return None
    place = experiment.signals.index(judged_of(experiment.signals))
    channel, begin = setup.channels[place], sum(experiment.sizes[:place])
    try:
        values = residuals.values(theta)
        errors, _ = experiment.errors(values)
    except UNREACHABLE:
        return None
    measured = channel.filtered(experiment.measured(channel, values))
    simulated = measured + errors[begin : begin + experiment.sizes[place]] / channel.weight
    return LiveResponse(channel.signal, setup.record.time[channel.kept], measured, simulated)


def with_iteration_responses(
    comparison: Comparison,
    setup: ExperimentSetup,
    residuals: Residuals,
    history: Sequence[Iteration],
) -> Comparison:
    """Return the comparison of a setup with the responses of the iterations that led to it.

    Iterations without a finite response are left out. A record of more than MOST_SAMPLES has none.
    The steps are longer than those of the fit, by which no figure differs.
    """
    if not history or len(comparison.time) > MOST_SAMPLES:
        return comparison
    numbers, sets = list[int](), list[Values]()
    for k in chosen(len(history)):
        try:
            sets.append(residuals.completed(history[k].values))
        except UNREACHABLE:  # a tie has none
            continue
        numbers.append(history[k].number)
    signal = comparison.judged_by
    place = setup.experiment.signals.index(signal)
    channel = setup.channels[place]
    experiment, coarse = setup.experiment, setup.experiment.coarse()
    if coarse is not experiment:
        with suppress(SimulationError):
            experiment = coarse.with_enough_substeps(sets[-1])
    samples, _ = experiment.samples_of_many(sets)
    responses = [compared(channel, own[:, place]) for own in samples]
    finite = [bool(np.isfinite(response[channel.kept]).all()) for response in responses]
    if not any(finite):
        return comparison
    kept = IterationResponses(
        signal=signal,
        numbers=tuple(number for number, good in zip(numbers, finite, strict=True) if good),
        time=comparison.time,
        measured=comparison.overlays[signal].measured,
        samples=np.stack(responses)[finite],
    )
    return replace(comparison, iteration_responses=kept)


def chosen(count: int) -> list[int]:
    """Choose evenly some of so many iterations, the first and last among them."""
    kept = np.linspace(0, count - 1, min(count, MOST_RESPONSES))
    return [int(k) for k in np.rint(kept)]


def skipped_response_notes(comparisons: Sequence[Comparison]) -> list[str]:
    """Say of which records the iterations are not kept for their size."""
    return [
        f"{comparison.record}: {len(comparison.time)} samples: the response after each "
        f"iteration is kept of records up to {MOST_SAMPLES}"
        for comparison in comparisons
        if len(comparison.time) > MOST_SAMPLES
    ]


def phase_ends(
    case: Case,
    setups: Sequence[ExperimentSetup],
    residuals: Residuals,
    history: Sequence[Iteration],
    fitted: Sequence[Comparison],
) -> Iterator[PhaseEnd]:
    """Yield the ends of the phases of the descent from the start of the case, but for the last one.

    Where a descent before that one was given up, its phases are not among them, and an end without
    a finite response is left out.
    """
    whole = [*takewhile(lambda line: line.phase in PHASES, history)]
    starts = [k for k, line in enumerate(whole) if isnan(line.damping)]
    own = whole[starts[-1] :] if starts else whole
    start = residuals.values(residuals.start)
    for line, following in pairwise(own):
        if line.phase == following.phase:
            continue
        values = residuals.completed(line.values)
        try:
            comparisons = tuple(
                compare_with_record(
                    setup.with_enough_substeps(values),
                    values,
                    start,
                    measured=match.features.measured,
                )
                for setup, match in zip(setups, fitted, strict=True)
            )
        except SimulationError:
            continue
        yield PhaseEnd(
            phase=line.phase,
            next_phase=following.phase,
            iteration=line.number,
            cost=line.cost,
            values={**fixed_values(case, values), **line.values},
            comparisons=comparisons,
        )


def behaviour_of(
    tests: Sequence[TestWithValues], others: Iterable[TestWithValues] = ()
) -> Behaviour:
    """Describe a run without a step, the state near rest and the limits met, by values in tests.

    The tests have sub-steps enough; each has its own values, with what was found about its record.
    """
    flat_runs, alike = list[FlatRun](), dict[object, list[TestWithValues]]()
    for setup, values in tests:
        experiment = setup.experiment
        simulator, parameters = experiment.at(values)
        try:
            drift = flat_drift(simulator, parameters, experiment.signals)
        except SimulationError:
            drift = nan
        flat_runs.append(FlatRun(experiment.name, drift, drift <= FLAT_DRIFT))
        key = (experiment.simulator.system, tuple(sorted(parameters.items())))
        alike.setdefault(key, []).append((setup, values))
    limits = []
    for setup, values in (*tests, *others):
        hits = limits_hit(*setup.experiment.at(setup.with_start_values(values)))
        limits.append(HitLimits(setup.name, hits))
    return Behaviour(tuple(flat_runs), tuple(map(_small_signal, alike.values())), tuple(limits))


def _small_signal(alike: Sequence[TestWithValues]) -> SmallSignalView:
    """Return the small-signal view of the state of rest that all these tests start from."""
    names, (first, values) = tuple(setup.experiment.name for setup, _ in alike), alike[0]
    system = first.experiment.simulator.system
    if "vref" not in system.inputs:
        why = "recorded signals drive the machine: there is no closed loop"
        return SmallSignalView(names, None, why)
    try:
        return SmallSignalView(names, small_signal(system, first.experiment.parameters(values)))
    except SimulationError as fault:
        return SmallSignalView(names, None, str(fault))


def as_found_of(
    case: Case,
    tests: Sequence[TestWithValues],
    matches: Sequence[Comparison],
    program: Program | None,
) -> AsFound:
    """Return the model before the test, which the case states or starts from, and its responses.

    ``tests`` are all tests with what was found about their records among the values: step
    instants, levels; ``matches`` are these. The responses of start values have no samples: those of
    the fit hold them.
    """
    section = case.as_found or AsFoundSection()
    unit = AsFound(
        source="" if case.as_found is None else section.source or NOT_NAMED,
        model=section.model or case.subject,
        values=dict(section.parameters),
        bus=section.bus,
        machine_id=section.id,
        file=section.file,
    )
    try:
        before, values = model_as_found(case)
        own = {name: values[name] for name in before.rows()}
        unit = replace(unit, model=before.subject, values=own)
        comparisons = []
        recordings = (*case.recordings, *case.validations)
        each = zip(recordings, tests, matches, strict=True)
        for recording, (setup, fitted), now in each:
            of_record = {name: value for name, value in fitted.items() if name not in case.rows()}
            at = {**of_record, **values}
            test = setup if before is case else build_experiment(before, recording, at)
            if program is not None:
                program.run(test, at)
            fine, read = test.with_enough_substeps(at), now.features.measured
            match = replace(compare_with_record(fine, at, measured=read), name=setup.name)
            empty = replace(match, time=np.zeros(0), overlays={})
            comparisons.append(match if unit.is_stated else empty)
    except (CaseError, SimulationError) as fault:
        return replace(unit, why=str(fault))
    return replace(unit, comparisons=tuple(comparisons))


def model_as_found(case: Case) -> tuple[Case, Values]:
    """Return a case with the exciter that the case says was found, and its values.

    They are the case's own where it does not say. Raises CaseError where they cannot be used.
    """
    section, before = case.as_found or AsFoundSection(), case
    if section.model is not None:
        # a name of the catalogue, as the check of the case read it: no file beside the case is run
        model = find(section.model.removesuffix(".py"), Path())
        if case.parts.exciter is None or model.name != case.parts.exciter.name:
            if case.external is not None:
                text = f"the program simulates {case.subject} only"
                raise CaseError(f"{case.path}: as_found.model: {model.name}: {text}")
            from exfit.case.other_model import (
                with_exciter,  # what `new` needs, a fit mostly does not
            )

            before = with_exciter(case, model.name, model)
    return before, values_of(before, dict(section.parameters))
