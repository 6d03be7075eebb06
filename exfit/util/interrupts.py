"""What an interruption (Ctrl-C) may not cut in two, and signals that interrupt as Ctrl-C does."""

import _thread
import os
import signal
import sys
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
IMPORTING = "<frozen importlib._bootstrap>"  # the file of the frames of an import
AGAIN = 0.02  # s until a signal that met an import is looked at again

# the signals that came, of those who listen: whatever catches an interruption, it stays here
_received: list[list[int]] = []


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


def interrupted(times: int = 1) -> bool:
    """Tell whether so many interruptions have come, whoever caught them: nothing new is begun."""
    return any(len(numbers) >= times for numbers in _received)


@contextmanager
def endings_as_interruptions() -> Iterator[list[int]]:
    """Have signals that end a program interrupt what is inside, as Ctrl-C does.

    What is given holds the numbers of those that came, of Ctrl-C too. Those that are ignored, as by
    nohup, stay so; other threads than the main one get none. An import ends first: a module that
    was interrupted cannot be imported again, nor what needs it.
    """
    received: list[int] = []
    program, imports = os.getpid(), _imports(sys._getframe())

    def interrupt(number: int, frame: FrameType | None) -> None:
        if os.getpid() != program:  # a process that was forked from this one ends as others do
            signal.signal(number, former[signal.Signals(number)])
            signal.raise_signal(number)
            return
        if _imports(frame) > imports:
            again = threading.Timer(AGAIN, _send, (signal.Signals(number),))
            again.daemon = True
            again.start()
            return
        received.append(number)
        raise KeyboardInterrupt

    main = threading.current_thread() is threading.main_thread()
    usual = {signal.SIGINT: signal.default_int_handler, **dict.fromkeys(ENDING, signal.SIG_DFL)}
    former = {
        number: handler
        for number, handler in usual.items()
        if main and signal.getsignal(number) is handler
    }
    try:
        for number in former:
            signal.signal(number, interrupt)
        _received.extend([received] if former else ())
        yield received
    finally:
        _received[:] = [each for each in _received if each is not received]
        for number, handler in former.items():
            signal.signal(number, handler)
        # where an interruption has passed through code made of text, as dataclasses are, CPython
        # ends the program by SIGINT in place of its exit code, unless other such code ran after it
        eval("None")


def _send(number: signal.Signals) -> None:
    """Send the main thread a signal, which elsewhere than on Windows wakes it, too."""
    if sys.platform == "win32":
        _thread.interrupt_main(number)
    else:
        signal.pthread_kill(threading.main_thread().ident or 0, number)


def _imports(frame: FrameType | None) -> int:
    """Count the frames of imports from a frame outwards."""
    count = 0
    while frame is not None:
        count += frame.f_code.co_filename == IMPORTING
        frame = frame.f_back
    return count
