"""Responses to other values than the fitted ones: where phases ended, and before the test."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, takewhile
from math import isnan
from pathlib import Path

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import AsFoundSection
from exfit.errors import CaseError, SimulationError
from exfit.fitting.build import build_experiment
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.program import Program
from exfit.fitting.residuals import Residuals
from exfit.fitting.system import values_of
from exfit.models import find
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import AsFound, Comparison, PhaseEnd
from exfit.results.model import Iteration
from exfit.util.strategies import PHASES
from exfit.workflows.case_description import fixed_values

Values = Mapping[str, float]

NOT_NAMED = "the planner's base"  # a model as found whose case does not say where it is from


def phase_ends(
    case: Case,
    setups: Sequence[ExperimentSetup],
    residuals: Residuals,
    history: Sequence[Iteration],
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
                compare_with_record(setup.with_enough_substeps(values), setup.name, values, start)
                for setup in setups
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


def as_found_of(
    case: Case, tests: Sequence[tuple[ExperimentSetup, Values]], program: Program | None = None
) -> AsFound:
    """Return the model before the test, which the case states or starts from, and its responses.

    ``tests`` are all tests with what was found about their records among the values: step
    instants, levels. The responses of start values have no samples: those of the fit hold them.
    """
    section = case.as_found or AsFoundSection()
    source = "" if case.as_found is None else section.source or NOT_NAMED
    try:
        before = _case_before(case, section)
    except CaseError as fault:
        model, stated = section.model or case.subject, dict(section.parameters)
        return _of_unit(AsFound(source, model, stated, (), str(fault)), section)
    values = values_of(before, dict(section.parameters))
    own = {name: values[name] for name in before.rows()}
    unit = _of_unit(AsFound(source, before.subject, own), section)
    try:
        comparisons = _comparisons(case, before, values, tests, program)
    except (CaseError, SimulationError) as fault:
        return replace(unit, why=str(fault))
    kept = (
        comparisons
        if unit.is_stated
        else [replace(match, time=np.zeros(0), overlays={}) for match in comparisons]
    )
    return replace(unit, comparisons=tuple(kept))


def model_as_found(case: Case) -> tuple[Case, Values]:
    """Return a case with the exciter that the case says was found, and its values.

    They are the case's own where it does not say. Raises CaseError where they cannot be used.
    """
    section = case.as_found or AsFoundSection()
    before = _case_before(case, section)
    return before, values_of(before, dict(section.parameters))


def _of_unit(unit: AsFound, section: AsFoundSection) -> AsFound:
    """Return a model as found with its place in the planner's base."""
    return replace(unit, bus=section.bus, machine_id=section.id, file=section.file)


def _case_before(case: Case, section: AsFoundSection) -> Case:
    """Return the case with the exciter of the planner's base."""
    if section.model is None:
        return case
    # a name of the catalogue, as the check of the case read it: no file beside the case is run
    model = find(section.model.removesuffix(".py"), Path())
    if case.parts.exciter is not None and model.name == case.parts.exciter.name:
        return case
    if case.external is not None:
        text = f"the program simulates {case.subject} only"
        raise CaseError([f"{case.path}: as_found.model: {model.name}: {text}"])
    from exfit.case.other_model import with_exciter  # what `new` needs, a fit mostly does not

    return with_exciter(case, model.name, model)


def _comparisons(
    case: Case,
    before: Case,
    values: Values,
    tests: Sequence[tuple[ExperimentSetup, Values]],
    program: Program | None,
) -> list[Comparison]:
    """Return the responses of the model before the test beside all records."""
    recordings = (*case.recordings, *case.validations)
    comparisons = []
    for recording, (setup, fitted) in zip(recordings, tests, strict=True):
        of_record = {name: value for name, value in fitted.items() if name not in case.rows()}
        at = {**of_record, **values}
        own = setup if before is case else build_experiment(before, recording, at)
        if program is not None:
            program.run(own, at)
        comparisons.append(compare_with_record(own.with_enough_substeps(at), setup.name, at))
    return comparisons
