"""The cases of a batch on a Dask cluster that somebody else has started.

They are sent to its workers as these come to need them, short ones together. Each case is bound to
a worker, so that a worker stays with a model, and a worker that is lost gives back what it had. The
scheduler holds no more cases than are under way. What distributed, which only this module and
`remote` import, logs and warns of stays silent: what matters becomes an error of exfit's.
"""

import asyncio
import logging
import pickle
import re
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from math import inf
from queue import Empty, SimpleQueue
from time import monotonic, sleep
from typing import TYPE_CHECKING, Any
from uuid import uuid4

from exfit.errors import ExfitError
from exfit.features.fleet import remote
from exfit.features.fleet.folder import CaseOutcome, Failure, FailureKind
from exfit.features.fleet.local import Begin, Compute, End, Waiting
from exfit.features.fleet.plan import PlannedCase
from exfit.features.fleet.remote import BundledTask, RemoteCases, Reply

if TYPE_CHECKING:
    from distributed import Client
    from distributed import Future as DaskFuture

CONNECTED_WITHIN = 5.0  # s: what answers at all answers sooner
ANSWERED_WITHIN = 20.0  # s: a scheduler or a worker that is busy, or imports exfit for a first time
CLOSED_WITHIN = 2.0  # s
OF_SYSTEM = re.compile(r"\[Errno -?[0-9]+\] (.+)")
MISSING = re.compile("No module named '[^']*'")
LOGGERS = ("distributed", "tornado", "asyncio")
SETTINGS = {
    "distributed.comm.timeouts.connect": f"{CONNECTED_WITHIN:g}s",
    "distributed.admin.large-graph-warning-threshold": "1 TB",  # the limits are those below
}

MOST_DEATHS = 3  # of the process of a case, after which the case is to blame
MOST_LOSSES = 10  # of its worker: mostly that is ended from outside, so there are more tries
AHEAD = 2  # for each thread of a worker: cases that it fits, and some that it need not wait for
TOGETHER, SHORTEST = 2.0, 0.05  # s: so many cases as take no longer travel together
MOST_BYTES = 256_000_000  # of the cases that are under way; one alone may have more
LOOK = 1.0  # s between two looks at which workers there are
AT_FIRST = 0.1  # s, before the first case
FIRST_WORKER = 10.0  # s: so long may the first worker take to appear
WITHOUT_WORKERS = 300.0  # s: so long may a cluster be without any
FETCHED_WITHIN = 5.0  # s, an outcome that is there


class ClusterError(ExfitError):
    """A cluster that cannot be used: its address, and what is wrong."""


@contextmanager
def connected(address: str) -> Iterator["Client"]:
    """Give a client of the scheduler at an address, closed in the end whatever happens.

    Raises ClusterError where dask.distributed is missing, or where no scheduler answers there
    within seconds.
    """
    try:
        import dask
        from distributed import Client
    except ImportError:
        text = 'needs the package distributed: pip install "exfit[cluster]"'
        raise ClusterError(f"--scheduler: {text}") from None
    with _silent(), dask.config.set(SETTINGS):
        with ThreadPoolExecutor(1) as apart:  # a notebook has its loop in this thread
            kind = apart.submit(lambda: asyncio.run(_kind_at(address))).result()
        if kind != "Scheduler":
            text = f"a {kind} of Dask, not a scheduler" if kind else "not a scheduler of Dask"
            raise ClusterError(f"{address}: {text}")
        try:
            client = Client(address, timeout=CONNECTED_WITHIN, set_as_default=False)
        except (OSError, ValueError, RuntimeError, TypeError) as fault:
            raise ClusterError(f"{address}: no connection: {_reason(fault)}") from None
        try:
            yield client
        finally:
            with suppress(Exception):  # of a connection that is lost already
                client.close(timeout=CLOSED_WITHIN)


@contextmanager
def _silent() -> Iterator[None]:
    names = {name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGGERS}
    levels = {logger: logger.level for logger in map(logging.getLogger, {*LOGGERS, *names})}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


async def _kind_at(address: str) -> str:
    """Ask an address for its role in Dask; "" where something else answers."""
    from distributed.comm import connect
    from distributed.core import send_recv
    from distributed.security import Security

    options = Security().get_connection_args("client")
    try:
        comm = await connect(address, timeout=CONNECTED_WITHIN, **options)
    except (OSError, ValueError) as fault:
        raise ClusterError(f"{address}: no connection: {_reason(fault)}") from None
    except TypeError:  # nothing else names certificates that are missing
        text = "no certificates are configured for TLS (distributed.comm.tls of Dask's settings)"
        raise ClusterError(f"{address}: {text}") from None
    except Exception:  # whatever the answer of another program is taken for
        return ""
    try:
        answer = await asyncio.wait_for(send_recv(comm, op="identity"), CONNECTED_WITHIN)
        return str(answer["type"])
    except Exception:
        return ""
    finally:
        comm.abort()


def _reason(fault: BaseException) -> str:
    """Word the cause of a fault, as the system does where it has words."""
    cause: BaseException | None = fault
    while cause is not None:
        system = OF_SYSTEM.search(str(cause))
        if system is not None:
            return system[1]
        cause = cause.__cause__
    return (str(fault).splitlines() or [type(fault).__name__])[0]


def threads_of(client: "Client") -> dict[str, int]:
    """Return the addresses of the workers that are connected, each with its threads.

    Raises ClusterError where the scheduler is lost.
    """
    if client.status != "running":
        raise lost(client)
    try:
        threads: dict[str, int] = client.sync(
            client.scheduler.ncores, callback_timeout=ANSWERED_WITHIN
        )
    except (OSError, TimeoutError) as fault:
        raise lost(client, fault) from None
    return threads


def lost(client: "Client", fault: BaseException | None = None) -> ClusterError:
    """Return the error of a scheduler that does not answer any more."""
    reason = "" if fault is None else f": {_reason(fault)}"
    text = f"connection to the scheduler lost{reason}"
    return ClusterError(f"{client.scheduler.address}: {text}")


def asked(client: "Client", worker: str) -> Future[Mapping[str, Any]]:
    """Ask a worker for its versions, and return what will have the answer."""
    call = client._run(remote.versions, workers=[worker], on_error="return")
    return asyncio.run_coroutine_threadsafe(call, client.loop.asyncio_loop)


def answered(worker: str, answer: Future[Mapping[str, Any]]) -> str | None:
    """Read the reason to refuse a worker, "" for none; None where it was lost meanwhile.

    It has other versions than this computer, so that the results would not be the same, or no
    exfit.
    """
    try:
        there = answer.result()[worker]
    except (OSError, KeyError, CancelledError):
        return None
    if isinstance(there, OSError):
        return None
    if isinstance(there, BaseException):
        missing = MISSING.search(str(there))  # distributed keeps its text, not always its kind
        if missing is not None:
            return f"exfit is missing there, or is an earlier version: {missing[0]}"
        return f"{type(there).__name__}: {_reason(there)}"
    return ", ".join(
        f"{name} {there.get(name, 'missing')}, here {version}"
        for name, version in remote.versions().items()
        if there.get(name) != version
    )


def cluster_workers(address: str, time_limit: float) -> Compute:
    """Make the `Compute` of a scheduler's cluster, each case in no more than ``time_limit`` s.

    It raises ClusterError where the cluster cannot be used: before the first case where a worker
    has other versions than this computer.
    """

    def compute(cases: Iterator[PlannedCase], begin: Begin, end: End) -> None:
        with connected(address) as client:
            dispatch = Dispatch(client, Waiting(cases), begin, end, time_limit)
            try:
                dispatch.wait_for_workers()
                dispatch.run()
            finally:
                dispatch.stop()

    return compute


@dataclass(frozen=True, eq=False)
class Sent:
    """Cases that are under way together: to which worker, and in how many bytes."""

    cases: tuple[PlannedCase, ...]
    worker: str
    size: int
    future: "DaskFuture"


@dataclass(eq=False)
class Dispatch:
    """The cases that wait and those that are under way, and the workers; all in one thread.

    ``threads`` are those of the workers in use, ``groups`` what they had last; ``checks`` are the
    answers of new workers, ``refused`` the reasons why others may not be used; ``begun`` are the
    cases that were announced. ``deaths`` and ``losses`` count how often the process and the worker
    of a case ended in its middle, by its name; ``lasted`` is what the last case of a group took, s.
    """

    client: "Client"
    waiting: Waiting
    begin: Begin
    end: End
    time_limit: float
    batch: str = field(default_factory=lambda: uuid4().hex)
    begun: set[str] = field(default_factory=set)
    sent: dict[str, Sent] = field(default_factory=dict)
    threads: dict[str, int] = field(default_factory=dict)
    groups: dict[str, str] = field(default_factory=dict)
    checks: dict[str, Future[Mapping[str, Any]]] = field(default_factory=dict)
    refused: dict[str, str] = field(default_factory=dict)
    deaths: Counter[str] = field(default_factory=Counter)
    losses: Counter[str] = field(default_factory=Counter)
    lasted: dict[str, float] = field(default_factory=dict)
    arrived: "SimpleQueue[str]" = field(default_factory=SimpleQueue)
    looked: float = -inf
    had_workers: float = field(default_factory=monotonic)

    def wait_for_workers(self) -> None:
        """Wait for the first workers; raises ClusterError for none, and for any that is refused."""
        began = monotonic()
        while self.checks or not self.threads:
            if monotonic() - began > (ANSWERED_WITHIN if self.checks else FIRST_WORKER):
                break
            sleep(AT_FIRST)
            self._look()
            if self.refused:
                raise ClusterError(self._refusals())
        if not self.threads:
            address = self.client.scheduler.address
            text = f"no worker is connected; start some: dask worker {address} --nthreads 1"
            raise ClusterError(f"{address}: {text}")

    def run(self) -> None:
        """Fit all cases; while no outcome arrives, the next case is planned.

        Raises ClusterError where the scheduler is lost, or where no worker is left.
        """
        while not self.waiting.exhausted or self.waiting or self.sent:
            if not self.waiting.exhausted and self.arrived.empty():
                self.waiting.plan_one()
            else:
                self._fetch()
            if monotonic() - self.looked >= LOOK:
                self._look()
            self._send()

    def stop(self) -> None:
        """End what is under way, at once; what the scheduler has of it goes, too."""
        with suppress(Exception):  # of a connection that is lost already
            self.client.cancel([sent.future for sent in self.sent.values()], force=True)
            if workers := [*self.threads]:  # one that does not answer is not waited for
                self.client.sync(
                    self.client._run, remote.stop_batch, self.batch, workers=workers,
                    on_error="ignore", callback_timeout=CLOSED_WITHIN,
                )  # fmt: skip

    def _look(self) -> None:
        """Look which workers there are; what those that are gone had waits again."""
        present = threads_of(self.client)
        for worker in [worker for worker in self.threads if worker not in present]:
            self._lose(worker)
        self._check(present)
        self.looked = monotonic()
        refused = bool(present) and present.keys() <= self.refused.keys()
        if self.threads:
            self.had_workers = self.looked
        elif refused or self.looked - self.had_workers > WITHOUT_WORKERS:
            address = self.client.scheduler.address
            raise ClusterError(self._refusals() or f"{address}: no worker is left")

    def _check(self, present: Mapping[str, int]) -> None:
        for worker in [worker for worker, answer in self.checks.items() if answer.done()]:
            reason = answered(worker, self.checks.pop(worker))
            if reason:
                self.refused[worker] = reason
            elif reason == "" and worker in present:
                self.threads[worker] = present[worker]
        for worker in present.keys() - {*self.threads, *self.refused, *self.checks}:
            self.checks[worker] = asked(self.client, worker)

    def _refusals(self) -> str:
        return "\n".join(f"worker {worker}: {reason}" for worker, reason in self.refused.items())

    def _lose(self, worker: str) -> None:
        """Take back what a worker had; its first cases, one for each thread, had begun."""
        threads = self.threads.pop(worker)
        had = [key for key, sent in self.sent.items() if sent.worker == worker]
        for place, key in enumerate(had):
            self._take_back(key, begun=place < threads)

    def _take_back(self, key: str, begun: bool = True) -> None:
        """Let cases wait again, unless one was lost too often."""
        sent = self.sent.pop(key)
        with suppress(Exception):  # the scheduler may have forgotten it
            self.client.cancel(sent.future, force=True)
        for case in sent.cases:
            name = case.entry.case
            self.losses[name] += begun
            if self.losses[name] < MOST_LOSSES:
                self.waiting.add(case)
            else:
                reason = f"its worker was lost {MOST_LOSSES} times while fitting it"
                self._fail(case, "crashed", reason)

    def _fail(self, case: PlannedCase, kind: FailureKind, reason: str) -> None:
        self.end(case, CaseOutcome(failure=Failure(kind, reason)))

    def _send(self) -> None:
        """Send cases to the workers that need some: one to each before any has a second."""
        if not self.waiting:  # what waits behind long cases goes where nothing is to be done
            had = Counter(sent.worker for sent in self.sent.values())
            idle = sum(max(0, threads - had[worker]) for worker, threads in self.threads.items())
            for key, sent in reversed([*self.sent.items()]):
                if idle > 0 and had[sent.worker] > self.threads[sent.worker]:
                    had[sent.worker] -= 1
                    idle -= 1
                    self._take_back(key, begun=False)
        for places in range(1, AHEAD + 1):
            for worker, threads in self.threads.items():
                while self.waiting and self._has_room(worker, places * threads):
                    self._submit(self._next_cases(worker), worker)

    def _next_cases(self, worker: str) -> tuple[PlannedCase, ...]:
        """Take the next cases for a worker, short ones of its group together, and begin them."""
        at_work = Counter(sent.cases[0].task.group for sent in self.sent.values())
        first = self.waiting.next_for(self.groups.get(worker, ""), at_work)
        group = self.groups[worker] = first.task.group
        others = min(self._together(group) - 1, self.waiting.of_group(group))
        cases = [first, *(self.waiting.next_for(group, at_work) for _ in range(others))]
        begun = [case for case in cases if case.entry.case in self.begun or self.begin(case)]
        self.begun.update(case.entry.case for case in begun)
        return tuple(begun)

    def _together(self, group: str) -> int:
        """So many cases of a group travel together; after a loss or a death each is alone again."""
        if group not in self.lasted or self.losses.total() or self.deaths:
            return 1
        threads = sum(self.threads.values())
        share = len(self.waiting) // (AHEAD * threads)  # of each, so that all end together
        return max(1, min(share, int(TOGETHER / max(self.lasted[group], SHORTEST))))

    def _has_room(self, worker: str, places: int) -> bool:
        under_way = sum(sent.size for sent in self.sent.values())
        cases = sum(sent.worker == worker for sent in self.sent.values())
        return cases < places and (under_way < MOST_BYTES or not self.sent)

    def _submit(self, cases: tuple[PlannedCase, ...], worker: str) -> None:
        sent, bundled = list[PlannedCase](), list[PlannedCase]()
        for case in cases:
            try:
                bundled.append(case._replace(task=BundledTask.of(case.task)))
                sent.append(case)
            except ExfitError as fault:
                self._fail(case, "failed", str(fault))
        if not sent:
            return
        payload = pickle.dumps(RemoteCases(tuple(bundled), self.batch, self.time_limit))
        key = f"exfit-{uuid4().hex}"

        # inside, so that it is pickled with its code: the scheduler unpacks it without exfit
        def run(payload: bytes) -> Any:
            from exfit.features.fleet.remote import run_packed

            return run_packed(payload)

        try:
            future = self.client.submit(run, payload, key=key, workers=[worker], pure=False)
        except Exception as fault:  # of many kinds, by where it has noticed
            raise lost(self.client, fault) from None
        self.sent[future.key] = Sent(tuple(sent), worker, len(payload), future)
        future.add_done_callback(lambda done: self.arrived.put(done.key))

    def _fetch(self) -> None:
        """Wait for a case to end, but no longer than until the next look at the workers.

        One whose worker was lost, or can fit none, is given to another.
        """
        from distributed.client import FutureCancelledError
        from distributed.scheduler import KilledWorker

        try:
            key = self.arrived.get(timeout=LOOK)
            sent = self.sent[key]
        except (Empty, KeyError):  # taken back before
            return
        try:
            replies: tuple[Reply, ...] = sent.future.result(timeout=FETCHED_WITHIN)
        except TimeoutError:
            self.arrived.put(key)  # or its worker is gone with it, as the next look shows
        except (FutureCancelledError, KilledWorker, OSError):
            self._take_back(key)
        except Exception as fault:
            self.refused[sent.worker] = f"cannot fit any case: {type(fault).__name__}: {fault}"
            self._lose(sent.worker)
        else:
            del self.sent[key]
            sent.future.release()
            try:
                self._send()  # before outcomes are written
            finally:
                for case, reply in zip(sent.cases, replies, strict=False):
                    self._finish(case, reply)
            for case in sent.cases[len(replies) :]:  # that it did not come to
                self.waiting.add(case)

    def _finish(self, case: PlannedCase, reply: Reply) -> None:
        """Take the outcome of a case; one whose process died is tried again, elsewhere perhaps."""
        if not reply.death:
            if known := reply.outcome.summary or reply.outcome.failure:
                self.lasted[case.task.group] = known.seconds
            self.end(case, reply.outcome)
            return
        self.deaths[case.entry.case] += 1
        if self.deaths[case.entry.case] < MOST_DEATHS:
            self.waiting.add(case)
        else:
            self._fail(case, "crashed", f"{reply.death}, {MOST_DEATHS} times")
