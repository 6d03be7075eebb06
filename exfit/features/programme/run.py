"""Programmes run: each test in its turn, with what those before it measured; or checked before."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path

from exfit import estimate, workflows
from exfit.case.case import Case
from exfit.errors import CaseError, ExfitError
from exfit.features.programme.case.programme import (
    FIT,
    Programme,
    ProgrammeStep,
    load_programme,
    steps_of,
)
from exfit.features.programme.case.schema_at_rest import SaturationTest, SteadyTest
from exfit.features.programme.kept import KEY, RESULTS, Keep, keep, key_of, result_kept
from exfit.features.programme.result import EnteredValue, FinishedTest, ProgrammeResult, StepResult
from exfit.features.programme.steady.tests_at_rest import points_of, saturation, steady
from exfit.features.programme.values import bases_of, errors_of_bases, values_given, with_values
from exfit.fitting.recordings import record_of
from exfit.plants import MACHINE
from exfit.records.reading import file_hash
from exfit.results.description import UnitDescription
from exfit.results.model import FitResult, Iteration
from exfit.runs.runner import AS_CASES_SAY, FitSettings, run_in_turn
from exfit.workflows.case_description import parts_of
from exfit.workflows.model_check import Check

Progress = Iteration | estimate.Progress
Values = tuple[EnteredValue, ...]


def run(
    programme: Programme | str | PathLike[str],
    folder: str | PathLike[str] | None = None,
    again: bool = False,
    progress: Callable[[ProgrammeStep, Progress | None], None] = lambda *_: None,
    finished: Callable[[FinishedTest], None] = lambda _: None,
    keep: Keep = keep,
    strategy: str | None = None,
    search: str | None = None,
) -> ProgrammeResult:
    """Run the tests of a programme in the order in which one feeds the next.

    Saturation tests come first, then points on load, then tests that determine data of the
    machine; what they measured enters the tests after them. Last all bump tests are fitted
    together. A case is the programme of one test.

    Args:
        programme: a programme, or the path of its file.
        folder: keeps the result of each test as soon as it is there. A test whose result is there
            already is not run again, unless its section, its files, the values that enter it or
            exfit have changed since. None: nothing is kept.
        again: runs all tests, whatever is kept.
        progress: called with the test that runs and its iteration, or how far its search from
            further starts is; None as it begins.
        finished: called with every test that has ended.
        keep: writes the result of a test into the folder.
        strategy: of the descent of each fit; None: the programme's own.
        search: "global" or "local"; None: the programme's own.

    A KeyboardInterrupt ends the run: the result has the tests that were done, and the best point of
    the fit that was running, which is not kept as done. A test that fails keeps no other from
    running. Raises CaseError with all faults of the file, and of its records.

    Example:
        >>> result = exfit.run("programme.yaml", "runs/unit-3")
        >>> {test.name: test.verdict for test in result.tests}
    """
    if not isinstance(programme, Programme):
        programme = load_programme(Path(programme))
    refuse_unreadable(programme)
    values = list[EnteredValue]()
    place = None if folder is None else Path(folder)

    def finished_step(step: ProgrammeStep) -> FinishedTest:
        kept = None if again else place
        test = finished_test(
            programme, step, tuple(values), kept, progress, FitSettings(strategy, search)
        )
        if place is not None:
            keep(test, place)
        values.extend(values_given(test, programme))
        return test

    ran = run_in_turn(steps_of(programme), finished_step, finished)
    return ProgrammeResult(
        path=programme.path,
        about=programme.about,
        tests=ran.runs,
        values=tuple(values),
        failed=ran.failed,
        not_run=ran.not_run,
        interrupted=ran.interrupted,
        unit=_unit_of(programme, tuple(values)),
    )


def _unit_of(programme: Programme, values: Values) -> UnitDescription:
    """Return the models of a programme, with what its tests gave where the file allows it."""
    case = programme.shared_case()
    with suppress(CaseError):  # a fit with these values has failed, which says why
        case = with_values(case, values)
    return UnitDescription(tuple(parts_of(case)), case.values(), case.sources())


def refuse_unreadable(programme: Programme) -> None:
    """Raise CaseError with what hinders the files of a programme from being read."""
    faults: list[str] = []
    for read in _readings(programme):
        try:
            read()
        except ExfitError as fault:
            faults += str(fault).splitlines()
    if faults:
        raise CaseError(dict.fromkeys(faults))


def _readings(programme: Programme) -> "list[Callable[[], object]]":
    """Plan the reading of each file of a programme."""
    readings: list[Callable[[], object]] = []
    for step in steps_of(programme):
        section = None if step.name == FIT else programme.test(step.name)
        if isinstance(section, SaturationTest | SteadyTest):
            readings.append(partial(points_of, section, programme.folder))
        else:
            case = case_of(programme, step)
            records = (*case.recordings, *case.validations)
            readings += [partial(record_of, case, recording) for recording in records]
    return readings


def case_of(programme: Programme, step: ProgrammeStep) -> Case:
    """Return the case of a fit of a programme, without what other tests measured."""
    return programme.bump_case() if step.name == FIT else programme.rejection_case(step.name)


def finished_test(
    programme: Programme,
    step: ProgrammeStep,
    values: Values,
    folder: Path | None,
    progress: Callable[[ProgrammeStep, Progress | None], None] = lambda *_: None,
    settings: FitSettings = AS_CASES_SAY,
) -> FinishedTest:
    """Return a test with its result: the one that is kept in a folder, or else that of a run."""
    programme = programme.with_bases(bases_of(values))
    key = key_of(step, programme, values, settings)
    kept = None if folder is None else result_kept(step, key, folder)
    if kept is not None:
        result = _as_it_is_now(kept, programme)
        return FinishedTest(step.name, step.kind, step.tests, key, result, kept=True)
    progress(step, None)
    result = _result_of(programme, step, values, partial(progress, step), settings)
    if isinstance(result, FitResult) and not result.interrupted:
        result = replace(
            result,
            inputs={**result.inputs, KEY: key},
            files={**result.files, KEY: "all that goes into it"},
        )
    return FinishedTest(step.name, step.kind, step.tests, key, result)


def _result_of(
    programme: Programme,
    step: ProgrammeStep,
    values: Values,
    progress: Callable[[Progress | None], None],
    settings: FitSettings,
) -> StepResult:
    section = None if step.name == FIT else programme.test(step.name)
    shared = programme.shared_case()
    machine = shared.parts.machine
    if isinstance(section, SaturationTest):
        return saturation(section, points_of(section, programme.folder), machine)
    if isinstance(section, SteadyTest) and machine is not None:
        case = with_values(shared, values)
        own, errors = case.values(), {**case.std_errors(), **errors_of_bases(values)}
        data = {row.symbol: own[MACHINE + row.symbol] for row in machine.sheet}
        std_errors = {name.removeprefix(MACHINE): error for name, error in errors.items()}
        points = points_of(section, programme.folder)
        return steady(section, points, machine, data, std_errors)
    case = with_values(case_of(programme, step), values)
    return workflows.fit(case, settings.strategy, progress, progress, search=settings.search)


def _as_it_is_now(result: StepResult, programme: Programme) -> StepResult:
    """Return a result that is kept, with what the file of the programme says beside its tests."""
    if not isinstance(result, FitResult):
        return result
    inputs = dict(result.inputs)
    with suppress(OSError):
        inputs["case"] = file_hash(programme.path)
    return replace(result, about=programme.about, case_text=programme.text, inputs=inputs)


@dataclass(frozen=True, eq=False)
class CheckedStep:
    """A test at rest with its result, or a fit with its check; ``fault``: why there is neither."""

    step: ProgrammeStep
    outcome: FinishedTest | Check | None
    fault: str = ""

    @property
    def sound(self) -> bool:
        """Whether nothing speaks against the run of the test."""
        if isinstance(self.outcome, Check):
            return self.outcome.agrees and self.outcome.flat
        return self.outcome is not None and self.outcome.holds


def check_programme(programme: Programme) -> Iterator[CheckedStep]:
    """Yield the tests at rest with their results, and each fit with its check.

    A fit is checked with what the tests at rest give it, and without what other fits will.
    Raises CaseError where a file cannot be read.
    """
    refuse_unreadable(programme)
    values: tuple[EnteredValue, ...] = ()
    for step in steps_of(programme):
        try:
            if step.kind in RESULTS:
                test = finished_test(programme, step, values, None)
                values = (*values, *values_given(test, programme))
                yield CheckedStep(step, test)
            else:
                case = case_of(programme.with_bases(bases_of(values)), step)
                yield CheckedStep(step, workflows.check(with_values(case, values)))
        except ExfitError as fault:
            yield CheckedStep(step, None, str(fault))
