"""From parameter values to a response: the start at rest, the grid, the sub-steps, the samples."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import (
    SIDE_BY_SIDE,
    Kernel,
    LinearKernel,
    Span,
    Start,
    TangentKernel,
    in_threads,
)
from exfit.engine.system import System, trace
from exfit.engine.trace import Node, evaluate, in_order
from exfit.errors import SimulationError
from exfit.models.blocks import SHORTEST

Array = NDArray[np.float64]
Values = Mapping[str, float]

MOST_STEPS = 1e7  # three hours at 1 ms
MOST_REPEATS = 3  # until the sub-steps are enough for the response that they give
MOST_SUBSTEPS = 1000  # per step: beyond it the step or a time constant is a mistake
REST_TOLERANCE = 1e-6  # pu/s: below any real motion
ROUNDING = 1e-13  # of a state
ON_GRID = 1e-6  # of a step: a sample that near to a grid point lies on it
NEIGHBOURS = 4  # grid points of the interpolation: its error is then of Runge-Kutta's order


class Change(NamedTuple):
    """A step of an input, by default of the reference: when (s) and by how much (pu)."""

    at: float
    step: float
    signal: str = "vref"


@dataclass(frozen=True, eq=False)
class Played:
    """Recorded inputs: ``time`` (M,) in s, and what each signal (M,) deviates from the start."""

    time: Array
    signals: Mapping[str, Array]


@dataclass(frozen=True)
class Course:
    """A test from ``start`` to ``end`` (s): steps of the inputs, and recorded ones played back."""

    start: float
    end: float
    steps: tuple[Change, ...]
    played: Played | None = None

    def level(self, signal: str, at: float) -> float:
        """Return the sum of an input's steps at an instant; a step counts from its own on."""
        return sum((c.step for c in self.steps if c.signal == signal and c.at <= at), start=0.0)

    def input(self, signal: str, times: Array, level: float) -> Array:
        """Return an input at times between which it makes no step; ``level`` is that of steps."""
        if self.played is None or signal not in self.played.signals:
            return np.full(len(times), level)
        return level + np.interp(times, self.played.time, self.played.signals[signal])


@dataclass(frozen=True)
class Response:
    """Simulated signals on one clock: ``time`` (M,) in s, each signal (M,) per unit."""

    time: Array
    signals: Mapping[str, Array]
    substeps: int


class Stretch(NamedTuple):
    """Equal steps of the grid between two changes of the inputs."""

    start: float
    step: float
    steps: int

    @property
    def end(self) -> float:
        """Where it ends, s."""
        return self.start + self.step * self.steps


def stretches(course: Course, step: float) -> list[Stretch]:
    """Divide a course at its changes, so that they fall on the grid, into steps of ``step``."""
    if (course.end - course.start) / step > MOST_STEPS:
        raise SimulationError(
            f"simulation.step: {step:g} s divides {course.end - course.start:g} s into more than "
            f"{MOST_STEPS:.0e} steps"
        )
    instants = {change.at for change in course.steps if course.start < change.at < course.end}
    result = []
    for start, end in pairwise([course.start, *sorted(instants), course.end]):
        count = max(1, math.ceil((end - start) / step - ON_GRID))
        result.append(Stretch(start, (end - start) / count, count))
    return result


class Sampling:
    """Reads a run, whose stretches lie one behind the other, at given times.

    Between grid points it interpolates with a cubic that never reaches across a step of the
    inputs; at the instant of a step it gives the values before the step.
    """

    def __init__(self, grid: Sequence[Stretch], times: Array) -> None:
        rows = np.zeros((len(times), NEIGHBOURS), dtype=np.int64)
        weights = np.zeros((len(times), NEIGHBOURS))
        ends = np.array([part.end for part in grid])
        owner = np.minimum(np.searchsorted(ends, times - ON_GRID * grid[0].step), len(grid) - 1)
        offset = 0
        for number, part in enumerate(grid):
            mine = owner == number
            near, weight = self._cubic((times[mine] - part.start) / part.step, part.steps)
            rows[mine, : near.shape[1]] = near + offset
            weights[mine, : near.shape[1]] = weight
            offset += part.steps + 1
        self._rows, self._weights = rows, weights
        self._exact = bool(np.all(weights[:, 0] == 1.0))

    @staticmethod
    def _cubic(position: Array, count: int) -> tuple[NDArray[np.int64], Array]:
        """Return neighbours and Lagrange weights, a row per position on ``count`` steps."""
        points = min(NEIGHBOURS, count + 1)
        first = np.clip(np.floor(position).astype(np.int64) - 1, 0, count + 1 - points)
        near = first[:, None] + np.arange(points)
        weights = np.ones(near.shape)
        for one in range(points):
            for other in range(points):
                if one != other:
                    weights[:, one] *= (position - near[:, other]) / (one - other)
        nearest = np.clip(np.rint(position), 0, count).astype(np.int64)
        on_grid = np.abs(position - nearest) < ON_GRID
        near[on_grid], weights[on_grid] = nearest[on_grid, None], np.arange(points) == 0
        return near, weights

    def __call__(self, run: Sequence[Array]) -> Array:
        """Return samples (M, ...) of a run given as one array (n + 1, ...) per stretch."""
        rows = np.concatenate(run) if len(run) > 1 else run[0]
        if self._exact:
            return np.asarray(rows[self._rows[:, 0]])
        return np.asarray(np.einsum("mk,mk...->m...", self._weights, rows[self._rows]))


@cache
def kernel(system: System, outputs: tuple[str, ...], lanes: int) -> Kernel:
    """Return the machine code that simulates a system."""
    return Kernel(system, outputs, lanes)


@cache
def tangent_kernel(
    system: System, outputs: tuple[str, ...], free: tuple[str, ...]
) -> TangentKernel:
    """Return the machine code that simulates a system with its derivatives."""
    return TangentKernel(system, outputs, free)


@cache
def linear_kernel(system: System) -> LinearKernel:
    """Return the machine code that linearises a system."""
    return LinearKernel(system)


@cache
def parameters_used(system: System) -> frozenset[str]:
    """Return the parameters that a response of the system can depend on."""
    traced = trace(system, system.outputs)
    targets = [*traced.rest, *traced.slopes, *traced.outputs, *traced.clamped]
    reached = {node.index for node in in_order(targets)}
    pairs = zip(system.parameters, traced.p, strict=True)
    return frozenset(name for name, node in pairs if node.index in reached)


class Simulator:
    """Simulates one system through one course, sampled at ``times`` (M,) in s.

    ``step`` (s) is the largest step; where the system is faster, every step is divided, into no
    fewer than ``least`` parts.
    """

    def __init__(
        self, system: System, course: Course, times: Array, step: float, least: int = 1
    ) -> None:
        self.system, self.course, self.times = system, course, times
        self.step, self.least = step, least
        self._grid = stretches(course, step)
        self._inputs = [self._inputs_of(part) for part in self._grid]
        self._sampling = Sampling(self._grid, times)
        self._last = b"", 0  # the sub-steps of the last values asked for

    @cached_property
    def time_constants(self) -> tuple[str, ...]:
        """The parameters in seconds that matter to the response."""
        used = parameters_used(self.system)
        return tuple(name for name in self.system.time_constants if name in used)

    def substeps(self, values: Values) -> int:
        """Return into how many parts each step is divided for these values.

        The rule is ceil(step * fastest rate), where the rate is the largest of the spectral radius
        of the slopes' Jacobian at rest and 1/T of every time constant that is not bypassed:
        Runge-Kutta of order four is unstable beyond 2.785, and a limit would hide it. It depends
        on the values alone, and a change of one sub-step moves a response by less than the
        method's own error. What is faster away from rest is for ``secured``.

        Raises SimulationError where the start is no rest, or beyond ``MOST_SUBSTEPS``.
        """
        p = self._vector(values)
        known, parts = self._last
        if known != p.tobytes():
            parts = max(self.least, self._parts(values, self._rate_at_rest(values, p)))
            self._last = p.tobytes(), parts
        return parts

    def substeps_along(self, values: Values, response: Response, points: int = 100) -> int:
        """Return the sub-steps that the rule asks for along a response with all its states."""
        p = self._vector(values)
        rest = linear_kernel(self.system).rest(p)
        inputs = self._sampling(self._inputs)
        rate = 0.0
        for row in np.linspace(0, len(response.time) - 1, points).astype(int):
            x = np.array([response.signals[name][row] for name in self.system.states])
            rate = max(rate, self._motion(p, rest, x, np.ascontiguousarray(inputs[row]))[1])
        return self._parts(values, rate)

    def secured(self, values: Values) -> "Simulator":
        """Return a simulator whose sub-steps are enough all along the response to these values.

        Raises SimulationError where that response does not stay finite.
        """
        simulator = self
        for _ in range(MOST_REPEATS):
            response = simulator.response(values)
            wanted = simulator.substeps_along(values, response)
            if wanted <= response.substeps:
                break
            simulator = Simulator(self.system, self.course, self.times, self.step, wanted)
        return simulator

    def step_error(self, values: Values, outputs: tuple[str, ...]) -> float:
        """Return by how much, at most and per unit, halving every step moves the outputs."""
        samples, parts = self.samples(values, outputs)
        finer = Simulator(self.system, self.course, self.times, self.step / 2.0, parts)
        return float(np.max(np.abs(samples - finer.samples(values, outputs)[0])))

    def response(self, values: Values, outputs: Sequence[str] | None = None) -> Response:
        """Return the outputs (all of the system's by default) at the sample times."""
        wanted = self.system.outputs if outputs is None else tuple(outputs)
        samples, parts = self.samples(values, wanted)
        return Response(self.times, dict(zip(wanted, samples.T, strict=True)), parts)

    def samples(self, values: Values, outputs: tuple[str, ...]) -> tuple[Array, int]:
        """Return outputs (M, ny) and the number of sub-steps."""
        parts = self.substeps(values)
        code = kernel(self.system, outputs, 1)
        p = self._vector(values)[:, None]
        run = code.run(p, code.start(p), self._spans(parts))
        return self._sampling(run)[:, :, 0], parts

    def samples_of_many(self, sets: Sequence[Values], outputs: tuple[str, ...]) -> Array:
        """Return outputs (M, ny, sets): side by side, in threads, and with equal sub-steps."""
        spans = self._spans(max(self.substeps(values) for values in sets))
        code = kernel(self.system, outputs, SIDE_BY_SIDE)
        vectors = np.stack([self._vector(values) for values in sets], axis=1)
        missing = -len(sets) % SIDE_BY_SIDE
        padded = np.pad(vectors, ((0, 0), (0, missing)), mode="edge")

        def block(first: int) -> Array:
            p = np.ascontiguousarray(padded[:, first : first + SIDE_BY_SIDE])
            return self._sampling(code.run(p, code.start(p), spans))

        firsts = range(0, padded.shape[1], SIDE_BY_SIDE)
        return np.concatenate(list(in_threads(block, firsts)), axis=2)[:, :, : len(sets)]

    def tangents(
        self, values: Values, outputs: tuple[str, ...], free: tuple[str, ...]
    ) -> tuple[Array, Array]:
        """Return outputs (M, ny) and their exact derivatives (M, ny, free)."""
        code = tangent_kernel(self.system, outputs, free)
        run, slopes = code.run(self._vector(values), self._spans(self.substeps(values)))
        return self._sampling(run), self._sampling(slopes)

    def _inputs_of(self, part: Stretch) -> Array:
        """Return the inputs at the grid points of a stretch, (n + 1, nu)."""
        times = np.linspace(part.start, part.end, part.steps + 1)
        names, course = self.system.inputs, self.course
        inputs = [course.input(name, times, course.level(name, part.start)) for name in names]
        return np.ascontiguousarray(np.stack(inputs, axis=1))

    def _vector(self, values: Values) -> Array:
        return np.array([values[name] for name in self.system.parameters], dtype=np.float64)

    def _spans(self, parts: int) -> list[Span]:
        return [Span(u, part.step, parts) for u, part in zip(self._inputs, self._grid, strict=True)]

    def _rate_at_rest(self, values: Values, p: Array) -> float:
        """Return the fastest rate (1/s) at the start; raises SimulationError if that is no rest."""
        rest = linear_kernel(self.system).rest(p)
        slopes, rate = self._motion(p, rest, rest.x, np.zeros(len(self.system.inputs)))
        # what the rounding of a state leaves of its slope, at the fastest rate
        rounding = ROUNDING * float(np.max(np.abs(rest.x))) * rate
        moving = ~(np.abs(slopes) <= REST_TOLERANCE + rounding)
        if np.any(moving) or not math.isfinite(rounding):
            why = self._why_moving(values, slopes, moving)
            at = f" at vt0 = {values['vt0']:g} pu" if "vt0" in values else ""
            raise SimulationError(f"no state of rest{at}: {why}")
        return rate

    def _motion(self, p: Array, rest: Start, x: Array, u: Array) -> tuple[Array, float]:
        """Return the slopes at states x and the spectral radius (1/s) of their Jacobian."""
        slopes, jacobian = linear_kernel(self.system).motion(p, rest.r, x, u)
        if not np.all(np.isfinite(jacobian)):
            return np.full(len(x), np.nan), np.inf
        return slopes, float(np.max(np.abs(np.linalg.eigvals(jacobian))))

    def _parts(self, values: Values, radius: float) -> int:
        lags = {name: values[name] for name in self.time_constants if values[name] >= SHORTEST}
        shortest = min(lags, key=lambda name: lags[name], default=None)
        rate = max(radius, 1.0 / lags[shortest] if shortest else 0.0)
        if not math.isfinite(rate):
            raise SimulationError("the response does not stay finite")
        parts = max(1, math.ceil(self.step * rate - ON_GRID))
        if parts > MOST_SUBSTEPS:
            smallest = (
                f"; the smallest time constant is {shortest} = {lags[shortest]:g} s"
                if shortest
                else ""
            )
            raise SimulationError(
                f"simulation.step: {self.step:g} s would need {parts} sub-steps "
                f"(limit {MOST_SUBSTEPS}) for a rate of {rate:.4g} 1/s{smallest}"
            )
        return parts

    def _why_moving(self, values: Values, slopes: Array, moving: NDArray[np.bool_]) -> str:
        states = zip(self.system.states, slopes, moving, strict=True)
        moved = [
            f"{name} moves by {slope:.3g} pu/s"
            for name, slope, moves in states
            if moves and math.isfinite(slope)
        ]
        return self._limits_passed(values) or ", ".join(moved) or "the values do not define one"

    def _limits_passed(self, values: Values) -> str:
        """Name the limits that the start would have to pass, with both values."""
        traced = trace(self.system, self.system.outputs)
        rest = evaluate(traced.rest, {node: values[node.args[0][2:]] for node in traced.p})
        at_rest = dict(
            zip((*traced.x, *traced.r), (rest[node] for node in traced.rest), strict=True)
        )
        known = {**rest, **at_rest, **dict.fromkeys(traced.u, 0.0)}
        everything = evaluate([*traced.slopes, *traced.outputs, *traced.clamped], known)
        found = []
        for node in [node for node in everything if node.op == "clip"]:
            x, low, high = (everything[operand] for operand in node.operands)
            for passed, limit, side in ((x > high, 2, "above"), (x < low, 1, "below")):
                name = _limit_name(node.operands[limit])
                if passed and name:
                    found.append(
                        f"the start needs {x:.6g}, {side} {name} = {(low, high)[limit - 1]:.6g}"
                    )
        return "; ".join(dict.fromkeys(found))


def _limit_name(node: Node) -> str:
    """Return the parameter that gives a limit: of all it is computed from, the one named so."""
    names = [str(n.args[0])[2:] for n in in_order([node]) if n.op == "symbol" and not n.varies]
    limits = [name for name in names if "MAX" in name or "MIN" in name]
    return ", ".join(limits or names)
