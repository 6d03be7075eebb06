"""Worker processes on this computer: they are given cases one by one, and replaced where they die.

A worker is a plain subprocess that reads its tasks from a pipe. The pool of the standard library
does not survive the death of a worker. That of pebble does, but where the batch itself is killed
its workers go on to the end of their cases; and as all of multiprocessing it imports the user's
main module in them, so that BLAS has begun its threads before it can be told to have one. Here the
end of the pipe ends a worker, whatever ended the batch.
"""

import json
import os
import pickle
import signal
import subprocess
import sys
import time
from collections import Counter, defaultdict, deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from tempfile import TemporaryFile
from threading import Thread
from typing import Any, NamedTuple

from exfit.errors import ExfitError
from exfit.features.fleet.folder import CaseOutcome, Failure
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.worker import BEGUN, READY
from exfit.util.interrupts import ENDING
from exfit.util.processes import THREADS, ending, last_lines

LISTENING = 0.1  # s: on Windows an interruption reaches only what returns from waiting
MOST_FAILED_STARTS = 3  # one after the other: something is wrong with all workers
MOST_LOST = 3  # workers that die before they begin with a case, until it is the case's fault
# the worker finds exfit where this process has found it
PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from exfit.features.fleet.worker import main; main()"
)
ONE_THREAD = (THREADS, "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
NO_PLUGINS = {"PYDANTIC_DISABLE_PLUGINS": "__all__"}  # else all packages are searched for some
TO_END = 5.0  # s: for a process without its pipe, and for the thread that listens to it

# whether a case is to be fitted still, as a worker is about to begin it; and its outcome
Begin = Callable[[PlannedCase], bool]
End = Callable[[PlannedCase, CaseOutcome], None]
# fits the cases of an iterator, and calls these two from the thread that it is called in
Compute = Callable[[Iterator[PlannedCase], Begin, End], None]


class Answer(NamedTuple):
    """A word of a worker: it is ready, it begins, an outcome; None: it has died."""

    worker: "WorkerProcess"
    content: Any


class WorkerProcess:
    """A worker process and the case that it is at.

    It is ``ready`` once it can be given a case; ``began`` is when it began with it, None before;
    ``group`` is that of its last case. Its answers are put into a queue, by a thread that listens.
    """

    def __init__(self, answers: "SimpleQueue[Answer]") -> None:
        self.case: PlannedCase | None = None
        self.began: float | None = None
        self.ready, self.group = False, ""
        self._errors = TemporaryFile()  # noqa: SIM115 - it is closed where the process has gone
        self._errors_before = 0
        with signals_held_back():
            self._process = subprocess.Popen(
                [sys.executable, "-c", PROGRAM, json.dumps(sys.path)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env={**os.environ, **dict.fromkeys(ONE_THREAD, "1"), **NO_PLUGINS},
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # on Windows
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._tasks, self._answers = self._process.stdin, self._process.stdout
        self._listener = Thread(target=self._listen, args=(answers,), daemon=True)
        self._listener.start()

    def _listen(self, answers: "SimpleQueue[Answer]") -> None:
        content: Any = ""
        while content is not None:
            try:
                content = pickle.load(self._answers)
            except (EOFError, OSError, ValueError, pickle.UnpicklingError):
                content = None
            answers.put(Answer(self, content))

    def give(self, case: PlannedCase) -> None:
        """Give a case to a worker that has none."""
        self.case, self.group, self.began = case, case.task.group, None
        self._errors_before = os.fstat(self._errors.fileno()).st_size
        with suppress(OSError):  # it has died, as its pipe will say
            pickle.dump(case.task, self._tasks, protocol=pickle.HIGHEST_PROTOCOL)
            self._tasks.flush()

    def dismiss(self) -> None:
        """End the process at once."""
        self._process.kill()

    def gone(self) -> str:
        """Wait for the end of a process whose pipe has ended, or that is dismissed.

        Returns how it ended, with what it wrote about errors last.
        """
        try:
            code = self._process.wait(TO_END)
        except subprocess.TimeoutExpired:
            self._process.kill()
            code = self._process.wait()
        self._listener.join(TO_END)
        words = [ending(code, "the worker"), last_lines(self._errors, self._errors_before)]
        for file in (self._tasks, self._answers, self._errors):
            with suppress(OSError):  # what could not be sent
                file.close()
        return ": ".join(filter(None, words))


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Block the signals that interrupt a program, also in processes started inside.

    A terminal sends Ctrl-C, and its own end, to all of its processes; only the batch shall act on
    it. Windows has no such mask: there the process is in a separate group, which Ctrl-C does not
    reach.
    """
    if sys.platform == "win32":
        yield
        return
    former = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, *ENDING})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, former)


def in_this_process(cases: Iterator[PlannedCase], begin: Begin, end: End) -> None:
    """Fit cases here, one after the other; no time limit ends them."""
    for case in cases:
        if begin(case):
            end(case, case.task.run())


class Waiting:
    """Cases that wait for a worker, by the group whose machine code they share.

    They come from an iterator, which plans each as it is asked for it.
    """

    def __init__(self, cases: Iterator[PlannedCase]) -> None:
        self._cases, self.exhausted = cases, False
        self._groups: defaultdict[str, deque[PlannedCase]] = defaultdict(deque)

    def __len__(self) -> int:
        return sum(map(len, self._groups.values()))

    def plan_one(self) -> None:
        """Add the next case of the iterator, or note that it is exhausted."""
        case = next(self._cases, None)
        if case is None:
            self.exhausted = True
        else:
            self.add(case)

    def add(self, case: PlannedCase) -> None:
        """Add a case behind the others of its group."""
        self._groups[case.task.group].append(case)

    def of_group(self, group: str) -> int:
        """Count the cases of a group."""
        return len(self._groups.get(group, ()))

    def next_for(self, group: str, at_work: Counter[str]) -> PlannedCase:
        """Return the next case for a worker that has had one of a group: of the same if possible.

        Else it is of the group with the most cases for each worker that is ``at_work`` on it.
        """
        if group not in self._groups:
            group = max(
                self._groups, key=lambda name: len(self._groups[name]) / (1 + at_work[name])
            )
        case = self._groups[group].popleft()
        if not self._groups[group]:
            del self._groups[group]
        return case


def local_workers(workers: int, time_limit: float) -> Compute:
    """Make the `Compute` of so many processes, each case in no more than ``time_limit`` s."""

    def compute(cases: Iterator[PlannedCase], begin: Begin, end: End) -> None:
        pool = Pool(Waiting(cases), begin, end, workers, time_limit)
        try:
            pool.run()
        finally:
            pool.stop()

    return compute


@dataclass(eq=False)
class Pool:
    """Workers at the cases of a batch; all of it happens in one thread, by their answers."""

    waiting: Waiting
    begin: Begin
    end: End
    most_workers: int
    time_limit: float
    workers: list[WorkerProcess] = field(default_factory=list)
    answers: "SimpleQueue[Answer]" = field(default_factory=SimpleQueue)
    failed_starts: int = 0
    lost: Counter[str] = field(default_factory=Counter)

    def run(self) -> None:
        """Fit all cases: while no worker has an answer, the next case is planned."""
        waiting = self.waiting
        while not waiting.exhausted or waiting or any(worker.case for worker in self.workers):
            if not waiting.exhausted and self.answers.empty():
                waiting.plan_one()
            else:
                self._listen()
            now = time.monotonic()
            for worker in [*self.workers]:
                if worker.began is not None and now - worker.began > self.time_limit:
                    reason = f"not finished after {self.time_limit:g} s"
                    self._dismiss(worker)
                    self._fail(worker, Failure("timed out", reason, self.time_limit))
            self._employ()

    def stop(self) -> None:
        """End all workers at once, in the middle of their cases too."""
        for worker in self.workers:
            worker.dismiss()
        for worker in self.workers:
            worker.gone()

    def _employ(self) -> None:
        """Give cases to the workers that have none, and start those that are missing."""
        for worker in self.workers:
            while worker.ready and not worker.case and self.waiting:
                at_work = Counter(other.case.task.group for other in self.workers if other.case)
                case = self.waiting.next_for(worker.group, at_work)
                if self.begin(case):
                    worker.give(case)
        idle = sum(not worker.case for worker in self.workers)
        missing = min(self.most_workers - len(self.workers), len(self.waiting) - idle)
        self.workers += [WorkerProcess(self.answers) for _ in range(missing)]

    def _listen(self) -> None:
        try:
            worker, content = self.answers.get(timeout=LISTENING)
        except Empty:
            return
        if worker not in self.workers:  # dismissed
            return
        if content is None:
            self._bury(worker)
        elif content == READY:
            worker.ready, self.failed_starts = True, 0
        elif content == BEGUN:
            worker.began = time.monotonic()
        else:
            case, worker.case, worker.began = worker.case, None, None
            if content.failure is not None and content.failure.kind == "crashed":
                self._dismiss(worker)  # whatever happened may have spoilt it
            self._employ()  # it begins the next case before the outcome is written
            if case is not None:
                self.end(case, content)

    def _dismiss(self, worker: WorkerProcess) -> None:
        self.workers.remove(worker)
        worker.dismiss()
        worker.gone()

    def _fail(self, worker: WorkerProcess, failure: Failure) -> None:
        if worker.case is not None:
            self.end(worker.case, CaseOutcome(failure=failure))

    def _bury(self, worker: WorkerProcess) -> None:
        """Replace a worker that has died; its case has crashed if it had begun."""
        self.workers.remove(worker)
        reason, case, seconds = worker.gone(), worker.case, 0.0
        if not worker.ready:
            self.failed_starts += 1
            if self.failed_starts >= MOST_FAILED_STARTS:
                raise ExfitError(f"no worker can be started: {reason}")
        if worker.began is not None:
            seconds = time.monotonic() - worker.began
        elif case is not None:
            self.lost[case.entry.case] += 1
            if self.lost[case.entry.case] < MOST_LOST:
                self.waiting.add(case)
                return
        self._fail(worker, Failure("crashed", reason, round(seconds, 3)))
