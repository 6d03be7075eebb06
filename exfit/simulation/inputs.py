"""The inputs of a test on the grid of its simulation: steps, recorded signals, segments."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.simulation.grid import ON_GRID, GridSegment

Array = NDArray[np.float64]

MOST_STEPS = 1e7  # three hours at 1 ms


class InputStep(NamedTuple):
    """A step of an input, by default of the reference: when (s) and by how much (pu).

    It falls on the grid exactly, and divides it; or, ``smooth``, it leaves the grid as it is, and
    is averaged over it with a linear B-spline. A fit may move the instant of a smooth one: the area
    under the input, which an exact step between grid points would lose or gain, stays that of the
    step wherever its instant lies, and follows it with a continuous derivative; so does the cost.
    """

    at: float
    step: float
    signal: str = "vref"
    smooth: bool = False

    def share(self, part: GridSegment) -> Array:
        """Return how much of the step the grid points (n + 1,) of a segment have seen."""
        if not self.smooth:
            return np.full(part.steps + 1, 1.0 if self.at <= part.start else 0.0)
        share, (near, x) = np.zeros(part.steps + 1), self._near(part)
        share[near], share[near.stop :] = 0.5 + x - 0.5 * x * np.abs(x), 1.0
        return share

    def share_slope(self, part: GridSegment) -> Array:
        """Return the derivative of ``share`` to the instant, 1/s; only a smooth step has it."""
        if not self.smooth:
            raise ValueError(f"the step of {self.signal} at {self.at:g} s is not smooth: it stays")
        slope, (near, x) = np.zeros(part.steps + 1), self._near(part)
        slope[near] = (np.abs(x) - 1.0) / part.step
        return slope

    def _near(self, part: GridSegment) -> tuple[slice, Array]:
        """Return the grid points less than a step from the instant, and how far beyond it."""
        position = (self.at - part.start) / part.step
        first, stop = np.clip(math.floor(position) + np.array([0, 2]), 0, part.steps + 1)
        return slice(first, stop), np.arange(first, stop) - position


@dataclass(frozen=True, eq=False)
class RecordedInputs:
    """Recorded inputs: ``time`` (M,) in s, and what each signal (M,) deviates from the start."""

    time: Array
    signals: Mapping[str, Array]


@dataclass(frozen=True)
class Inputs:
    """A test from ``start`` to ``end`` (s): steps of the inputs, and recorded ones played back."""

    start: float
    end: float
    steps: tuple[InputStep, ...]
    recorded: RecordedInputs | None = None

    def level(self, signal: str, at: float) -> float:
        """Return the sum of an input's exact steps at an instant; each counts from its own on."""
        made = (c.step for c in self.steps if c.signal == signal and not c.smooth and c.at <= at)
        return sum(made, start=0.0)

    def input(self, signal: str, part: GridSegment) -> Array:
        """Return an input at the grid points (n + 1,) of a segment."""
        u = np.full(part.steps + 1, self.level(signal, part.start))
        if self.recorded is not None and signal in self.recorded.signals:
            u += np.interp(part.times, self.recorded.time, self.recorded.signals[signal])
        for change in self.steps:
            if change.smooth and change.signal == signal:
                u += change.step * change.share(part)
        return u


@dataclass(frozen=True)
class Direction:
    """What moves together in one derivative, and how fast each.

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
    if (inputs.end - inputs.start) / step > MOST_STEPS:
        raise SimulationError(
            f"simulation.step: {step:g} s divides {inputs.end - inputs.start:g} s into more than "
            f"{MOST_STEPS:.0e} steps"
        )
    exact = (change.at for change in inputs.steps if not change.smooth)
    instants = {at for at in exact if inputs.start < at < inputs.end}
    result = []
    for start, end in pairwise([inputs.start, *sorted(instants), inputs.end]):
        count = max(1, math.ceil((end - start) / step - ON_GRID))
        result.append(GridSegment(start, (end - start) / count, count))
    return result
