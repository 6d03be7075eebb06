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


@contextmanager
def terminations_as_interrupts() -> Iterator[None]:
    """Let SIGTERM, and the end of the terminal, interrupt what is inside as Ctrl-C does.

    One that is ignored stays so. In another thread than the main one nothing is done.
    """
    numbers = [getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")]
    former = {number: signal.getsignal(number) for number in numbers if number is not None}
    taken = [number for number, action in former.items() if action is signal.SIG_DFL]
    if threading.current_thread() is not threading.main_thread():
        taken = []
    try:
        for number in taken:
            signal.signal(number, _interrupt)
        yield
    finally:
        for number in taken:
            signal.signal(number, former[number])


def _interrupt(*_: object) -> None:
    """Interrupt as Ctrl-C does, which may be deferred, or ignored by what a script started."""
    if callable(signal.getsignal(signal.SIGINT)):
        signal.raise_signal(signal.SIGINT)
    else:
        raise KeyboardInterrupt
