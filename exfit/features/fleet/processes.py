"""The process of a worker, seen from the batch: its start, its pipes, its end."""

import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from queue import SimpleQueue
from tempfile import TemporaryFile
from threading import Thread
from typing import Any, NamedTuple

from exfit.features.fleet.plan import PlannedCase
from exfit.util.ended_processes import ending, last_lines
from exfit.util.interrupts import ENDING
from exfit.util.threads import THREADS

# the worker finds exfit where this process has found it
PROGRAM = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from exfit.features.fleet.worker import main; main()"
)
ONE_THREAD = (THREADS, "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
NO_PLUGINS = {"PYDANTIC_DISABLE_PLUGINS": "__all__"}  # else all packages are searched for some
TO_END = 5.0  # s: for a process without its pipe, and for the thread that listens to it


class Answer(NamedTuple):
    """What a worker says: that it is ready, that it begins, an outcome; None: that it has died."""

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

    def give(self, case: PlannedCase, group: str) -> None:
        """Give a case to a worker that has none."""
        self.case, self.group, self.began = case, group, None
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
        reason = ": ".join(
            filter(
                None, (ending(code, "the worker"), last_lines(self._errors, self._errors_before))
            )
        )
        for file in (self._tasks, self._answers, self._errors):
            with suppress(OSError):  # what could not be sent
                file.close()
        return reason


@contextmanager
def signals_held_back() -> Iterator[None]:
    """Let processes that are started inside have what interrupts a program held back, for good.

    A terminal sends Ctrl-C, and its own end, to all of its processes; only the batch shall act on
    it. Windows has no such mask: there the process is in a group of its own, which Ctrl-C does not
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
