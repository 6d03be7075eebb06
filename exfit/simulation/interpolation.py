"""A run read at given times: polynomials that never reach across a step."""

from collections.abc import Sequence
from fractions import Fraction
from functools import cache, cached_property
from math import prod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.sampling import SampleRows
from exfit.util.arrays import Array

ON_GRID = 1e-6  # of a step: a sample that near to a grid point lies on it
BLOCK = 1 << 16  # samples that are read at a time
NEIGHBOURS = 6  # grid points of an interpolation, whose slope then jumps by less than 1e-9


class GridSegment(NamedTuple):
    """Equal steps of the grid between two changes of the inputs."""

    start: float
    step: float
    steps: int

    @property
    def end(self) -> float:
        """End of it, s."""
        return self.start + self.step * self.steps

    @property
    def times(self) -> Array:
        """Its grid points (n + 1,), s."""
        return np.linspace(self.start, self.end, self.steps + 1)


@cache
def lagrange(points: int) -> Array:
    """Polynomials that are one at one of some points a step apart, zero at the others.

    A row of coefficients each, from the lowest power of the distance from their middle up, and
    below them those of their slopes: zero where there are fewer points than NEIGHBOURS,
    (2 NEIGHBOURS, NEIGHBOURS).
    """
    # the polynomials are rational: worked out exactly, they are the same on every machine
    places = [Fraction(2 * k - points + 1, 2) for k in range(points)]  # about the middle
    values = np.zeros((NEIGHBOURS, NEIGHBOURS))
    slopes = np.zeros((NEIGHBOURS, NEIGHBOURS))
    for k, place in enumerate(places):
        others = places[:k] + places[k + 1 :]
        coefficients = [Fraction(1)]
        for other in others:
            raised, scaled = [Fraction(0), *coefficients], [*coefficients, Fraction(0)]
            coefficients = [a - other * b for a, b in zip(raised, scaled, strict=True)]
        size = prod((place - other for other in others), start=Fraction(1))
        values[k, :points] = [float(c / size) for c in coefficients]
        slopes[k, : points - 1] = [float(n * c / size) for n, c in enumerate(coefficients)][1:]
    return np.vstack([values, slopes])


class Interpolation:
    """Reads a run, whose segments lie one behind the other, at given times less a delay (s).

    Between grid points it interpolates with a polynomial that never reaches across an exact step of
    the inputs; at the instant of such a step it gives the values before the step. Before the start
    and after the end it gives the values there. What it needs for that is kept for BLOCK times, and
    found anew for each block of more.
    """

    def __init__(self, grid: Sequence[GridSegment], times: Array, delay: float = 0.0) -> None:
        # with a delay no sample is moved to the grid: what is read must follow it without a jump
        near = ON_GRID if delay == 0.0 else 0.0
        wanted = times - delay
        read = np.clip(wanted, grid[0].start, grid[-1].end)
        self._still = np.abs(wanted - read) > near * grid[0].step
        start, step, count, end = np.array([(*part, part.end) for part in grid]).T
        owner = np.minimum(np.searchsorted(end, read - near * step[0]), len(grid) - 1)
        position, last = (read - start[owner]) / step[owner], count[owner]
        self._kinds = {min(NEIGHBOURS, part.steps + 1) for part in grid}
        self._step, self._points = step[owner], np.minimum(NEIGHBOURS, last + 1.0)
        first = np.clip(np.floor(position) - 1.0, 0.0, last + 1.0 - self._points)
        self._from_middle = position - first - 0.5 * (self._points - 1.0)
        before = np.cumsum(count + 1.0) - count - 1.0
        self.first = (before[owner] + first).astype(np.int64)
        self.last = int(before[-1] + count[-1])
        nearest = np.clip(np.rint(position), 0.0, last)
        self._on_grid = self._still | (np.abs(position - nearest) < near)
        self._nearest = (before[owner] + nearest).astype(np.int64)

    @property
    def blocks(self) -> list[slice]:
        """The samples, so many at a time that what belongs to them takes little memory."""
        count = len(self.first)
        return [slice(first, min(first + BLOCK, count)) for first in range(0, count, BLOCK)]

    def __call__(self, run: Sequence[Array]) -> Array:
        """Return samples (M, ...) of a run given as one array (n + 1, ...) per segment."""
        rows, weights, _ = self.reading()
        whole = joined(run)
        samples = np.empty((len(rows), *whole.shape[1:]))
        for block in self.blocks:
            points = whole[rows[block]]
            np.einsum("mk,mk...->m...", weights[block], points, out=samples[block])
        return samples

    def reading(self, changing: bool = False) -> SampleRows:
        """Arrays for machine code to read; where it is ``changing``, with time derivatives."""
        return self._changing if changing else self._plain

    @cached_property
    def _plain(self) -> SampleRows:
        if self._on_grid.all():
            return SampleRows(self._nearest[:, None], np.ones((len(self.first), 1)))
        return SampleRows(self._rows, self.weights(slice(None)))

    @cached_property
    def _changing(self) -> SampleRows:
        slopes = self._polynomials(slice(None), slice(NEIGHBOURS, 2 * NEIGHBOURS))
        slopes /= self._step[:, None]
        slopes[self._still] = 0.0
        return SampleRows(self._rows, self.weights(slice(None)), slopes)

    @property
    def _rows(self) -> NDArray[np.int64]:
        """Points of a run from which each sample is read, (M, NEIGHBOURS)."""
        return np.asarray(np.minimum(self.first[:, None] + np.arange(NEIGHBOURS), self.last))

    def weights(self, block: slice) -> Array:
        """Weight of each of the points from which a block's samples are read.

        They are NEIGHBOURS, from ``first`` on, but none is behind ``last``; (block, NEIGHBOURS).
        """
        weights = self._polynomials(block, slice(0, NEIGHBOURS))
        on_grid = self._on_grid[block]
        if on_grid.any():
            # by their own places: behind the end, one row stands for all
            places = self.first[block][on_grid, None] + np.arange(NEIGHBOURS)
            weights[on_grid] = places == self._nearest[block][on_grid, None]
        return weights

    def _polynomials(self, block: slice, rows: slice) -> Array:
        """Return rows of ``lagrange`` at the samples of a block, a column each."""
        away, points = self._from_middle[block], self._points[block]
        powers = np.ones((len(away), NEIGHBOURS))
        for k in range(1, NEIGHBOURS):
            np.multiply(powers[:, k - 1], away, out=powers[:, k])
        if len(self._kinds) == 1:
            return powers @ lagrange(*self._kinds)[rows].T
        weights = np.zeros((len(away), NEIGHBOURS))
        for n in self._kinds:
            weights += (powers * (points == n)[:, None]) @ lagrange(n)[rows].T
        return weights


class GridPoints:
    """Reads a run at some ``rows`` (M,) of its grid, one segment behind the other."""

    def __init__(self, rows: NDArray[np.int64]) -> None:
        self._rows = rows
        self._reading = SampleRows(rows[:, None], np.ones((len(rows), 1)))

    def reading(self, changing: bool = False) -> SampleRows:
        """Return what machine code reads; raises for the derivative to a delay, one of samples."""
        if changing:
            raise NotImplementedError("a delay between points of the grid")
        return self._reading

    def __call__(self, run: Sequence[Array]) -> Array:
        """Return these points (M, ...) of a run."""
        return joined(run)[self._rows]


def joined(run: Sequence[Array]) -> Array:
    """Return a run (G, ...) of one array (n + 1, ...) per segment, these one behind the other."""
    return np.concatenate(run) if len(run) > 1 else run[0]
