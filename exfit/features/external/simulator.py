"""A simulator that takes the signals of a test from another program, and all else from its twin."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.simulation.inputs import Direction
from exfit.simulation.simulator import Response, Simulator
from exfit.simulation.substeps import NO_SUBSTEPS

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Values = Mapping[str, float]
Limits = Mapping[str, tuple[float, float]]

QUOTIENT_STEP = 1e-3  # of scaled parameters: far above the tolerances of programs that integrate


class RunOutcome(Protocol):
    """A run of another program: its signals, or why it has none."""

    @property
    def signals(self) -> Mapping[str, Array]:
        """The signals (M,) by name."""

    @property
    def failure(self) -> str:
        """Why there are none, "" where there are."""


class Program(Protocol):
    """Another program that simulates."""

    @property
    def place(self) -> str:
        """Where a case names it."""

    def remembered(self, request: Mapping[str, Any]) -> RunOutcome | None:
        """Return the run of a request that was made before and has not failed, None else."""

    def runs(self, requests: Sequence[Mapping[str, Any]]) -> Sequence[RunOutcome]:
        """Return the run of each request: "values", "steps", "times", "signals"."""


class TwinSimulator(Simulator):
    """A simulator of which some signals are not those of its system; its system is a twin.

    On the points of its grid, and to small inputs, it simulates the twin.
    """

    alone = False

    def __init__(self, twin: Simulator) -> None:
        vars(self).update(vars(twin))

    @property
    def twin(self) -> Simulator:
        """The simulator of the twin alone."""
        twin = Simulator.__new__(Simulator)
        vars(twin).update(vars(self))
        return twin

    def on_grid(self, points: int | None = None) -> Simulator:
        """Return the simulator of the twin that gives all points of its grid, or so many."""
        return self.twin.on_grid(points)

    def small_signal(self) -> Simulator:
        """Return the simulator of the twin's response that is linear in the inputs."""
        return self.twin.small_signal()

    def _with(self, step: float, least: int) -> "TwinSimulator":
        result = copy(self)
        vars(result).update(vars(super()._with(step, least)))
        return result


class ProgramSimulator(TwinSimulator):
    """A simulator of a twin whose ``signals`` another program gives, or has given.

    ``names`` are those of the parameters that have another name there.
    """

    def __init__(
        self,
        twin: Simulator,
        program: Program,
        signals: tuple[str, ...],
        names: Mapping[str, str],
    ) -> None:
        super().__init__(twin)
        self.program, self.signals, self.names = program, signals, names

    def request(self, values: Values) -> dict[str, Any]:
        """Return the request for a run: all values, the steps, the instants without the delay."""
        inputs = self.inputs
        times = np.clip(self.times - self.delay, inputs.start, inputs.end)
        return {
            "values": {self.names.get(name, name): value for name, value in values.items()},
            "steps": [
                {"signal": step.signal, "at": step.at, "step": step.step, "ramp": step.ramp}
                for step in inputs.steps
            ],
            "times": times.tolist(),
            "signals": list(self.signals),
        }

    def put_remembered(
        self,
        samples: Array,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Sequence[Simulator] | None,
    ) -> None:
        """Put the runs that the program remembers in the place of samples (K, M, ny) of K sets."""
        simulators = [self] * len(sets) if tests is None else tests
        for k, (simulator, values) in enumerate(zip(simulators, sets, strict=True)):
            run = self.program.remembered(_request(simulator, values))
            if run is not None:
                _put(samples[k], run, outputs)


class ExternalSimulator(ProgramSimulator):
    """Simulates its signals in another program; exact derivatives are those of the twin."""

    def substeps(self, values: Values) -> int:
        """Return the sub-steps of the twin; raises SimulationError where the program has failed."""
        parts = super().substeps(values)
        (run,) = self.program.runs([self.request(values)])
        if run.failure:
            raise SimulationError(f"{self.program.place}: {run.failure}")
        return parts

    def samples_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Counts]:
        """Return outputs (K, M, ny) of K sets; a run that failed has no sub-steps.

        Where the twin has no start at rest, which has no derivative either, there is no run.
        """
        if set(outputs) <= set(self.signals):
            samples = np.full((len(sets), len(self.times), len(outputs)), np.nan)
            parts = self._substeps_of_many(self._vectors(sets))
        else:
            samples, parts = super().samples_of_many(sets, outputs, tests)
        return self._with_runs(samples, parts, sets, outputs, tests)

    def tangents_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Array, Counts]:
        """Return outputs (K, M, ny) of K sets, with the derivatives (K, M, ny, N) of the twin."""
        samples, slopes, parts = super().tangents_of_many(sets, outputs, directions, tests)
        samples, parts = self._with_runs(samples, parts, sets, outputs, tests)
        return samples, slopes, parts

    def _with_runs(
        self,
        samples: Array,
        parts: Counts,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Sequence[Simulator] | None,
    ) -> tuple[Array, Counts]:
        """Return the samples of the twin with the signals of the program in place of its own."""
        simulators = [self] * len(sets) if tests is None else tests
        reached = np.flatnonzero(parts != NO_SUBSTEPS).tolist()
        requests = [_request(simulators[k], sets[k]) for k in reached]
        samples, parts = samples.copy(), parts.copy()
        for k, run in zip(reached, self.program.runs(requests), strict=True):
            if run.failure:
                parts[k], samples[k] = NO_SUBSTEPS, np.nan
            else:
                _put(samples[k], run, outputs)
        return samples, parts


class QuotientSimulator(ExternalSimulator):
    """Simulates its signals in another program, whose runs give the derivatives as well.

    These are quotients over QUOTIENT_STEP of a direction, forward, or backward where a parameter
    would leave its ``limits`` or that run fails; 0 where both fail. All runs are side by side.
    """

    def __init__(
        self,
        twin: Simulator,
        program: Program,
        signals: tuple[str, ...],
        names: Mapping[str, str],
        limits: Limits,
    ) -> None:
        super().__init__(twin, program, signals, names)
        self.limits = limits

    def response(self, values: Values, outputs: Sequence[str] | None = None) -> Response:
        """Return the outputs (all signals of the program by default) at the sample times."""
        return super().response(values, self.signals if outputs is None else outputs)

    def tangents_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Array, Counts]:
        """Return outputs (K, M, ny) of K sets, with quotients (K, M, ny, N) in their directions."""
        samples, parts = self.samples_of_many(sets, outputs, tests)
        simulators = [self] * len(sets) if tests is None else tests
        slopes = np.zeros((*samples.shape, len(directions[0])))
        reached = np.flatnonzero(parts != NO_SUBSTEPS).tolist()
        missing = [(k, j) for k in reached for j in range(len(directions[k]))]
        for turn in (1.0, -1.0):
            steps = [turn * self._step(sets[k], directions[k][j]) for k, j in missing]
            runs = self.program.runs(
                [
                    _moved(simulators[k], sets[k], directions[k][j], step)
                    for (k, j), step in zip(missing, steps, strict=True)
                ]
            )
            failed = []
            for (k, j), step, run in zip(missing, steps, runs, strict=True):
                moved = samples[k].copy()
                _put(moved, run, outputs)
                slopes[k, :, :, j] = (moved - samples[k]) / step
                failed += [(k, j)] if run.failure else []
            missing = failed
        return samples, slopes, parts

    def _step(self, values: Values, direction: Direction) -> float:
        """Return the step of a direction that keeps its parameters within their limits."""
        for name, rate in direction.parameters.items():
            low, high = self.limits.get(name, (-np.inf, np.inf))
            if not low <= values[name] + QUOTIENT_STEP * rate <= high:
                return -QUOTIENT_STEP
        return QUOTIENT_STEP


class LinearSimulator(ProgramSimulator):
    """Simulates the signals of a program by its run at one set of values and quotients there.

    ``directions`` (N) are those in which values, steps and the delay may differ from these. Where
    the program remembers a run, that run is the response.
    """

    def __init__(
        self, at: QuotientSimulator, values: Values, directions: Sequence[Direction]
    ) -> None:
        super().__init__(at, at.program, at.signals, at.names)
        self._at, self._values = at, values
        self._coordinates = Coordinates(directions)
        self._samples, self._slopes = at.tangents(values, at.signals, directions)

    def samples_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Counts]:
        """Return outputs (K, M, ny) of K sets, linear in what they differ by."""
        samples, parts = super().samples_of_many(sets, outputs, tests)
        here = self._coordinates.place(self._values, self._at)
        for k, values in enumerate(sets):
            simulator = self if tests is None else tests[k]
            place = self._coordinates.place(values, simulator)
            linear = self._samples + self._slopes @ self._coordinates.along(place - here)
            _put(samples[k], _Linear(dict(zip(self.signals, linear.T, strict=True))), outputs)
        self.put_remembered(samples, sets, outputs, tests)
        return samples, parts

    def tangents_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Array, Counts]:
        """Return outputs (K, M, ny) of K sets, with the quotients (K, M, ny, N) of the one set."""
        samples, parts = self.samples_of_many(sets, outputs, tests)
        slopes = [self._at.tangents(self._values, outputs, own)[1] for own in directions]
        return samples, np.stack(slopes), parts


class Coordinates:
    """How far values, steps and the delay of a test lie along some directions (N)."""

    def __init__(self, directions: Sequence[Direction]) -> None:
        self._names = sorted({name for each in directions for name in each.parameters})
        self._steps = sorted({step for each in directions for step in each.steps})
        rows = np.array([self._rates(each) for each in directions]).reshape(len(directions), -1).T
        self._sizes = np.max(np.abs(rows), axis=1, initial=0.0)
        self._sizes[self._sizes == 0.0] = 1.0
        self._inverse = np.linalg.pinv(rows / self._sizes[:, None])

    def place(self, values: Values, simulator: Simulator) -> Array:
        """Return what the directions move, of values and of a simulator's inputs."""
        moved = [simulator.inputs.steps[step] for step in self._steps]
        steps = [number for step in moved for number in (step.at, step.step)]
        return np.array([*(values[name] for name in self._names), *steps, simulator.delay])

    def along(self, way: Array) -> Array:
        """Return how far (N,) a way between two places goes along each direction."""
        return np.asarray(self._inverse @ (way / self._sizes))

    def _rates(self, direction: Direction) -> list[float]:
        steps = [rate for step in self._steps for rate in direction.steps.get(step, (0.0, 0.0))]
        names = [direction.parameters.get(name, 0.0) for name in self._names]
        return [*names, *steps, direction.delay]


class _Linear(NamedTuple):
    """Signals that are no run, but follow from one."""

    signals: Mapping[str, Array]
    failure: str = ""


class CorrectedSimulator(ProgramSimulator):
    """Simulates the twin, with a difference (M,) per unit that is added to some signals.

    It is that between another program and the twin at one set of values, where both agree so.
    Where the program remembers a run, that run is the response; it is asked for none.
    """

    def __init__(self, external: ExternalSimulator, differences: Mapping[str, Array]) -> None:
        super().__init__(external, external.program, external.signals, external.names)
        self.differences = differences

    def samples_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Counts]:
        """Return outputs (K, M, ny) of K sets, corrected."""
        samples, parts = super().samples_of_many(sets, outputs, tests)
        samples = samples + self._added(outputs)
        self.put_remembered(samples, sets, outputs, tests)
        return samples, parts

    def tangents_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Sequence[Simulator] | None = None,
    ) -> tuple[Array, Array, Counts]:
        """Return outputs (K, M, ny) of K sets, corrected, with the derivatives of the twin."""
        samples, slopes, parts = super().tangents_of_many(sets, outputs, directions, tests)
        return samples + self._added(outputs), slopes, parts

    def _added(self, outputs: tuple[str, ...]) -> Array:
        nothing = np.zeros(len(self.times))
        return np.stack([self.differences.get(name, nothing) for name in outputs], axis=1)


def _request(simulator: Simulator, values: Values) -> dict[str, Any]:
    """Return the request for a run of a simulator that is one of a program."""
    assert isinstance(simulator, ProgramSimulator)
    return simulator.request(values)


def _moved(
    simulator: Simulator, values: Values, direction: Direction, step: float
) -> dict[str, Any]:
    """Return the request for a run a step away from values and inputs, in a direction."""
    steps = list(simulator.inputs.steps)
    for place, (at, size) in direction.steps.items():
        old = steps[place]
        steps[place] = old._replace(at=old.at + step * at, step=old.step + step * size)
    moved = simulator.with_inputs(tuple(steps), simulator.delay + step * direction.delay)
    changes = {name: values[name] + step * rate for name, rate in direction.parameters.items()}
    return _request(moved, {**values, **changes})


def _put(samples: Array, run: RunOutcome, outputs: tuple[str, ...]) -> None:
    """Put the signals of a run in the place of those of outputs (M, ny)."""
    for place, name in enumerate(outputs):
        if name in run.signals:
            samples[:, place] = run.signals[name]
