"""A program that simulates in place of exfit, in several long-lived processes side by side.

One line of JSON asks a process, one line is its answer.
"""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryFile
from threading import Thread
from typing import Any, NamedTuple

import numpy as np

from exfit.util.arrays import Array
from exfit.util.processes import ending, last_lines
from exfit.util.text import show_value

NAME = "the program"
# a program that hangs does not see that its input has ended, where exfit itself is killed
GUARD = "import os, sys; sys.stdin.buffer.read(); os.killpg(int(sys.argv[1]), 9)"
TO_END = 5.0  # s: for a process that was ended, and for the thread that listens to it


class ProgramError(Exception):
    """The program gave no answer that can be read."""


class ExternalProcess:
    """A process of a command: started when it is first asked, and again after each ProgramError.

    It runs in ``folder``, in a separate session, which Ctrl-C does not reach. Standard input
    and output are for the lines of JSON; what it writes about errors is quoted where it ends.
    """

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self.command, self.folder, self.starts = tuple(command), folder, 0
        self._running: _Running | None = None

    def answer(self, request: dict[str, Any], time_limit: float) -> dict[str, Any]:
        """Return the answer to a request, which has the same id.

        Raises ProgramError where there is none within ``time_limit`` (s), or none that is one.
        """
        try:
            if self._running is None:
                self._running = _Running(self.command, self.folder)
                self.starts += 1
            line = self._running.answer(json.dumps(request), time_limit)
            text = line.decode(errors="replace").strip()
            try:
                answer = json.loads(text)
            except ValueError:
                raise ProgramError(f"{show_value(text)} is not a line of JSON") from None
            if not isinstance(answer, dict):
                raise ProgramError(f"{show_value(text)} is not a JSON object")
            if answer.get("id") != request["id"]:
                given = show_value(answer.get("id"))
                raise ProgramError(f"the answer has id {given}, not {request['id']}")
            return answer
        except BaseException:  # an interruption too: what it says later answers nothing
            self.end()
            raise

    def end(self) -> None:
        """End the process, and all that it has started."""
        running, self._running = self._running, None
        if running is not None:
            running.end()


class _Running:
    """The process itself, with the thread that listens to it."""

    def __init__(self, command: Sequence[str], folder: Path) -> None:
        self._errors = TemporaryFile()  # noqa: SIM115 - it is closed where the process is ended
        try:
            self._process = subprocess.Popen(
                command,
                cwd=folder,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                start_new_session=True,
                creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),  # on Windows
            )
        except (OSError, ValueError) as fault:
            self._errors.close()
            raise ProgramError(f"{command[0]} cannot be started: {fault}") from fault
        self._guard: subprocess.Popen[bytes] | None = None
        if sys.platform != "win32":  # it kills the group when this process ends
            self._guard = subprocess.Popen(
                [sys.executable, "-S", "-E", "-c", GUARD, str(self._process.pid)],
                stdin=subprocess.PIPE,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,  # where the group has ended by itself
                start_new_session=True,
            )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests, self._answers = self._process.stdin, self._process.stdout
        self._lines: SimpleQueue[bytes] = SimpleQueue()
        self._listener = Thread(target=self._listen, daemon=True)
        self._listener.start()

    def _listen(self) -> None:
        """Put each line into a queue, an empty one at the end."""
        with suppress(OSError, ValueError):  # closed meanwhile
            for line in self._answers:
                self._lines.put(line)
        self._lines.put(b"")

    def answer(self, request: str, time_limit: float) -> bytes:
        with suppress(OSError):  # it has ended, as its answers say
            self._requests.write(request.encode() + b"\n")
            self._requests.flush()
        try:
            line = self._lines.get(timeout=time_limit)
        except Empty:
            raise ProgramError(f"no answer within {time_limit:g} s") from None
        if line:
            return line
        try:
            code = self._process.wait(TO_END)
        except subprocess.TimeoutExpired:
            raise ProgramError(f"{NAME} has closed its output") from None
        words = filter(None, (ending(code, NAME), last_lines(self._errors)))
        raise ProgramError(": ".join(words))

    def end(self) -> None:
        """Kill the process with its group and wait for it."""
        if self._guard is not None:
            self._guard.kill()
            self._guard.communicate()
        if sys.platform == "win32":
            self._process.kill()
        else:
            with suppress(ProcessLookupError, PermissionError):  # all of the group has ended
                os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._listener.join(TO_END)
        for file in (self._requests, self._answers, self._errors):
            with suppress(OSError):  # what could not be sent
                file.close()


class ExternalRun(NamedTuple):
    """A run of another program: its signals (M,) by name, or why it has none."""

    signals: Mapping[str, Array]
    failure: str = ""


class RunCounts(NamedTuple):
    """How many runs a program was asked for, how many failed, how often it was restarted."""

    runs: int
    failed: int
    restarts: int


class ExternalProgram:
    """A command that simulates: ``parallel`` processes of it, each with a ``time_limit`` (s).

    ``place`` is where the case names it. A run that fails is made once again: of what fails now and
    then a second run has signals, of what cannot be simulated it has none either. No run is asked
    for beyond that: its outcome is remembered, a failure too.
    """

    def __init__(
        self,
        command: Sequence[str],
        folder: Path,
        parallel: int,
        time_limit: float,
        place: str = "plant.command",
    ) -> None:
        self.time_limit, self.place = time_limit, place
        self._processes = [ExternalProcess(command, folder) for _ in range(parallel)]
        self._free: SimpleQueue[ExternalProcess] = SimpleQueue()
        for process in self._processes:
            self._free.put(process)
        self._outcomes: dict[str, ExternalRun] = {}
        self._values: set[str] = set()
        self._numbers = count(1)
        self._earlier_failures = 0

    @property
    def counts(self) -> RunCounts:
        """The runs until now."""
        failed = sum(bool(outcome.failure) for outcome in self._outcomes.values())
        again = self._earlier_failures
        starts = sum(process.starts for process in self._processes)
        started = sum(process.starts > 0 for process in self._processes)
        return RunCounts(len(self._outcomes) + again, failed + again, starts - started)

    def runs(self, requests: Sequence[Mapping[str, Any]]) -> list[ExternalRun]:
        """Return the runs of requests, side by side; each names its "signals" and "times"."""
        by_key = {_key(request): request for request in requests}
        missing = {key: by_key[key] for key in by_key if key not in self._outcomes}
        self._values |= {_key_of(request["values"]) for request in missing.values()}
        self._run_all(missing)
        failed = {key: missing[key] for key in missing if self._outcomes[key].failure}
        self._earlier_failures += len(failed)
        self._run_all(failed)
        return [self._outcomes[_key(request)] for request in requests]

    def remembered(self, request: Mapping[str, Any]) -> ExternalRun | None:
        """Return the run of a request that was made before and has not failed, None else."""
        if _key_of(request["values"]) not in self._values:  # a search asks for many
            return None
        outcome = self._outcomes.get(_key(request))
        return None if outcome is None or outcome.failure else outcome

    def close(self) -> None:
        """End all processes."""
        for process in self._processes:
            process.end()

    def _run_all(self, requests: Mapping[str, Mapping[str, Any]]) -> None:
        """Remember the outcomes of requests by their keys."""
        if len(requests) <= 1 or len(self._processes) == 1:
            for key, request in requests.items():
                self._outcomes[key] = self._run(request)
            return
        executor = ThreadPoolExecutor(min(len(requests), len(self._processes)))
        try:
            outcomes = list(executor.map(self._run, requests.values()))
            self._outcomes |= zip(requests, outcomes, strict=True)
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            self.close()  # so that no thread waits for an answer
            raise
        finally:
            executor.shutdown()

    def _run(self, request: Mapping[str, Any]) -> ExternalRun:
        process = self._free.get()
        try:
            answer = process.answer({"id": next(self._numbers), **request}, self.time_limit)
        except ProgramError as fault:
            return ExternalRun({}, str(fault))
        finally:
            self._free.put(process)
        return run_of(answer, request["signals"], len(request["times"]))


def _key(request: Mapping[str, Any]) -> str:
    return json.dumps({**request, "values": _key_of(request["values"])}, sort_keys=True)


def _key_of(values: Mapping[str, float]) -> str:
    """Key of values, alike for those that differ by rounding."""
    return json.dumps({name: f"{value:.12g}" for name, value in values.items()}, sort_keys=True)


def run_of(answer: Mapping[str, Any], signals: Sequence[str], samples: int) -> ExternalRun:
    """Return the run that an answer holds: all of the signals, as many finite samples of each."""
    if "error" in answer:
        return ExternalRun({}, f"it reports: {answer['error']}")
    given = answer.get("signals")
    if not isinstance(given, Mapping):
        return ExternalRun({}, "the answer has neither signals nor error")
    missing = [signal for signal in signals if signal not in given]
    if missing:
        return ExternalRun({}, f"signals.{missing[0]}: missing in the answer")
    arrays: dict[str, Array] = {}
    for name in signals:
        try:
            array = np.array(given[name], dtype=np.float64)
        except (TypeError, ValueError):
            return ExternalRun({}, f"signals.{name}: {show_value(given[name])} is not a list")
        if array.shape != (samples,):
            size = len(array) if array.ndim == 1 else f"an array {array.shape} of"
            return ExternalRun({}, f"signals.{name}: {size} samples, not {samples}")
        wrong = int(np.count_nonzero(~np.isfinite(array)))
        if wrong:
            return ExternalRun({}, f"signals.{name}: {wrong} of {samples} samples are not finite")
        arrays[name] = array
    return ExternalRun(arrays)
