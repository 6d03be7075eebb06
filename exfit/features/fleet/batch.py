"""Many cases fitted by many workers: what is done is kept in a folder, and not done again."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from math import inf
from os import PathLike
from pathlib import Path
from types import MappingProxyType

from exfit.errors import ExfitError
from exfit.features.fleet.folder import (
    CaseOutcome,
    CaseSummary,
    Fleet,
    IndexEntry,
    case_name,
    failure_of,
    has_entry,
    is_done,
    prepare_folder,
    read_fleet,
    row_of,
    state_of,
    write_entry,
    write_outcome,
)
from exfit.features.fleet.local import Compute, in_this_process, local_workers
from exfit.features.fleet.plan import (
    BatchSettings,
    PlannedCase,
    case_files,
    planned_case,
    share_of,
)
from exfit.features.fleet.task import FurtherFiles
from exfit.runs.runner import FitSettings
from exfit.util.gate import guarded
from exfit.util.interrupts import endings_as_interruptions
from exfit.util.processes import processors
from exfit.util.text import near
from exfit.util.trust import refuse_unknown
from exfit.util.vocabulary import SEARCHES, STRATEGIES

TIME_LIMIT = 3600.0  # s: of a case
MOST_TABLES = 5  # until those are left to another run that goes on in the folder


CaseMaking = Callable[[], str]  # writes a case and returns "", or why it cannot be made


class BatchObserver:
    """Sees a batch go on, and does nothing; all calls come from one thread, in their order.

    Of each case of the run ``kept`` or ``finished`` is called once, unless the run is interrupted.
    Cases are named by their paths as the index has them.
    """

    def begun(self, cases: int, workers: int) -> None:
        """So many cases are to be done by so many workers; 0: by those of a cluster."""

    def kept(self, case: str) -> None:
        """A case is done already, or failed: by an earlier run, or as another of equal content."""

    def started(self, case: str) -> None:
        """A worker begins the fit of a case."""

    def finished(self, summary: CaseSummary) -> None:
        """A case has ended: done, failed, refused, no record ..."""


def batch(
    cases: Iterable[str | PathLike[str]] | str | PathLike[str],
    folder: str | PathLike[str] = "fleet",
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    part: tuple[int, int] = (1, 1),
    retry_failed: bool = False,
    trust: bool = False,
    time_limit: float = TIME_LIMIT,
    strategy: str | None = None,
    search: str | None = None,
    observer: BatchObserver | None = None,
    further: Sequence[FurtherFiles] = (),
    compute: Compute | None = None,
    write_tables: Callable[[Fleet], None] = lambda _: None,
    made: Mapping[Path, CaseMaking] = MappingProxyType({}),
) -> Fleet:
    """Fit many cases in several processes; what the folder has already is not fitted again.

    A case is fitted as by ``exfit.fit``, in a worker process with one thread, and a programme is
    run as by ``exfit.run``. Its result is stored in the folder under a hash of all its inputs: the
    case, its records, the code that it names, these settings and the version of exfit. A case that
    fails, crashes or does not end is a row with its reason, and the others continue.

    Args:
        cases: case files, programmes, and folders with such files in them or below.
        folder: keeps the results; that of an earlier batch is continued.
        workers: worker processes; None: one for each processor; 0: the cases are fitted in this
            process, without a time limit.
        scheduler: the address of that of a Dask cluster, whose workers fit the cases in place of
            processes of this computer; the contents of all files travel to them.
        part: (number, of): only this share of the cases, so that several computers that share the
            folder fit all of them, each once.
        retry_failed: fits again what failed, crashed, or took too long.
        trust: runs the code that cases name; else only what the user has trusted (exfit trust).
        time_limit: of a case, s; inf: none.
        strategy: of the local optimisation of each case; None: that of the case.
        search: "global" or "local"; None: that of the case.
        observer: is called as the batch proceeds.
        further: make more files of each result; they are sent to workers, so must be functions of
            a module.
        compute: has the cases fitted in another way than in processes of this computer.
        write_tables: called with the fleet at the end, and again if the folder has changed since.
        made: further cases, by their files, each with the function that makes it when its turn
            comes: it returns why it cannot, or "".

    A KeyboardInterrupt ends all workers at once: what is finished is kept, and the fleet is
    ``interrupted``. Raises ExfitError where there are no cases, the folder cannot be written, or
    the cluster cannot be used or is lost: what is done is kept then, too.

    Example:
        >>> fleet = exfit.batch(["cases"], "fleet", workers=4)
        >>> {case.name: case.verdict for case in fleet.cases}
    """
    given = [cases] if isinstance(cases, str | PathLike) else [*cases]
    place = Path(folder)
    _refuse(part, workers, time_limit, strategy, search)
    existing = case_files([*map(Path, given)], place) if given or not made else ()
    each_once = {case_name(place, file): file for file in (*existing, *made)}
    files = share_of([*each_once.values()], part, place)
    settings = BatchSettings(FitSettings(strategy, search), retry_failed, tuple(further))
    run = BatchRun(files, place, settings, observer or BatchObserver(), made)
    count = min(workers or processors(), max(1, len(files)))
    if scheduler is not None:
        from exfit.features.fleet.dispatch import cluster_workers

        compute, count = cluster_workers(scheduler, time_limit), 0
    elif workers == 0:
        compute, count = compute or in_this_process, 1
    try:
        with guarded((lambda _: None) if trust else refuse_unknown):
            interrupted = run.fit_all(compute or local_workers(count, time_limit), count)
    except ExfitError:
        with suppress(ExfitError):  # the first fault is reported
            tables_of(place, write_tables)
        raise
    fleet = tables_of(place, write_tables)
    return replace(fleet, run=frozenset(run.files), interrupted=interrupted)


def _refuse(
    part: tuple[int, int],
    workers: int | None,
    time_limit: float,
    strategy: str | None,
    search: str | None,
) -> None:
    faults, (number, of) = [], part
    if not 1 <= number <= of:
        faults.append(f"part {number}/{of}: must be 1/N ... N/N")
    if workers is not None and workers < 0:
        faults.append(f"workers: {workers} must be 0 or more")
    if not 0.0 < time_limit <= inf:
        faults.append(f"time limit: {time_limit:g} s must be above 0")
    for word, given, known in (("strategy", strategy, STRATEGIES), ("search", search, SEARCHES)):
        if given is not None and given not in known:
            faults.append(f"{word}: {given} is unknown; {near(given, known)}")
    if faults:
        raise ExfitError("\n".join(faults))


class BatchRun:
    """A run over some cases, by their names: it keeps their outcomes, and announces them."""

    def __init__(
        self,
        files: Sequence[Path],
        folder: Path,
        settings: BatchSettings,
        observer: BatchObserver,
        made: Mapping[Path, CaseMaking],
    ) -> None:
        self.files = {case_name(folder, file): file for file in files}
        self.made = {case_name(folder, file): make for file, make in made.items()}
        self.folder, self.settings, self.observer = folder, settings, observer

    def fit_all(self, compute: Compute, workers: int) -> bool:
        """Fit the cases that are not done; return whether an interruption ended it."""
        prepare_folder(self.folder)
        self.observer.begun(len(self.files), workers)
        with endings_as_interruptions():
            try:
                compute(self._to_fit(), self._begin, self._end)
            except KeyboardInterrupt:
                self._note_the_others()
                return True
            except ExfitError:  # without workers nothing goes on
                with suppress(ExfitError):
                    self._note_the_others()
                raise
        return False

    def _to_fit(self) -> Iterator[PlannedCase]:
        """Yield the cases that are to be fitted; the others are entered and announced."""
        keys = set[str]()
        for name, file in self.files.items():
            make = self.made.get(name)
            why_not_made = "" if make is None else make()  # a case of a table is made first
            case = planned_case(file, self.folder, self.settings, why_not_made)
            entry = case if isinstance(case, IndexEntry) else case.entry
            write_entry(self.folder, entry)
            key, retry = entry.key, self.settings.retry_failed
            failed_before = not retry and failure_of(self.folder, key) is not None
            if isinstance(case, IndexEntry):
                self.observer.finished(row_of(case))
            elif key in keys or failed_before or is_done(self.folder, key):
                self.observer.kept(name)
            else:
                keys.add(key)
                yield case

    def _begin(self, case: PlannedCase) -> bool:
        """Announce that a case begins; return false where another run has done it meanwhile."""
        done = is_done(self.folder, case.entry.key)
        announce = self.observer.kept if done else self.observer.started
        announce(case.entry.case)
        return not done

    def _end(self, case: PlannedCase, outcome: CaseOutcome) -> None:
        """Keep the outcome of a case, and announce it."""
        entry = case.entry
        if outcome.changed:
            entry = IndexEntry(entry.case, reason=outcome.changed, facts=entry.facts)
            write_entry(self.folder, entry)
        else:
            write_outcome(self.folder, entry.key, outcome)
        row = row_of(entry, outcome.failure)
        if outcome.summary is not None:
            row = replace(outcome.summary, name=row.name, case=entry.case)
        self.observer.finished(row)

    def _note_the_others(self) -> None:
        """Enter the cases that were not even planned when the run ended early."""
        for name in self.files:
            if not has_entry(self.folder, name):
                write_entry(self.folder, IndexEntry(name))


def tables_of(folder: Path, write_tables: Callable[[Fleet], None]) -> Fleet:
    """Return the fleet of a folder, once its tables are written with all that is done.

    Where several runs end at a time, the last table is whole: each run writes it again if something
    was added since it had looked. One that is outrun again and again leaves it to the others.
    """
    for attempt in range(MOST_TABLES):
        before = state_of(folder)
        fleet = read_fleet(folder)
        if attempt == MOST_TABLES - 1 and state_of(folder) != before:
            break
        write_tables(fleet)
        if state_of(folder) == before:
            break
    return fleet
