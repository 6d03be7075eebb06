"""Compound files ([MS-CFB]), as .xls are: streams whose sectors are linked in chains."""

import struct
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

MARK = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
HEAD = 512
FIRST_LINKS = 109  # sectors of links that the head itself names
LAST = 0xFFFFFFFA  # a larger number is no sector
SHIFTS = (9, 12)  # two to so many is the size of a sector
ENTRY, STREAM, ROOT = 128, 2, 5
SMALL = 64  # bytes of a sector of small streams


class CompoundError(Exception):
    """A chain of sectors that does not end, or a part that is missing."""


class _Entry(NamedTuple):
    """A line of the directory: its first sector, and how many bytes it has."""

    name: str
    kind: int
    start: int
    size: int


def streams(data: bytes) -> Iterator[tuple[str, bytes]]:
    """Yield the streams of a compound file by name; raises CompoundError for a damaged one."""
    if len(data) < HEAD:
        raise CompoundError(f"{len(data)} bytes are less than its head")
    shift, first, small_below, small_links = struct.unpack_from("<30xH16xI4x2I", data)
    if shift not in SHIFTS:
        raise CompoundError(f"sectors of 2**{shift} bytes")
    size = 1 << shift
    links = _numbers(_joined(data, _link_sectors(data, size), size))

    def chained(start: int) -> bytes:
        return _joined(data, _chain(links, start), size)

    root, *entries = _entries(chained(first))
    short, short_links = chained(root.start), _numbers(chained(small_links))
    sectors = 0
    for entry in entries:
        if entry.kind != STREAM:
            continue
        small = entry.size < small_below
        chain = _chain(short_links if small else links, entry.start)
        sectors += len(chain)
        if sectors > len(links) + len(short_links):
            raise CompoundError("streams share their sectors")
        stream = _joined(short, chain, SMALL, 0) if small else _joined(data, chain, size)
        yield entry.name, stream[: entry.size]


def _link_sectors(data: bytes, size: int) -> list[int]:
    """Return the sectors that hold the links."""
    numbers = [*struct.unpack_from(f"<{FIRST_LINKS}I", data, HEAD - 4 * FIRST_LINKS)]
    (following,) = struct.unpack_from("<I", data, 68)
    while following < LAST:
        *more, following = _numbers(_joined(data, [following], size)) or (LAST,)
        numbers += more
        if len(numbers) * size > len(data) + (FIRST_LINKS + size) * size:
            raise CompoundError("more links than sectors")
    return [number for number in numbers if number < LAST]


def _chain(links: Sequence[int], start: int) -> list[int]:
    """Return the sectors of a chain in their order."""
    chain = []
    while start < LAST:
        chain.append(start)
        if start >= len(links) or len(chain) > len(links):
            raise CompoundError("a chain of sectors does not end")
        start = links[start]
    return chain


def _joined(data: bytes, sectors: Sequence[int], size: int, head: int = 1) -> bytes:
    """Return the bytes of sectors, which begin after so many that are the head."""
    return b"".join(data[(at + head) * size : (at + head + 1) * size] for at in sectors)


def _numbers(data: bytes) -> list[int]:
    numbers: list[int] = np.frombuffer(data[: len(data) // 4 * 4], "<u4").tolist()
    return numbers


def _entries(directory: bytes) -> list[_Entry]:
    """Return the lines of the directory, that of the root first."""
    entries = []
    for at in range(0, len(directory) - ENTRY + 1, ENTRY):
        name, length, kind, start, size = struct.unpack_from("<64sHB49xIQ", directory, at)
        text = name[: max(length - 2, 0)].decode("utf-16-le", "replace")
        entries.append(_Entry(text, kind, start, size))
    if not entries or entries[0].kind != ROOT:
        raise CompoundError("no directory")
    return entries
