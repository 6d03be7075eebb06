"""A program that simulates in place of exfit, in several processes side by side."""

import json
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from itertools import count
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.features.external.process import ExternalProcess, ProgramError
from exfit.util.text import show_value

Array = NDArray[np.float64]


class ExternalRun(NamedTuple):
    """A run of another program: its signals (M,) by name, or why it has none."""

    signals: Mapping[str, Array]
    failure: str = ""


class RunCounts(NamedTuple):
    """How many runs a program was asked for, how many failed, how often it was started anew."""

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
        keys = [_key(request) for request in requests]
        missing = {
            key: request
            for key, request in zip(keys, requests, strict=True)
            if key not in self._outcomes
        }
        self._values |= {_key_of(request["values"]) for request in missing.values()}
        self._run_all(missing)
        failed = {key: missing[key] for key in missing if self._outcomes[key].failure}
        self._earlier_failures += len(failed)
        self._run_all(failed)
        return [self._outcomes[key] for key in keys]

    def remembered(self, request: Mapping[str, Any]) -> ExternalRun | None:
        """Return the run of a request that was made before and has not failed, None else."""
        if _key_of(request["values"]) not in self._values:  # a search asks for many
            return None
        outcome = self._outcomes.get(_key(request))
        return None if outcome is None or outcome.failure else outcome

    def end(self) -> None:
        """End all processes."""
        for process in self._processes:
            process.end()

    def _run_all(self, requests: Mapping[str, Mapping[str, Any]]) -> None:
        """Remember the outcomes of requests by their keys."""
        if len(requests) <= 1 or len(self._processes) == 1:
            for key, request in requests.items():
                self._outcomes[key] = self._run(request)
        else:
            outcomes = self._side_by_side([*requests.values()])
            self._outcomes |= zip(requests, outcomes, strict=True)

    def _side_by_side(self, requests: Sequence[Mapping[str, Any]]) -> list[ExternalRun]:
        executor = ThreadPoolExecutor(min(len(requests), len(self._processes)))
        try:
            return list(executor.map(self._run, requests))
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            self.end()  # so that no thread waits for an answer
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


@contextmanager
def running(program: ExternalProgram) -> Iterator[ExternalProgram]:
    """Let a program be used inside, and end its processes however that ends."""
    try:
        yield program
    finally:
        program.end()


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
    for signal in signals:
        try:
            array = np.array(given[signal], dtype=np.float64)
        except (TypeError, ValueError):
            return ExternalRun({}, f"signals.{signal}: {show_value(given[signal])} is no list")
        if array.shape != (samples,):
            size = len(array) if array.ndim == 1 else f"an array {array.shape} of"
            return ExternalRun({}, f"signals.{signal}: {size} samples, not {samples}")
        wrong = int(np.count_nonzero(~np.isfinite(array)))
        if wrong:
            return ExternalRun({}, f"signals.{signal}: {wrong} of {samples} samples are not finite")
        arrays[signal] = array
    return ExternalRun(arrays)
