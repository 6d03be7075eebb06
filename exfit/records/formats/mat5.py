"""The layout of MATLAB files of version 5 to 7.2, which SciPy trusts: damaged, it ends Python.

Checked here is that the elements nest as they should (MathWorks, "MAT-File Format", chapter 1).
"""

import struct
import zlib
from collections.abc import Iterator
from math import prod

HEAD = 128  # bytes before the first element; their last two tell the order of bytes
ORDERS = {b"IM": "<", b"MI": ">"}
MATRIX, COMPRESSED = 14, 15
FLAGS = (6,)
COUNTS = (5, 6)  # int32; other programs than MATLAB write uint32
NAMES = (1, 16)  # int8; others write UTF-8
WIDTHS = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 4, 9: 8, 12: 8, 13: 8, 16: 1, 17: 2, 18: 4}
CELL, STRUCT, OBJECT, CHARACTERS, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
NUMBERS = range(6, 16)  # classes from double to uint64
COMPLEX = 0x0800
DEEPEST = 50

Element = tuple[int, memoryview]


class Damage(Exception):
    """An element that is not what its place asks for."""


def is_mat5(data: bytes) -> bool:
    """Tell whether a file is of version 5 to 7.2."""
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
            raise Damage(f"{len(data) - at} bytes behind the last element")
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
    """Raise Damage where what follows the name of an array is not as its class asks."""
    kind = word & 0xFF
    if kind in (STRUCT, OBJECT):
        if kind == OBJECT:
            _part(parts, NAMES)
        width = struct.unpack(order + "i", _part(parts, COUNTS, 4))[0]
        fields = _part(parts, NAMES)
        if width <= 0 or len(fields) % width:
            raise Damage(f"{len(fields)} bytes of names of {width} bytes each")
        count *= len(fields) // width
    if kind in (CELL, STRUCT, OBJECT, FUNCTION):
        arrays = [*parts]
        for inner, content in arrays:
            _check_matrix(inner, content, order, depth + 1)
        if len(arrays) != count and kind != FUNCTION:
            raise Damage(f"{len(arrays)} arrays in an array of {count}")
        return
    if kind == SPARSE:
        _part(parts, COUNTS)
        _part(parts, COUNTS)
    elif kind not in NUMBERS and kind != CHARACTERS:
        raise Damage(f"an array of class {kind}")
    found = [(inner, len(content)) for inner, content in parts]
    if len(found) != (2 if word & COMPLEX else 1):
        raise Damage(f"{len(found)} parts of numbers in an array")
    for inner, size in found:
        width = WIDTHS.get(inner, 0)
        if width == 0 or (kind in NUMBERS and size != count * width):
            raise Damage(f"{size} bytes of type {inner} in an array of {count}")


def _part(parts: Iterator[Element], kinds: tuple[int, ...], size: int | None = None) -> memoryview:
    """Return the content of the next part, which must be of one of the types."""
    kind, content = next(parts, (0, memoryview(b"")))
    if kind not in kinds or size not in (None, len(content)) or len(content) % WIDTHS[kind]:
        raise Damage(f"{len(content)} bytes of type {kind} in the place of type {kinds[0]}")
    return content
