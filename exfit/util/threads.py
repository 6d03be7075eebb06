"""Work shared out among the processors."""

import os
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, TypeVar

from exfit.errors import ExfitError

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

Item = TypeVar("Item")
Done = TypeVar("Done")


THREADS = "EXFIT_THREADS"  # the variable of the environment that says how many threads compute


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
