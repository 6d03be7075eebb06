"""The memory that reading a file may take: what a file will need is estimated before it is read.

A file of a few kilobytes can declare, or unpack to, more than any computer holds.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from exfit.errors import RecordError
from exfit.util.files import regular_size, why_unreadable

GIGABYTE = 1e9
LEAST_LIMIT = 1.0  # GB, where a case gives none
SHARE_OF_FILE = 4.0  # the limit is so many times the file's size, where that is more
MOST_BY_SIZE = 4.0  # GB, that the size of a file alone may lift the limit to
OWN = 0.15e9  # bytes, of Python and the libraries, without any file
NUMBER = 8  # bytes of a float64
WORKING_COLUMNS = 10  # as long as the record, which looking at a column takes at a time
HOW_TO_RAISE = "memory, in GB, raises it: of the record in a case, --memory of a command"


class TooLargeError(RecordError):
    """A file that needs more memory than it may take."""


@dataclass(frozen=True)
class MemoryLimit:
    """How much memory, in bytes, reading a file may take."""

    path: Path
    size: int
    most: float

    def check(self, needed: float, what: str) -> None:
        """Raise TooLargeError where ``what`` needs more bytes than are allowed."""
        total = needed + OWN
        if total > self.most:
            raise TooLargeError(
                f"{self.path}: {what}: reading needs about {total / GIGABYTE:.3g} GB of memory, "
                f"the limit is {self.most / GIGABYTE:.3g} GB; {HOW_TO_RAISE}"
            )

    def check_columns(self, lengths: Sequence[int], held: float = 0.0) -> None:
        """Raise TooLargeError where columns of such lengths, beside ``held`` bytes, need more."""
        longest = max(lengths, default=0)
        needed = NUMBER * (sum(lengths) + WORKING_COLUMNS * longest)
        plural = "s" * (len(lengths) != 1)
        self.check(needed + held, f"{longest} samples in {len(lengths)} column{plural}")


def memory_limit(path: Path, memory: float | None, *beside: Path) -> MemoryLimit:
    """Return the limit for a file and those ``beside`` it; ``memory`` in GB, None: the usual one.

    Raises RecordError for what is no file, as a pipe or a device, which may never end, and for one
    that is larger than the limit.
    """
    size = sum(map(_size, (path, *beside)))
    usual = max(LEAST_LIMIT, min(SHARE_OF_FILE * size / GIGABYTE, MOST_BY_SIZE))
    limit = MemoryLimit(path, size, GIGABYTE * (usual if memory is None else memory))
    limit.check(size, f"{size} bytes")
    return limit


def _size(path: Path) -> int:
    """Return the size of a file in bytes; raises RecordError for what is none."""
    with readable(path):
        return regular_size(path)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Raise RecordError for what keeps a file from being read."""
    try:
        yield
    except (OSError, ValueError) as fault:
        raise RecordError(f"{path}: cannot be read: {why_unreadable(fault)}") from None
