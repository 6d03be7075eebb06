"""How another process ended, in words: its exit code, and what it wrote about errors last."""

import os
import signal
from typing import IO

HIGHEST_CODE = 255  # with which a program ends by itself
MOST_ERRORS = 10_000  # bytes of them that are looked at
LINES_OF_ERRORS = 3


def ending(code: int, process: str) -> str:
    """Describe the end of a process by its exit code."""
    if code < 0:
        return f"{process} was ended by {_signal_name(-code)}"
    if code > HIGHEST_CODE:  # an exception of Windows
        return f"{process} was ended by {code:#x}"
    return f"{process} ended with exit code {code}"


def last_lines(errors: IO[bytes], since: int = 0) -> str:
    """Return the last lines of a file of errors, of those from the byte ``since`` on."""
    end = errors.seek(0, os.SEEK_END)
    errors.seek(max(since, end - MOST_ERRORS))
    lines = errors.read().decode(errors="replace").splitlines()
    return " | ".join([line.strip() for line in lines if line.strip()][-LINES_OF_ERRORS:])


def _signal_name(number: int) -> str:
    """Return the name of a signal, with what is likely behind it."""
    try:
        name = signal.Signals(number).name
    except ValueError:
        return f"signal {number}"
    return f"{name}, for want of memory or by hand" if name == "SIGKILL" else name
