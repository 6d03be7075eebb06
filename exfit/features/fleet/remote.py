"""Cases in the workers of a cluster, with the contents of all files that they name.

Each is fitted in a process beside the worker, which shares no disk with this computer. A separate
process can be ended where a case hangs, is the only one to end where a case crashes, and computes
with one thread, however many the worker has: the worker's other cases and its connection to the
scheduler go on.
"""

import hashlib
import os
import pickle
import platform
import shutil
import sys
import time
import zlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import chdir, contextmanager
from dataclasses import dataclass, field, replace
from functools import cache
from importlib.metadata import version
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import mkdtemp
from threading import Lock, Semaphore, Timer
from typing import TYPE_CHECKING, NamedTuple

from exfit import __version__
from exfit.errors import ExfitError
from exfit.features.fleet.folder import CaseOutcome, Failure
from exfit.features.fleet.local import Answer, WorkerProcess
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.task import CaseTask, run_case
from exfit.features.fleet.worker import BEGUN, READY
from exfit.util.cache import CACHE
from exfit.util.files import ROOT, below, read_regular, why_unreadable

if TYPE_CHECKING:
    from distributed import Worker

QUICKLY = 1  # the level of compression: the next ones gain little and take several times as long
PAYS = 0.9  # of the length: what compression leaves, or less
LIBRARIES = ("numpy", "scipy", "llvmlite", "pydantic")  # that the last bits of a result depend on
STARTED_WITHIN = 120.0  # s: a process may import exfit from a slow disk
LISTENING = 1.0  # s between two looks at the clock
IDLE = 300.0  # s without a case, as after the sudden end of a client: then processes end


@dataclass(frozen=True)
class PackedFile:
    """The content of a file: its path, its SHA-256, its bytes, as zlib packs them where it pays."""

    path: str
    sha256: str
    content: bytes
    compressed: bool

    @classmethod
    def of(cls, path: str, content: bytes) -> "PackedFile":
        """Return the file of a path with its content."""
        sha256, packed = hashlib.sha256(content).hexdigest(), zlib.compress(content, QUICKLY)
        pays = len(packed) <= PAYS * len(content)
        return cls(path, sha256, packed if pays else content, pays)

    def unpacked(self) -> bytes:
        """Return the bytes of the file; raises ExfitError where they are not those of its hash."""
        try:
            content = zlib.decompress(self.content) if self.compressed else self.content
        except zlib.error as fault:
            raise ExfitError(f"{self.path}: damaged on its way to the worker: {fault}") from None
        if hashlib.sha256(content).hexdigest() != self.sha256:
            raise ExfitError(f"{self.path}: damaged on its way to the worker: its SHA-256 differs")
        return content


@dataclass(frozen=True)
class Bundle:
    """A case, by its path as it was given in a folder, and its files with their contents.

    The paths of the files are absolute, without links and dots.
    """

    case: str
    folder: str
    files: tuple[PackedFile, ...]

    @property
    def size(self) -> int:
        """Number of bytes that travel."""
        return sum(len(file.content) for file in self.files)


def bundle_of(paths: Sequence[Path]) -> Bundle:
    """Return a case, the first of some paths, with the files that it names, the others.

    One that does not exist is left out: the worker reports it as missing. Raises ExfitError for a
    file that cannot be read, and where links make one path of two files.
    """
    files: dict[str, PackedFile] = {}
    for path in paths:
        place = os.path.normpath(path.absolute())
        try:
            file = PackedFile.of(place, read_regular(path))
        except FileNotFoundError:
            continue
        except (OSError, ValueError) as fault:
            raise ExfitError(f"{path}: cannot be read: {why_unreadable(fault)}") from None
        if files.setdefault(place, file) != file:
            raise ExfitError(f"{path}: is not {place}: a link stands before ..")
    return Bundle(str(paths[0]), str(Path.cwd()), tuple(files.values()))


@contextmanager
def laid_out(bundle: Bundle, within: Path) -> Iterator[Path]:
    """Lay the files out for this process, which reads them by the user's paths inside.

    Gives the path of the case as the user gave it. For the time it lasts a folder ``within``
    another, which is that of all cases of the process and is emptied first, stands for the root of
    all paths that cases name, and the current folder is that of the user below it: no other thread
    of the process may read cases meanwhile. Raises ExfitError where the files cannot be written, or
    where one arrived damaged.
    """
    try:
        root = _own_folder(within)
        _remove_files(root)
        working = below(root, Path(bundle.folder))
        working.mkdir(parents=True, exist_ok=True)
        for file in bundle.files:
            place = below(root, Path(file.path))
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(file.unpacked())
    except OSError as fault:
        raise ExfitError(f"temporary folder of the worker: {fault.strerror}") from None
    former_root = os.environ.get(ROOT)
    try:
        os.environ[ROOT] = str(root)
        with chdir(working):
            yield Path(bundle.case)
    finally:
        if former_root is None:
            del os.environ[ROOT]
        else:
            os.environ[ROOT] = former_root


@cache
def _own_folder(within: Path) -> Path:
    within.mkdir(parents=True, exist_ok=True)
    return Path(mkdtemp(prefix="exfit-", dir=within)).resolve()


def _remove_files(root: Path) -> None:
    """Remove all files and links below a root; its folders are mostly those of the next case."""
    for path in [*root.rglob("*")]:
        if path.is_symlink() or not path.is_dir():
            path.unlink()


@dataclass(frozen=True, kw_only=True)
class BundledTask(CaseTask):
    """A case with its files, which are laid out ``temporary``, in a folder of the worker."""

    bundle: Bundle
    temporary: Path = Path()

    @classmethod
    def of(cls, task: CaseTask) -> "BundledTask":
        """Return a task with its files; raises ExfitError as `bundle_of`."""
        return cls(**vars(task), bundle=bundle_of(task.files))

    def run(self) -> CaseOutcome:
        """Fit the case; it reads only its files. To be run in a separate process."""
        # what the process finds from its current folder, before it leaves that
        sys.path[:] = [str(Path(path).absolute()) for path in sys.path]
        if cache := os.environ.get(CACHE):
            os.environ[CACHE] = str(Path(cache).absolute())
        try:
            with laid_out(self.bundle, self.temporary):
                return run_case(self)
        except ExfitError as fault:
            return CaseOutcome(failure=Failure("failed", str(fault)))


class RemoteCases(NamedTuple):
    """Cases as they travel: with their files, of which batch, and how long one may take (s)."""

    cases: tuple[PlannedCase, ...]
    batch: str
    limit: float


class Reply(NamedTuple):
    """The reply of a worker: the outcome of a case, or how the process that had it died."""

    outcome: CaseOutcome = CaseOutcome()
    death: str = ""


class NoProcess(Exception):
    """A worker that can start no process for cases, and why."""


def versions() -> dict[str, str]:
    """Read the versions, the system and the processor that results of this computer depend on."""
    return {
        "exfit": __version__,
        "Python": platform.python_version(),
        **{library: version(library) for library in LIBRARIES},
        "system": sys.platform,
        "processor": platform.machine(),
    }


@dataclass(eq=False)
class Seat:
    """A process beside a worker, with the queue of what it says; ``ended`` once it has."""

    process: WorkerProcess
    said: "SimpleQueue[Answer]"
    ended: bool = False

    @classmethod
    def taken(cls) -> "Seat":
        """Return a process that is ready; raises NoProcess where none can be started."""
        said: SimpleQueue[Answer] = SimpleQueue()
        seat = cls(WorkerProcess(said), said)
        try:
            ready = said.get(timeout=STARTED_WITHIN).content == READY
        except Empty:
            ready = False
            seat.process.dismiss()
        if not ready:
            raise NoProcess(seat.gone())
        return seat

    def reply(self, case: PlannedCase, limit: float, is_wanted: Callable[[], bool]) -> Reply:
        """Have a case fitted; the process has ended where that takes longer or crashes.

        It is ended, too, once the case is not wanted any more.
        """
        self.process.give(case)
        until = time.monotonic() + limit
        while time.monotonic() < until:
            try:
                content = self.said.get(timeout=min(LISTENING, limit)).content
            except Empty:
                if is_wanted():
                    continue
                self.process.dismiss()
                return Reply(death=self.gone())
            if content is None:
                return Reply(death=self.gone())
            if content != BEGUN:
                return Reply(content)
        self.process.dismiss()
        self.gone()
        failure = Failure("timed out", f"not finished after {limit:g} s", limit)
        return Reply(CaseOutcome(failure=failure))

    def gone(self) -> str:
        """Wait for the end of the process; return how it ended."""
        self.ended = True
        return self.process.gone()


@dataclass(eq=False)
class Seats:
    """The processes of a batch beside a worker: one for each of its threads that has a case.

    The threads of the worker share it; of those with a case so many are ``free`` to have it fitted,
    the others wait. ``stopped`` once the batch has ended.
    """

    folder: Path
    free: Semaphore
    lock: Lock = field(default_factory=Lock)
    idle: list[Seat] = field(default_factory=list)
    busy: set[Seat] = field(default_factory=set)
    stopped: bool = False
    leaving: Timer | None = None

    def replies(self, remote: RemoteCases, is_wanted: Callable[[], bool]) -> tuple[Reply, ...]:
        """Have cases fitted one by one, as long as they are wanted.

        Raises NoProcess where no process can be started for one.
        """
        while not self.free.acquire(timeout=LISTENING):
            if not is_wanted():
                return ()
        try:
            return tuple(
                self._reply(case, remote.limit, is_wanted) for case in remote.cases if is_wanted()
            )
        finally:
            self._leave_later()
            self.free.release()

    def _reply(self, case: PlannedCase, limit: float, is_wanted: Callable[[], bool]) -> Reply:
        if isinstance(case.task, BundledTask):
            case = case._replace(task=replace(case.task, temporary=self.folder))
        with self._seat() as seat:
            return seat.reply(case, limit, is_wanted)

    @contextmanager
    def _seat(self) -> Iterator[Seat]:
        """Give a process, idle or new; one that has ended is not used again."""
        with self.lock:
            if self.stopped:
                raise NoProcess("the batch has ended")
            seat = self.idle.pop() if self.idle else None
        seat = seat or Seat.taken()
        with self.lock:
            self.busy.add(seat)
        try:
            if self.stopped:
                raise NoProcess("the batch has ended")
            yield seat
        finally:
            with self.lock:
                self.busy.discard(seat)
                if not seat.ended:
                    self.idle.append(seat)

    def _leave_later(self) -> None:
        """Let idle processes end after a while without a case, at once where the batch has."""
        with self.lock:
            if self.leaving is not None:
                self.leaving.cancel()
            self.leaving = Timer(0.0 if self.stopped else IDLE, self._leave)
            self.leaving.daemon = True
            self.leaving.start()

    def _leave(self) -> None:
        """End the processes that have had nothing to do for long."""
        with self.lock:
            idle, self.idle = self.idle, []
        for seat in idle:
            seat.process.dismiss()
        for seat in idle:
            seat.gone()

    def stop(self) -> None:
        """End all processes at once, in the middle of a fit too."""
        with self.lock:
            self.stopped = True
            for seat in self.busy:  # whose thread sees that it ends
                seat.process.dismiss()
        self._leave()
        shutil.rmtree(self.folder, ignore_errors=True)


def run_packed(payload: bytes) -> tuple[Reply, ...]:
    """Have packed cases fitted, in a worker of the cluster.

    The worker's next ones wait beside them, so that its process need not wait for the cluster.
    """
    from distributed import get_worker, secede

    remote: RemoteCases = pickle.loads(payload)
    worker = get_worker()
    key = worker.get_current_task()

    def is_wanted() -> bool:  # not after a sudden end of the client, who could not say so
        state = worker.state.tasks.get(key)
        return state is not None and state.state != "cancelled"

    secede()
    return _seats(worker, remote.batch).replies(remote, is_wanted)


def stop_batch(batch: str, dask_worker: "Worker | None" = None) -> None:
    """End the processes of a batch beside a worker, which distributed names."""
    if dask_worker is not None:
        _seats(dask_worker, batch).stop()


def _seats(worker: "Worker", batch: str) -> Seats:
    """Return the processes of a batch beside a worker, which has them as long as it runs."""
    batches: dict[str, Seats] = vars(worker).setdefault("exfit_batches", {})
    folder = Path(worker.local_directory) / f"exfit-{batch}"
    seats = Seats(folder, Semaphore(worker.state.nthreads))
    return batches.setdefault(batch, seats)  # in one step: its threads share them
