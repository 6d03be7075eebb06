"""Programmes run: each test with the results of those before it; or checked before."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from os import PathLike
from pathlib import Path

from exfit import estimate, workflows
from exfit.case.case import Case
from exfit.errors import CaseError, ExfitError
from exfit.features.programme.folder import RESULTS, Keep, keep, key_of, result_kept
from exfit.features.programme.programme import Programme, load_programme, steps_of
from exfit.features.programme.programme_schema import (
    BUMP,
    GovernorTest,
    SaturationTest,
    SteadyTest,
    TestOfProgramme,
)
from exfit.features.programme.result import (
    EnteredValue,
    FinishedTest,
    GovernorCurve,
    ProgrammeResult,
    ProgrammeStep,
    SaturationResult,
    VCurve,
)
from exfit.features.programme.tests_at_rest import governor, points_of, saturation, steady
from exfit.fitting.recordings import record_of
from exfit.plants import GOVERNOR, MACHINE
from exfit.records.reading import file_hash
from exfit.records.units import alike
from exfit.results.description import UnitDescription
from exfit.results.model import OF_PROGRAMME, FitResult, FittedParameter, Iteration
from exfit.runs.runner import AS_CASES_SAY, FitSettings, run_in_turn
from exfit.util.vocabulary import FITTED, LEAST_CERTAIN_FIRST, NOT_STATED
from exfit.workflows.case_description import parts_of
from exfit.workflows.given_values import with_given_values
from exfit.workflows.model_check import Check

Progress = Iteration | estimate.Progress
Values = tuple[EnteredValue, ...]
Watch = Callable[[ProgrammeStep, Progress | None], None]

MEASURED = "measured"
BASE = ".base"  # how the name of a base ends, behind its signal


def run(
    programme: Programme | str | PathLike[str],
    folder: str | PathLike[str] | None = None,
    again: bool = False,
    progress: Watch = lambda *_: None,
    finished: Callable[[FinishedTest], None] = lambda _: None,
    keep: Keep = keep,
    strategy: str | None = None,
    search: str | None = None,
) -> ProgrammeResult:
    """Run the tests of a programme in the order in which one feeds the next.

    Saturation tests come first, then points on load, then tests that determine data of the
    machine; their results are passed on to the later tests. Last, all bump tests are fitted
    together. A case is a programme of one test.

    Args:
        programme: a programme, or the path of its file.
        folder: keeps the result of each test as soon as it exists. A finished test is run again
            only if its section, its files, the values passed on to it or exfit have changed. None:
            nothing is kept.
        again: runs all tests again, also those whose result is kept.
        progress: called with the test that runs and its iteration, or how far its search from
            further starts is; None as it begins.
        finished: called with every test that has ended.
        keep: writes the result of a test into the folder.
        strategy: of each local optimisation; None: that of the programme.
        search: "global" or "local"; None: that of the programme.

    A KeyboardInterrupt ends the run: the result has the finished tests, and the best point of the
    fit that was running, which is not kept as finished. If a test fails the others are run. Raises
    CaseError with all faults of the file, and of its records.

    Example:
        >>> result = exfit.run("programme.yaml", "runs/unit-3")
        >>> {test.name: test.verdict for test in result.tests}
    """
    if not isinstance(programme, Programme):
        programme = load_programme(Path(programme))
    refuse_unreadable(programme)
    values = list[EnteredValue]()
    place = None if folder is None else Path(folder)
    kept, settings = None if again else place, FitSettings(strategy, search)

    def finished_step(step: ProgrammeStep) -> FinishedTest:
        test = finished_test(programme, step, tuple(values), kept, progress, settings)
        if place is not None:
            keep(test, place)
        values.extend(values_given(test, programme))
        return test

    ran = run_in_turn(steps_of(programme), finished_step, finished)
    case = programme.shared_case()
    with suppress(CaseError):  # a fit with these values has failed, which says why
        case = with_values(case, tuple(values))
    return ProgrammeResult(
        path=programme.path,
        about=programme.about,
        tests=ran.runs,
        values=tuple(values),
        failed=ran.failed,
        not_run=ran.not_run,
        interrupted=ran.interrupted,
        unit=UnitDescription(tuple(parts_of(case)), case.values(), case.sources()),
    )


def refuse_unreadable(programme: Programme) -> None:
    """Raise CaseError with what hinders the files of a programme from being read."""
    readings: list[Callable[[], object]] = []
    for step in steps_of(programme):
        section = programme.test(step.name)
        if isinstance(section, SaturationTest | SteadyTest | GovernorTest):
            readings.append(partial(points_of, section, programme.folder))
        else:
            case = programme.case_of(step.name)
            records = (*case.recordings, *case.validations)
            readings += [partial(record_of, case, recording) for recording in records]
    faults: list[str] = []
    for reading in readings:
        try:
            reading()
        except ExfitError as fault:
            faults += str(fault).splitlines()
    if faults:
        raise CaseError(dict.fromkeys(faults))


def finished_test(
    programme: Programme,
    step: ProgrammeStep,
    values: Values,
    folder: Path | None,
    progress: Watch = lambda *_: None,
    settings: FitSettings = AS_CASES_SAY,
) -> FinishedTest:
    """Return a test with its result: the one that is kept in a folder, or else that of a run."""
    programme = programme.with_bases(bases_of(values))
    key = key_of(step, programme, values, settings)
    result = None if folder is None else result_kept(step, key, folder)
    kept = result is not None
    if result is None:
        progress(step, None)
        result = _at_rest(programme, programme.test(step.name), values)
        if result is None:
            case, watch = with_values(programme.case_of(step.name), values), partial(progress, step)
            strategy, search = settings
            result = workflows.fit(case, strategy, watch, watch, search=search)
        if isinstance(result, FitResult) and not result.interrupted:
            inputs = {**result.inputs, OF_PROGRAMME: key}
            files = {**result.files, OF_PROGRAMME: "all its inputs"}
            result = replace(result, inputs=inputs, files=files)
    elif isinstance(result, FitResult):  # with what the file says now beside its tests
        inputs = dict(result.inputs)
        with suppress(OSError):
            inputs["case"] = file_hash(programme.path)
        result = replace(result, about=programme.about, case_text=programme.text, inputs=inputs)
    return FinishedTest(**vars(step), key=key, result=result, kept=kept)


def _at_rest(
    programme: Programme, section: TestOfProgramme | None, values: Values
) -> SaturationResult | VCurve | GovernorCurve | None:
    """Return the result of a test of points, None of another one."""
    shared = programme.shared_case()
    machine, model = shared.parts.machine, shared.parts.governor
    if isinstance(section, SaturationTest):
        return saturation(section, points_of(section, programme.folder), machine)
    if isinstance(section, SteadyTest) and machine is not None:
        case = with_values(shared, values)
        own, errors = case.values(), {**case.std_errors()}
        errors |= {
            value.name: value.std_error
            for value in values
            if value.name.endswith(BASE) and value.entered
        }
        data = {row.symbol: own[MACHINE + row.symbol] for row in machine.sheet}
        std_errors = {name.removeprefix(MACHINE): error for name, error in errors.items()}
        return steady(section, points_of(section, programme.folder), machine, data, std_errors)
    if isinstance(section, GovernorTest) and model is not None:
        own = with_values(shared, values).values()
        data = {row.symbol: own[GOVERNOR + row.symbol] for row in model.sheet}
        return governor(section, points_of(section, programme.folder), model, data)
    return None


def with_values(case: Case, values: Values) -> Case:
    """Return a case with what the tests before it gave, and how uncertain that is.

    A free parameter starts from it.

    Raises CaseError where a value contradicts others, or lies outside the bounds of a free one.
    """
    own = case.values()
    last = {value.name: value for value in values if value.entered and value.name in own}
    if not last:
        return case
    sources = {name: value.source for name, value in last.items()}
    numbers = {name: value.value for name, value in last.items()}
    changed = with_given_values(case, numbers, "the tests before", sources)
    by_test = {
        name: given._replace(source=f"test {last[name].test}") if name in last else given
        for name, given in changed.given_values.items()
    }
    std_errors = {name: value.std_error for name, value in last.items()}
    return replace(changed, given_values=by_test, given_std_errors=std_errors)


def bases_of(values: Values) -> dict[str, tuple[float, str]]:
    """Collect the bases that tests gave, by signal: 1 pu, and its unit."""
    return {
        value.name.removesuffix(BASE): (value.value, value.unit)
        for value in values
        if value.name.endswith(BASE)
    }


def values_given(test: FinishedTest, programme: Programme) -> Iterator[EnteredValue]:
    """Yield the values of a finished test for those after it, each beside that of the file.

    Only what the test limits on both sides counts, and only where its points or record are matched.

    A value of the file stays where its source is more certain than a test: a fitted value replaces
    one that is typical or has no source stated, a measured one also one that was fitted; what was
    measured before, unless by an earlier test of the programme itself, what a test report says, the
    maker's and the nameplate's remain. Of equal certainty the test of the programme counts.
    """
    if not test.holds:
        return
    case = programme.shared_case()
    own, sources, stated = case.values(), case.sources(), {*case.values()} - {*case.typical()}
    for value in _measured(test):
        low, high = value.interval
        if value.name.endswith(BASE):
            # beside the first base of the file that contradicts it
            signal = value.name.removesuffix(BASE)
            bases = [
                channel.base
                for section in programme.columns()
                if (channel := section.get(signal)) is not None
                and isinstance(getattr(channel, "base", None), float)
                and channel.unit is not None
                and alike(channel.unit, value.unit)
            ]
            outside = [base for base in bases if not low <= base <= high]
            given = next(iter((*outside, *bases)), None)
            source, entered = NOT_STATED if bases else "", not bases
        elif value.name in own:
            given = own[value.name] if value.name in stated else None
            source, certainty = sources[value.name], LEAST_CERTAIN_FIRST.index
            entered = certainty(source) <= certainty(value.source)
        else:
            continue
        excluded = given is not None and not low <= given <= high
        yield replace(value, given=given, given_source=source, entered=entered, excluded=excluded)


def _measured(test: FinishedTest) -> Iterator[EnteredValue]:
    result = test.result
    if isinstance(result, SaturationResult):
        values = [(MACHINE + symbol, v, "") for symbol, v in result.machine_values.items()]
        values += [(signal + BASE, v, unit) for signal, (v, unit) in result.channel_bases.items()]
        for name, value, unit in values:
            low, high = value.interval
            if low is not None and high is not None:
                yield EnteredValue(name, value.value, (low, high), MEASURED, test.name, unit)
    elif isinstance(result, VCurve | GovernorCurve):
        prefix = MACHINE if isinstance(result, VCurve) else GOVERNOR
        for symbol, parameter in result.parameters.items():
            name = symbol if parameter.of_record else prefix + symbol
            yield from _fitted(name, parameter, MEASURED, test.name)
    elif test.kind != BUMP:
        for name, parameter in result.parameters.items():
            if name.startswith(MACHINE):
                yield from _fitted(name, parameter, FITTED, test.name)


def _fitted(
    name: str, parameter: FittedParameter, source: str, test: str
) -> Iterator[EnteredValue]:
    low, high = parameter.interval or (None, None)
    if low is not None and high is not None:
        value = EnteredValue(name, parameter.value, (low, high), source, test, parameter.unit)
        yield replace(value, min=parameter.min, max=parameter.max)


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
    values: Values = ()
    for step in steps_of(programme):
        try:
            if step.kind in RESULTS:
                test = finished_test(programme, step, values, None)
                values = (*values, *values_given(test, programme))
                yield CheckedStep(step, test)
            else:
                case = programme.with_bases(bases_of(values)).case_of(step.name)
                yield CheckedStep(step, workflows.check(with_values(case, values)))
        except ExfitError as fault:
            yield CheckedStep(step, None, str(fault))
