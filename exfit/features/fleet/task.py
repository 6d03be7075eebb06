"""One case of a batch, from its files to the files of its fit: the same in every worker."""

import hashlib
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from traceback import extract_tb
from typing import TYPE_CHECKING

from exfit.errors import ExfitError
from exfit.features.fleet.folder import KEY_DIGITS, CaseOutcome, Failure
from exfit.features.fleet.programmes import TESTS, run_programme, summary_of_programme
from exfit.features.fleet.summary import summary_of
from exfit.runs import store
from exfit.runs.runner import FitSettings
from exfit.runs.store import digest_of
from exfit.util.files import read_regular

if TYPE_CHECKING:
    from exfit.features.programme.result import ProgrammeResult
    from exfit.results.model import FitResult

# of a result, and of the folder where it will lie
FurtherFiles = Callable[["FitResult | ProgrammeResult", Path], Iterable[tuple[str, str]]]

CODE = ".py"
CHANGED = "changed while the case was fitted: run the batch again"


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
    first = digest_of(files[0]) if case is None else hashlib.sha256(case).hexdigest()
    return _key([first, *map(digest_of, files[1:])], settings)


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
    return CaseOutcome(
        failure=Failure("crashed", f"{type(fault).__name__}: {fault}{place}", seconds)
    )


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
    digests = [hashlib.sha256(data).hexdigest(), *map(digest_of, task.files[1:])]
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


def _key(digests: Sequence[str | None], settings: FitSettings) -> str:
    return store.key_of(digests, **settings._asdict())[:KEY_DIGITS]


def _seconds(began: float) -> float:
    return round(time.process_time() - began, 3)
