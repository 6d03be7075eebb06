"""Calls into machine code: arrays by their addresses, the interpreter's lock released."""

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# rows of eight bytes each, addresses and counts, of the tables that the loops of `driver` work on
JOB = ("p", "dp", "rates", "spans")  # sets side by side, from rest through all segments
SPAN = ("u", "shapes", "row", "n", "parts", "h")  # a segment of a run
SAMPLES = ("rows", "weights", "slopes", "out", "dout", "change")  # of one of the sets of a job
WORK = ("r", "x", "out", "dr", "dx", "dout", "du")  # where a job leaves what is not asked for

# the arrays of the functions that linearise
AT_REST = ("p", "r", "x", "slopes", "jacobian", "dp", "dr", "dx", "units", "u")
ALONG = ("p", "r", "x", "u", "slopes", "jacobian", "dp", "dr", "units")


def address(array: Array) -> int:
    """Take the address of an array; raises TypeError where machine code could not read it."""
    if array.dtype != np.float64 or not array.flags.c_contiguous:
        raise TypeError("the kernel takes C-contiguous arrays of float64")
    place: int = array.__array_interface__["data"][0]  # a third of the time of array.ctypes
    return place


def place_of(table: NDArray[np.int64]) -> int:
    """Take the address of a table of whole numbers."""
    if table.dtype != np.int64 or not table.flags.c_contiguous:
        raise TypeError("the kernel takes C-contiguous tables of int64")
    place: int = table.__array_interface__["data"][0]
    return place


def function(
    engine: Any, name: str, arrays: int, last: Sequence[Any] = (), first: Sequence[Any] = ()
) -> Any:
    """Return a function of the machine code: so many arrays, and numbers before and after them."""
    # a call through ctypes releases the interpreter's lock
    prototype = ctypes.CFUNCTYPE(None, *first, *[ctypes.c_void_p] * arrays, *last)
    return prototype(engine.get_function_address(name))
