"""The kept result of each test of a programme, under a hash of all that goes into it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError
from exfit.features.programme.case.programme import Programme, ProgrammeStep
from exfit.features.programme.result import EnteredValue, FinishedTest, ProgrammeResult, StepResult
from exfit.features.programme.steady.consistency import contradictions_at_rest
from exfit.features.programme.steady.saturation_result import SaturationResult
from exfit.features.programme.steady.v_curve_result import VCurve
from exfit.results.description import UnitDescription
from exfit.results.io import load_result, result_text
from exfit.results.model import FitResult
from exfit.runs import store
from exfit.runs.runner import AS_CASES_SAY, FitSettings
from exfit.runs.store import digest_of
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME
from exfit.util.files import read_json, write
from exfit.util.text import show_value, to_json
from exfit.util.typed import plain
from exfit.util.typed_reading import FormError, read

KEY = "test"  # the label of the key among the inputs of a fit
VERSION = 1  # of the file of a test that is no fit
RESULTS: Mapping[str, type[SaturationResult] | type[VCurve]] = {
    "saturation": SaturationResult,
    "steady": VCurve,
}


@dataclass(frozen=True)
class KeptTest:
    """A test as programme.json names it: its folder, its kind, its tests, the key of its result."""

    name: str
    kind: str
    tests: tuple[str, ...]
    key: str


@dataclass(frozen=True)
class KeptSummary:
    """The content of programme.json but its version; ``programme`` is the file that was run."""

    tests: tuple[KeptTest, ...]
    programme: Path
    about: Mapping[str, float | str]
    values: tuple[EnteredValue, ...]
    failed: Mapping[str, str]
    not_run: tuple[str, ...]
    interrupted: bool
    unit: UnitDescription


Keep = Callable[[FinishedTest, Path], None]


def key_of(
    step: ProgrammeStep,
    programme: Programme,
    values: tuple[EnteredValue, ...],
    settings: FitSettings = AS_CASES_SAY,
) -> str:
    """Return the SHA-256 of all that goes into a test: its section, its files, values, exfit.

    ``values`` are those that the tests before gave.
    """
    entered = {
        value.name: [value.value, value.std_error, value.source]
        for value in values
        if value.entered
    }
    files = [digest_of(path) for path in programme.files_of(step.name)]
    given = {name: value for name, value in settings._asdict().items() if value is not None}
    content = programme.content_of(step.name)
    return store.key_of(files, content=content, values=entered, **given)


def result_kept(step: ProgrammeStep, key: str, folder: Path) -> StepResult | None:
    """Return the result of an earlier run of a test with the same key; None where there is none."""
    file = folder / step.name / WHOLE_FIT
    if step.kind in RESULTS:
        labels = {"version": VERSION, "key": key}
        result = store.read_kept(file, RESULTS[step.kind], under="result", **labels)
        return None if result is None or any(contradictions_at_rest(result)) else result
    try:
        fit = load_result(file)
    except ExfitError:
        return None  # there is none, or it is not ours
    return fit if fit.inputs.get(KEY) == key else None


def text_of(test: FinishedTest) -> str:
    """Return the text of the result.json of a test."""
    if isinstance(test.result, FitResult):
        return result_text(test.result)
    content: dict[str, Any] = {"version": VERSION, "kind": test.kind, "key": test.key}
    return to_json({**content, "result": plain(test.result, whole=True)})


def keep(test: FinishedTest, folder: Path) -> None:
    """Write the result of a test, and nothing else of it, into the folder of its programme."""
    write(folder / test.name / WHOLE_FIT, text_of(test))


def summary_text(result: ProgrammeResult) -> str:
    """Return the text of programme.json: all of a programme but the results of its tests."""
    tests = tuple(KeptTest(test.name, test.kind, test.tests, test.key) for test in result.tests)
    summary = KeptSummary(
        tests=tests,
        programme=result.path,
        about=result.about,
        values=result.values,
        failed=result.failed,
        not_run=result.not_run,
        interrupted=result.interrupted,
        unit=result.unit,
    )
    return store.text_of(summary, version=VERSION)


def load_summary(folder: Path) -> ProgrammeResult:
    """Return the result of a programme, given its folder: of its summary and of each test.

    Raises ExfitError where it cannot be read, or has changed since.
    """
    source = folder / WHOLE_PROGRAMME
    content = read_json(source)
    try:
        if content.get("version") != VERSION:
            raise FormError(f"version: {show_value(content.get('version'))} is not {VERSION}")
        summary: KeptSummary = read(KeptSummary, content)
        for at, test in enumerate(summary.tests):
            if Path(test.name).name != test.name:
                raise FormError(f"tests[{at}].name: {show_value(test.name)} is not that of a test")
    except FormError as fault:
        raise ExfitError(f"{source}: not the result of a programme: {fault}; run again") from None
    tests = []
    for test in summary.tests:
        step = ProgrammeStep(test.name, test.kind, test.tests)
        result = result_kept(step, test.key, folder)
        if result is None:
            raise ExfitError(f"{folder / step.name}: not the result of this programme; run again")
        tests.append(FinishedTest(step.name, step.kind, step.tests, test.key, result, kept=True))
    return ProgrammeResult(
        summary.programme,
        summary.about,
        tests=tuple(tests),
        values=summary.values,
        failed=summary.failed,
        not_run=summary.not_run,
        interrupted=summary.interrupted,
        unit=summary.unit,
    )
