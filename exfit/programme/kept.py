"""What a programme keeps of each test: its result, under a hash of all that goes into it."""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from exfit import __version__
from exfit.case.programme import Programme
from exfit.errors import ExfitError
from exfit.programme.result import (
    EnteredValue,
    FinishedTest,
    ProgrammeResult,
    StepResult,
)
from exfit.programme.steps import ProgrammeStep
from exfit.records.reading import file_hash
from exfit.results.description import UnitDescription
from exfit.results.io import WHOLE_FIT, WHOLE_PROGRAMME, load_result, result_text
from exfit.results.model import FitResult
from exfit.results.saturation import SaturationResult
from exfit.results.v_curve import VCurve
from exfit.util.files import write
from exfit.util.text import to_json
from exfit.util.typed import FormError, Reader, plain

KEY = "test"  # the label of the key among the inputs of a fit
VERSION = 1  # of the file of a test that is no fit
RESULTS: Mapping[str, type[SaturationResult] | type[VCurve]] = {
    "saturation": SaturationResult,
    "steady": VCurve,
}

Keep = Callable[[FinishedTest, Path], None]


def key_of(step: ProgrammeStep, programme: Programme, values: tuple[EnteredValue, ...]) -> str:
    """Return the SHA-256 of all that goes into a test: its section, its files, values, exfit.

    ``values`` are those that the tests before gave. Raises ExfitError for a file that is missing.
    """
    entered = {
        value.name: [value.value, value.std_error, value.source]
        for value in values
        if value.entered
    }
    content = {
        "exfit": __version__,
        "content": programme.content_of(step.name),
        "files": [file_hash(path) for path in programme.files_of(step.name)],
        "values": entered,
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def result_kept(step: ProgrammeStep, key: str, folder: Path) -> StepResult | None:
    """Return the result of an earlier run of a test with the same key; None where there is none."""
    file = folder / step.name / WHOLE_FIT
    try:
        if step.kind not in RESULTS:
            fit = load_result(file)
            return fit if fit.inputs.get(KEY) == key else None
        content = json.loads(file.read_bytes())
        if content["key"] != key or content["version"] != VERSION:
            return None
        result: StepResult = Reader().read(RESULTS[step.kind], content["result"])
    except (ExfitError, FormError, OSError, ValueError, LookupError, TypeError):
        return None  # there is none, or it is not ours
    return result


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
    tests = [
        {"name": test.name, "kind": test.kind, "tests": list(test.tests), "key": test.key}
        for test in result.tests
    ]
    others = {
        "programme": str(result.path),
        "about": plain(result.about),
        "values": plain(result.values),
        "failed": plain(result.failed),
        "not_run": list(result.not_run),
        "interrupted": result.interrupted,
        "unit": plain(result.unit, whole=True),
    }
    return to_json({"version": VERSION, "tests": tests, **others})


def load_summary(folder: Path) -> ProgrammeResult:
    """Return the result of a programme, given its folder: of its summary and of each test.

    Raises ExfitError where it cannot be read, or has changed since.
    """
    source = folder / WHOLE_PROGRAMME
    try:
        content = json.loads(source.read_bytes())
        steps = [
            (ProgrammeStep(test["name"], test["kind"], tuple(test["tests"])), test["key"])
            for test in content["tests"]
        ]
        values = Reader().read(tuple[EnteredValue, ...], content["values"])
        unit = Reader().read(UnitDescription, content.get("unit", {}))  # older ones have none
        others = {key: content[key] for key in ("about", "failed", "interrupted")}
        path, not_run = Path(content["programme"]), tuple(content["not_run"])
    except OSError as error:
        raise ExfitError(f"{source}: cannot be read: {error.strerror}") from None
    except (ExfitError, ValueError, LookupError, TypeError) as error:
        raise ExfitError(f"{source}: not the result of a programme: {error}; run again") from None
    tests = []
    for step, key in steps:
        result = result_kept(step, key, folder)
        if result is None:
            raise ExfitError(f"{folder / step.name}: not the result of this programme; run again")
        tests.append(FinishedTest(step.name, step.kind, step.tests, key, result, kept=True))
    return ProgrammeResult(
        path, tests=tuple(tests), values=values, not_run=not_run, unit=unit, **others
    )
