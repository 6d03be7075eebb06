"""How large the pages of a Parquet file get when they are unpacked, by their own headers.

The footer may state less. pyarrow unpacks each page into as many bytes as its header declares.
Source: Apache Parquet format, PageHeader; Apache Thrift, compact protocol.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

if TYPE_CHECKING:
    from pyarrow.parquet import ColumnChunkMetaData, FileMetaData

LARGEST_HEADER = 1 << 16  # bytes: it may hold the least and the largest value of its page
UNPACKED, PACKED = 2, 3  # fields of a header: bytes of the page, and of what is in the file
STOP, INTEGERS, BINARY, STRUCT = 0, (4, 5, 6), 8, 12  # kinds of a field
LENGTHS = {1: 0, 2: 0, 3: 1, 7: 8}  # bytes of the others: true, false, a byte, a float64
MOST_BITS = 64  # of an integer


def unpacked_bytes(file: BinaryIO, metadata: "FileMetaData", names: Sequence[str]) -> int:
    """Return how many bytes the pages of the largest of some columns unpack to.

    Raises ValueError or IndexError where a header is damaged.
    """
    sizes = dict.fromkeys(names, 0)
    for group in map(metadata.row_group, range(metadata.num_row_groups)):
        for chunk in map(group.column, range(group.num_columns)):
            for name in names:
                if chunk.path_in_schema == name or chunk.path_in_schema.startswith(f"{name}."):
                    sizes[name] += _unpacked_chunk(file, chunk)
    return max(sizes.values(), default=0)


def _unpacked_chunk(file: BinaryIO, chunk: "ColumnChunkMetaData") -> int:
    offsets = (chunk.data_page_offset, chunk.dictionary_page_offset)
    at = min(offset for offset in offsets if offset)
    end, unpacked = at + chunk.total_compressed_size, 0
    while at < end:
        file.seek(at)
        header = _header(file.read(min(LARGEST_HEADER, end - at)))
        at += header.length + header.packed
        unpacked += header.unpacked
    return unpacked


class PageHeader(NamedTuple):
    """How long a header is, and how large its page is, packed and unpacked, bytes."""

    length: int
    packed: int
    unpacked: int


def _header(data: bytes) -> PageHeader:
    reader = CompactReader(data)
    sizes = reader.integers_of_struct()
    if min(sizes[UNPACKED], sizes[PACKED]) < 0:
        raise ValueError("a page of less than no bytes")
    return PageHeader(reader.at, sizes[PACKED], sizes[UNPACKED])


class CompactReader:
    """A place in data of Thrift's compact protocol."""

    def __init__(self, data: bytes) -> None:
        self.data, self.at = data, 0

    def integers_of_struct(self) -> dict[int, int]:
        """Return the integers of a struct by their field, and go to its end."""
        found, field = dict[int, int](), 0
        while (head := self._byte()) != STOP:
            field = field + (head >> 4) if head >> 4 else self._integer()
            kind = head & 0x0F
            if kind in INTEGERS:
                found[field] = self._integer()
            else:
                self._skip(kind)
        return found

    def _byte(self) -> int:
        self.at += 1
        return self.data[self.at - 1]

    def _unsigned(self) -> int:
        value = 0
        for shift in range(0, MOST_BITS, 7):
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise ValueError("an integer of more than 64 bits")

    def _integer(self) -> int:
        value = self._unsigned()
        return (value >> 1) ^ -(value & 1)

    def _skip(self, kind: int) -> None:
        """Go behind a value; in the header of a page are neither lists nor maps."""
        if kind == STRUCT:
            self.integers_of_struct()
        elif kind == BINARY:
            length = self._unsigned()
            self.at += length
        elif kind in LENGTHS:
            self.at += LENGTHS[kind]
        else:
            raise ValueError(f"a field of kind {kind} in the header of a page")
