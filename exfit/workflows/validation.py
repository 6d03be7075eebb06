"""How fitted values do on other records: those of the case, or one that is given by hand."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import SINGLE, Recording
from exfit.dsp.quality import SPIKE_LIMIT, noise_of, spikes
from exfit.errors import CaseError
from exfit.fitting.build import build_experiments, build_unseen
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.parameters import scaled_values
from exfit.fitting.problem import residuals_of
from exfit.fitting.program import Program, by_program
from exfit.fitting.shown_instants import instants_of
from exfit.fitting.system import values_of
from exfit.fitting.validation_steps import GivenSteps, SetupOfRecord, with_steps_of_record
from exfit.records.record import Record
from exfit.results.compare_with_record import compare_with_record
from exfit.results.comparisons import Comparison, ValidatedStep
from exfit.results.description import OtherProgram, RecordedTest, versions
from exfit.results.validation_result import ValidationResult
from exfit.util.file_names import folded
from exfit.util.text import magnitude_fault
from exfit.util.vocabulary import NOT_STATED
from exfit.verdict.diagnostics import causes_before_fit
from exfit.verdict.run_quality import (
    state_of_rest_notes,
    step_error_notes,
    switching_notes,
    unsteady_signals,
    voltage_notes,
)
from exfit.workflows.case_description import (
    identified_values,
    inputs_of,
    other_program_of,
    parts_of,
    tests_of,
    text_of,
)
from exfit.workflows.given_values import ValuesOrResult, changes_of
from exfit.workflows.responses import (
    aligned,
    as_found_of,
    behaviour_of,
    fitted_to_record,
    model_as_found,
    validation_of,
)

Values = Mapping[str, float]

# a step, and the response with it where it is, by the bound that it is on
EARLIER_OR_LATER = {"min": ("earlier", "late"), "max": ("later", "early")}
LONE_RECORD = "record"  # its name, as in the case
NOTHING_TO_VALIDATE_ON = (
    "missing: the case has no record that was not fitted; name one there, or give it by "
    "`exfit validate CASE --record FILE` (record in Python)"
)


class ComparedTest(NamedTuple):
    """A test with sub-steps enough, its own values, and how its record compares."""

    recording: Recording
    setup: ExperimentSetup
    values: Values
    comparison: Comparison


class Validation(NamedTuple):
    """The tests that were compared, the fitted ones first, and a case that has just these.

    ``values`` are those of the unit.
    """

    case: Case
    values: Values
    tests: tuple[ComparedTest, ...]
    other_program: OtherProgram | None = None

    @property
    def fitted(self) -> bool:
        """Whether the values were fitted to some of the records."""
        return not all(test.comparison.validation for test in self.tests)

    @property
    def comparisons(self) -> list[Comparison]:
        """Their comparisons."""
        return [test.comparison for test in self.tests]


def validate(
    case: Case,
    values: "ValuesOrResult | None",
    record: Record | Path | str | None,
    step: float | Sequence[float],
    at: float | Sequence[float],
    program: Program | None = None,
) -> Validation:
    """Return the comparisons with the fitted records, then with those that no fit saw.

    No fit saw any record where nothing in the case is free, nor without ``values``: they are those
    of the model as found then. A ``program`` simulates if one is given. A ``record`` by hand, whose
    steps may be given, takes the place of the others. Raises ExfitError where input cannot be used,
    or where there is nothing to validate on.
    """
    given = GivenSteps(_numbers("step", step), _numbers("at", at))
    if record is None and any(given):
        raise CaseError(
            f"{case.path}: step and at need a record with them: --record (record in Python)"
        )
    saw: tuple[Recording, ...] = ()
    setups: Sequence[ExperimentSetup] = ()
    if values is None:
        case, own = model_as_found(case)
    else:
        own = values_of(case, changes_of(case, values))
        if case.free() and case.recordings:
            saw, setups = case.recordings, build_experiments(case, own)
    tests = [_fitted(case, *pair, own, program) for pair in zip(saw, setups, strict=True)]
    matches = [test.comparison for test in tests]
    if record is not None:
        case, test = _validated_by_hand(case, matches, own, record, given, program)
        case = replace(case, validations=(test.recording,))
        if not saw:
            case = replace(case, record=None, records=case.validations, validations=())
        tests.append(test)
    else:
        recordings = (*(() if saw else case.recordings), *case.validations)
        if not recordings:
            raise CaseError(f"{case.path}: validate: {NOTHING_TO_VALIDATE_ON}")
        unseen = build_unseen(case, recordings, own, setups)
        unseen = tuple(by_program(program, setup, own) for setup in unseen)
        pairs = zip(recordings, unseen, strict=True)
        tests += [_validated(case, matches, *pair, own) for pair in pairs]
    described = other_program_of(case, program, [test.setup for test in tests])
    return Validation(case, own, tuple(tests), described)


def _numbers(name: str, given: float | Sequence[float]) -> tuple[float, ...]:
    numbers = tuple(given) if isinstance(given, Sequence) else (given,)
    faults = [magnitude_fault(each) for each in numbers]
    faults += ["0 is not a step"] * (name == "step" and 0.0 in numbers)
    for fault in filter(None, faults):
        raise CaseError(f"{name}: {fault}")
    return numbers


def _fitted(
    case: Case,
    recording: Recording,
    setup: ExperimentSetup,
    values: Values,
    program: Program | None,
) -> ComparedTest:
    setup = by_program(program, setup.with_enough_substeps(values), values)
    moves = None
    if program is None:  # a run of it for each would be many
        residuals = residuals_of(case, [setup])
        at = scaled_values(residuals.free, setup.with_start_values(values))
        moves = residuals.moves(at)
    comparison = compare_with_record(setup, values, moves=moves, criteria=case.criteria)
    return ComparedTest(recording, setup, values, comparison)


def _validated(
    case: Case,
    fitted: Sequence[Comparison],
    recording: Recording,
    setup: ExperimentSetup,
    values: Values,
) -> ComparedTest:
    """Compare values with a record that no fit saw, judged by the ``fitted`` ones."""
    setup, values = aligned(case, setup, values)
    if setup.name == SINGLE:  # fit is no name for what was not fitted
        setup = replace(setup, experiment=replace(setup.experiment, name=LONE_RECORD))
    comparison = validation_of(case, fitted, setup, values)
    simulator, at = setup.experiment.at(values)
    simulated = {signal: overlay.simulated for signal, overlay in comparison.overlays.items()}
    notes = (
        *comparison.notes,
        *(cause.sentence for cause in causes_before_fit(case, recording)),
        *switching_notes(setup),
        *state_of_rest_notes(simulator, at),
        *step_error_notes(case, simulator, at, simulated),
        *voltage_notes(case, comparison.time, simulated.get("vt")),
    )
    return ComparedTest(recording, setup, values, replace(comparison, notes=notes))


def _validated_by_hand(
    case: Case,
    fitted: Sequence[Comparison],
    values: Values,
    record: Record | Path | str,
    given: GivenSteps,
    program: Program | None,
) -> tuple[Case, ComparedTest]:
    """Compare values with a record that the case does not name, judged by ``fitted`` ones.

    The case has that record where it was given as samples. Its columns are those of the first
    record under validate, or else of the first fitted one; windows and masks are those of its own.
    Raises ExfitError where the record or the steps given cannot be used.
    """
    recordings = (*case.validations, *case.recordings)
    if not recordings:
        text = "record: missing; its columns are needed to read a record"
        raise CaseError(f"{case.path}: {text}")
    file = record.source if isinstance(record, Record) else Path(record)
    update = {"file": str(file.absolute()), "window": None, "mask": ()}
    section = recordings[0].record.model_copy(update=update)
    taken = {folded(match.name) for match in fitted}
    name = file.name if folded(file.stem) in taken else file.stem
    recording = recordings[0].model_copy(update={"name": name, "record": section})
    if isinstance(record, Record):
        case = replace(case, given_records={**case.given_records, name: record})
    test = with_steps_of_record(case, recording, values, given)
    compared = _validated(case, fitted, recording, by_program(program, test.setup, values), values)
    setup, own, comparison = compared.setup, compared.values, compared.comparison
    # the values whose instants are fitted within what the record allows
    best = fitted_to_record(case, setup, own) if instants_of(setup) else own
    comparison = replace(
        comparison,
        steps=tuple(_steps(setup, comparison, own, best, given)),
        notes=(*_notes(test, setup, comparison, fitted, best), *comparison.notes),
    )
    return case, compared._replace(comparison=comparison)


def _steps(
    setup: ExperimentSetup, comparison: Comparison, values: Values, best: Values, given: GivenSteps
) -> Iterator[ValidatedStep]:
    """Yield the steps that the record holds, as they were found at last or given."""
    simulator, moved = (setup.experiment.with_inputs(each) for each in (values, best))
    least = None
    if instants_of(setup):
        least = compare_with_record(setup, best).rmse
    found = (*(() if given.instants else ("instant",)), *(() if given.sizes else ("size",)))
    for step, other in zip(simulator.inputs.steps, moved.inputs.steps, strict=True):
        at = step.at + simulator.delay
        if at >= setup.record.time[0]:
            best_at = None if least is None else other.at + moved.delay
            yield ValidatedStep(step.signal, at, step.step, found, comparison.rmse, best_at, least)


def _notes(
    test: SetupOfRecord,
    setup: ExperimentSetup,
    comparison: Comparison,
    fitted: Sequence[Comparison],
    best: Values,
) -> Iterator[str]:
    """Yield notes on a record that was given by hand.

    ``setup`` has the bounds within which the record allows its instants, ``best`` those at which it
    is matched best.
    """
    record, steady = test.setup.record, test.setup.test.steady
    for match in fitted:
        if match.sha256 == comparison.sha256:
            yield (
                f"{comparison.record} was fitted ({match.name}): it is no independent validation"
            )
    for channel in test.setup.channels:  # spikes count as errors of the model
        kept = channel.kept & np.isfinite(channel.measured)
        samples = channel.measured[kept]
        count = len(spikes(record.time[kept], samples, noise_of(samples), SPIKE_LIMIT))
        if count:
            yield (
                f"{channel.signal} of {record.source.name} has {count} samples that look like "
                f"spikes: `outliers: {SPIKE_LIMIT:g}` on the channel leaves them out"
            )
    yield from test.notes
    if not test.notes and steady is not None:
        causes = unsteady_signals(record, steady, test.setup.channels)
        yield from (cause.sentence for cause in causes)
    for parameter in setup.free:
        side = parameter.bound(best[parameter.name])
        if side is not None and parameter.name.endswith(".at"):
            way, late = EARLIER_OR_LATER[side]
            yield (
                f"a step {way} than the recorded one would match better than that at "
                f"{parameter.start:.4g} s: the response is too {late}"
            )


OF_CASE, GIVEN = "values of the case, which has no free parameter", "given values"
AS_FOUND = "the model as found, before any fit"


def validation_result(
    validation: Validation,
    sources: Mapping[str, str],
    program: Program | None,
) -> ValidationResult:
    """Return a validation with all that a report shows of it.

    ``sources`` says where those values come from that were given beside the case.
    """
    case, values, tests, other_program = validation
    own = [(test.setup, test.values) for test in tests]
    setups, found = [setup for setup, _ in own], None
    if case.as_found is not None:
        found = as_found_of(case, own, validation.comparisons, program)
    hashes, names = inputs_of(case, setups)
    return ValidationResult(
        case=case.path,
        about=case.about,
        model=case.subject,
        saturation=case.saturation,
        origin=GIVEN if validation.fitted else AS_FOUND if case.free() else OF_CASE,
        values={name: values[name] for name in case.values()},
        sources=_sources(validation, sources),
        ties={name: tie.text for name, tie in case.ties.by_name.items()},
        matches=tuple(validation.comparisons),
        versions=versions(),
        inputs=hashes,
        parts=tuple(parts_of(case)),
        tests=tuple(_described(validation, setups)),
        behaviour=None if case.has_no_equations else behaviour_of(own),
        files=names,
        case_text=text_of(case),
        as_found=found,
        criteria=case.criteria,
        other_program=other_program,
    )


def _sources(validation: Validation, sources: Mapping[str, str]) -> dict[str, str]:
    """Name the source of every value: of those that differ from the case, the one who gave it."""
    case, values = validation.case, validation.values
    of_case, free = case.values(), case.free() if validation.fitted else ()
    changed = [name for name in of_case if name not in free and values[name] != of_case[name]]
    given = {name: word for name, word in sources.items() if name in of_case}
    others = [name for name in changed if name not in case.ties.by_name]
    return {**case.sources(fitted=free), **dict.fromkeys(others, NOT_STATED), **given}


def _described(validation: Validation, setups: Sequence[ExperimentSetup]) -> Iterator[RecordedTest]:
    """Yield the tests with their records; of a record by hand the steps that it shows."""
    matches = validation.comparisons
    described = tests_of(validation.case, setups, identified_values({}, matches))
    for match, test in zip(matches, described, strict=True):
        done = "; ".join(step.text for step in match.steps) or test.done
        role = "validation" if match.validation else "fitted"
        yield test._replace(name=match.name, role=role, done=done)
