"""What gives the signals of a test in place of its equations: another program, or its own runs.

All else of the test, its grid and its sub-steps among it, stays that of the equations: the twin.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.features.external.program import ExternalProgram, ExternalRun
from exfit.simulation.inputs import Direction
from exfit.simulation.simulator import Simulator
from exfit.simulation.substeps import NO_SUBSTEPS
from exfit.util.arrays import Array

Counts = NDArray[np.int64]
Values = Mapping[str, float]
Tests = Sequence[Simulator] | None

QUOTIENT_STEP = 1e-3  # of scaled parameters: far above the tolerances of programs that integrate


def _twin(simulator: Simulator) -> Simulator:
    """Return the simulator of the same test by the equations."""
    return simulator.with_responder(None)


@dataclass(frozen=True, eq=False)
class ProgramSignals:
    """The ``signals`` of a test that a program gives.

    ``names`` are those of the parameters that have another name there.
    """

    program: ExternalProgram
    signals: tuple[str, ...]
    names: Mapping[str, str]

    def request(
        self,
        simulator: Simulator,
        values: Values,
        direction: Direction | None = None,
        step: float = 0.0,
    ) -> dict[str, Any]:
        """Make the request for a run: all values, the steps, the times without the delay.

        Values and inputs are a ``step`` away in a ``direction`` where one is given.
        """
        if direction is not None:
            steps = list(simulator.inputs.steps)
            for place, (at, size) in direction.steps.items():
                old = steps[place]
                steps[place] = old._replace(at=old.at + step * at, step=old.step + step * size)
            delay = simulator.delay + step * direction.delay
            simulator = simulator.with_inputs(tuple(steps), delay)
            rates = direction.parameters.items()
            values = {**values, **{name: values[name] + step * rate for name, rate in rates}}
        inputs = simulator.inputs
        times = np.clip(simulator.times - simulator.delay, inputs.start, inputs.end)
        return {
            "values": {self.names.get(name, name): value for name, value in values.items()},
            "steps": [
                {"signal": each.signal, "at": each.at, "step": each.step, "ramp": each.ramp}
                for each in inputs.steps
            ],
            "times": times.tolist(),
            "signals": list(self.signals),
        }

    def run(self, simulator: Simulator, values: Values) -> ExternalRun:
        """Have the program run a test at some values."""
        (run,) = self.program.runs([self.request(simulator, values)])
        return run


def put(samples: Array, signals: Mapping[str, Array], outputs: tuple[str, ...]) -> None:
    """Put signals in the place of those outputs (M, ny)."""
    for place, name in enumerate(outputs):
        if name in signals:
            samples[:, place] = signals[name]


class ProgramResponder:
    """Responds by a program, or by what its runs have shown; it has the outputs of the twin."""

    def __init__(self, given: ProgramSignals) -> None:
        self.given = given

    def outputs(self, simulator: Simulator) -> tuple[str, ...]:
        """Name the outputs of what stands for the unit."""
        return simulator.system.outputs

    def confirm(self, simulator: Simulator, values: Values) -> None:
        """Accept all values: no run is asked for."""


class RunResponder(ProgramResponder):
    """Responds by a run of the program each time; exact derivatives are those of the twin."""

    def confirm(self, simulator: Simulator, values: Values) -> None:
        """Raise SimulationError where the program has failed."""
        run = self.given.run(simulator, values)
        if run.failure:
            raise SimulationError(f"{self.given.program.place}: {run.failure}")

    def samples_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Tests,
    ) -> tuple[Array, Counts]:
        """Run outputs (K, M, ny) of K sets; a run that failed has no sub-steps.

        Where the twin has no start at rest, which has no derivative either, there is no run.
        """
        if set(outputs) <= set(self.given.signals):
            samples = np.full((len(sets), len(simulator.times), len(outputs)), np.nan)
            _, parts = simulator.prepared(sets)
        else:
            samples, parts = _twin(simulator).samples_of_many(sets, outputs, tests)
        return self._with_runs(samples, parts, tests or [simulator] * len(sets), sets, outputs)

    def tangents_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Tests,
    ) -> tuple[Array, Array, Counts]:
        """Run outputs (K, M, ny) of K sets, with the derivatives (K, M, ny, N) of the twin."""
        samples, slopes, parts = _twin(simulator).tangents_of_many(sets, outputs, directions, tests)
        simulators = tests or [simulator] * len(sets)
        samples, parts = self._with_runs(samples, parts, simulators, sets, outputs)
        return samples, slopes, parts

    def _with_runs(
        self,
        samples: Array,
        parts: Counts,
        simulators: Sequence[Simulator],
        sets: Sequence[Values],
        outputs: tuple[str, ...],
    ) -> tuple[Array, Counts]:
        """Put the signals of the program in the place of those of its twin."""
        reached = np.flatnonzero(parts != NO_SUBSTEPS).tolist()
        requests = [self.given.request(simulators[k], sets[k]) for k in reached]
        samples, parts = samples.copy(), parts.copy()
        for k, run in zip(reached, self.given.program.runs(requests), strict=True):
            if run.failure:
                parts[k], samples[k] = NO_SUBSTEPS, np.nan
            else:
                put(samples[k], run.signals, outputs)
        return samples, parts


class QuotientResponder(RunResponder):
    """Responds by runs of the program, which give the derivatives as well.

    These are quotients over QUOTIENT_STEP of a direction, forward, or backward where a parameter
    would leave its ``limits`` or that run fails; 0 where both fail. All runs are side by side.
    """

    def __init__(self, given: ProgramSignals, limits: Mapping[str, tuple[float, float]]) -> None:
        super().__init__(given)
        self._limits = limits

    def outputs(self, simulator: Simulator) -> tuple[str, ...]:
        """Name the signals of the program: there are no others."""
        return self.given.signals

    def tangents_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Tests,
    ) -> tuple[Array, Array, Counts]:
        """Run outputs (K, M, ny) of K sets, with quotients (K, M, ny, N) in their directions."""
        samples, parts = self.samples_of_many(simulator, sets, outputs, tests)
        simulators = tests or [simulator] * len(sets)
        slopes = np.zeros((*samples.shape, len(directions[0])))
        reached = np.flatnonzero(parts != NO_SUBSTEPS).tolist()
        missing = [(k, j) for k in reached for j in range(len(directions[k]))]
        for turn in (1.0, -1.0):
            steps = [turn * self._step(sets[k], directions[k][j]) for k, j in missing]
            requests = [
                self.given.request(simulators[k], sets[k], directions[k][j], step)
                for (k, j), step in zip(missing, steps, strict=True)
            ]
            runs = self.given.program.runs(requests)
            failed = []
            for (k, j), step, run in zip(missing, steps, runs, strict=True):
                moved = samples[k].copy()
                put(moved, run.signals, outputs)
                slopes[k, :, :, j] = (moved - samples[k]) / step
                failed += [(k, j)] if run.failure else []
            missing = failed
        return samples, slopes, parts

    def _step(self, values: Values, direction: Direction) -> float:
        """Choose the step of a direction that keeps its parameters within their limits."""
        for name, rate in direction.parameters.items():
            low, high = self._limits.get(name, (-np.inf, np.inf))
            if not low <= values[name] + QUOTIENT_STEP * rate <= high:
                return -QUOTIENT_STEP
        return QUOTIENT_STEP


class SettledResponder(ProgramResponder, ABC):
    """Responds without a run; where the program remembers one, that run is the response."""

    @abstractmethod
    def correct(
        self, samples: Array, simulator: Simulator, values: Values, outputs: tuple[str, ...]
    ) -> None:
        """Correct the outputs (M, ny) that the equations give at values."""

    def samples_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: Tests,
    ) -> tuple[Array, Counts]:
        """Find outputs (K, M, ny) of K sets, corrected."""
        samples, parts = _twin(simulator).samples_of_many(sets, outputs, tests)
        simulators = tests or [simulator] * len(sets)
        for own, test, values in zip(samples, simulators, sets, strict=True):
            self.correct(own, test, values, outputs)
            run = self.given.program.remembered(self.given.request(test, values))
            if run is not None:
                put(own, run.signals, outputs)
        return samples, parts


class LinearResponder(SettledResponder):
    """Responds by a run of the program at one set of values and quotients there.

    ``directions`` (N) are those in which values, steps and the delay may differ from these.
    """

    def __init__(
        self,
        given: ProgramSignals,
        at: Simulator,
        values: Values,
        directions: Sequence[Direction],
    ) -> None:
        super().__init__(given)
        self._at, self._values = at, values
        self._samples, self._slopes = at.tangents(values, given.signals, directions)
        self._names = sorted({name for each in directions for name in each.parameters})
        self._steps = sorted({step for each in directions for step in each.steps})
        rates = [
            [
                *(each.parameters.get(name, 0.0) for name in self._names),
                *(rate for step in self._steps for rate in each.steps.get(step, (0.0, 0.0))),
                each.delay,
            ]
            for each in directions
        ]
        rows = np.array(rates).reshape(len(directions), -1).T
        self._sizes = np.max(np.abs(rows), axis=1, initial=0.0)
        self._sizes[self._sizes == 0.0] = 1.0
        self._inverse = np.linalg.pinv(rows / self._sizes[:, None])
        self._here = self._place(values, at)

    def _place(self, values: Values, simulator: Simulator) -> Array:
        """List what the directions move, of values and of a simulator's inputs."""
        moved = [simulator.inputs.steps[step] for step in self._steps]
        steps = [number for step in moved for number in (step.at, step.step)]
        return np.array([*(values[name] for name in self._names), *steps, simulator.delay])

    def correct(
        self, samples: Array, simulator: Simulator, values: Values, outputs: tuple[str, ...]
    ) -> None:
        """Put signals, linear in what they differ by, in the place of outputs (M, ny)."""
        along = self._inverse @ ((self._place(values, simulator) - self._here) / self._sizes)
        linear = self._samples + self._slopes @ along
        put(samples, dict(zip(self.given.signals, linear.T, strict=True)), outputs)

    def tangents_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Tests,
    ) -> tuple[Array, Array, Counts]:
        """Find outputs (K, M, ny) of K sets, with the quotients (K, M, ny, N) of the one set."""
        samples, parts = self.samples_of_many(simulator, sets, outputs, tests)
        slopes = [self._at.tangents(self._values, outputs, own)[1] for own in directions]
        return samples, np.stack(slopes), parts


class CorrectedResponder(SettledResponder):
    """Responds by the twin, with a difference (M,) per unit that is added to some signals.

    It is that between the program and the twin at one set of values, where both agree so.
    """

    def __init__(self, given: ProgramSignals, differences: Mapping[str, Array]) -> None:
        super().__init__(given)
        self.differences = differences

    def correct(
        self, samples: Array, simulator: Simulator, values: Values, outputs: tuple[str, ...]
    ) -> None:
        """Add the differences to outputs (M, ny)."""
        for place, name in enumerate(outputs):
            if name in self.differences:
                samples[:, place] += self.differences[name]

    def tangents_of_many(
        self,
        simulator: Simulator,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: Tests,
    ) -> tuple[Array, Array, Counts]:
        """Simulate outputs (K, M, ny) of K sets, corrected, with the derivatives of the twin."""
        samples, slopes, parts = _twin(simulator).tangents_of_many(sets, outputs, directions, tests)
        for own, values in zip(samples, sets, strict=True):
            self.correct(own, simulator, values, outputs)
        return samples, slopes, parts
