"""The layout of MATLAB files of version 5 to 7.2, which SciPy trusts: damaged, it ends Python.

Checked here is that the elements nest as they should (MathWorks, "MAT-File Format", chapter 1).
"""

import struct
import zlib
from collections.abc import Iterator, Sequence
from math import prod

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

Element = tuple[int, memoryview]


class Damage(Exception):
    """An element that is not what its place requires."""


def is_mat5(data: bytes) -> bool:
    """Return whether a file is of version 5 to 7.2."""
    return data[HEAD - 2 : HEAD] in ORDERS and not data.startswith(b"\0")


def check(data: bytes) -> None:
    """Raise Damage or zlib.error where the elements of a file do not nest."""
    order = ORDERS[data[HEAD - 2 : HEAD]]
    for kind, content in _elements(memoryview(data)[HEAD:], order, padded=False):
        if kind == COMPRESSED:
            for inner, unpacked in _elements(memoryview(zlib.decompress(content)), order):
                _check_matrix(inner, unpacked, order)
        else:
            _check_matrix(kind, content, order)


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


def _check_matrix(kind: int, data: memoryview, order: str, depth: int = 0) -> None:
    """Raise Damage where an element is no array, or its parts are not those of its class."""
    if kind != MATRIX or depth > DEEPEST:
        raise Damage(f"an element of type {kind} in the place of an array")
    if not data:  # an empty array
        return
    parts = _elements(data, order)
    word = struct.unpack(order + "II", _part(parts, FLAGS, 8))[0]
    if word & 0xFF == OPAQUE:  # SciPy does not look further into it
        return
    sizes = _part(parts, COUNTS)
    shape = struct.unpack(f"{order}{len(sizes) // 4}i", sizes)
    if len(shape) < 2 or min(shape) < 0:
        raise Damage(f"an array of the size {shape}")
    _part(parts, NAMES)
    _check_content(word, prod(shape), parts, order, depth)


def _check_content(word: int, count: int, parts: Iterator[Element], order: str, depth: int) -> None:
    """Raise Damage where what follows the name of an array is not as its class requires."""
    kind = word & 0xFF
    if kind in (STRUCT, OBJECT):
        if kind == OBJECT:
            _part(parts, NAMES)
        count *= _count_fields(parts, order)
    if kind in NESTED:
        _check_nested(kind, count, parts, order, depth)
        return
    if kind == SPARSE:
        _part(parts, COUNTS)
        _part(parts, COUNTS)
    elif kind not in NUMBERS and kind != CHARACTERS:
        raise Damage(f"an array of class {kind}")
    _check_numbers(kind, count, bool(word & COMPLEX), [*parts])


def _count_fields(parts: Iterator[Element], order: str) -> int:
    """Return how many fields a struct has; raises Damage where their names have no even width."""
    width: int = struct.unpack(order + "i", _part(parts, COUNTS, 4))[0]
    names = _part(parts, NAMES)
    if width <= 0 or len(names) % width:
        raise Damage(f"{len(names)} bytes of names of {width} bytes each")
    return len(names) // width


def _check_nested(kind: int, count: int, parts: Iterator[Element], order: str, depth: int) -> None:
    """Raise Damage where the elements of cells or structs are no arrays, or not so many."""
    arrays = [*parts]
    for inner, content in arrays:
        _check_matrix(inner, content, order, depth + 1)
    if len(arrays) != count and kind != FUNCTION:
        raise Damage(f"{len(arrays)} arrays in an array of {count}")


def _check_numbers(kind: int, count: int, is_complex: bool, parts: Sequence[Element]) -> None:
    """Raise Damage where the parts of an array, real and imaginary, have not its size."""
    if len(parts) != (2 if is_complex else 1):
        raise Damage(f"{len(parts)} parts of numbers in an array")
    for inner, content in parts:
        width = WIDTHS.get(inner, 0)
        if width == 0 or (kind in NUMBERS and len(content) != count * width):
            raise Damage(f"{len(content)} bytes of type {inner} in an array of {count}")


def _part(parts: Iterator[Element], kinds: tuple[int, ...], size: int | None = None) -> memoryview:
    """Return the content of the next part, which must be of one of the types."""
    kind, content = next(parts, (0, memoryview(b"")))
    if kind not in kinds or size not in (None, len(content)) or len(content) % WIDTHS[kind]:
        raise Damage(f"{len(content)} bytes of type {kind} in the place of type {kinds[0]}")
    return content
