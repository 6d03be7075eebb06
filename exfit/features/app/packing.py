"""Curves as a page takes them: thinned to what its pixels can show, and packed as bytes."""

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from exfit.util.arrays import Array, Places

COLUMNS = 1200  # pixels across: two samples of each, the least and the largest, are all one sees
MOST = 2 * 2 * COLUMNS  # samples that are sent as they are


def thinned(time: Array, curves: Iterable[Array]) -> tuple[Array, list[Array]]:
    """Thin curves (M,) to the extremes of each pixel's samples, in the order of time.

    Each has the instants of its first and last sample there; an isolated peak stays.
    """
    given = list(curves)
    if len(time) <= MOST:
        return time, given
    edges = np.linspace(0, len(time), COLUMNS + 1).astype(np.intp)[:-1]
    last = np.append(edges[1:], len(time)) - 1
    return _paired(time[edges], time[last]), [_extremes(curve, edges) for curve in given]


def _extremes(curve: Array, edges: Places) -> Array:
    """Return the least and the largest of each stretch, the one first that is nearer its begin.

    Of samples that are left out (nan) the others count.
    """
    low, high = np.fmin.reduceat(curve, edges), np.fmax.reduceat(curve, edges)
    rises = curve[edges] - low <= high - curve[edges]
    return _paired(np.where(rises, low, high), np.where(rises, high, low))


def _paired(first: Array, second: Array) -> Array:
    return np.stack([first, second], axis=1).ravel()


def packed(content: Mapping[str, Any]) -> bytes:
    """Write a message: its length, its JSON with blanks to a multiple of four bytes, its arrays.

    In the JSON an array is {"at": ..., "n": ...}: its place and length among the numbers behind it,
    of four bytes each, the least significant first.
    """
    arrays, at = list[Array](), 0

    def plain(value: Any) -> Any:
        nonlocal at
        if isinstance(value, np.ndarray):
            arrays.append(value)
            at += len(value)
            return {"at": at - len(value), "n": len(value)}
        if isinstance(value, Mapping):
            return {str(key): plain(entry) for key, entry in value.items()}
        if isinstance(value, list | tuple):
            return [plain(entry) for entry in value]
        if isinstance(value, float) and not np.isfinite(value):
            return None
        return value

    head = json.dumps(plain(content), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    with np.errstate(over="ignore"):
        numbers = [np.asarray(each, dtype="<f4").tobytes() for each in arrays]
    return b"".join([len(head).to_bytes(4, "little"), head, *numbers])
