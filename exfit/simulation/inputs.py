"""The inputs of a test on the grid of its simulation: steps, recorded signals, segments."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from exfit.simulation.interpolation import ON_GRID, GridSegment
from exfit.util.arrays import Array, median_step

PAUSE = 1e-9  # s: steps and ramps that follow one another sooner are one move


class InputStep(NamedTuple):
    """A step of an input, by default of the reference: when (s) and by how much (pu).

    With a ``ramp`` (s) it is made in a line that ends so much later. It falls on the grid exactly,
    and divides it; or, ``smooth``, it leaves the grid as it is, and is averaged over it with a
    linear B-spline. A fit may move the instant of a smooth one: the area under the input, which an
    exact step between grid points would lose or gain, stays that of the step wherever its instant
    lies, and follows it with a continuous derivative; so does the cost.
    """

    at: float
    step: float
    signal: str = "vref"
    smooth: bool = False
    ramp: float = 0.0

    @property
    def end(self) -> float:
        """The instant from which on it is complete, s."""
        return self.at + self.ramp

    def share(self, part: GridSegment) -> Array:
        """Share of the step at the grid points (n + 1,) of a segment."""
        if not self.smooth and self.ramp:
            way: Array = (part.times - self.at) / self.ramp
            return way.clip(0.0, 1.0)
        if not self.smooth:
            return np.full(part.steps + 1, 1.0 if self.at <= part.start else 0.0)
        seen = np.zeros(part.steps + 1)
        changing = self._changing(part)
        seen[changing.stop :] = 1.0
        begun = _steps_after(self.at, part, changing)
        if not self.ramp:
            seen[changing] = _mean_of_step(begun)
            return seen
        done = _steps_after(self.end, part, changing)
        rising = (_mean_of_line(begun) - _mean_of_line(done)) * (part.step / self.ramp)
        # the difference of two areas is rounded; over a short ramp that is much of its height
        seen[changing] = np.where(done >= 1.0, 1.0, rising.clip(0.0, 1.0))
        return seen

    def share_slope(self, part: GridSegment) -> Array:
        """Return the derivative of ``share`` to the instant, 1/s; only a smooth step has it."""
        if not self.smooth:
            raise ValueError(f"the step of {self.signal} at {self.at:g} s is not smooth: it stays")
        slope = np.zeros(part.steps + 1)
        changing = self._changing(part)
        begun = _steps_after(self.at, part, changing)
        if not self.ramp:
            near = np.abs(begun)
            slope[changing] = np.where(near < 1.0, (near - 1.0) / part.step, 0.0)
        else:
            done = _steps_after(self.end, part, changing)
            slope[changing] = (_mean_of_step(done) - _mean_of_step(begun)) / self.ramp
        return slope

    def _changing(self, part: GridSegment) -> slice:
        """Return the grid points of a segment whose B-splines see a smooth step change."""
        first = math.floor((self.at - part.start) / part.step)
        last = math.ceil((self.end - part.start) / part.step)
        return slice(*(min(max(row, 0), part.steps + 1) for row in (first - 1, last + 2)))


def _steps_after(at: float, part: GridSegment, rows: slice) -> Array:
    """Distance of some grid points of a segment from an instant before them, in steps."""
    return np.arange(rows.start, rows.stop) - (at - part.start) / part.step


def _mean_of_step(x: Array) -> Array:
    """Return the mean of a unit step over a linear B-spline, x of its half-widths after it."""
    return np.where(np.abs(x) < 1.0, 0.5 + x - 0.5 * x * np.abs(x), np.where(x > 0.0, 1.0, 0.0))


def _mean_of_line(x: Array) -> Array:
    """Mean of a line that rises from there by one in each half-width: its integral."""
    corner = 1.0 / 6.0 + 0.5 * x + 0.5 * x**2 - np.abs(x) ** 3 / 6.0
    return np.where(np.abs(x) < 1.0, corner, np.maximum(x, 0.0))


@dataclass(frozen=True, eq=False)
class RecordedInput:
    """A recorded input: by how much its ``samples`` (M,) at ``time`` (s) deviate from the start.

    Between samples it runs in lines; beyond the first and last it stays.
    """

    time: Array
    samples: Array

    def on(self, part: GridSegment) -> Array:
        """Return it at the grid points (n + 1,) of a segment.

        Where samples lie closer than these, it is averaged over the grid with a linear B-spline: so
        the area under it stays the same, and what lies between grid points is not lost.
        """
        if median_step(self.time) >= part.step * (1.0 - ON_GRID):
            return np.interp(part.times, self.time, self.samples)
        grid = part.start + part.step * np.arange(-1, part.steps + 2)  # one more on each side
        inside = self.time[(self.time > grid[0]) & (self.time < grid[-1])]
        ends = np.insert(inside, np.searchsorted(inside, grid), grid)
        values = np.interp(ends, self.time, self.samples)
        lengths = np.diff(ends)
        cell = np.clip(np.searchsorted(grid, ends[:-1], "right") - 1, 0, len(grid) - 2)
        share = (0.5 * (ends[1:] + ends[:-1]) - grid[cell]) / part.step  # of the middle
        # the product of two lines: of their middles, and a twelfth of that of their changes
        areas = 0.5 * lengths * (values[1:] + values[:-1])
        bent = np.diff(values) * lengths**2 / (12.0 * part.step)
        areas = np.stack([(1.0 - share) * areas - bent, share * areas + bent])
        falling, rising = (np.bincount(cell, area, len(grid) - 1) for area in areas)
        averages: Array = (rising[:-1] + falling[1:]) / part.step
        return averages


@dataclass(frozen=True, eq=False)
class SplinedInput:
    """A recorded input: by how much its ``samples`` (M,) at ``time`` (s) deviate from the start.

    Cubic splines run through them, from jump to jump: each of the ``jumps`` is the sample before it
    and the one after it, between which it runs in lines. ``integrated`` it is the integral of that
    from the first sample on. Beyond the first and last sample it stays.
    """

    time: Array
    samples: Array
    jumps: tuple[tuple[int, int], ...] = ()
    integrated: bool = False

    def on(self, part: GridSegment) -> Array:
        """Return it at the grid points (n + 1,) of a segment."""
        return self.at(part.times)

    def at(self, times: Array) -> Array:
        """Return it at some instants (n,), s."""
        values: Array = self._polynomials(times.clip(self.time[0], self.time[-1]))
        return values

    def slope(self, times: Array) -> Array:
        """Slope at some instants (n,) between the first and last, per s."""
        values: Array = self._slopes(times)
        return values

    def between(self, times: Array) -> Array:
        """Polynomials (n, 4) of the share that has passed of each interval between times (n + 1,).

        They have its values and slopes at both ends; at a jump those on either side differ, and
        before the first sample and after the last the slope is zero.
        """
        first, last = self.time[0], self.time[-1]
        inside = times.clip(first, last)
        values, slopes = self._polynomials(inside), self._slopes(inside)
        before = slopes.copy()
        for k in {row for jump in self.jumps for row in jump if row}:
            away = self.time[k] - self.time[k - 1]
            before[times == self.time[k]] = np.polyval(self._slopes.c[:, k - 1], away)
        length, rise = np.diff(times), np.diff(values)
        d0 = length * np.where((times >= first) & (times < last), slopes, 0.0)[:-1]
        d1 = length * np.where((times > first) & (times <= last), before, 0.0)[1:]
        polynomials = values[:-1], d0, 3.0 * rise - 2.0 * d0 - d1, d0 + d1 - 2.0 * rise
        return np.stack(polynomials, axis=1)

    @cached_property
    def _polynomials(self) -> Any:
        """The polynomials between the samples, as SciPy evaluates them."""
        from scipy.interpolate import CubicSpline, PPoly

        first, parts, end = 0, [], len(self.time) - 1
        for last, after in (*self.jumps, (end, end)):
            if last > first:
                own = slice(first, last + 1)
                parts.append(CubicSpline(self.time[own], self.samples[own]).c)
            parts += [self._line(place) for place in range(last, after)]
            first = after
        polynomials = PPoly(np.concatenate(parts, axis=1), self.time)
        return polynomials.antiderivative() if self.integrated else polynomials

    @cached_property
    def _slopes(self) -> Any:
        return self._polynomials.derivative()

    def _line(self, after: int) -> Array:
        """Return the coefficients (4, 1) of the line from a sample to the next one."""
        change = self.samples[after + 1] - self.samples[after]
        slope = change / (self.time[after + 1] - self.time[after])
        return np.array([[0.0], [0.0], [slope], [self.samples[after]]])


@dataclass(frozen=True)
class Inputs:
    """A test from ``start`` to ``end`` (s): steps of the inputs, and recorded ones by signal."""

    start: float
    end: float
    steps: tuple[InputStep, ...]
    recorded: Mapping[str, RecordedInput | SplinedInput] = field(default_factory=dict)

    def level(self, signal: str, at: float) -> float:
        """Return the sum of an input's exact steps at an instant; each counts when complete."""
        _, _, ends, sizes = self._changes(signal)
        return sum(sizes[ends <= at].tolist(), start=0.0)

    def input(self, signal: str, part: GridSegment) -> Array:
        """Return an input at the grid points (n + 1,) of a segment."""
        u = self.stepped(signal, part)
        return u + self.recorded[signal].on(part) if signal in self.recorded else u

    def stepped(self, signal: str, part: GridSegment) -> Array:
        """Sum of the steps and ramps of an input."""
        u = np.full(part.steps + 1, self.level(signal, part.start))
        changes, starts, ends, _ = self._changes(signal)
        for k in np.flatnonzero((starts <= part.start) & (part.start < ends)):
            u += changes[k].step * changes[k].share(part)
        return u

    def _changes(self, signal: str) -> tuple[list[InputStep], Array, Array, Array]:
        """Steps of an input, from when to when each moves its segment (s), and its size.

        A smooth one may move any segment, and is in no level.
        """
        if signal not in self._known:  # a table of an angle has hundreds, and as many segments
            own = [change for change in self.steps if change.signal == signal]
            smooth = np.array([change.smooth for change in own], dtype=np.bool_)
            starts, ends, sizes = np.array([(c.at, c.end, c.step) for c in own]).reshape(-1, 3).T
            starts, ends = np.where(smooth, -np.inf, starts), np.where(smooth, np.inf, ends)
            self._known[signal] = own, starts, ends, sizes
        return self._known[signal]

    @cached_property
    def _known(self) -> dict[str, tuple[list[InputStep], Array, Array, Array]]:
        return {}

    def moves(self, signal: str) -> list["InputMove"]:
        """Return the moves of an input in order: what follows without a pause is one."""
        moves: list[InputMove] = []
        for change in self.steps:
            if change.signal == signal:
                if moves and change.at - moves[-1].end < PAUSE:
                    moves[-1] = moves[-1].with_step(change)
                else:
                    moves.append(InputMove(change.at, change.end, change.step, abs(change.step)))
        return moves


class InputMove(NamedTuple):
    """Move of an input from ``start`` to ``end`` (s): its change, and the largest on the way."""

    start: float
    end: float
    change: float
    largest: float

    def with_step(self, step: InputStep) -> "InputMove":
        """Continue the move with a step."""
        change = self.change + step.step
        return InputMove(self.start, step.end, change, max(self.largest, abs(change)))


@dataclass(frozen=True)
class Direction:
    """Values that move together in one derivative, each with its rate.

    System parameters by name; steps of the inputs by their index, as (d at, d step) in s and pu,
    where only a smooth one has an instant that moves; the recorder's delay in s.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    delay: float = 0.0


def each(names: Iterable[str]) -> tuple[Direction, ...]:
    """Return a direction for each parameter, which moves alone."""
    return tuple(Direction({name: 1.0}) for name in names)


def grid_segments(inputs: Inputs, step: float) -> list[GridSegment]:
    """Divide inputs at their exact steps, which so fall on the grid, into steps of ``step``."""
    exact = (at for change in inputs.steps if not change.smooth for at in (change.at, change.end))
    instants = {at for at in exact if inputs.start < at < inputs.end}
    result = []
    for start, end in pairwise([inputs.start, *sorted(instants), inputs.end]):
        count = max(1, math.ceil((end - start) / step - ON_GRID))
        result.append(GridSegment(start, (end - start) / count, count))
    return result
