"""Worker processes on this computer: they are given cases one by one, and replaced where they die.

A worker is a plain subprocess that reads its tasks from a pipe. The pool of the standard library
does not survive the death of a worker. That of pebble does, but where the batch itself is killed
its workers go on to the end of their cases; and as all of multiprocessing it imports the user's
main module in them, so that BLAS has begun its threads before it can be told to have one. Here the
end of the pipe ends a worker, whatever ended the batch.
"""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from queue import Empty, SimpleQueue

from exfit.errors import ExfitError
from exfit.features.fleet.folder import CaseOutcome, Failure
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.processes import Answer, WorkerProcess
from exfit.features.fleet.worker import BEGUN, READY

LISTENING = 0.1  # s: on Windows an interruption reaches only what returns from waiting
MOST_FAILED_STARTS = 3  # one after the other: something is wrong with all workers
MOST_LOST = 3  # workers that die before they begin with a case, until it is the case's fault

# whether a case is to be fitted still, as a worker is about to begin it; and what it came to
Begin = Callable[[PlannedCase], bool]
End = Callable[[PlannedCase, CaseOutcome], None]
# fits the cases of an iterator, and calls these two from the thread that it is called in
Compute = Callable[[Iterator[PlannedCase], Begin, End], None]


def in_this_process(cases: Iterator[PlannedCase], begin: Begin, end: End) -> None:
    """Fit cases here, one after the other; no time limit ends them."""
    for case in cases:
        if case.task is not None and begin(case):
            end(case, case.task.run())


def local_workers(workers: int, time_limit: float) -> Compute:
    """Return what fits cases in so many processes, each case in no more than ``time_limit`` s."""

    def compute(cases: Iterator[PlannedCase], begin: Begin, end: End) -> None:
        pool = Pool(cases, begin, end, workers, time_limit)
        try:
            pool.run()
        finally:
            pool.stop()

    return compute


class Waiting:
    """Cases that wait for a worker, by the group whose machine code they share.

    They come from an iterator, which plans each as it is asked for it.
    """

    def __init__(self, cases: Iterator[PlannedCase]) -> None:
        self._cases, self.exhausted = cases, False
        self._groups: dict[str, deque[PlannedCase]] = {}

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
        self._groups.setdefault(group_of(case), deque()).append(case)

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


def group_of(case: PlannedCase) -> str:
    """Return the group of a case."""
    return "" if case.task is None else case.task.group


class Pool:
    """Workers at the cases of a batch; all of it happens in one thread, by their answers."""

    def __init__(
        self,
        cases: Iterator[PlannedCase],
        begin: Begin,
        end: End,
        most_workers: int,
        time_limit: float,
    ) -> None:
        self.waiting, self.begin, self.end = Waiting(cases), begin, end
        self.most_workers, self.time_limit = most_workers, time_limit
        self.workers: list[WorkerProcess] = []
        self.answers: SimpleQueue[Answer] = SimpleQueue()
        self.failed_starts = 0
        self.lost: Counter[str] = Counter()

    def run(self) -> None:
        """Fit all cases: while no worker has an answer, the next case is planned."""
        waiting = self.waiting
        while not waiting.exhausted or waiting or any(worker.case for worker in self.workers):
            if not waiting.exhausted and self.answers.empty():
                waiting.plan_one()
            else:
                self._listen()
            self._end_overdue()
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
                at_work = Counter(group_of(other.case) for other in self.workers if other.case)
                case = self.waiting.next_for(worker.group, at_work)
                if self.begin(case):
                    worker.give(case, group_of(case))
        idle = sum(not worker.case for worker in self.workers)
        missing = min(self.most_workers - len(self.workers), len(self.waiting) - idle)
        self.workers += [WorkerProcess(self.answers) for _ in range(missing)]

    def _listen(self) -> None:
        """Wait a moment for an answer, and act on it."""
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
            self._finish(worker, content)

    def _finish(self, worker: WorkerProcess, outcome: CaseOutcome) -> None:
        """Take the outcome of a worker's case; it begins the next one before this is written."""
        case = worker.case
        worker.case = worker.began = None
        if outcome.failure is not None and outcome.failure.kind == "crashed":
            self._dismiss(worker)  # whatever happened may have spoilt it
        self._employ()
        if case is not None:
            self.end(case, outcome)

    def _dismiss(self, worker: WorkerProcess) -> None:
        self.workers.remove(worker)
        worker.dismiss()
        worker.gone()

    def _end_overdue(self) -> None:
        now = time.monotonic()
        for worker in [*self.workers]:
            if worker.began is not None and now - worker.began > self.time_limit:
                case = worker.case
                self._dismiss(worker)
                reason = f"no end after {self.time_limit:g} s"
                if case is not None:
                    failure = Failure("timed out", reason, self.time_limit)
                    self.end(case, CaseOutcome(failure=failure))

    def _bury(self, worker: WorkerProcess) -> None:
        """Replace a worker that has died; its case has crashed if it had begun."""
        self.workers.remove(worker)
        reason = worker.gone()
        if not worker.ready:
            self.failed_starts += 1
            if self.failed_starts >= MOST_FAILED_STARTS:
                raise ExfitError(f"no worker can be started: {reason}")
        case = worker.case
        if case is None:
            return
        if worker.began is None:
            self.lost[case.entry.case] += 1
            if self.lost[case.entry.case] < MOST_LOST:
                self.waiting.add(case)
                return
        seconds = 0.0 if worker.began is None else time.monotonic() - worker.began
        self.end(case, CaseOutcome(failure=Failure("crashed", reason, round(seconds, 3))))
