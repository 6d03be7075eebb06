"""Directions of differentiation as arrays, as the machine code takes them."""

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.system import System
from exfit.simulation.inputs import Direction, Inputs
from exfit.simulation.interpolation import GridSegment

Array = NDArray[np.float64]


class InputShape(NamedTuple):
    """Contribution of a step to the tangent of its input: as its instant moves, or its size."""

    step: int
    instant: bool

    def on(self, segment: GridSegment, inputs: Inputs) -> Array:
        """Return it at the grid points (n + 1,) of a segment, per second or per unit."""
        change = inputs.steps[self.step]
        if self.instant:
            return change.step * change.share_slope(segment)
        return change.share(segment)

    def rate(self, direction: Direction) -> float:
        """Rate of its growth in a direction."""
        at, size = direction.steps.get(self.step, (0.0, 0.0))
        return at if self.instant else size


@dataclass(frozen=True)
class Moves:
    """Moves of the directions of some sets, all together.

    ``columns`` are the directions that need a run: that of a delay alone needs none; ``delayed``
    those that have a delay. ``free`` are the parameters that move; ``shapes`` belong to the inputs
    that do.
    """

    columns: tuple[int, ...]
    delayed: tuple[int, ...]
    free: tuple[str, ...]
    shapes: dict[str, tuple[InputShape, ...]]

    @property
    def moving(self) -> tuple[str, ...]:
        """Inputs that move."""
        return tuple(self.shapes)

    def tangents(self, system: System, directions: Sequence[Sequence[Direction]]) -> Array:
        """Move of each parameter in each direction that needs a run, (K, np, N)."""
        place = {name: system.parameters.index(name) for name in self.free}
        tangents = np.zeros((len(directions), len(system.parameters), len(self.columns)))
        for of_set, own in zip(tangents, directions, strict=True):
            for column, k in enumerate(self.columns):
                for name, rate in own[k].parameters.items():
                    of_set[place[name], column] = rate
        return tangents

    def rates(self, directions: Sequence[Sequence[Direction]]) -> Array | None:
        """Growth of each shape in these directions, (K, moving, shapes, N)."""
        if not self.shapes:
            return None
        sizes = (len(self.shapes), self._most_shapes, len(self.columns))
        rates = np.zeros((len(directions), *sizes))
        for of_set, own in zip(rates, directions, strict=True):
            for row, shapes in zip(of_set, self.shapes.values(), strict=True):
                for place, shape in enumerate(shapes):
                    row[place] = [shape.rate(own[k]) for k in self.columns]
        return rates

    def shapes_on(self, segment: GridSegment, inputs: Inputs) -> Array:
        """Return the shapes at the grid points of a segment, (n + 1, moving, shapes)."""
        heights = np.zeros((segment.steps + 1, len(self.shapes), self._most_shapes))
        for row, shapes in enumerate(self.shapes.values()):
            for place, shape in enumerate(shapes):
                heights[:, row, place] = shape.on(segment, inputs)
        return heights

    @property
    def _most_shapes(self) -> int:
        return max(map(len, self.shapes.values()))


def moves_of(system: System, inputs: Inputs, directions: Sequence[Sequence[Direction]]) -> Moves:
    """Collect the moves of the directions of several sets."""
    every = [(k, move) for own in directions for k, move in enumerate(own)]
    shapes = {shape for _, move in every if move.steps for shape in _shapes_of(move)}
    return Moves(
        columns=_places(every, lambda move: bool(move.parameters or move.steps)),
        delayed=_places(every, lambda move: move.delay != 0.0),
        free=_moving_parameters(system, [move for _, move in every]),
        shapes=_by_signal(system, inputs, shapes) if shapes else {},
    )


def _places(
    every: Iterable[tuple[int, Direction]], among: Callable[[Direction], bool]
) -> tuple[int, ...]:
    """Return the places of the directions of which something is true, of any set."""
    return tuple(sorted({k for k, move in every if among(move)}))


def _moving_parameters(system: System, moves: Sequence[Direction]) -> tuple[str, ...]:
    free = {name for move in moves for name in move.parameters}
    return tuple(name for name in system.parameters if name in free)


def _shapes_of(move: Direction) -> Iterator[InputShape]:
    for step, (at, size) in move.steps.items():
        if at:
            yield InputShape(step, True)
        if size:
            yield InputShape(step, False)


def _by_signal(
    system: System, inputs: Inputs, shapes: Collection[InputShape]
) -> dict[str, tuple[InputShape, ...]]:
    """Return the shapes of each input that moves."""
    pairs = [(inputs.steps[shape.step].signal, shape) for shape in sorted(shapes)]
    moving = {signal for signal, _ in pairs}
    return {
        name: tuple(shape for signal, shape in pairs if signal == name)
        for name in system.inputs
        if name in moving
    }
