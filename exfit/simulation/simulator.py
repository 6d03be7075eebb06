"""From parameter values to a response: the start at rest, the sub-steps, the samples."""

import math
from collections.abc import Container, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import SIDE_BY_SIDE, Span, Start, TangentKernel
from exfit.engine.system import System
from exfit.errors import SimulationError
from exfit.models.blocks import SHORTEST
from exfit.simulation.grid import ON_GRID, GridSegment
from exfit.simulation.inputs import Direction, Inputs, InputStep, grid_segments
from exfit.simulation.interpolation import Interpolation, WholeRun, joined
from exfit.simulation.kernels import kernel, linear_kernel, parameters_used, tangent_kernel
from exfit.simulation.limits import limits_passed
from exfit.util.threads import in_threads

Array = NDArray[np.float64]
Values = Mapping[str, float]

MOST_REPEATS = 3  # until the sub-steps are enough for the response that they give
MOST_SUBSTEPS = 1000  # per step: beyond it the step or a time constant is a mistake
REST_TOLERANCE = 1e-6  # pu/s: below any real motion
STATE_ROUNDING = 1e-13  # of a state, relative
REMEMBERED = 64  # sets of values: several threads use a few of theirs again


@dataclass(frozen=True, eq=False)
class Run:
    """A simulation at every point of its grid: ``time`` (n,) in s, the outputs and inputs (n,).

    The instant of an exact step is there twice, before it and after it.
    """

    time: Array
    outputs: Mapping[str, Array]
    inputs: Mapping[str, Array]


@dataclass(frozen=True)
class Response:
    """Simulated signals on one clock: ``time`` (M,) in s, each signal (M,) per unit."""

    time: Array
    signals: Mapping[str, Array]
    substeps: int


class Simulator:
    """Simulates one system through a test's inputs, sampled at ``times`` (M,) in s.

    ``step`` (s) is the largest step; where the system is faster, every step is divided, into no
    fewer than ``least`` parts. A recorder's ``delay`` (s) makes it show at ``times`` the response
    at ``times - delay``: before the start, where all is at rest, and after the end that there.
    """

    def __init__(
        self,
        system: System,
        inputs: Inputs,
        times: Array,
        step: float,
        least: int = 1,
        delay: float = 0.0,
    ) -> None:
        self.system, self.inputs, self.times = system, inputs, times
        self.step, self.least, self.delay = step, least, delay
        self._grid = grid_segments(inputs, step)
        # a long record is read on the grid once, whatever else a fit moves
        self._recorded_samples = [
            {name: recorded.on(segment) for name, recorded in inputs.recorded.items()}
            for segment in self._grid
        ]
        self._input_samples = self._inputs_on_grid()
        self._sampling: Interpolation | WholeRun = Interpolation(self._grid, times, delay)
        self._substeps_of: dict[bytes, int] = {}  # of the parameters of late

    def with_inputs(self, steps: tuple[InputStep, ...], delay: float) -> "Simulator":
        """Return the simulator of the same test with other steps and another delay (s).

        The instant of a smooth step may be another, and the size of any. It costs little: the grid
        and the sub-steps found so far are shared. Raises ValueError where a step is another.
        """
        if [_fixed(change) for change in steps] != [_fixed(change) for change in self.inputs.steps]:
            raise ValueError("only the sizes of steps and the instants of smooth ones may change")
        pairs = zip(steps, self.inputs.steps, strict=True)
        changed = {new.signal for new, old in pairs if new != old}
        result = copy(self)
        result.inputs, result.delay = replace(self.inputs, steps=steps), delay
        if changed:
            result._input_samples = result._inputs_on_grid(changed)
        if delay != self.delay:
            result._sampling = Interpolation(self._grid, self.times, delay)
        return result

    def on_grid(self) -> "Simulator":
        """Return the simulator that gives all points of its grid, whatever the delay.

        An instant of an exact step is there twice: before and after it.
        """
        result = copy(self)
        result.times, result._sampling = (
            np.concatenate([segment.times for segment in self._grid]),
            WholeRun(),
        )
        return result

    def sampling(self) -> Interpolation:
        """Return what reads the response at the sample times from the points of its grid."""
        if isinstance(self._sampling, Interpolation):
            return self._sampling
        return Interpolation(self._grid, self.times, self.delay)

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
        method's own error. What is faster away from rest is for ``with_enough_substeps``.

        Raises SimulationError where the start is no rest, or beyond ``MOST_SUBSTEPS``.
        """
        p = self._vector(values)
        key = p.tobytes()
        parts = self._substeps_of.get(key)
        if parts is None:
            parts = max(self.least, self._parts(values, self._rate_at_rest(values, p)))
            if len(self._substeps_of) >= REMEMBERED:
                self._substeps_of.clear()
            self._substeps_of[key] = parts
        return parts

    def substeps_along(self, values: Values, response: Response, points: int = 100) -> int:
        """Return the sub-steps that the rule requires along a response with all its states."""
        p = self._vector(values)
        rest = linear_kernel(self.system).rest(p)
        inputs = self._sampling(self._input_samples)
        rows = np.linspace(0, len(response.time) - 1, points).astype(int)
        states = np.stack([response.signals[name][rows] for name in self.system.states], axis=1)
        code, r = linear_kernel(self.system), rest.r
        pairs = zip(np.ascontiguousarray(states), np.ascontiguousarray(inputs[rows]), strict=True)
        jacobians = np.stack([code.motion(p, r, x, u)[1] for x, u in pairs])
        return self._parts(values, fastest(jacobians))

    def with_enough_substeps(self, values: Values) -> "Simulator":
        """Return a simulator whose sub-steps are enough all along the response to these values.

        Raises SimulationError where that response does not stay finite.
        """
        simulator = self
        for _ in range(MOST_REPEATS):
            whole = simulator.on_grid()
            response = whole.response(values)
            wanted = whole.substeps_along(values, response)
            if wanted <= response.substeps:
                break
            simulator = self._with(self.step, wanted)
        return simulator

    def step_error(self, values: Values, outputs: tuple[str, ...]) -> float:
        """Return by how much, at most and per unit, halving every step moves any of the outputs."""
        return max(self.step_errors(values, outputs).values())

    def step_errors(self, values: Values, outputs: tuple[str, ...]) -> dict[str, float]:
        """Return by how much, at most and per unit, halving every step moves each output.

        At the points of the grid: a record with many more samples shows no more.
        """
        times = np.unique(np.concatenate([segment.times for segment in self._grid]))
        coarse = Simulator(self.system, self.inputs, times, self.step, self.least)
        samples, parts = coarse.samples(values, outputs)
        finer = Simulator(self.system, self.inputs, times, self.step / 2.0, parts)
        moved = np.max(np.abs(samples - finer.samples(values, outputs)[0]), axis=0)
        return dict(zip(outputs, map(float, moved), strict=True))

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

    def input(self, signal: str) -> Array:
        """Return an input (M,) at the sample times, which the recorder delays."""
        inputs = self._sampling(self._input_samples)
        return inputs[:, self.system.inputs.index(signal)]

    def run(self, values: Values) -> Run:
        """Return all outputs and inputs of the system on the grid, without the recorder's delay."""
        code = kernel(self.system, self.system.outputs, 1)
        p = self._vector(values)[:, None]
        run = code.run(p, code.start(p), self._spans(self.substeps(values)))
        return Run(
            np.concatenate([segment.times for segment in self._grid]),
            dict(zip(self.system.outputs, joined(run)[:, :, 0].T, strict=True)),
            dict(zip(self.system.inputs, joined(self._input_samples).T, strict=True)),
        )

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
        self, values: Values, outputs: tuple[str, ...], directions: Sequence[Direction]
    ) -> tuple[Array, Array]:
        """Return outputs (M, ny) and their exact derivatives (M, ny, directions).

        A direction costs the same whatever moves in it; one of the delay alone costs nothing.
        Raises ValueError where one moves the instant of a step that is not smooth.
        """
        columns = [k for k, d in enumerate(directions) if d.parameters or d.steps]
        driving = [directions[k] for k in columns]
        code = self._tangent_code(outputs, driving)
        spans = self._spans(self.substeps(values))
        if code.moving:
            spans = [
                span._replace(du=self._moving(segment, code.moving, driving))
                for span, segment in zip(spans, self._grid, strict=True)
            ]
        run, derived = code.run(self._vector(values), self._seeds(driving), spans)
        slopes = np.zeros((len(self.times), len(outputs), len(directions)))
        slopes[:, :, columns] = self._sampling(derived)
        delays = np.array([direction.delay for direction in directions])
        if np.any(delays):
            slopes -= self._sampling.slope(run)[:, :, None] * delays
        return self._sampling(run), slopes

    def _tangent_code(
        self, outputs: tuple[str, ...], directions: Sequence[Direction]
    ) -> TangentKernel:
        """Return the machine code whose derivatives cover what these directions move."""
        free = {name for direction in directions for name in direction.parameters}
        moving = {
            self.inputs.steps[index].signal for direction in directions for index in direction.steps
        }
        return tangent_kernel(
            self.system,
            outputs,
            tuple(name for name in self.system.parameters if name in free),
            tuple(name for name in self.system.inputs if name in moving),
        )

    def _seeds(self, directions: Sequence[Direction]) -> Array:
        """Return how each parameter moves in each direction, (np, N)."""
        seeds = np.zeros((len(self.system.parameters), len(directions)))
        for column, direction in enumerate(directions):
            for name, rate in direction.parameters.items():
                seeds[self.system.parameters.index(name), column] = rate
        return seeds

    def _moving(
        self, segment: GridSegment, inputs: Sequence[str], directions: Sequence[Direction]
    ) -> Array:
        """Return how inputs move in each direction at a segment's grid points, (n + 1, nu, N)."""
        du = np.zeros((segment.steps + 1, len(inputs), len(directions)))
        for column, direction in enumerate(directions):
            for index, (at, step) in direction.steps.items():
                change = self.inputs.steps[index]
                if change.signal in inputs:
                    row = du[:, inputs.index(change.signal), column]
                    if at:
                        row += at * change.step * change.share_slope(segment)
                    if step:
                        row += step * change.share(segment)
        return du

    def _with(self, step: float, least: int) -> "Simulator":
        return Simulator(self.system, self.inputs, self.times, step, least, self.delay)

    def _inputs_on_grid(self, changed: Container[str] | None = None) -> list[Array]:
        """Return the inputs at the grid points of each segment, (n + 1, nu).

        Only those ``changed`` are computed anew, where these are given.
        """
        samples = []
        for k, (segment, recorded) in enumerate(
            zip(self._grid, self._recorded_samples, strict=True)
        ):
            u = np.empty((segment.steps + 1, len(self.system.inputs)))
            for column, name in enumerate(self.system.inputs):
                if changed is None or name in changed:
                    u[:, column] = self.inputs.stepped(name, segment) + recorded.get(name, 0.0)
                else:
                    u[:, column] = self._input_samples[k][:, column]
            samples.append(u)
        return samples

    def _vector(self, values: Values) -> Array:
        return np.array([values[name] for name in self.system.parameters], dtype=np.float64)

    def _spans(self, parts: int) -> list[Span]:
        return [
            Span(u, segment.step, parts)
            for u, segment in zip(self._input_samples, self._grid, strict=True)
        ]

    def _rate_at_rest(self, values: Values, p: Array) -> float:
        """Return the fastest rate (1/s) at the start; raises SimulationError if that is no rest."""
        rest = linear_kernel(self.system).rest(p)
        slopes, rate = self._motion(p, rest, rest.x, np.zeros(len(self.system.inputs)))
        # what the rounding of a state leaves of its slope, at the fastest rate
        rounding = STATE_ROUNDING * float(np.max(np.abs(rest.x))) * rate
        moving = ~(np.abs(slopes) <= REST_TOLERANCE + rounding)
        if np.any(moving) or not math.isfinite(rounding):
            why = self._why_moving(values, slopes, moving)
            at = f" at vt0 = {values['vt0']:g} pu" if "vt0" in values else ""
            raise SimulationError(f"no state of rest{at}: {why}")
        return rate

    def _motion(self, p: Array, rest: Start, x: Array, u: Array) -> tuple[Array, float]:
        """Return the slopes at states x and the spectral radius (1/s) of their Jacobian."""
        slopes, jacobian = linear_kernel(self.system).motion(p, rest.r, x, u)
        rate = fastest(jacobian)
        return slopes if math.isfinite(rate) else np.full(len(x), np.nan), rate

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
        return (
            limits_passed(self.system, values) or ", ".join(moved) or "the values do not define one"
        )


def _fixed(change: InputStep) -> InputStep:
    """Return what of a step cannot be moved."""
    return change._replace(at=0.0 if change.smooth else change.at, step=0.0)


def fastest(jacobians: Array) -> float:
    """Return the largest spectral radius of Jacobians (..., nx, nx), inf where one is infinite."""
    if not np.isfinite(jacobians).all():
        return math.inf
    return float(np.abs(np.linalg.eigvals(jacobians)).max())
