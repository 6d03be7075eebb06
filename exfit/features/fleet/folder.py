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
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from math import inf, nan
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

import numpy as np

from exfit.errors import ExfitError
from exfit.results.facts import UNIT, Facts, stated
from exfit.results.verdict import GOOD, MATCHES
from exfit.runs.runner import distinct_names
from exfit.runs.store import read_kept, text_of
from exfit.util.arrays import Array
from exfit.util.file_names import WHOLE_FIT, WHOLE_PROGRAMME
from exfit.util.files import prepare, within, write, write_quickly, write_together
from exfit.util.text import error_of_interval, rounded_value
from exfit.util.typed import IN_FILE, plain

if TYPE_CHECKING:
    from exfit.results.model import FitResult

CaseStatus = Literal[
    "done", "failed", "timed out", "crashed", "refused", "no record", "not run"
]  # fmt: skip
FailureKind = Literal["failed", "timed out", "crashed"]

INDEX = "index"
SUMMARY, FAILED = "summary.json", "failed.json"
OUTCOMES = (WHOLE_FIT, WHOLE_PROGRAMME, FAILED)
FIT_OF_PROGRAMME = "fit"
VERSION = 2  # of a summary; one of another version is made again
KEY_DIGITS = 32  # hexadecimal, of the SHA-256 of all that goes into a fit
KEY = re.compile(rf"[0-9a-f]{{{KEY_DIGITS}}}")
MOST_POINTS = 120  # of a curve in a summary
CURVE_DIGITS = 6  # significant, of a point of a curve


class CaseFacts(NamedTuple):
    """The unit of a case: its name, its place in a planner's file, its models.

    ``unit`` is what ``about`` has under Unit, else the bus and the machine; "" where neither is
    given. ``bus`` and ``machine_id`` are those of ``as_found``.
    """

    unit: str = ""
    bus: int | None = None
    machine_id: str | None = None
    model: str = ""
    machine_model: str = ""


class SummaryParameter(NamedTuple):
    """A value of the unit, with its 95 % interval where it was fitted.

    A side of the interval without a limit is None; ``source`` says where the value comes from,
    which is an earlier fit where it is "fitted" and the parameter is not ``fitted`` here. ``min``
    and ``max`` are infinite where there is no bound.
    """

    value: Annotated[float, nan]
    low: float | None
    high: float | None
    source: str
    unit: str
    fitted: bool
    min: Annotated[float, -inf] = -inf
    max: Annotated[float, inf] = inf

    def rounded(self, number: float) -> str:
        """Return the value, or an end of its interval, as tables print it: within the bounds."""
        return rounded_value(number, error_of_interval(self.low, self.high), self.min, self.max)


class SummaryValidation(NamedTuple):
    """The outcome of records that were not fitted, "" without any; ``rmse``: the largest, pu."""

    outcome: Literal["accepted", "not accepted", ""] = ""
    rmse: float | None = None


@dataclass(frozen=True, eq=False)
class SummaryCurve:
    """A signal of a fitted record beside its simulation: at most 120 points (M,) each, per unit.

    ``time`` is in s; what is left out of the comparison is nan.
    """

    record: str
    signal: str
    time: Array
    measured: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class CaseSummary:
    """The outcome of a case of a batch.

    ``name`` is that of no other case of the batch, ``case`` the path of its file, relative to the
    folder of the batch where there is a way, and ``key`` the folder of its fit there, "" without
    one. ``reason`` says why it is not done, or is the reason of the verdict, and ``cause`` is the
    first cause of that with its remedy. ``rmse`` (pu) is by signal, the largest over the fitted
    records; ``criteria`` is the result of those that the case gives; ``parameters`` are all of the
    unit's, fitted or not; ``unresolved`` names those fitted that the records do not determine.
    ``seconds`` is processor time; ``about`` are the facts that the case of a fit states of its unit
    and test.
    """

    name: str
    case: str
    key: str
    status: CaseStatus
    reason: str = ""
    unit: str = ""
    bus: int | None = None
    machine_id: str | None = None
    model: str = ""
    machine_model: str = ""
    verdict: str = ""
    holds: bool = False
    rmse: Mapping[str, Annotated[float, nan]] = field(default_factory=dict)
    validation: SummaryValidation = field(default_factory=SummaryValidation)
    criteria: str = ""
    unresolved: tuple[str, ...] = ()
    parameters: Mapping[str, SummaryParameter] = field(default_factory=dict)
    curves: tuple[SummaryCurve, ...] = field(default=(), metadata=IN_FILE)
    seconds: float = 0.0
    notes: tuple[str, ...] = ()
    about: Facts = field(default_factory=dict)
    cause: str = ""

    @property
    def outcome(self) -> str:
        """The outcome in a few words: the verdict, or why there is none."""
        from exfit.results.side_by_side import NOT_ACCEPTED

        if self.status != "done":
            return self.status
        if self.verdict in (GOOD, MATCHES) and not self.holds:
            return NOT_ACCEPTED
        return self.verdict or "no verdict"

    @property
    def fitted(self) -> dict[str, SummaryParameter]:
        """The parameters that the fit of this case determined, or should have."""
        return {name: value for name, value in self.parameters.items() if value.fitted}


def facts_of(content: Mapping[str, Any]) -> CaseFacts:
    """Read the unit from the content of a case file, faulty or not."""
    about, as_found, plant = (
        section if isinstance(section := content.get(key), Mapping) else {}
        for key in ("about", "as_found", "plant")
    )
    bus, machine_id = as_found.get("bus"), as_found.get("id")
    bus = bus if isinstance(bus, int) and not isinstance(bus, bool) else None
    machine_id = None if machine_id is None else str(machine_id)
    model, machine = _text(content.get("model")), _text(plant.get("machine"))
    return CaseFacts(_unit(about, bus, machine_id), bus, machine_id, model, machine)


def _unit(about: Mapping[Any, Any], bus: int | None, machine_id: str | None) -> str:
    """Name the unit as its case does, else by its place in the planner's file."""
    facts = {str(key): _text(fact) for key, fact in about.items()}
    place = [] if bus is None else [f"bus {bus}"]
    place += [] if machine_id is None else [f"machine {machine_id}"]
    return stated(facts, UNIT) or ", ".join(place)


def _text(content: Any) -> str:
    return str(content) if isinstance(content, str | int | float) else ""


def summary_of(result: "FitResult", key: str, seconds: float) -> CaseSummary:
    """Return the summary of a fit that has ended; ``seconds`` of processor time it took.

    Its name and path are those of its case until a batch gives others.
    """
    from exfit.results.criteria import judged_by_criteria
    from exfit.results.side_by_side import explanation_of

    found = result.as_found
    bus, machine_id = (None, None) if found is None else (found.bus, found.machine_id)
    rmse: dict[str, float] = {}  # the largest where several records have a signal
    for comparison in result.comparisons:
        for signal, channel in comparison.channels.items():
            rmse[signal] = max(channel.rmse, rmse.get(signal, channel.rmse))
    validation = SummaryValidation()
    if result.validation:
        accepted = all(match.accepted for match in result.validation)
        largest = max(match.rmse for match in result.validation)
        validation = SummaryValidation(
            "accepted" if accepted else "not accepted", largest if largest < np.inf else None
        )
    return CaseSummary(
        name=result.name,
        case=result.case.as_posix(),
        key=key,
        status="done",
        reason=explanation_of(result),
        unit=_unit(result.about, bus, machine_id),
        bus=bus,
        machine_id=machine_id,
        model=result.model,
        machine_model=result.machine_model or "",
        verdict=result.verdict.verdict,
        holds=result.holds,
        rmse=rmse,
        validation=validation,
        criteria=judged_by_criteria(result).sentence if result.criteria.given else "",
        unresolved=_unresolved(result),
        parameters=_parameters(result),
        curves=tuple(_curves(result)),
        seconds=round(seconds, 3),
        notes=(*result.notes, *(note for match in result.comparisons for note in match.notes)),
        about=dict(result.about),
        cause=next((cause.sentence for cause in result.verdict.causes), ""),
    )


def _unresolved(result: "FitResult") -> tuple[str, ...]:
    """List the parameters that the records do not determine, as the verdict counts them.

    A parameter whose interval was not looked for, as without a global search, or that has none as
    the response misses the records, is none of these.
    """
    from exfit.results.intervals.determination import NEEDS_PROFILE, UNFINISHED

    if result.knowledge is None or result.verdict.misfit:
        return ()
    return tuple(
        name
        for name, parameter in result.parameters.items()
        if not (parameter.of_record or parameter.determined)
        and parameter.why not in (NEEDS_PROFILE, UNFINISHED)
    )


def _parameters(result: "FitResult") -> dict[str, SummaryParameter]:
    units = {
        part.prefix + symbol: row.unit
        for part in result.parts
        for symbol, row in (part.sheet or {}).items()
    }
    of_records, parameters = result.of_records, {}
    for name, value in result.values.items():
        if name in of_records:
            continue
        source, fitted = result.source_of(name), result.parameters.get(name)
        if fitted is None:
            unit = units.get(name, "")
            parameters[name] = SummaryParameter(value, None, None, source, unit, False)
        else:
            low, high = fitted.interval or (None, None)
            parameters[name] = SummaryParameter(
                value, low, high, source, fitted.unit, True, fitted.min, fitted.max
            )
    return parameters


def _curves(result: "FitResult") -> Iterator[SummaryCurve]:
    from exfit.dsp.sampling import kept_rows
    from exfit.results.thinning import rounded

    for comparison in result.comparisons:
        for signal, overlay in comparison.overlays.items():
            drawn = [overlay.measured, overlay.simulated]
            rows = kept_rows(drawn, (MOST_POINTS - 2) // (2 * len(drawn)))
            samples = [rounded(line[rows], CURVE_DIGITS) for line in (comparison.time, *drawn)]
            yield SummaryCurve(comparison.name, signal, *samples)


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
        write_together(within(folder, key), dict([*others, (SUMMARY, summary), result]), [FAILED])
    elif outcome.failure is not None:
        write(within(folder, key) / FAILED, text_of(outcome.failure))


def prepare_folder(folder: Path) -> None:
    """Make the folder of a batch; raises ExfitError where it cannot be written."""
    prepare(within(folder, INDEX))


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
    """Stamp all files of a folder that change when a case is added or ends."""
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
