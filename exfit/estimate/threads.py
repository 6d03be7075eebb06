"""Many searches side by side in threads, which one interruption ends together."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from queue import Empty, SimpleQueue
from threading import Event
from typing import TypeVar

from numpy.typing import ArrayLike

from exfit.estimate.arrays import Array
from exfit.estimate.requests import Function

Item = TypeVar("Item")
Done = TypeVar("Done")

LISTENING = 0.1  # s: on Windows an interruption reaches only what returns from waiting


def side_by_side(
    task: Callable[[Item], Done],
    items: Sequence[Item],
    workers: int | None,
    receive: Callable[[Done], object],
    stop: Event,
) -> None:
    """Do a task for every item in ``workers`` threads.

    ``receive`` is called with every result, in the thread that waits here. KeyboardInterrupt, there
    or in a task, sets ``stop``, which tasks obey by ``until``, and drops what has not begun. Any
    other exception does so too and is raised. None takes as many threads as there are processors.
    """
    finished: SimpleQueue[Future[Done]] = SimpleQueue()
    pool = ThreadPoolExecutor(workers or os.cpu_count())
    try:
        for item in items:
            pool.submit(task, item).add_done_callback(finished.put)
        for _ in items:
            receive(next_of(finished).result())
    except KeyboardInterrupt:
        stop.set()
    except BaseException:
        stop.set()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


def next_of(finished: "SimpleQueue[Future[Done]]") -> "Future[Done]":
    """Wait for the next task to end, open to interruptions."""
    while True:
        try:
            return finished.get(timeout=LISTENING)
        except Empty:
            continue


def until(stop: Event, fun: Function) -> Function:
    """Return fun, made to raise KeyboardInterrupt once ``stop`` is set."""

    def heeding(x: Array) -> ArrayLike:
        if stop.is_set():
            raise KeyboardInterrupt
        return fun(x)

    return heeding
