"""The layout of MATLAB files of version 5 to 7.2, which SciPy trusts: damaged, it ends Python.

Checked here is that the elements nest as they should (MathWorks, "MAT-File Format", chapter 1), and
that they do not need too much memory.
"""

import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from math import prod

from exfit.records.formats.memory import MemoryLimit

HEAD = 128  # bytes before the first element; the last two give the order of bytes
ORDERS = {b"IM": "<", b"MI": ">"}
MATRIX, COMPRESSED = 14, 15
FLAGS = (6,)
COUNTS = (5, 6)  # int32; programs other than MATLAB write uint32
NAMES = (1, 16)  # int8; others write UTF-8
WIDTHS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
CELL, STRUCT, OBJECT, CHARACTERS, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
NESTED = (CELL, STRUCT, OBJECT, FUNCTION)
NUMBERS = range(6, 16)  # classes from double to uint64
COMPLEX = 0x0800
DEEPEST = 50
ARRAYS = "its arrays"
WHILE_UNPACKED = 2  # times the bytes of an element, which zlib joins of pieces
# bytes while an array is read: of itself, of a cell or field, of a character, a complex number
ARRAY_BYTES, REFERENCE, CHARACTER_BYTES, COMPLEX_BYTES = 300, 16, 20, 56

Element = tuple[int, memoryview]


class Damage(Exception):
    """An element that is not what its place requires."""


def is_mat5(data: bytes) -> bool:
    """Return whether a file is of version 5 to 7.2."""
    return data[HEAD - 2 : HEAD] in ORDERS and b"\0" not in data[:4]


def check(data: bytes, limit: MemoryLimit) -> None:
    """Raise Damage or zlib.error where the elements of a file do not nest.

    Raises TooLargeError where its arrays need more memory than they may take.
    """
    order = ORDERS[data[HEAD - 2 : HEAD]]
    needed = len(data)
    for kind, content in _elements(memoryview(data)[HEAD:], order, padded=False):
        if kind == COMPRESSED:
            unpacked = _unpacked(content, needed, limit)
            arrays = _elements(memoryview(unpacked), order)
            needed += sum(_memory_of(inner, array, order) for inner, array in arrays)
        else:
            needed += _memory_of(kind, content, order)
        limit.check(needed, ARRAYS)


def _unpacked(content: memoryview, needed: int, limit: MemoryLimit) -> bytes:
    """Return a compressed element; raises TooLargeError where it needs too much memory."""
    unpacking = zlib.decompressobj()
    unpacked = unpacking.decompress(content, max(int(limit.most - needed) // WHILE_UNPACKED, 1))
    if unpacking.unconsumed_tail:
        limit.check(needed + WHILE_UNPACKED * len(unpacked), ARRAYS)
    if not unpacking.eof:
        raise Damage("a compressed element is cut off")
    return unpacked


def _elements(data: memoryview, order: str, padded: bool = True) -> Iterator[Element]:
    """Yield type and content of each element; these are padded to 8 bytes inside a matrix."""
    at = 0
    while at < len(data):
        if len(data) - at < 8:
            raise Damage(f"{len(data) - at} bytes after the last element")
        kind, size = struct.unpack_from(order + "II", data, at)
        start = at + 8
        if kind >> 16:  # a small element: its size in the upper half, its content in the tag
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            end = at + 8
        else:
            end = start + size + (-size % 8 if padded else 0)
        if start + size > min(end, len(data)):
            raise Damage(f"an element of {size} bytes, of which {max(len(data) - start, 0)} exist")
        yield kind, data[start : start + size]
        at = end


def _memory_of(kind: int, data: memoryview, order: str, depth: int = 0) -> int:
    """Return how many bytes an array takes when SciPy reads it.

    Raises Damage where an element is no array, or its parts are not those of its class.
    """
    if kind != MATRIX or depth > DEEPEST:
        raise Damage(f"an element of type {kind} in the place of an array")
    if not data:  # an empty array
        return ARRAY_BYTES
    parts = _elements(data, order)
    word = struct.unpack(order + "II", _part(parts, FLAGS, 8))[0]
    if word & 0xFF == OPAQUE:  # names, then an array
        arrays = (part for part in parts if part[0] == MATRIX)
        return ARRAY_BYTES + sum(_memory_of(*array, order, depth + 1) for array in arrays)
    sizes = _part(parts, COUNTS)
    shape = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    if len(shape) < 2 or min(shape) < 0:
        raise Damage(f"an array of the size {shape}")
    _part(parts, NAMES)
    return ARRAY_BYTES + _memory_of_content(word, prod(shape), parts, order, depth)


def _memory_of_content(
    word: int, count: int, parts: Iterator[Element], order: str, depth: int
) -> int:
    """Return how many bytes the content of an array takes, what follows its name."""
    kind = word & 0xFF
    fields = 1
    if kind in (STRUCT, OBJECT):
        if kind == OBJECT:
            _part(parts, NAMES)
        fields = _count_fields(parts, order)
    if kind in NESTED:
        return REFERENCE * count * max(fields, 1) + _memory_of_nested(
            kind, count * fields, parts, order, depth
        )
    if kind == SPARSE:
        _part(parts, COUNTS)
        _part(parts, COUNTS)
    elif kind not in NUMBERS and kind != CHARACTERS:
        raise Damage(f"an array of class {kind}")
    return _memory_of_numbers(kind, count, bool(word & COMPLEX), parts)


def _count_fields(parts: Iterator[Element], order: str) -> int:
    """Return how many fields a struct has; raises Damage where their names have no even width."""
    width: int = struct.unpack(order + "i", _part(parts, COUNTS, 4))[0]
    names = _part(parts, NAMES)
    if width <= 0 or len(names) % width:
        raise Damage(f"{len(names)} bytes of names of {width} bytes each")
    return len(names) // width


def _memory_of_nested(
    kind: int, count: int, parts: Iterator[Element], order: str, depth: int
) -> int:
    """Return the bytes of cells or structs; raises Damage where they are not so many arrays."""
    needed = arrays = 0
    for inner, content in parts:
        needed += _memory_of(inner, content, order, depth + 1)
        arrays += 1
    if arrays != count and kind != FUNCTION:
        raise Damage(f"{arrays} arrays in an array of {count}")
    return needed


def _memory_of_numbers(kind: int, count: int, is_complex: bool, parts: Iterator[Element]) -> int:
    """Return the bytes of numbers or text; raises Damage where its parts have not their size."""
    expected = 2 if is_complex else 1
    contents = [*islice(parts, expected + 1)]
    if len(contents) != expected:
        raise Damage(f"{len(contents)} parts of numbers in an array")
    for inner, content in contents:
        width = WIDTHS.get(inner, 0)
        if width == 0 or (kind in NUMBERS and len(content) != count * width):
            raise Damage(f"{len(content)} bytes of type {inner} in an array of {count}")
    if kind == CHARACTERS:
        return CHARACTER_BYTES * count
    stored = sum(len(content) for _, content in contents)
    return COMPLEX_BYTES * count if is_complex and kind != SPARSE else 2 * stored


def _part(parts: Iterator[Element], kinds: tuple[int, ...], size: int | None = None) -> memoryview:
    """Return the content of the next part, which must be of one of the types."""
    kind, content = next(parts, (0, memoryview(b"")))
    if kind not in kinds or size not in (None, len(content)) or len(content) % WIDTHS[kind]:
        raise Damage(f"{len(content)} bytes of type {kind} in the place of type {kinds[0]}")
    return content
