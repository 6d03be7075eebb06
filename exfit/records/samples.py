"""The samples of many channels in little memory."""

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.util.arrays import Array


class _Bits(NamedTuple):
    """A column (length,) of zeros and ones."""

    packed: NDArray[np.uint8]
    length: int


class Samples(Mapping[str, Array]):
    """Columns (M,) by name; those of zeros and ones take a bit each.

    A COMTRADE record of 4 MB can hold 30 million of these, in thousands of status channels.
    """

    def __init__(self, columns: Iterable[tuple[str, Array]]) -> None:
        self._kept = {name: _packed(column) for name, column in columns}

    def beside(self, others: "Samples") -> "Samples":
        """Return these columns and ``others`` behind them."""
        both = Samples(())
        both._kept = {**self._kept, **others._kept}
        return both

    def __getitem__(self, name: str) -> Array:
        """Return a column (M,); raises KeyError."""
        kept = self._kept[name]
        if isinstance(kept, _Bits):
            return np.unpackbits(kept.packed, count=kept.length).astype(np.float64)
        return kept

    def __iter__(self) -> Iterator[str]:
        """Iterate over the names, in the order of the file."""
        return iter(self._kept)

    def __len__(self) -> int:
        """Return the number of columns."""
        return len(self._kept)


def _packed(column: Array) -> Array | _Bits:
    ones = column == 1.0
    if np.all(ones | (column == 0.0)) and not np.signbit(column).any():
        return _Bits(np.packbits(ones), len(column))
    return column
