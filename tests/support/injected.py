"""Interruptions of a command at an entry into a module of exfit, and what is wrong after them.

The entries are counted, so that a run can be interrupted again at the same one. A module is
interrupted when a command enters it for the first time and for the last.
"""

import contextlib
import inspect
import io
import math
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np
from ended_commands import contents

from exfit import __main__
from exfit.util import interrupts

OWN = str(Path(__main__.__file__).parent) + os.sep
CODES = KEPT, NOTHING_KEPT = 3, 130
MARK = '"interrupted": true'  # of a result that was written before its end


class Entry(NamedTuple):
    """The n-th call of a function of a module, from 1 on."""

    module: str
    number: int


class _Again:
    """Calls a function once the exception that has it is handled and gone."""

    def __init__(self, function: Callable[[], None]) -> None:
        self.function = function

    def __del__(self) -> None:
        self.function()


class Injection:
    """Counts the entries while a command runs, and interrupts at one, and perhaps once more.

    ``gap``: the second interruption comes so many entries after the first has been caught.
    """

    def __init__(self, at: Entry | None = None, gap: int = 0) -> None:
        self.at, self.gap = at, gap
        self.counts, self.since = Counter[str](), 0
        self.sent: list[tuple[float, float]] = []  # s of processor time and of the clock, at each

    def __call__(self, frame, event: str, _) -> None:
        code = frame.f_code
        listening = event == "call" and interrupts._received
        if not listening or not code.co_filename.startswith(OWN) or code.co_name[0] == "<":
            return
        if code.co_flags & inspect.CO_GENERATOR:  # its last lines would be skipped
            return
        module = code.co_filename[len(OWN) :]
        self.counts[module] += 1
        first = not self.sent and self.at == (module, self.counts[module])
        if self.sent:
            self.since += 1
        if first or (len(self.sent) == 1 and self.gap and self.since == self.gap):
            self.sent.append(_now())
            try:
                signal.raise_signal(signal.SIGINT)
            except KeyboardInterrupt as interruption:  # which takes this function away
                interruption.again = _Again(self.go_on)
                raise

    def go_on(self) -> None:
        """Count on, where a second interruption is to come."""
        if self.gap:
            sys.setprofile(self)


def _now() -> tuple[float, float]:
    return time.process_time(), time.monotonic()


class Ran(NamedTuple):
    """How a command ended, what it wrote to standard error, and how long it went on, s.

    Since the first interruption: by the processor, and by the clock.
    """

    code: int | None
    err: str
    seconds: tuple[float, float]


def run(arguments: tuple[str, ...], injection: Injection) -> Ran:
    """Run a command in this process as the program does, with an injection."""
    out, err, code = io.StringIO(), io.StringIO(), None
    given, sys.argv = sys.argv, ["exfit", *arguments]
    ending = _page_that_ends() if arguments[0] == "app" else contextlib.nullcontext()
    try:
        with ending, contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            sys.setprofile(injection)
            try:
                __main__.main()
            except SystemExit as ended:
                code = int(ended.code or 0)
            finally:
                sys.setprofile(None)
    finally:
        sys.argv = given
    processor, clock = np.subtract(_now(), injection.sent[0]) if injection.sent else (0.0, 0.0)
    injection.gap = 0
    return Ran(code, err.getvalue(), (processor, clock))


def entries(arguments: tuple[str, ...]) -> list[Entry]:
    """Return the first and the last entry into each module of exfit."""
    counting = Injection()
    ran = run(arguments, counting)
    assert ran.code in (0, 3), (arguments, ran.err)
    ends = ((module, number) for module, n in counting.counts.items() for number in {1, n})
    return sorted(Entry(*end) for end in ends)


@contextlib.contextmanager
def _page_that_ends() -> Iterator[None]:
    """Let the server of a page end when nobody opens it: without an interruption, with 0."""
    from exfit.features.app import server

    class Closed(server.Pages):
        def __init__(self) -> None:
            super().__init__()
            self.closed = -math.inf

    with mock.patch.object(server, "Pages", Closed):
        yield


class Ended(NamedTuple):
    """What is wrong after interruptions of a command, and how long it went on, as in Ran."""

    faults: list[str]
    seconds: tuple[float, float]


def _stamps(folder: Path) -> dict[Path, int]:
    """Return when each file of a folder was written, ns."""
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}


def interrupted(
    arguments: tuple[str, ...], at: Entry, gap: int, whole: set[Path], folder: Path
) -> Ended:
    """Interrupt a command once or twice; ``whole`` are the files of a run without that."""
    injection, faults, before = Injection(at, gap), [], _stamps(folder)
    ran = run(arguments, injection)
    if not injection.sent:
        return Ended([], (0.0, 0.0))
    served = arguments[0] == "app" and ran.code == 0  # Ctrl-C ends it so; one swallowed, with 3
    if not served and ran.code not in CODES:
        faults.append(f"exit code {ran.code}: {ran.err}")
    if not served and "nterrupted" not in ran.err:
        faults.append(f"not said: {ran.code} {ran.err!r}")
    if "Traceback" in ran.err:
        faults.append(ran.err)
    written = [path for path, stamp in _stamps(folder).items() if before.get(path) != stamp]
    if ran.code == KEPT and not written:
        faults.append(f"exit code {KEPT}, but nothing is kept: {ran.err}")
    partial = [path for path in written if path.suffix == ".json" and MARK in path.read_text()]
    if ran.code == NOTHING_KEPT and partial:
        faults.append(f"exit code {NOTHING_KEPT}, but {partial[0]} is kept")
    if others := {*contents(folder)} - whole:
        faults.append(f"files: {sorted(map(str, others))}")
    return Ended(faults, ran.seconds)
