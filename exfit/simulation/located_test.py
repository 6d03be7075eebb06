"""A test for runs with located crossings: its grid, its inputs, its samples, what moves."""

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.located_runs import LocatedCourse, LocatedSegment
from exfit.simulation.inputs import Direction, Inputs, InputStep, RecordedInput, SplinedInput
from exfit.simulation.interpolation import ON_GRID, GridSegment
from exfit.util.arrays import Array, distinct, median_step

DENSEST = 1e-3  # s: a recorded input with closer samples is averaged over steps as long
SAME = 1e-9  # of a step
AFTER_JUMP = np.array([1 / 16, 1 / 8, 1 / 4, 1 / 2, 3 / 4, 1, 1.5, 2.0])  # steps behind a jump


class SamplePlaces(NamedTuple):
    """The samples of a run: in each segment their ``positions``, in steps from its start.

    ``still`` (M,) are the samples before the start and after the end, which a delay does not move.
    ``places`` (M,) are those of the samples as they were asked for, None where they are in order.
    """

    positions: tuple[Array, ...]
    still: NDArray[np.bool_]
    places: NDArray[np.intp] | None = None

    def as_asked(self, samples: Array) -> Array:
        """Samples (K, M, ...) in the order in which they were asked for."""
        return samples if self.places is None else samples[:, self.places]


class LocatedTest:
    """The inputs of a test as polynomials of the time in each step of a grid.

    Every step and ramp begins and ends a segment exactly where it lies, also one whose instant a
    fit moves; the samples of a recorded input are points of the grid.
    """

    def __init__(self, signals: Sequence[str], inputs: Inputs, step: float, share: float) -> None:
        self.signals, self.share, self.step = tuple(signals), share, step
        self.inputs = exact(inputs)
        instants = {at for change in self.inputs.steps for at in (change.at, change.end)}
        inside = sorted(at for at in instants if inputs.start < at < inputs.end)
        self.bounds = [inputs.start, *inside, inputs.end]
        self.grids = [self._grid(*ends) for ends in pairwise(self.bounds)]

    def with_steps(self, steps: tuple[InputStep, ...]) -> "LocatedTest":
        """The test with other steps."""
        return LocatedTest(self.signals, replace(self.inputs, steps=steps), self.step, self.share)

    def _grid(self, start: float, end: float) -> Array:
        """Grid points (n + 1,) of a segment, s: no steps longer than ``step``."""
        points = np.array([start, end])
        length = self.step
        for recorded in self.inputs.recorded.values():
            if median_step(recorded.time) < DENSEST * (1.0 - ON_GRID):
                length = min(length, DENSEST)
                continue
            inside = recorded.time[(recorded.time > start) & (recorded.time < end)]
            points = distinct(np.append(points, inside))
        if start > self.inputs.start:
            # a jump moves what is fast, which has come to rest after some steps
            points = distinct(np.append(points, (start + length * AFTER_JUMP).clip(max=end)))
        lengths = np.diff(points)
        counts = np.maximum(np.ceil(lengths / length - ON_GRID), 1.0).astype(int)
        parts = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        steps = np.repeat(lengths / counts, counts)
        return np.append(np.repeat(points[:-1], counts) + parts * steps, end)

    @cached_property
    def polynomials(self) -> list[Array]:
        """Coefficients (n, nu, 4) of the inputs in each step of each segment."""
        result = []
        for times in self.grids:
            u = np.zeros((len(times) - 1, len(self.signals), 4))
            for column, signal in enumerate(self.signals):
                u[:, column, :2] = self._stepped(signal, times)
                if signal in self.inputs.recorded:
                    u[:, column] += _recorded(self.inputs.recorded[signal], times)
            result.append(self.share * u)
        return result

    def _stepped(self, signal: str, times: Array) -> Array:
        """Levels and changes (n, 2) of an input by its steps and ramps."""
        line = np.zeros((len(times) - 1, 2))
        for change in self.inputs.steps:
            if change.signal == signal:
                line += change.step * _share(change, times)
        return line

    def reading(self, times: Array, delay: float = 0.0) -> SamplePlaces:
        """Where samples at times (M,) lie, less a delay (s).

        At the instant of a jump a sample is before it; of two at one time the second is behind it.
        """
        if np.any(np.diff(times) < 0.0):
            order = np.argsort(times, kind="stable")
            places = np.argsort(order)
            sorted_ones = self.reading(times[order], delay)
            return SamplePlaces(sorted_ones.positions, sorted_ones.still[places], places)
        wanted = times - delay
        read = np.clip(wanted, self.bounds[0], self.bounds[-1])
        near = ON_GRID * self.step if delay == 0.0 else 0.0
        inside = self.bounds[1:-1]
        owner = np.searchsorted(inside, read - near, side="left")
        again = np.flatnonzero((np.diff(read) == 0.0) & (wanted == read)[1:]) + 1
        behind = np.searchsorted(inside, read[again], side="right")
        jumped = behind > np.searchsorted(inside, read[again], side="left")
        owner[again[jumped]] = behind[jumped]
        firsts = np.searchsorted(owner, np.arange(len(self.grids) + 1))
        positions = []
        for grid, first, last in zip(self.grids, firsts[:-1], firsts[1:], strict=True):
            own = read[first:last]
            k = np.clip(np.searchsorted(grid, own, side="right") - 1, 0, len(grid) - 2)
            position = k + (own - grid[k]) / (grid[k + 1] - grid[k])
            nearest = np.rint(position)
            position = np.where(np.abs(position - nearest) < SAME, nearest, position)
            positions.append(position.clip(0.0, len(grid) - 1.0))
        return SamplePlaces(tuple(positions), np.asarray(np.abs(wanted - read) > near))

    def course(
        self, reading: SamplePlaces, shapes: Sequence[Sequence["tuple[int, bool]"]] = ()
    ) -> LocatedCourse:
        """What machine code runs through; ``shapes`` are those of each input that moves."""
        segments = []
        most = max(map(len, shapes), default=0)
        for times, u, positions in zip(
            self.grids, self.polynomials, reading.positions, strict=True
        ):
            heights = None
            if shapes:
                heights = np.zeros((len(times), len(shapes), most))
                for row, of_input in enumerate(shapes):
                    for place, (step, instant) in enumerate(of_input):
                        heights[:, row, place] = self._shape(step, instant, times)
            segments.append(LocatedSegment(u, np.diff(times), positions, heights))
        return LocatedCourse(segments)

    def _shape(self, step: int, instant: bool, times: Array) -> Array:
        """Tangent of an input at grid points as a step grows, or its instant moves."""
        change = self.inputs.steps[step]
        if not instant:
            line = _share(change, times)
            return self.share * np.append(line[:, 0], line[-1].sum())
        rising = bool(change.ramp) and change.at <= times[0] < change.end
        slope = -change.step / change.ramp if rising else 0.0
        return np.full(len(times), self.share * slope)

    def instants(self, directions: Sequence[Direction]) -> Array:
        """Moves of the instants at which segments begin, (segments, N)."""
        moved = np.zeros((len(self.grids), len(directions)))
        for row, at in enumerate(self.bounds[1:-1], start=1):
            here = [n for n, c in enumerate(self.inputs.steps) if c.at == at and not c.ramp]
            total = sum(abs(self.inputs.steps[n].step) for n in here)
            for n in here if total else ():
                weight = abs(self.inputs.steps[n].step) / total
                moved[row] += [weight * d.steps.get(n, (0.0, 0.0))[0] for d in directions]
        return moved

    def inputs_at(self, reading: SamplePlaces) -> Array:
        """Inputs (M, nu) at samples."""
        parts = []
        for u, positions in zip(self.polynomials, reading.positions, strict=True):
            k = np.minimum(positions.astype(int), len(u) - 1)
            s = (positions - k)[:, None]
            c = u[k]
            parts.append(((c[..., 3] * s + c[..., 2]) * s + c[..., 1]) * s + c[..., 0])
        return np.asarray(reading.as_asked(np.concatenate(parts)[None])[0])


def exact(inputs: Inputs) -> Inputs:
    """Inputs whose steps are all made where they lie, none averaged over a grid."""
    steps = tuple(change._replace(smooth=False) for change in inputs.steps)
    return replace(inputs, steps=steps)


def _share(change: InputStep, times: Array) -> Array:
    """Share of a step at the start of each interval, and by how much it grows in it, (n, 2)."""
    if not change.ramp:
        level = 1.0 if change.at <= times[0] else 0.0
        return np.tile([level, 0.0], (len(times) - 1, 1))
    way = ((times - change.at) / change.ramp).clip(0.0, 1.0)
    return np.column_stack([way[:-1], np.diff(way)])


def _recorded(recorded: RecordedInput | SplinedInput, times: Array) -> Array:
    """Polynomials (n, 4) of a recorded input in intervals whose ends its samples are among."""
    if isinstance(recorded, SplinedInput):
        return recorded.between(times)
    h = np.diff(times)
    if median_step(recorded.time) < DENSEST * (1.0 - ON_GRID):
        part = GridSegment(float(times[0]), float(h.mean()), len(h))
        values = np.interp(times, part.times, recorded.on(part))
    else:
        values = np.interp(times, recorded.time, recorded.samples)
    zero = np.zeros(len(h))
    return np.column_stack([values[:-1], np.diff(values), zero, zero])
