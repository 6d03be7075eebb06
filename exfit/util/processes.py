"""Work shared out among the processors; how another process ended, in words."""

import os
import signal
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import IO, TYPE_CHECKING, TypeVar

from exfit.errors import ExfitError

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

Item = TypeVar("Item")
Done = TypeVar("Done")

THREADS = "EXFIT_THREADS"  # the variable of the environment that says how many threads compute
HIGHEST_CODE = 255  # with which a program ends by itself
MOST_ERRORS = 10_000  # bytes of them that are looked at
LINES_OF_ERRORS = 3


def processors() -> int:
    """Count the threads that shall compute: EXFIT_THREADS, else the processors of this process.

    These are the ones that it may use where the system says so, else all. Raises ExfitError where
    EXFIT_THREADS is no whole number from 1.
    """
    given = os.environ.get(THREADS, "")
    if not given:
        affinity = getattr(os, "sched_getaffinity", None)  # on Linux only
        return len(affinity(0)) if affinity else os.cpu_count() or 1
    if not given.isdecimal() or int(given) < 1:
        raise ExfitError(f"{THREADS}: {given} must be a whole number from 1")
    return int(given)


@cache
def _workers() -> "ThreadPoolExecutor":
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(max_workers=processors())


def in_threads(run: Callable[[Item], Done], items: Sequence[Item]) -> Iterable[Done]:
    """Return run(item) of each, spread over the processors; a single one needs no thread."""
    alone = len(items) == 1 or processors() == 1
    return map(run, items) if alone else _workers().map(run, items)


def ending(code: int, process: str) -> str:
    """Describe the end of a process by its exit code."""
    if code < 0:
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = f"signal {-code}"
        likely = ", out of memory or by hand" if name == "SIGKILL" else ""
        return f"{process} was ended by {name}{likely}"
    if code > HIGHEST_CODE:  # an exception of Windows
        return f"{process} was ended by {code:#x}"
    return f"{process} ended with exit code {code}"


def last_lines(errors: IO[bytes], since: int = 0) -> str:
    """Return the last lines of a file of errors, of those from the byte ``since`` on."""
    end = errors.seek(0, os.SEEK_END)
    errors.seek(max(since, end - MOST_ERRORS))
    lines = errors.read().decode(errors="replace").splitlines()
    return " | ".join([line.strip() for line in lines if line.strip()][-LINES_OF_ERRORS:])
