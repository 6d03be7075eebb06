"""One case of a batch, from its files to the files of its fit: the same in every worker.

A programme is a case: all tests of a unit in one run, one folder and one row.
"""

import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from traceback import extract_tb
from typing import TYPE_CHECKING

from exfit.errors import ExfitError
from exfit.features.fleet.folder import (
    KEY_DIGITS,
    CaseOutcome,
    CaseSummary,
    Failure,
    SummaryParameter,
    summary_of,
)
from exfit.runs import store
from exfit.runs.runner import FitSettings
from exfit.util.file_names import WHOLE_PROGRAMME
from exfit.util.files import read_regular

if TYPE_CHECKING:
    from exfit.features.programme.result import ProgrammeResult
    from exfit.results.model import FitResult

# of a result, and of the folder where it will lie
FurtherFiles = Callable[["FitResult | ProgrammeResult", Path], Iterable[tuple[str, str]]]

CODE = ".py"
CHANGED = "changed while the case was fitted: run the batch again"
TESTS = "tests"  # the key at the top of a case file that makes it a programme
BASE = ".base"  # how the name of what is no parameter of the unit ends: 1 pu of a channel


@dataclass(frozen=True)
class CaseTask:
    """A case to be fitted, as a worker is given it; it can be pickled.

    ``files`` are the case and those that it names, the case first; ``key`` is the hash of their
    contents and the settings. ``folder`` is where the fit will lie; a worker writes nothing there.
    Cases of one ``group`` share their machine code. ``further`` are functions that make files
    beside those of every fit, such as a report.
    """

    files: tuple[Path, ...]
    key: str
    folder: Path
    settings: FitSettings = field(default_factory=FitSettings)
    group: str = ""
    further: tuple[FurtherFiles, ...] = ()

    def run(self) -> CaseOutcome:
        """Fit the case, in the process of a worker."""
        return run_case(self)


def key_of(files: Sequence[Path], settings: FitSettings, case: bytes | None = None) -> str:
    """Return the key of a case: the hash of its files, the settings and the version of exfit.

    A file that is missing or cannot be read counts as such. ``files`` are the case and those that
    it names, in its order; ``case`` is the content of the first where it has been read already.
    """
    first = store.digest_of(files[0]) if case is None else hashlib.sha256(case).hexdigest()
    return _key([first, *map(store.digest_of, files[1:])], settings)


def _key(digests: Sequence[str | None], settings: FitSettings) -> str:
    return store.key_of(digests, **settings._asdict())[:KEY_DIGITS]


def run_case(task: CaseTask) -> CaseOutcome:
    """Fit a case; nothing that goes wrong is raised but what ends the process.

    The files are those of which the key was made, before the fit and after it: else the outcome
    only says that they have changed.
    """
    began = time.process_time()
    try:
        return _outcome(task, began)
    except ExfitError as fault:
        return CaseOutcome(failure=Failure("failed", str(fault), _seconds(began)))
    except (Exception, SystemExit) as fault:
        return crash(fault, _seconds(began))


def crash(fault: BaseException, seconds: float = 0.0) -> CaseOutcome:
    """Return the outcome of a case in which happened what should not, after processor time in s."""
    frames = extract_tb(fault.__traceback__)
    place = f" ({Path(frames[-1].filename).name}:{frames[-1].lineno})" if frames else ""
    reason = f"{type(fault).__name__}: {fault}{place}"
    return CaseOutcome(failure=Failure("crashed", reason, seconds))


def _outcome(task: CaseTask, began: float) -> CaseOutcome:
    """Fit a case, or run a programme; raises ExfitError where that is not possible.

    What is run is what the key was made of, code that the case names too.
    """
    from exfit import workflows
    from exfit.case.load import parse_case
    from exfit.case.peek import content_of
    from exfit.case.yaml import decoded
    from exfit.results.io import files_of_fit

    path, settings = task.files[0], task.settings
    try:
        data = read_regular(path)
    except OSError:
        return CaseOutcome(changed=CHANGED)
    digests = [hashlib.sha256(data).hexdigest(), *map(store.digest_of, task.files[1:])]
    if _key(digests, settings) != task.key:
        return CaseOutcome(changed=CHANGED)
    text = decoded(data, path)
    result: FitResult | ProgrammeResult
    if TESTS in content_of(text, path):
        result, files = run_programme(path, *settings)
        summary = summary_of_programme(result, task.key, _seconds(began))
    else:
        hashes = zip(task.files, digests, strict=True)
        code = next((digest for file, digest in hashes if file.suffix == CODE), None)
        case = parse_case(text, path, code or "")
        result = workflows.fit(case, settings.strategy, search=settings.search)
        if result.interrupted:
            raise KeyboardInterrupt
        files = dict(files_of_fit(result))
        summary = summary_of(result, task.key, _seconds(began))
    made = dict(entry for further in task.further for entry in further(result, task.folder))
    if key_of(task.files, settings) != task.key:
        return CaseOutcome(changed=CHANGED)
    return CaseOutcome({**made, **files}, summary)


def _seconds(began: float) -> float:
    return round(time.process_time() - began, 3)


def run_programme(
    file: Path, strategy: str | None, search: str | None
) -> "tuple[ProgrammeResult, dict[str, str]]":
    """Run a programme; return its result and its files by name, as `exfit run` writes them.

    Raises ExfitError where one of its tests fails, KeyboardInterrupt where it is interrupted.
    """
    from exfit.features.programme import folder
    from exfit.features.programme.run import run

    with TemporaryDirectory(prefix="exfit-", ignore_cleanup_errors=True) as temporary:
        place = Path(temporary)
        result = run(
            file, place, again=True, keep=folder.write_test, strategy=strategy, search=search
        )
        if result.interrupted:
            raise KeyboardInterrupt
        if result.failed:
            raise ExfitError("\n".join(f"{name}: {why}" for name, why in result.failed.items()))
        folder.write_programme(result, place)
        return result, files_of(place)


def files_of(place: Path) -> dict[str, str]:
    """Read the files of a programme by name, last the one that says that all is done."""
    paths = sorted(path for path in place.rglob("*") if path.is_file())
    paths.sort(key=lambda path: path == place / WHOLE_PROGRAMME)
    return {path.relative_to(place).as_posix(): path.read_text(encoding="utf-8") for path in paths}


def summary_of_programme(result: "ProgrammeResult", key: str, seconds: float) -> CaseSummary:
    """Summarise a programme as a row: its fit of the bump tests, with what all tests gave.

    Verdict and reason are those of the first test that is not matched, or of the last one.
    """
    from exfit.results.facts import UNIT, stated

    weakest = next((test for test in result.tests if not test.holds), result.tests[-1])
    if result.fit is not None:
        row = summary_of(result.fit, key, seconds)
    else:
        models = {part.kind: part.name for part in result.unit.parts}
        row = CaseSummary(
            result.name,
            result.path.as_posix(),
            key,
            "done",
            unit=stated({key: str(fact) for key, fact in result.about.items()}, UNIT) or "",
            model=models.get("exciter", ""),
            machine_model=models.get("machine", ""),
            seconds=seconds,
            about=dict(result.about),
        )
    measured = {
        value.name: SummaryParameter(
            value.value, *value.interval, value.source, value.unit, True, value.min, value.max
        )
        for value in result.values
        if value.entered and not value.name.endswith(BASE)
    }
    return replace(
        row,
        verdict=weakest.verdict,
        reason=f"{weakest.name}: {weakest.reason}",
        holds=result.holds,
        parameters={**row.parameters, **measured},
        notes=(*row.notes, *result.warnings),
    )
