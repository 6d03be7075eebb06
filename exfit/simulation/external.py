"""A simulator that takes the signals of a test from another program, and all else from its twin."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from exfit.errors import SimulationError
from exfit.simulation.inputs import Direction
from exfit.simulation.simulator import Simulator
from exfit.simulation.substeps import NO_SUBSTEPS

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
Values = Mapping[str, float]


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


class ExternalSimulator(ProgramSimulator):
    """Simulates its signals in another program; exact derivatives are those of the twin."""

    def substeps(self, values: Values) -> int:
        """Return the sub-steps of the twin; raises SimulationError where the program has failed."""
        parts = super().substeps(values)
        (run,) = self.program.runs([self.request(values)])
        if run.failure:
            raise SimulationError(f"plant.command: {run.failure}")
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
        for k, values in enumerate(sets):
            simulator = self if tests is None else tests[k]
            run = self.program.remembered(_request(simulator, values))
            if run is not None:
                _put(samples[k], run, outputs)
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


def _put(samples: Array, run: RunOutcome, outputs: tuple[str, ...]) -> None:
    """Put the signals of a run in the place of those of outputs (M, ny)."""
    for place, name in enumerate(outputs):
        if name in run.signals:
            samples[:, place] = run.signals[name]
