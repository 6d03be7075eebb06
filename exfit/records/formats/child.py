"""Binary files, read in a process of its own whose memory and time are limited.

A file of a few kilobytes can declare, or unpack to, more than any computer holds, and a damaged one
can end a package that reads it, and Python with it. The process of this one starts a child for such
a file, and asks it for one column after the other: a line of JSON each way, then the bytes of the
column. The child ends with the table.

Memory is limited where the system limits the addresses of a process (Linux; macOS and Windows do
not). Everywhere what a file says of its size is checked before it is read, and the child is ended
when it takes too long.
"""

import json
import os
import sys
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields
from functools import partial
from importlib import import_module
from io import BufferedReader
from pathlib import Path
from subprocess import PIPE, Popen, TimeoutExpired
from tempfile import TemporaryFile
from threading import Timer
from time import monotonic
from typing import IO, Any, NoReturn, cast
from weakref import finalize

import numpy as np
from numpy.typing import NDArray

from exfit.errors import RecordError
from exfit.records.formats.columns import Columns
from exfit.records.formats.table import (
    GIGABYTE,
    HOW_TO_RAISE,
    OWN,
    MemoryLimit,
    StoppedError,
    memory_limit,
)
from exfit.util.files import on_disk
from exfit.util.processes import ending, last_lines

BOOT = (
    "import sys; sys.path[:] = sys.argv[1:]; from exfit.records.formats.child import serve; serve()"
)
ENVIRONMENT = {"OPENBLAS_NUM_THREADS": "1", "RUST_BACKTRACE": "0"}
PACKAGES = {"excel": "python_calamine", "matlab": "scipy.io", "parquet": "pyarrow.parquet"}
LONGEST = (60.0, 10e-6)  # s to answer, and for each byte of the file
ADDRESSES = 2e9  # bytes that libraries reserve, where the system does not say it
OUT_OF_MEMORY = ("memory allocation", "MemoryError")  # as Rust and Python say it
PANIC = "panicked"  # Rust's word for an end by a fault of its own
ENDING = 5.0  # s that a process has to end after it closed its output
LEAST = 0.3e9  # bytes: with fewer addresses some packages read no file at all
KEPT = frozenset(("path", "fetch", "limit"))  # fields of a table that are no part of the answer


def read_table(module: str, path: Path, sheet: str | None, memory: float | None) -> Columns:
    """Read a binary file by a module of this package, in a child; ``memory`` in GB.

    Raises RecordError for a file that is damaged or needs more memory or time than it may take, or
    where the package that reads it is missing.
    """
    limit = memory_limit(path, memory)
    child = _Child(limit, module, "read", sheet)
    found: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value
        for name, value in child.answer().items()
    }
    return Columns(path=path, fetch=child.column, limit=limit, **found)


def texts_of_sheets(path: Path) -> dict[str, list[list[str]]]:
    """Read the cells of all sheets of a workbook as texts, by name; raises RecordError."""
    sheets: dict[str, list[list[str]]] = _Child(
        memory_limit(path, None), "excel", "texts_of_sheets", None
    ).answer()
    return sheets


class _Child:
    """The process that reads one file."""

    def __init__(self, limit: MemoryLimit, module: str, function: str, sheet: str | None) -> None:
        size = 0
        with suppress(Exception), zipfile.ZipFile(on_disk(limit.path)) as archive:  # a workbook
            size = sum(entry.file_size for entry in archive.filelist)
        limit.check(size, f"{size} bytes, unpacked")
        self.limit = limit
        self.seconds = LONGEST[0] + LONGEST[1] * limit.size
        try:
            self.errors = TemporaryFile()  # noqa: SIM115 - it ends with the process
            self.process = Popen(
                [sys.executable, "-P", "-c", BOOT, *sys.path],
                stdin=PIPE,
                stdout=PIPE,
                stderr=self.errors,
                env={**os.environ, **ENVIRONMENT},
            )
        except OSError as fault:
            text = f"{limit.path}: the process that reads it cannot be started: {fault}"
            raise RecordError(text) from fault
        finalize(self, _end, self.process, self.errors)
        self.first = [module, function, str(limit.path), sheet, limit.most, self.seconds]

    def answer(self) -> Any:
        """Return what it finds in the file."""
        found, _ = self._answered(self.first)
        return found

    def column(self, at: int) -> NDArray[Any]:
        """Fetch a column by its place."""
        kind, data = self._answered(at)
        return data.view(kind)

    def _answered(self, request: Any) -> tuple[Any, NDArray[np.uint8]]:
        requests = cast(IO[bytes], self.process.stdin)
        answers = cast(BufferedReader, self.process.stdout)
        late, began = Timer(self.seconds, self.process.kill), monotonic()
        late.daemon = True
        late.start()
        try:
            requests.write(json.dumps(request).encode() + b"\n")
            requests.flush()
            error, memory, content, size = json.loads(answers.readline())
            data = np.empty(size, np.uint8)
            if answers.readinto(data.data) < size:
                raise EOFError
        except (OSError, EOFError, ValueError):
            self._refuse_ended(monotonic() - began)
        except BaseException:
            self.process.kill()  # else the rest of this answer would be taken for the next one
            raise
        finally:
            late.cancel()
        if memory:
            raise self._too_large()
        if error is not None:
            raise RecordError(error)
        return content, data

    def _refuse_ended(self, taken: float) -> NoReturn:
        """Raise the error of a process that ended without an answer."""
        if taken >= self.seconds:
            self.process.kill()
            text = f"reading it took longer than {self.seconds:.3g} s"
            raise StoppedError(f"{self.limit.path}: {text}")
        try:
            code = self.process.wait(ENDING)
        except TimeoutExpired:
            self.process.kill()
            code = self.process.wait()
        said = last_lines(self.errors)
        if any(words in said for words in OUT_OF_MEMORY):
            raise self._too_large()
        what = "damaged: " if code < 0 or PANIC in said else ""
        why = ending(code, "the process that read it") + (f": {said}" if said else "")
        raise StoppedError(f"{self.limit.path}: {what}{why}")

    def _too_large(self) -> StoppedError:
        most = self.limit.most / GIGABYTE
        return StoppedError(
            f"{self.limit.path}: reading needs more than {most:.3g} GB of memory, the limit; "
            f"{HOW_TO_RAISE}"
        )


def _end(process: Popen[bytes], errors: IO[bytes]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout, errors):
        if stream is not None:
            with suppress(OSError):  # of what the process did not take any more
                stream.close()


# ---- in the child


def serve() -> None:
    """Read the file that the first line of the input names, and answer for its columns."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what a package prints is no answer
    requests = sys.stdin.buffer
    module, function, path, sheet, most, seconds = json.loads(requests.readline())
    lonely = Timer(2.0 * seconds, os._exit, (1,))  # where who asked has been killed
    lonely.daemon = True
    lonely.start()
    with suppress(ImportError):  # said by the module itself
        import_module(PACKAGES[module])
    _limit_memory(most)
    read = getattr(import_module(f"exfit.records.formats.{module}"), function)
    found = _answer(answers, partial(read, Path(path), *([] if sheet is None else [sheet])))
    lonely.cancel()
    if isinstance(found, Columns):
        for line in requests:
            _answer(answers, partial(found.fetch, int(line)))


def _answer(answers: IO[bytes], ask: Callable[[], Any]) -> Any:
    """Answer with what a function returns, or why it does not."""
    found, data = None, b""
    try:
        found = content = ask()
        if isinstance(found, np.ndarray):
            content, data = found.dtype.str, found.tobytes()
        elif isinstance(found, Columns):
            names = {field.name for field in fields(found)} - KEPT
            content = {name: getattr(found, name) for name in names}
        head = json.dumps([None, False, content, len(data)])
    except RecordError as fault:
        head = json.dumps([str(fault), False, None, 0])
    except MemoryError:
        head, data = json.dumps([None, True, None, 0]), b""
    answers.write(head.encode() + b"\n")
    answers.write(data)
    answers.flush()
    return found


def _limit_memory(most: float) -> None:
    """Limit the addresses of this process to those that it has and so many bytes more."""
    if sys.platform == "win32":
        return
    import resource

    try:
        pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[0])
        used = float(pages * resource.getpagesize())
    except OSError:
        used = ADDRESSES
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    allowed = int(used + max(most - OWN, LEAST))
    if hard != resource.RLIM_INFINITY:
        allowed = min(allowed, hard)
    with suppress(OSError, ValueError):  # macOS has the name, not the limit
        resource.setrlimit(resource.RLIMIT_AS, (allowed, allowed))
    with suppress(OSError, ValueError):
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
