"""The folder of a batch: a folder for each fit, an index of the cases, and both read as a fleet.

    <key>/result.json   a fit with its tables: there, and whole, once it is done; of a programme
                        programme.json, with a folder for each of its tests
    <key>/summary.json  its row of the table, made again where it is missing
    <key>/failed.json   in place of both: why there is no fit
    index/<hash>.json   for each case its path, and its key or the reason why it has none

Parts of a batch, and batches one after the other, need no coordination but this.
"""

import hashlib
import os
import re
from collections import Counter
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from exfit.errors import ExfitError
from exfit.features.fleet.summary import CaseFacts, CaseStatus, CaseSummary, FailureKind, summary_of
from exfit.runs.runner import distinct_names
from exfit.runs.store import read_kept, text_of
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME
from exfit.util.files import prepare, write, write_quickly, write_together
from exfit.util.typed import plain

INDEX, CASES = "index", "cases"
SUMMARY, FAILED = "summary.json", "failed.json"
OUTCOMES = (WHOLE_FIT, WHOLE_PROGRAMME, FAILED)
FIT_OF_PROGRAMME = "fit"
VERSION = 1  # of a summary; one of another version is made again
KEY_DIGITS = 32  # hexadecimal, of the SHA-256 of all that goes into a fit
KEY = re.compile(rf"[0-9a-f]{{{KEY_DIGITS}}}")


@dataclass(frozen=True)
class IndexEntry:
    """A case of a batch: its path, and its key or, in ``status`` and ``reason``, why it has none.

    The path is relative to the folder of the batch where there is a way.
    """

    case: str
    key: str = ""
    status: CaseStatus = "not run"
    reason: str = ""
    facts: CaseFacts = field(default_factory=CaseFacts)

    @property
    def file(self) -> str:
        """The name of its file in the index."""
        return f"{hashlib.sha256(self.case.encode()).hexdigest()[:KEY_DIGITS]}.json"


@dataclass(frozen=True)
class Failure:
    """The reason why a case has no fit, and the processor time that was spent, s."""

    kind: FailureKind
    reason: str
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class CaseOutcome:
    """The outcome of a case: the files of its fit by name with their summary, or a failure.

    The last file is that by which the fit, or the programme, is known to be done.
    Neither: the case, or a file of it, was changed meanwhile, in the way that ``changed`` says.
    """

    files: Mapping[str, str] = field(default_factory=dict)
    summary: CaseSummary | None = None
    failure: Failure | None = None
    changed: str = ""


@dataclass(frozen=True, eq=False)
class Fleet:
    """All cases of a batch's folder, in the order of their names.

    After a run ``run`` holds the paths of its cases, as the rows have them; it was ``interrupted``
    by Ctrl-C, which may have left some of them out.
    """

    folder: Path
    cases: tuple[CaseSummary, ...]
    run: frozenset[str] = frozenset()
    interrupted: bool = False

    @property
    def of_run(self) -> tuple[CaseSummary, ...]:
        """The cases of the run; all of them where it is not known."""
        return tuple(case for case in self.cases if not self.run or case.case in self.run)

    @property
    def counts(self) -> dict[CaseStatus, int]:
        """Number of cases of each status."""
        return dict(Counter(case.status for case in self.cases))

    def path_of(self, case: CaseSummary) -> Path:
        """Return the path of the file of a case."""
        return case_path(self.folder, case.case)

    def folder_of(self, case: CaseSummary) -> Path | None:
        """Return the folder of the fit, or the programme, of a case; None where there is none."""
        return self.folder / case.key if case.status == "done" else None

    def fit_of(self, case: CaseSummary) -> Path | None:
        """Find the folder of the fit of a case, that of its bump tests in a programme; or None."""
        place = self.folder_of(case)
        if place is None or not (place / WHOLE_PROGRAMME).is_file():
            return place
        return place / FIT_OF_PROGRAMME if (place / FIT_OF_PROGRAMME).is_dir() else None

    def to_dict(self) -> dict[str, Any]:
        """Return all but the curves as plain data, as ``exfit batch --json`` prints it."""
        return {
            "folder": str(self.folder),
            "counts": dict(self.counts),
            "cases": [plain(case) for case in self.cases],
            "interrupted": self.interrupted,
        }


def case_name(folder: Path, case: Path) -> str:
    """Return the path of a case as the index has it."""
    path = case.parent.resolve() / case.name
    try:
        return Path(os.path.relpath(path, folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.as_posix()


def case_path(folder: Path, case: str) -> Path:
    """Return the path of a case that the index has."""
    return Path(os.path.normpath(folder.absolute() / case))


def is_done(folder: Path, key: str) -> bool:
    """Look for the fit of a key, whole."""
    return any((folder / key / name).is_file() for name in (WHOLE_FIT, WHOLE_PROGRAMME))


def failure_of(folder: Path, key: str) -> Failure | None:
    """Read the failure of a key; None where its fit did not fail, or was not run."""
    return read_kept(folder / key / FAILED, Failure)


def write_outcome(folder: Path, key: str, outcome: CaseOutcome) -> None:
    """Write the outcome of a case under its key; raises ExfitError where that is not possible."""
    if outcome.summary is not None:
        summary = text_of(outcome.summary, version=VERSION)
        *others, result = outcome.files.items()
        write_together(folder / key, dict([*others, (SUMMARY, summary), result]), [FAILED])
    elif outcome.failure is not None:
        write(folder / key / FAILED, text_of(outcome.failure))


def prepare_folder(folder: Path) -> None:
    """Make the folder of a batch; raises ExfitError where it cannot be written."""
    prepare(folder / INDEX)


def write_entry(folder: Path, entry: IndexEntry) -> None:
    """Write an entry of the index; raises ExfitError where that is not possible."""
    text = text_of(entry)
    with suppress(OSError):
        if (folder / INDEX / entry.file).read_bytes() == text.encode():
            return
    write_quickly(folder / INDEX / entry.file, text)


def has_entry(folder: Path, case: str) -> bool:
    """Look for the entry of a case in the index."""
    return (folder / INDEX / IndexEntry(case).file).is_file()


def entries_of(folder: Path) -> dict[str, IndexEntry]:
    """Return the index by the paths of the cases; a damaged entry is missing until its next run.

    So is one whose key is no name of a folder here, but perhaps a way out of it.
    """
    entries = (read_kept(file, IndexEntry) for file in sorted((folder / INDEX).glob("*.json")))
    return {
        entry.case: entry
        for entry in entries
        if entry is not None and (not entry.key or KEY.fullmatch(entry.key))
    }


def read_fleet(folder: str | os.PathLike[str]) -> Fleet:
    """Return all cases of a folder that ``exfit batch`` writes, as they are now.

    Raises ExfitError where it is no such folder.

    Example:
        >>> fleet = exfit.read_fleet("fleet")
        >>> [case.name for case in fleet.cases if not case.holds]
    """
    place = Path(folder)
    if not (place / INDEX).is_dir():
        raise ExfitError(f"{place}: not the folder of a batch: {INDEX} is missing")
    entries = [*entries_of(place).values()]
    names = distinct_names([case_path(place, entry.case) for entry in entries])
    rows = [
        replace(_row(place, entry), name=name, case=entry.case)
        for name, entry in zip(names, entries, strict=True)
    ]
    return Fleet(place, tuple(sorted(rows, key=lambda row: (row.name.casefold(), row.name))))


def state_of(folder: Path) -> frozenset[tuple[str, int, int]]:
    """Stamp all files of a folder that change when a case is added or comes to an end."""
    stamps = set[tuple[str, int, int]]()
    for pattern in (f"{INDEX}/*.json", *(f"*/{each}" for each in OUTCOMES)):
        for file in folder.glob(pattern):
            with suppress(OSError):  # replaced or removed meanwhile
                status = file.stat()
                stamps.add((str(file), status.st_mtime_ns, status.st_size))
    return frozenset(stamps)


def row_of(entry: IndexEntry, failure: Failure | None = None) -> CaseSummary:
    """Return the row of a case without a fit: for the reason of its failure, or of its entry."""
    row = CaseSummary(
        name=Path(entry.case).stem,
        case=entry.case,
        key=entry.key,
        status=entry.status,
        reason=entry.reason,
        **entry.facts._asdict(),
    )
    if failure is None:
        return row
    return replace(row, status=failure.kind, reason=failure.reason, seconds=failure.seconds)


def _row(folder: Path, entry: IndexEntry) -> CaseSummary:
    """Return the row of a case: its summary where it is done, made again where that is missing."""
    if not entry.key or not is_done(folder, entry.key):
        return row_of(entry, failure_of(folder, entry.key) if entry.key else None)
    place = folder / entry.key
    summary = read_kept(place / SUMMARY, CaseSummary, version=VERSION)
    if summary is not None:
        return summary
    try:
        if (place / WHOLE_PROGRAMME).is_file():
            from exfit.features.fleet.task import summary_of_programme
            from exfit.features.programme.folder import load_summary

            programme = load_summary(place)
            seconds = sum(getattr(each, "seconds", 0.0) for each in programme.results.values())
            return summary_of_programme(programme, entry.key, seconds)
        from exfit.results.io import load_result

        result = load_result(place)
        return summary_of(result, entry.key, result.seconds)
    except ExfitError as fault:
        return replace(row_of(entry), status="failed", reason=str(fault))
