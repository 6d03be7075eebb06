"""A recorded input that runs between its samples in splines, as smooth as what was recorded."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.simulation.grid import GridSegment

Array = NDArray[np.float64]


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
        """Return how fast it changes at some instants (n,) between the first and last, per s."""
        values: Array = self._polynomials.derivative()(times)
        return values

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

    def _line(self, after: int) -> Array:
        """Return the coefficients (4, 1) of the line from a sample to the next one."""
        change = self.samples[after + 1] - self.samples[after]
        slope = change / (self.time[after + 1] - self.time[after])
        return np.array([[0.0], [0.0], [slope], [self.samples[after]]])
