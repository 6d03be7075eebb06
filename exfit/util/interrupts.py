"""What an interruption (Ctrl-C) may not cut in two."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Let an interruption take effect only once what is inside has ended.

    Where that ends with an exception, this one counts. Other threads than the main one are never
    interrupted, and nothing is done in them; nor where interruptions are ignored.
    """
    former = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or not callable(former):
        yield
        return
    pending: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: pending.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, former)
    if pending:
        signal.raise_signal(signal.SIGINT)
