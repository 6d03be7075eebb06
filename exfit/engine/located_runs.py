"""Runs with located crossings: the machine code of a system and the tables that it works on."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import compiled, text_of
from exfit.engine.sampling import (
    LOCATED_JOB,
    LOCATED_SPAN,
    Table,
    address,
    function,
    places,
    work_space,
)
from exfit.engine.system import System
from exfit.util.arrays import Array


class LocatedSegment(NamedTuple):
    """A segment of a run, between two jumps of its inputs.

    ``u`` (n, nu, 4) are the inputs in each of its n steps, polynomials of the share of the step
    that has passed; ``h`` (n,) the steps, s; ``positions`` (M,) its samples in steps from its
    start. ``shapes`` (n + 1, moving, columns) is what the tangents of moving inputs consist of.
    """

    u: Array
    h: Array
    positions: Array
    shapes: Array | None = None


class LocatedCourse:
    """The segments that a parameter set runs through from rest, with the table of the code."""

    def __init__(self, segments: Sequence[LocatedSegment]) -> None:
        self.segments = tuple(segments)
        counts = [len(segment.positions) for segment in segments]
        self.samples, self.longest = sum(counts), max(len(segment.h) for segment in segments)
        shapes = segments[0].shapes
        self.columns = 0 if shapes is None else shapes.shape[-1]
        firsts = np.cumsum([0, *counts]).tolist()
        rows = [
            (
                address(of.u),
                address(of.h),
                len(of.h),
                1,
                address(of.positions),
                count,
                int(_still(of)),
                first,
                0 if of.shapes is None else address(of.shapes),
            )
            for of, count, first in zip(segments, counts, firsts, strict=False)
        ]
        self.table: Table = np.array(rows, dtype=np.int64)


def _still(segment: LocatedSegment) -> bool:
    """Test that no input moves, nor any tangent of one, in a segment."""
    constant = not segment.u[:, :, 1:].any() and (segment.u[:, :, 0] == segment.u[0, :, 0]).all()
    shapes = segment.shapes
    return bool(constant and (shapes is None or (shapes == shapes[0]).all()))


class LocatedKernel:
    """Simulates ``lanes`` parameter sets side by side with located crossings."""

    def __init__(self, system: System, outputs: Sequence[str], lanes: int = 1) -> None:
        self.lanes, self.outputs = lanes, tuple(outputs)

        def ir() -> str:
            from exfit.engine.located_code import simulation

            return simulation(system, self.outputs, lanes)

        engine = compiled(f"located {lanes} {text_of(system, self.outputs)}", ir)
        self._call = function(engine, "located_runs", "ipiip")
        sizes = (len(system.setpoints), len(system.states), len(system.states))
        self._lengths = (*(size * lanes for size in sizes), 0, 0, 0, 0)

    def samples(
        self, p: Array, courses: Sequence[LocatedCourse], parts: NDArray[np.int64]
    ) -> Array:
        """Return the outputs (K, M, ny) of sets p (K, np), each in its course or all in one.

        Those with the same course and the same sub-steps run side by side.
        """
        count, lanes, first = len(p), self.lanes, courses[0]
        alone = lanes == 1
        jobs = np.arange(count)[:, None] if alone else _side_by_side(parts, lanes)
        together = p if alone else np.ascontiguousarray(p[jobs].transpose(0, 2, 1))
        out = np.empty((len(jobs), first.samples, len(self.outputs), lanes))
        spans = _spans(courses, parts if alone else parts[jobs[:, 0]], jobs[:, 0])
        table = np.zeros((len(jobs), len(LOCATED_JOB)), np.int64)
        table[:, 0], table[:, 5] = places(together, len(jobs)), places(out, len(jobs))
        table[:, 4] = places(spans, len(jobs), np.int64)
        work, scratch = work_space(self._lengths)
        self._call(
            len(jobs), address(table, np.int64), len(first.segments), 0, address(work, np.int64)
        )
        del scratch
        if alone:
            return out[..., 0]
        samples = np.empty((count, *out.shape[1:3]))
        samples[jobs] = out.transpose(0, 3, 1, 2)
        return samples


class LocatedTangentKernel:
    """Simulates one parameter set with its exact derivatives across located crossings."""

    def __init__(
        self,
        system: System,
        outputs: Sequence[str],
        free: Sequence[str],
        moving: Sequence[str],
        directions: int,
    ) -> None:
        self.outputs, self.directions, self.moving = tuple(outputs), directions, len(moving)

        def ir() -> str:
            from exfit.engine.located_code import simulation

            return simulation(system, self.outputs, directions, free, moving)

        traced = text_of(system, self.outputs)
        engine = compiled(f"located {tuple(free)} {tuple(moving)} {directions} {traced}", ir)
        self._call = function(engine, "located_runs", "ipiip")
        self._sizes = (len(system.setpoints), len(system.states), len(system.states))

    def samples(
        self,
        p: Array,
        dp: Array,
        courses: Sequence[LocatedCourse],
        parts: NDArray[np.int64],
        instants: Array,
        rates: Array | None = None,
    ) -> tuple[Array, Array, Array]:
        """Return outputs (K, M, ny) of sets p (K, np), their derivatives, and those to time.

        ``dp`` (K, np, N) are the tangents of the parameters in N directions, ``instants``
        (K, segments, N) those of the instants at which segments begin, ``rates`` (K, moving,
        columns, N) those of the inputs' shapes. The derivatives are (K, M, ny, N).
        """
        count, width, first = len(p), self.directions, courses[0]
        blocks, given = max(1, -(-dp.shape[-1] // width)), dp.shape[-1]
        shape = (count, first.samples, len(self.outputs))
        outputs, changes = np.empty((2, blocks, *shape))
        slopes = np.empty((blocks, *shape, width))
        tables = np.zeros((blocks, count, len(LOCATED_JOB)), np.int64)
        spans = _spans(courses, parts, np.arange(count))
        kept = []
        for block in range(blocks):
            some = slice(block * width, min((block + 1) * width, given))
            table = tables[block]
            own = [_padded(array[..., some], width) for array in (dp, instants)]
            own += [] if rates is None else [_padded(rates[..., some], width)]
            kept.append(own)
            for column, array in (
                (0, p),
                *zip((1, 2, 3), own, strict=False),
                (5, outputs[block]),
                (6, slopes[block]),
                (7, changes[block]),
            ):
                table[:, column] = places(array, count)
            table[:, 4] = places(spans, count, np.int64)
        inputs = (first.longest + 1) * self.moving * width
        of_states = (*self._sizes, *(size * width for size in self._sizes))
        work, scratch = work_space((*of_states, inputs))
        self._call(
            blocks * count,
            address(tables, np.int64),
            len(first.segments),
            first.columns,
            address(work, np.int64),
        )
        del scratch, kept
        joined = slopes[0] if blocks == 1 else np.concatenate(slopes, axis=-1)
        return outputs[0], joined[..., :given], changes[0]


def _padded(array: Array, width: int) -> Array:
    """Tangents with as many directions as run together, none missing."""
    if array.shape[-1] == width and array.flags.c_contiguous:
        return array
    result = np.zeros((*array.shape[:-1], width))
    result[..., : array.shape[-1]] = array
    return result


def _spans(courses: Sequence[LocatedCourse], parts: NDArray[np.int64], sets: Table) -> Table:
    """Tables of the segments of jobs, with the sub-steps of each."""
    if len(sets) == 1:
        spans = courses[0].table[None].copy()
    elif len(courses) == 1:
        spans = np.repeat(courses[0].table[None], len(sets), axis=0)
    else:
        spans = np.array([courses[k].table for k in sets])
    spans[:, :, LOCATED_SPAN.index("parts")] = parts[:, None]
    return spans


def _side_by_side(parts: NDArray[np.int64], lanes: int) -> NDArray[np.intp]:
    """Numbers of sets (jobs, lanes) that run together, the last one again where some are left."""
    order = np.argsort(parts, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(parts[order])) + 1)
    padded = [np.pad(group, (0, -len(group) % lanes), mode="edge") for group in groups]
    return np.concatenate(padded).reshape(-1, lanes)


# made once in a process
located_kernel, located_tangent_kernel = cache(LocatedKernel), cache(LocatedTangentKernel)
