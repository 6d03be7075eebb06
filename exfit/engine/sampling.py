"""Runs of many parameter sets in one call of machine code, sampled where a record is."""

import ctypes
import threading
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.calls import JOB, SAMPLES, SPAN, address, place_of

Array = NDArray[np.float64]
Table = NDArray[np.int64]

CACHE_LINE = 8  # numbers: what a vector is read from begins at a multiple
MOST_KEPT = 1 << 23  # numbers (64 MB) of a scratch buffer that is used again

_scratch = threading.local()  # new pages for every run would cost a fifth of it


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


class Samples(NamedTuple):
    """Outputs (K, M, ny) of K sets and their derivatives (K, blocks, M, ny, directions).

    ``change`` (K, M, ny) are their time derivatives, where the readings have weights for them.
    """

    outputs: Array
    slopes: Array | None
    change: Array | None


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
        self.readings = _of_each([_places(reading) for reading in readings], self.sets)
        self.spans = _of_each([_table(course.segments) for course in courses], self.sets)
        self.spans[:, :, SPAN.index("parts")] = parts.reshape(self.sets, -1)
        steps = np.array([segment.step for segment in segments])
        h = steps / self.spans[:, :, SPAN.index("parts")]
        self.spans[:, :, SPAN.index("h")] = h.view(np.int64)


def _of_each(tables: Sequence[Any], sets: int) -> Table:
    """Return a table of each set, where there is one for all as well."""
    table = np.array(tables, dtype=np.int64)
    return table if len(tables) == sets else np.repeat(table, sets, axis=0)


def _places(reading: SampleRows) -> tuple[int, int, int]:
    slopes = 0 if reading.slopes is None else address(reading.slopes)
    return place_of(reading.rows), address(reading.weights), slopes


def _table(segments: Sequence[Segment]) -> list[tuple[int, ...]]:
    table: list[tuple[int, ...]] = []
    row = 0
    for u, _, shapes in segments:
        table.append((address(u), 0 if shapes is None else address(shapes), row, len(u) - 1, 0, 0))
        row += len(u)
    return table


class Sampler:
    """Calls the function ``sampled`` of some machine code."""

    def __init__(self, engine: Any, sizes: Sizes) -> None:
        self.sizes = sizes
        numbers, pointer = ctypes.c_int64, ctypes.c_void_p
        arguments = (numbers, pointer, pointer, *[numbers] * 4, pointer)
        prototype = ctypes.CFUNCTYPE(None, *arguments)
        self._call = prototype(engine.get_function_address("sampled"))

    def __call__(
        self,
        p: Array,
        courses: Courses,
        sets: NDArray[np.intp],
        dp: Array | None = None,
        rates: Array | None = None,
    ) -> Samples:
        """Run jobs of sets side by side, and return the samples of all K sets of ``courses``.

        ``p`` (jobs, np, lanes) are their parameters, ``sets`` (jobs, lanes) the numbers of these
        sets; ``dp`` (K, blocks, np, directions) the tangents of sets that run one by one, a job
        for each block, and ``rates`` (K, blocks, moving, columns, directions) those of the inputs
        that move.
        """
        sizes, count = self.sizes, courses.sets
        blocks = 1 if dp is None else dp.shape[1]
        shape = (courses.samples, sizes.outputs)
        outputs = np.empty((count, *shape))
        slopes = None if dp is None else np.empty((count, blocks, *shape, sizes.directions))
        changing = dp is not None and courses.readings[0, 2] != 0
        changes = np.empty((count, *shape)) if changing else None
        jobs = np.zeros((len(sets), blocks, len(JOB)), np.int64)
        jobs[:, :, 0] = _places_in(p, len(sets))[:, None]
        if dp is not None:
            jobs[:, :, 1] = _places_in(dp, len(sets) * blocks).reshape(-1, blocks)
        if rates is not None:
            jobs[:, :, 2] = _places_in(rates, len(sets) * blocks).reshape(-1, blocks)
        jobs[:, :, 3] = _places_in(courses.spans, count)[sets[:, 0]][:, None]
        lanes = np.zeros((len(sets), blocks, sets.shape[1], len(SAMPLES)), np.int64)
        lanes[..., :3] = courses.readings[sets][:, None]
        lanes[..., 3] = _places_in(outputs, count)[sets][:, None]
        if slopes is not None:
            lanes[..., 4] = _places_in(slopes, count * blocks).reshape(-1, blocks)[:, :, None]
        if changes is not None:
            lanes[..., 5] = _places_in(changes, count)[sets][:, None]
        work, scratch = self._work(courses)
        self._call(
            len(sets) * blocks,
            place_of(jobs),
            place_of(lanes),
            courses.segments,
            courses.samples,
            courses.points,
            courses.columns,
            place_of(work),
        )
        del scratch
        return Samples(outputs, slopes, changes)

    def _work(self, courses: Courses) -> tuple[Table, Array]:
        """Lay out the work space of a job: its addresses, and the buffer that holds it."""
        setpoints, states, outputs, sets, directions, moving = self.sizes
        wide = sets * directions
        lengths = (
            *(setpoints * sets, states * sets, courses.rows * outputs * sets),
            *(setpoints * wide, states * wide, courses.rows * outputs * wide),
            courses.longest * moving * directions,
        )
        offsets, end = [], 0
        for length in lengths:
            offsets.append(end)
            end += -(-length // CACHE_LINE) * CACHE_LINE
        scratch = _scratch_of(end + CACHE_LINE)
        begin = -(-address(scratch) // (8 * CACHE_LINE)) * (8 * CACHE_LINE)
        return np.array([begin + 8 * offset for offset in offsets]), scratch


def _places_in(array: NDArray[Any], count: int) -> Table:
    """Take the addresses of ``count`` equal parts of an array."""
    begin = place_of(array) if array.dtype == np.int64 else address(array)
    return begin + np.arange(count) * (array.nbytes // max(count, 1))


def _scratch_of(size: int) -> Array:
    """Return a buffer of at least so many numbers, this thread's own."""
    kept: Array | None = getattr(_scratch, "buffer", None)
    if kept is not None and len(kept) >= size:
        return kept
    buffer = np.empty(size)
    if size <= MOST_KEPT:
        _scratch.buffer = buffer
    return buffer
