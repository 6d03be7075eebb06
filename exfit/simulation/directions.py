"""Derivatives of responses: their directions as the machine code takes them, and its runs."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import DIRECTIONS
from exfit.engine.located_runs import located_tangent_kernel
from exfit.engine.sampling import Courses
from exfit.engine.system import System
from exfit.engine.tangents import tangent_kernel
from exfit.simulation.inputs import Direction, Inputs
from exfit.simulation.interpolation import GridSegment
from exfit.simulation.substeps import NO_SUBSTEPS
from exfit.util.arrays import Array
from exfit.util.processes import in_threads

if TYPE_CHECKING:
    from exfit.simulation.simulator import Simulator

Counts = NDArray[np.int64]


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


class Moves(NamedTuple):
    """Moves of the directions of some sets, all together.

    ``columns`` are the directions that need a run: that of a delay alone needs none; ``delayed``
    those that have a delay. ``free`` are the parameters that move; ``shapes`` belong to the inputs
    that do.
    """

    columns: tuple[int, ...]
    delayed: tuple[int, ...]
    free: tuple[str, ...]
    shapes: dict[str, tuple[InputShape, ...]]

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

    def without_instants(self, inputs: Inputs) -> "Moves":
        """The moves without the shapes of exact steps whose instant moves."""
        shapes = {
            name: tuple(
                shape for shape in own if not shape.instant or inputs.steps[shape.step].ramp
            )
            for name, own in self.shapes.items()
        }
        return self._replace(shapes={name: own for name, own in shapes.items() if own})

    @property
    def _most_shapes(self) -> int:
        return max(map(len, self.shapes.values()))


def moves_of(system: System, inputs: Inputs, directions: Sequence[Sequence[Direction]]) -> Moves:
    """Collect the moves of the directions of several sets."""
    every = [(k, move) for own in directions for k, move in enumerate(own)]
    free = {name for _, move in every for name in move.parameters}
    return Moves(
        columns=tuple(sorted({k for k, move in every if move.parameters or move.steps})),
        delayed=tuple(sorted({k for k, move in every if move.delay != 0.0})),
        free=tuple(name for name in system.parameters if name in free),
        shapes=_shapes(system, inputs, [move for _, move in every if move.steps]),
    )


def _shapes(
    system: System, inputs: Inputs, moves: Sequence[Direction]
) -> dict[str, tuple[InputShape, ...]]:
    """Return the shapes of each input that moves."""
    shapes = {
        InputShape(step, instant)
        for move in moves
        for step, rates in move.steps.items()
        for instant, rate in zip((True, False), rates, strict=True)
        if rate
    }
    of_inputs: dict[str, tuple[InputShape, ...]] = {}
    for name in system.inputs if shapes else ():
        own = sorted(shape for shape in shapes if inputs.steps[shape.step].signal == name)
        if own:
            of_inputs[name] = tuple(own)
    return of_inputs


def tangents_by_equations(
    simulator: "Simulator",
    sets: Sequence[Mapping[str, float]],
    outputs: tuple[str, ...],
    directions: Sequence[Sequence[Direction]],
    tests: "Sequence[Simulator] | None",
) -> tuple[Array, Array, Counts]:
    """Simulate as `Simulator.tangents_of_many`."""
    p, parts = simulator.prepared(sets)
    reached = np.flatnonzero(parts != NO_SUBSTEPS).tolist()
    if not reached:
        samples = np.full((len(sets), len(simulator.times), len(outputs)), np.nan)
        return samples, np.full((*samples.shape, len(directions[0])), np.nan), parts
    own = [directions[k] for k in reached]
    simulators = [simulator] if tests is None else [tests[k] for k in reached]
    if simulator.located:
        samples, slopes = _located_tangents(simulators, outputs, p[reached], parts[reached], own)
    else:
        samples, slopes = _literal_tangents(simulators, outputs, p[reached], parts[reached], own)
    return _of_all(samples, reached, len(sets)), _of_all(slopes, reached, len(sets)), parts


def _literal_tangents(
    simulators: "Sequence[Simulator]",
    outputs: tuple[str, ...],
    p: Array,
    parts: Counts,
    own: Sequence[Sequence[Direction]],
) -> tuple[Array, Array]:
    """Outputs (K, M, ny) of sets p (K, np) on the literal grid, and their derivatives."""
    system = simulators[0].system
    moves = moves_of(system, simulators[0].inputs, own)
    courses = Courses([test.course(moves) for test in simulators], parts)
    width = DIRECTIONS if len(moves.columns) <= DIRECTIONS else 2 * DIRECTIONS
    code = tangent_kernel(system, outputs, moves.free, tuple(moves.shapes), width)
    tangents, rates = moves.tangents(system, own), moves.rates(own)

    def block(first: int) -> tuple[Array, Array, Array | None]:
        some = slice(first, first + width)
        growing = None if rates is None else rates[..., some]
        return code.samples(p, tangents[..., some], courses, growing)

    firsts = range(0, len(moves.columns), width)
    if len(p) > 1 or len(firsts) <= 1:
        samples, slopes, change = code.samples(p, tangents, courses, rates)
    else:  # of a single set each block of directions in a thread
        blocks = [*in_threads(block, firsts)]
        samples, _, change = blocks[0]
        slopes = np.concatenate([each for _, each, _ in blocks], axis=-1)
    if len(moves.columns) < len(own[0]):
        driven, slopes = slopes, np.zeros((*samples.shape, len(own[0])))
        slopes[..., list(moves.columns)] = driven
    for k in moves.delayed if change is not None else ():
        delays = np.array([of_set[k].delay for of_set in own])
        slopes[..., k] -= delays[:, None, None] * change
    return samples, slopes


def _located_tangents(
    simulators: "Sequence[Simulator]",
    outputs: tuple[str, ...],
    p: Array,
    parts: Counts,
    directions: Sequence[Sequence[Direction]],
) -> tuple[Array, Array]:
    """Outputs (K, M, ny) of sets p (K, np) with located crossings, and their derivatives."""
    first = simulators[0]
    system, count = first.system, len(directions[0])
    # the instant of a step is where a segment begins; only that of a ramp changes the input
    moves = moves_of(system, first.inputs, directions).without_instants(first.inputs)
    courses = [simulator.located_course(moves) for simulator in simulators]
    instants = [
        simulator.instants([own[k] for k in moves.columns])
        for simulator, own in zip(
            simulators if len(simulators) > 1 else [first] * len(directions),
            directions,
            strict=True,
        )
    ]
    width = DIRECTIONS if len(moves.columns) <= DIRECTIONS else 2 * DIRECTIONS
    code = located_tangent_kernel(system, outputs, moves.free, tuple(moves.shapes), width)
    tangents, rates = moves.tangents(system, directions), moves.rates(directions)
    samples, driven, change = code.samples(p, tangents, courses, parts, np.array(instants), rates)
    share = first.share
    if share != 1.0:
        samples = samples[:, :1] + (samples - samples[:, :1]) / share
        driven = driven[:, :1] + (driven - driven[:, :1]) / share
    samples, driven, change = map(first.as_asked, (samples, driven, change))
    slopes = driven
    if len(moves.columns) < count:
        slopes = np.zeros((*samples.shape, count))
        slopes[..., list(moves.columns)] = driven
    for k in moves.delayed:
        delays = np.array([own[k].delay for own in directions])
        moved = np.where([simulator.still for simulator in simulators], 0.0, 1.0)
        slopes[..., k] -= delays[:, None, None] * moved[:, :, None] * change
    return samples, slopes


def _of_all(results: Array, reached: Sequence[int], count: int) -> Array:
    """Results of all sets, no numbers where one was not reached."""
    if len(reached) == count:
        return results
    every = np.full((count, *results.shape[1:]), np.nan)
    every[list(reached)] = results
    return every
