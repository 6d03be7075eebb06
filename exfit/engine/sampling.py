"""Runs of many parameter sets in one call of machine code, sampled where a record is.

Arrays are given by their addresses; a call releases the interpreter's lock.
"""

import ctypes
import threading
from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.util.arrays import Array

Table = NDArray[np.int64]

# rows of eight bytes each, addresses and counts, of the tables that the loops of `driver` work on
JOB = ("p", "dp", "rates", "spans")  # sets side by side, from rest through all segments
SPAN = ("u", "shapes", "row", "n", "parts", "h")  # a segment of a run
SAMPLES = ("rows", "weights", "slopes", "out", "dout", "change")  # of one of the sets of a job
WORK = ("r", "x", "out", "dr", "dx", "dout", "du")  # where a job leaves what is not asked for

# the same of runs with located crossings
LOCATED_JOB = ("p", "dp", "dtau", "rates", "spans", "out", "dout", "change")
LOCATED_SPAN = ("u", "h", "n", "parts", "pos", "samples", "still", "first", "shapes")
LOCATED_WORK = ("r", "x", "f", "dr", "dx", "df", "du")

# the arrays of the functions that linearise
AT_REST = ("p", "r", "x", "slopes", "jacobian", "dp", "dr", "dx", "units", "u")
ALONG = ("p", "r", "x", "u", "slopes", "jacobian", "dp", "dr", "units")

CACHE_LINE = 8  # numbers: what a vector is read from begins at a multiple
MOST_KEPT = 1 << 23  # numbers (64 MB) of a scratch buffer that is used again
KINDS = {"p": ctypes.c_void_p, "i": ctypes.c_int64, "d": ctypes.c_double}
NO_BYTES: Any = ctypes.c_char * 0

_scratch = threading.local()  # new pages for every run would cost a fifth of it


def address(array: NDArray[Any], kind: type = np.float64) -> int:
    """Take the address of an array; raises TypeError where machine code could not read it."""
    flags = array.flags
    if array.dtype != kind or not flags.c_contiguous:
        raise TypeError(f"the kernel takes C-contiguous arrays of {kind.__name__}")
    if flags.writeable:  # takes a third of the time
        return ctypes.addressof(NO_BYTES.from_buffer(array))
    return int(array.__array_interface__["data"][0])


def function(engine: Any, name: str, kinds: str) -> Any:
    """Return a function of the machine code: "ppi" takes two arrays and a whole number."""
    prototype = ctypes.CFUNCTYPE(None, *(KINDS[kind] for kind in kinds))
    return prototype(engine.get_function_address(name))


class Segment(NamedTuple):
    """A segment of a run: inputs u (n + 1, nu) at its grid points, a ``step`` (s) apart.

    ``shapes`` (n + 1, moving, columns): what the tangents of the inputs that move consist of.
    """

    u: Array
    step: float
    shapes: Array | None = None


class SampleRows(NamedTuple):
    """The places of M samples: sums of ``rows`` (M, points) of a run times ``weights``, as large.

    ``slopes`` (M, points) are the weights that give their time derivatives, where these are wanted.
    """

    rows: Table
    weights: Array
    slopes: Array | None = None

    def enlarged(self, factor: float) -> "SampleRows":
        """Enlarge the deviations from the first row so many times."""
        if factor == 1.0:
            return self
        count = len(self.rows)
        rows = np.column_stack([self.rows, np.zeros(count, dtype=np.int64)])
        weights = np.column_stack([factor * self.weights, np.full(count, 1.0 - factor)])
        slopes = self.slopes
        if slopes is not None:
            slopes = np.column_stack([factor * slopes, np.zeros(count)])
        return SampleRows(rows, weights, slopes)

    def padded(self, points: int) -> "SampleRows":
        """Return the same of more points, of which the last ones count nothing."""
        missing = points - self.weights.shape[1]
        if not missing:
            return self
        ends = ((0, 0), (0, missing))
        slopes = None if self.slopes is None else np.pad(self.slopes, ends)
        return SampleRows(np.pad(self.rows, ends, mode="edge"), np.pad(self.weights, ends), slopes)


class Course(NamedTuple):
    """The segments that a parameter set runs through from rest, and their samples."""

    segments: Sequence[Segment]
    reading: SampleRows


class Sizes(NamedTuple):
    """Sizes of the tables of one job of the machine code; ``directions`` may be 0."""

    setpoints: int
    states: int
    outputs: int
    sets: int = 1
    directions: int = 0
    moving: int = 0


class Courses:
    """The courses of K sets: one that all share, or each its own on the same grid.

    ``parts`` (K,) are the sub-steps of each step, or (K, segments) where they are not the same.
    """

    def __init__(self, courses: Sequence[Course], parts: NDArray[np.int64]) -> None:
        self.parts, self.sets = parts, len(parts)
        segments = courses[0].segments
        lengths = [len(segment.u) for segment in segments]
        self.rows, self.longest, self.segments = sum(lengths), max(lengths), len(lengths)
        self.points = max(course.reading.weights.shape[1] for course in courses)
        readings = [course.reading.padded(self.points) for course in courses]
        self.samples = len(readings[0].weights)
        self.arrays = courses, readings  # what the addresses below point into
        shapes = segments[0].shapes
        self.columns = 0 if shapes is None else shapes.shape[-1]

        def of_each(tables: Sequence[Any]) -> Table:
            table = np.array(tables, dtype=np.int64)
            return table if len(tables) == self.sets else np.repeat(table, self.sets, axis=0)

        def place(array: Array | None) -> int:
            return 0 if array is None else address(array)

        self.readings = of_each(
            [(address(rows, np.int64), address(w), place(slopes)) for rows, w, slopes in readings]
        )
        firsts = np.cumsum([0, *lengths]).tolist()
        self.spans = of_each(
            [
                [
                    (address(u), place(shapes), row, len(u) - 1, 0, 0)
                    for row, (u, _, shapes) in zip(firsts, course.segments, strict=False)
                ]
                for course in courses
            ]
        )
        substeps = self.spans[:, :, SPAN.index("parts")]
        substeps[:] = parts.reshape(self.sets, -1)
        h = np.array([segment.step for segment in segments]) / substeps
        self.spans[:, :, SPAN.index("h")] = h.view(np.int64)


class Sampler:
    """Calls the function ``sampled`` of some machine code."""

    def __init__(self, engine: Any, sizes: Sizes) -> None:
        self.sizes, self._call = sizes, function(engine, "sampled", "ippiiiip")

    def __call__(
        self,
        p: Array,
        courses: Courses,
        sets: NDArray[np.intp],
        dp: Array | None = None,
        rates: Array | None = None,
    ) -> tuple[Array, Array | None, Array | None]:
        """Run jobs of sets side by side, and return the samples of all K sets of ``courses``.

        ``p`` (jobs, np, lanes) are their parameters, ``sets`` (jobs, lanes) the numbers of these
        sets; ``dp`` (K, blocks, np, directions) the tangents of sets that run one by one, a job
        for each block, and ``rates`` (K, blocks, moving, columns, directions) those of the inputs
        that move. The samples are the outputs (K, M, ny), their derivatives (K, blocks, M, ny,
        directions), and those to time (K, M, ny) where the readings have weights for them.
        """
        sizes, count, jobs = self.sizes, courses.sets, len(sets)
        blocks = 1 if dp is None else dp.shape[1]
        shape = (courses.samples, sizes.outputs)
        outputs = np.empty((count, *shape))
        slopes = None if dp is None else np.empty((count, blocks, *shape, sizes.directions))
        changes = np.empty((count, *shape)) if dp is not None and courses.readings[0, 2] else None
        table = np.zeros((jobs, blocks, len(JOB)), np.int64)
        table[:, :, 0] = places(p, jobs)[:, None]
        for column, array in ((1, dp), (2, rates)):
            if array is not None:
                table[:, :, column] = places(array, jobs * blocks).reshape(-1, blocks)
        table[:, :, 3] = places(courses.spans, count, np.int64)[sets[:, 0]][:, None]
        lanes = np.zeros((jobs, blocks, sets.shape[1], len(SAMPLES)), np.int64)
        lanes[..., :3] = courses.readings[sets][:, None]
        lanes[..., 3] = places(outputs, count)[sets][:, None]
        if slopes is not None:
            lanes[..., 4] = places(slopes, count * blocks).reshape(-1, blocks)[:, :, None]
        if changes is not None:
            lanes[..., 5] = places(changes, count)[sets][:, None]
        work, scratch = self._work(courses)
        tables = (address(table, np.int64), address(lanes, np.int64))
        counts = (courses.segments, courses.samples, courses.points, courses.columns)
        self._call(jobs * blocks, *tables, *counts, address(work, np.int64))
        del scratch
        return outputs, slopes, changes

    def _work(self, courses: Courses) -> tuple[Table, Array]:
        """Lay out the work space of a job: its addresses, and this thread's buffer with it."""
        setpoints, states, outputs, sets, directions, moving = self.sizes
        values = [size * sets for size in (setpoints, states, courses.rows * outputs)]
        of_inputs = courses.longest * moving * directions
        return work_space((*values, *(size * directions for size in values), of_inputs))


@cache
def _layout(lengths: tuple[int, ...]) -> tuple[Table, int]:
    """Offsets of arrays of so many numbers, each at a line of the cache, and the size of all."""
    ends = np.cumsum(-(-np.array(lengths) // CACHE_LINE) * CACHE_LINE)
    return 8 * np.array([0, *ends[:-1]]), int(ends[-1]) + CACHE_LINE


def work_space(lengths: tuple[int, ...]) -> tuple[Table, Array]:
    """Lay out arrays of so many numbers: their addresses, and this thread's buffer with them."""
    offsets, size = _layout(lengths)
    scratch: Array | None = getattr(_scratch, "buffer", None)
    if scratch is None or len(scratch) < size:
        scratch = np.empty(size)
        if size <= MOST_KEPT:
            _scratch.buffer = scratch
    return 8 * CACHE_LINE * -(-address(scratch) // (8 * CACHE_LINE)) + offsets, scratch


def places(array: NDArray[Any], count: int, kind: type = np.float64) -> Table:
    """Take the addresses of ``count`` equal parts of an array."""
    return array.nbytes // max(count, 1) * np.arange(count) + address(array, kind)
