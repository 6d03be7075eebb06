"""What an interruption (Ctrl-C) may not cut in two, and signals that interrupt as Ctrl-C does."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

# how systems end a program: kill, a scheduler's time limit, a closed terminal, Ctrl-Break
ENDING = tuple(
    signal.Signals[name]
    for name in ("SIGTERM", "SIGHUP", "SIGBREAK")
    if name in signal.Signals.__members__
)
SIGNALLED = 128  # exit codes of programs that a signal ended are its number and this, for shells


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Let an interruption take effect only once what is inside has ended.

    Where that ends with an exception, this one counts. Other threads than the main one are never
    interrupted, and nothing is done in them; nor where interruptions are ignored.
    """
    if threading.current_thread() is threading.main_thread():
        with _deferred(signal.SIGINT, *ENDING):
            yield
    else:
        yield


@contextmanager
def _deferred(*numbers: signal.Signals) -> Iterator[None]:
    """Defer signals: one inside the other, so that each is restored whatever the others raise."""
    if not numbers:
        yield
        return
    first, *others = numbers
    former = signal.getsignal(first)
    if not callable(former):
        with _deferred(*others):
            yield
        return
    pending: list[int] = []
    signal.signal(first, lambda number, _: pending.append(number))
    try:
        with _deferred(*others):
            yield
    finally:
        signal.signal(first, former)
    if pending:
        signal.raise_signal(first)


@contextmanager
def endings_as_interruptions() -> Iterator[list[int]]:
    """Have signals that end a program interrupt what is inside, as Ctrl-C does.

    What is given holds the numbers of those that came. Those that are ignored, as by nohup, stay
    so; other threads than the main one get none.
    """
    received: list[int] = []
    program = os.getpid()

    def interrupt(number: int, _: FrameType | None) -> None:
        if os.getpid() != program:  # a process that was forked from this one ends as others do
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        received.append(number)
        raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    replaced = [it for it in ENDING if main and signal.getsignal(it) is signal.SIG_DFL]
    try:
        for number in replaced:
            signal.signal(number, interrupt)
        yield received
    finally:
        for number in replaced:
            signal.signal(number, signal.SIG_DFL)
        # where an interruption has passed through code made of text, as dataclasses are, CPython
        # ends the program by SIGINT in place of its exit code, unless other such code ran after it
        eval("None")
