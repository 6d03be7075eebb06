"""Standard output and standard error that end no command: its files are worth more."""

import errno
import io
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

import click

from exfit.util.text import printable

FAILED = 1
UNABLE = ("strict", "surrogateescape")  # what Python has for streams: in the locale C the latter
CLOSED = (errno.EPIPE, errno.EINVAL)  # what a pipe without a reader is called, here and on Windows


class Outlet(io.RawIOBase):
    """Hands bytes on until that fails; remembers the fault, and drops what comes after."""

    def __init__(self, target: Any) -> None:
        self.target = target
        self.fault: OSError | None = None

    def writable(self) -> bool:
        """Tell that it can be written to."""
        return True

    def fileno(self) -> int:
        """Return the number of the file that the bytes go to."""
        return int(self.target.fileno())

    def write(self, data: Any) -> int | None:
        """Hand bytes on; return how many were taken."""
        if self.fault is None:
            try:
                count: int | None = self.target.write(data)
            except OSError as fault:
                self.fault = fault
            else:
                return count
        return len(data)


def echo(text: str, err: bool = False, file: Any = None) -> None:
    """Print a text, in which codes stand for what would control the terminal: names may hold it."""
    click.echo(printable(text), err=err, file=file)


@contextmanager
def unfailing_output() -> Iterator[Callable[[Any], Any]]:
    """Let nothing written to standard output or error raise, for as long as a command runs.

    Characters that the encoding lacks become question marks. What is given reports what was lost,
    and returns the exit code in place of a given one: 1 in place of 0, but not where the reader of
    a pipe has seen enough.
    """
    former = sys.stdout, sys.stderr
    sys.stdout, sys.stderr = (_unfailing(stream) for stream in former)

    def exit_code(code: Any) -> Any:
        sys.stdout.flush()
        fault = _fault_of(sys.stdout)
        if fault is None:
            return code
        closed = fault.errno in CLOSED
        kind = "Warning" if closed else "Error"
        text = f"{kind}: standard output: {fault.strerror}: not all of it was written"
        echo(text, err=True)
        return code if closed else code or FAILED

    try:
        yield exit_code
    finally:
        own = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = former
        for stream, closed in zip(own, former, strict=True):
            with suppress(OSError, ValueError):
                stream.flush() if closed else stream.close()


def output_is_lost() -> bool:
    """Tell whether standard output has no reader any more."""
    return _fault_of(sys.stdout) is not None


def _unfailing(stream: TextIO | None) -> TextIO:
    """Return a stream in place of one; for one that is closed a place that keeps nothing."""
    if stream is None:
        return open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123
    if not isinstance(stream, io.TextIOWrapper):
        return stream  # not the system's: a notebook's, a test's
    errors = "replace" if stream.errors in UNABLE else stream.errors
    if stream.isatty():
        stream.reconfigure(errors=errors)
        return stream
    with suppress(OSError):
        stream.flush()
    outlet = Outlet(getattr(stream.buffer, "raw", stream.buffer))
    return io.TextIOWrapper(
        io.BufferedWriter(outlet), stream.encoding, errors, line_buffering=stream.line_buffering
    )


def _fault_of(stream: TextIO) -> OSError | None:
    """Name the reason for which a stream loses its text."""
    outlet = getattr(getattr(stream, "buffer", None), "raw", None)
    return outlet.fault if isinstance(outlet, Outlet) else None
