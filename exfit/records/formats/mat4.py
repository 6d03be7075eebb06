"""The layout of MATLAB files of version 4: each matrix has a head of five numbers and its name.

Checked here is that the file holds what the heads declare (MathWorks, "MAT-File Format",
chapter 1), and that it does not need too much memory.
"""

import struct

from exfit.records.formats.mat5 import ARRAYS, CHARACTER_BYTES, COMPLEX_BYTES, Damage
from exfit.records.formats.memory import MemoryLimit

HEAD = 20
WIDTHS = (8, 4, 4, 2, 2, 1)  # bytes of a number, by its type
FULL, TEXT, SPARSE = 0, 1, 2
MOST_KIND = 5000  # of a head in the right order of bytes


def is_mat4(data: bytes) -> bool:
    """Return whether a file is of version 4."""
    return len(data) >= HEAD and b"\0" in data[:4]


def check(data: bytes, limit: MemoryLimit) -> None:
    """Raise Damage where a matrix exceeds the file, TooLargeError where all need too much."""
    order = "<" if 0 <= struct.unpack("<i", data[:4])[0] <= MOST_KIND else ">"
    needed, at = len(data), 0
    while at < len(data):
        if len(data) - at < HEAD:
            raise Damage(f"{len(data) - at} bytes after the last matrix")
        kind, rows, columns, is_complex, name = struct.unpack_from(order + "5i", data, at)
        number, matrix = kind // 10 % 10, kind % 10
        if number >= len(WIDTHS) or matrix > SPARSE or min(kind, rows, columns, name) < 0:
            raise Damage(f"a matrix of the kind {kind} and the size ({rows}, {columns})")
        count = rows * columns
        size = count * WIDTHS[number] * (2 if is_complex == 1 and matrix == FULL else 1)
        at += HEAD + name + size
        if at > len(data):
            raise Damage(f"a matrix of {size} bytes in a file of {len(data)}")
        text = CHARACTER_BYTES * count if matrix == TEXT else 2 * size
        needed += COMPLEX_BYTES * count if size > count * WIDTHS[number] else text
        limit.check(needed, ARRAYS)
