"""Work shared out among the processors."""

import os
from collections.abc import Callable, Iterable, Sequence
from functools import cache
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from concurrent.futures import ThreadPoolExecutor

Item = TypeVar("Item")
Done = TypeVar("Done")


@cache
def _workers() -> "ThreadPoolExecutor":
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(max_workers=os.cpu_count() or 1)


def in_threads(run: Callable[[Item], Done], items: Sequence[Item]) -> Iterable[Done]:
    """Return run(item) of each, spread over the processors; a single one needs no thread."""
    return map(run, items) if len(items) == 1 else _workers().map(run, items)
