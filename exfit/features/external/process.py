"""A long-lived process that simulates: one line of JSON asks it, one line is its answer."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryFile
from threading import Thread
from typing import IO, Any

from exfit.util.processes import ending, last_lines
from exfit.util.text import show_value

NAME = "the program"
# a program that hangs does not see that its input has ended, where exfit itself is killed
GUARD = "import os, sys; sys.stdin.buffer.read(); os.killpg(int(sys.argv[1]), 9)"
TO_END = 5.0  # s: for a process that was ended, and for the thread that listens to it


class ProgramError(Exception):
    """The program gave no answer that can be read."""


class ExternalProcess:
    """A process of a command: started when it is first asked, and anew after each ProgramError.

    It runs in ``folder``, in a session of its own, which Ctrl-C does not reach. Standard input
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
            answer = self._running.answer(json.dumps(request), time_limit)
            return _checked(answer, request["id"])
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
        self._guard = _guard_of(self._process.pid)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests, self._answers = self._process.stdin, self._process.stdout
        self._lines: SimpleQueue[bytes] = SimpleQueue()
        self._listener = Thread(target=_listen, args=(self._answers, self._lines), daemon=True)
        self._listener.start()

    def answer(self, request: str, time_limit: float) -> bytes:
        with suppress(OSError):  # it has ended, as its answers say
            self._requests.write(request.encode() + b"\n")
            self._requests.flush()
        try:
            line = self._lines.get(timeout=time_limit)
        except Empty:
            raise ProgramError(f"no answer within {time_limit:g} s") from None
        if not line:
            raise ProgramError(self._reason())
        return line

    def _reason(self) -> str:
        """Describe the end of a process whose answers have ended."""
        try:
            code = self._process.wait(TO_END)
        except subprocess.TimeoutExpired:
            return f"{NAME} has closed its output"
        return ": ".join(filter(None, (ending(code, NAME), last_lines(self._errors))))

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


def _guard_of(group: int) -> subprocess.Popen[bytes] | None:
    """Start what kills a group of processes when this process ends; not on Windows."""
    if sys.platform == "win32":
        return None
    return subprocess.Popen(
        [sys.executable, "-S", "-E", "-c", GUARD, str(group)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,  # where the group has ended by itself
        start_new_session=True,
    )


def _listen(answers: IO[bytes], lines: "SimpleQueue[bytes]") -> None:
    """Put each line into a queue, an empty one at the end."""
    with suppress(OSError, ValueError):  # closed meanwhile
        for line in answers:
            lines.put(line)
    lines.put(b"")


def _checked(line: bytes, number: int) -> dict[str, Any]:
    """Read the line of an answer; raises ProgramError where it is none."""
    text = line.decode(errors="replace").strip()
    try:
        answer = json.loads(text)
    except ValueError:
        raise ProgramError(f"{show_value(text)} is not a line of JSON") from None
    if not isinstance(answer, dict):
        raise ProgramError(f"{show_value(text)} is not a JSON object")
    if answer.get("id") != number:
        raise ProgramError(f"the answer has id {show_value(answer.get('id'))}, not {number}")
    return answer
