"""From parameter values to a response: the start at rest, the sub-steps, the samples."""

from collections.abc import Callable, Container, Mapping, Sequence
from copy import copy
from dataclasses import replace
from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.engine.kernel import SIDE_BY_SIDE, Span, kernel, linear_kernel
from exfit.engine.located_runs import LocatedCourse, located_kernel
from exfit.engine.sampling import Course, Courses, Segment
from exfit.engine.system import System
from exfit.plants import REFERENCES
from exfit.signals import OF_STEP
from exfit.simulation.inputs import Direction, Inputs, InputStep, grid_segments
from exfit.simulation.interpolation import GridPoints, Interpolation, joined
from exfit.simulation.located_test import LocatedTest, SamplePlaces, exact
from exfit.simulation.memory import RunSize, check_run
from exfit.simulation.responder import Counts, Kept, Responder, Values
from exfit.simulation.substeps import (
    NO_SUBSTEPS,
    groups,
    spectral_radii,
    substeps_at_rest,
    substeps_for,
    why_unreachable,
)
from exfit.util.arrays import Array, distinct

if TYPE_CHECKING:
    from exfit.simulation.directions import Moves

ComplexArray = NDArray[np.complex128]
Answer = TypeVar("Answer")

POINTS_ALONG = 100  # of a response, where its sub-steps are checked
MOST_REPEATS = 3  # until the sub-steps are enough for the response that they give
BESIDE_JUMP = 2.0  # steps: as far as the B-splines of a smooth jump reach on both grids
JUMP = 1e-3  # s
REACH = 2.0  # of the fastest rate that a sub-step takes, where the step is chosen by its error
LARGEST_STEP = 2e-2  # s, the first that is tried where an accuracy is asked for
STEPS = (1e-2, *(k * 10.0**-n for n in (3, 4) for k in (5.0, 2.0, 1.0)))  # s, the others
SHORTEST_STEP, LARGEST_DIVISION = STEPS[-1], 10.0
MOST_STATES = 20  # of systems that gain from lanes; with 34 and 41 a set takes 3.5 times as long
FEW = 12  # sets: with located crossings they run faster one by one, as they cross apart
LARGEST_GROWTH = 35.0  # logarithm: of a rounding of 1e-16 to about 1 pu
SAFE = 0.5  # of the accuracy: parameters move in a fit
READ_IN = 5.0  # parts of a step in which a whole run with located crossings is read
MOST_KEPT = 1 << 21  # numbers: 16 MB
SMALL_SHARE = 1e-3  # of the inputs: the response is linear, and far above the rounding of a run


class Run(NamedTuple):
    """A simulation at every point of its grid: ``time`` (n,) in s, the outputs and inputs (n,).

    The instant of an exact step is there twice, before it and after it.
    """

    time: Array
    outputs: Mapping[str, Array]
    inputs: Mapping[str, Array]


class Response(NamedTuple):
    """Simulated signals on one clock: ``time`` (M,) in s, each signal (M,) per unit."""

    time: Array
    signals: Mapping[str, Array]
    substeps: int


class Simulator:
    """Simulates one system through a test's inputs, sampled at ``times`` (M,) in s.

    ``step`` (s) is the largest step; where the system is faster, every step is divided, into no
    fewer than ``least`` parts. A recorder's ``delay`` (s) makes it show at ``times`` the response
    at ``times - delay``: before the start, where all is at rest, and after the end that there. A
    ``responder`` gives the response at these times in place of the equations, not that on the grid.
    ``located``, the crossings of limits are found within a step, which starts anew from there; with
    an ``accuracy`` (pu) the step is one by which signals err by less, see ``with_enough_substeps``.
    Raises SimulationError where that takes more than so much ``memory``, GB; a case gives it.
    """

    def __init__(
        self,
        system: System,
        inputs: Inputs,
        times: Array,
        step: float,
        least: int = 1,
        delay: float = 0.0,
        responder: Responder | None = None,
        located: bool = False,
        accuracy: float | None = None,
        memory: float = inf,
    ) -> None:
        steps = (inputs.end - inputs.start) / step
        check_run(RunSize(steps, len(times), len(system.outputs), 0, located), step, memory)
        self.system, self.inputs, self.times, self.memory = system, inputs, times, memory
        self.step, self.least, self.delay, self.responder = step, least, delay, responder
        self.accuracy = accuracy
        self._share = 1.0  # of the inputs
        self._course: tuple[tuple[int, int], LocatedCourse] | None = None
        self._kept: Kept | None = None
        self._answers: dict[str, tuple[object, Any]] = {}
        self._located = LocatedTest(system.inputs, inputs, step, 1.0) if located else None
        # of a run with located crossings, the points at which it is read as a whole
        read = (exact(inputs), step / READ_IN) if located else (inputs, step)
        self._grid = grid_segments(*read)
        # a long record is read on the grid once, whatever else a fit moves
        self._recorded_samples = [
            {name: recorded.on(segment) for name, recorded in inputs.recorded.items()}
            for segment in (() if located else self._grid)
        ]
        self._segments = self._segments_of()
        self._sampling: Interpolation | GridPoints | SamplePlaces = self._sampling_of(times)

    @property
    def located(self) -> bool:
        """Whether crossings of limits are located within the steps."""
        return self._located is not None

    def _sampling_of(self, times: Array) -> Interpolation | SamplePlaces:
        if self._located is not None:
            return self._located.reading(times, self.delay)
        return Interpolation(self._grid, times, self.delay)

    @property
    def steps(self) -> int:
        """Number of steps of the grid."""
        if self._located is not None:
            return sum(map(len, self._located.grids))
        return sum(segment.steps for segment in self._grid)

    def _copied(self) -> "Simulator":
        result = copy(self)
        result._kept, result._answers = None, {}
        return result

    def _answer(self, what: str, asked: object, find: Callable[[], Answer]) -> Answer:
        """Return the last answer where the same is asked again, as at the end of a search."""
        known = self._answers.get(what)
        if known is None or known[0] != asked:
            known = self._answers[what] = asked, find()
        answer: Answer = known[1]
        return answer

    def _of_system(self, values: Values) -> tuple[float, ...]:
        return tuple(values[name] for name in self.system.parameters)

    def with_responder(self, responder: Responder | None) -> "Simulator":
        """Make the simulator of the same test whose response another gives, or the equations."""
        result = self._copied()
        result.responder = responder
        return result

    def with_inputs(self, steps: tuple[InputStep, ...], delay: float) -> "Simulator":
        """Return the simulator of the same test with other steps and another delay (s).

        The instant of a smooth step may be another, and the size of any. It costs little: the grid
        and the sub-steps found so far are shared. Raises ValueError where a step is another.
        """
        if steps == self.inputs.steps and delay == self.delay:
            return self
        both = [*steps, *self.inputs.steps]
        fixed = [each._replace(at=0.0 if each.smooth else each.at, step=0.0) for each in both]
        if fixed[: len(steps)] != fixed[len(steps) :]:
            raise ValueError("only the sizes of steps and the times of smooth ones may change")
        pairs = zip(steps, self.inputs.steps, strict=True)
        changed = {new.signal for new, old in pairs if new != old}
        result = self._copied()
        result.inputs, result.delay = replace(self.inputs, steps=steps), delay
        if result._located is not None:
            if changed:
                result._located = result._located.with_steps(result.inputs.steps)
            if changed or delay != self.delay:
                result._sampling = result._sampling_of(self.times)
            return result
        if changed:
            result._segments = result._segments_of(changed)
        if delay != self.delay:
            result._sampling = result._sampling_of(self.times)
        return result

    def remade(
        self,
        *,
        system: System | None = None,
        inputs: Inputs | None = None,
        times: Array | None = None,
        step: float | None = None,
        least: int | None = None,
        delay: float | None = None,
        rough: bool = False,
        memory: float | None = None,
    ) -> "Simulator":
        """Make the simulator by equations of another system, test or grid; the rest stays.

        A ``rough`` one takes its step whatever its error.
        """
        return Simulator(
            system or self.system,
            inputs or self.inputs,
            self.times if times is None else times,
            step or self.step,
            least or self.least,
            self.delay if delay is None else delay,
            located=self.located,
            accuracy=None if rough else self.accuracy,
            memory=memory or self.memory,
        )

    def at_times(self, times: Array) -> "Simulator":
        """Return the simulator of the same run that is sampled at other times (M,) in s."""
        result = self._copied()
        result.times, result._sampling = times, result._sampling_of(times)
        return result

    def on_grid(self, points: int | None = None) -> "Simulator":
        """Take all points of the grid, or so many, in place of samples, whatever the delay.

        An instant of an exact step is there twice: before and after it.
        """
        times = np.concatenate([segment.times for segment in self._grid])
        count = len(times)
        rows = np.arange(count) if points is None else np.linspace(0, count - 1, points).astype(int)
        result = self.with_responder(None)
        result.times, result._sampling = times[rows], GridPoints(rows)
        if self._located is not None:
            result.delay = 0.0
            result._sampling = result._sampling_of(result.times)
        return result

    def small_signal(self) -> "Simulator":
        """Return the simulator of the response that is linear in the inputs.

        It simulates a small share of them, so that no limit is met, and enlarges how the response
        deviates from the rest.
        """
        result = self.with_responder(None)
        result.least, result._share = 1, SMALL_SHARE
        if self._located is not None:
            result._located = LocatedTest(self.system.inputs, self.inputs, self.step, SMALL_SHARE)
        result._segments = result._segments_of()
        return result

    def sampling(self) -> Interpolation:
        """Reader of the response at the sample times from the points of its grid."""
        if isinstance(self._sampling, Interpolation):
            return self._sampling
        return Interpolation(self._grid, self.times, self.delay)

    def substeps(self, values: Values) -> int:
        """Return into how many parts each step is divided for these values.

        The rule is that of ``substeps_at_rest``; what is faster away from rest is for
        ``with_enough_substeps``. Raises SimulationError where the start is no rest, or the rule
        asks for too many.
        """
        p, parts = self.prepared([values])
        if parts[0] == NO_SUBSTEPS:
            raise why_unreachable(self.system, self._reach, values, p[0])
        if self.responder is not None:
            self.responder.confirm(self, values)
        return int(parts[0])

    def prepared(self, sets: Sequence[Values]) -> tuple[Array, Counts]:
        """Return the parameters of sets as machine code takes them (K, np), and sub-steps (K,).

        These are NO_SUBSTEPS where there is no rest.
        """
        names = self.system.parameters
        p = np.array([[values[name] for name in names] for values in sets], dtype=np.float64)
        parts = substeps_at_rest(self.system, self._reach, p)
        return p, parts if self.least == 1 else np.maximum(parts, self.least * (parts > 0))

    @property
    def jump(self) -> float:
        """How near (s) a sample is to a step so that it may show the value on either side of it.

        On the literal grid a step whose instant is found takes one step of it.
        """
        return JUMP if self.located else self.step

    @property
    def _reach(self) -> float:
        """Step (s) of the rule for sub-steps: of its unit that of the literal grid is."""
        return self.step / REACH if self.located else self.step

    def rates_at_rest(self, values: Values) -> ComplexArray:
        """Return the eigenvalues (1/s) of the system at rest, zero for a state that stays put.

        Raises SimulationError where the start is no rest.
        """
        self.substeps(values)
        p, _ = self.prepared([values])
        jacobian = linear_kernel(self.system).at_rest(p).jacobian[0]
        return np.asarray(np.linalg.eigvals(jacobian), dtype=np.complex128)

    def substeps_along(self, values: Values, points: int = POINTS_ALONG) -> tuple[int, int]:
        """Return the sub-steps of a response, and those that the rule requires all along it."""
        system, some = self.system, self.on_grid(points)
        signals, parts = some.samples(values, system.outputs)
        states = signals[:, [system.outputs.index(name) for name in system.states]]
        inputs = np.ascontiguousarray(some._inputs())
        code, (p, _) = linear_kernel(system), self.prepared([values])
        r = code.rest(p[0]).r
        _, jacobians = code.motion(p[0], r, np.ascontiguousarray(states), inputs)
        radius = float(spectral_radii(jacobians).max())
        return parts, substeps_for(system, self._reach, values, radius)

    def with_enough_substeps(
        self, values: Values, signals: tuple[str, ...] | None = None
    ) -> "Simulator":
        """Return a simulator whose sub-steps are enough all along the response to these values.

        With an accuracy its step is divided until a quarter of it would move no signal by more
        than that, but where the rest is so unstable that rounding alone would. (Behind a crossing,
        half a step may err as much as a whole one.) Raises SimulationError where that response does
        not stay finite.
        """
        asked = signals, self._of_system(values)
        return self._answer("fine", asked, lambda: self._fine(values, signals)) or self

    def _fine(self, values: Values, signals: tuple[str, ...] | None) -> "Simulator | None":
        """Find the simulator with sub-steps enough, None where it is this one."""
        simulator = self._with_substeps(values)
        if self.accuracy is None or self.growth(values) > LARGEST_GROWTH:
            return None if simulator is self else simulator
        judged = signals or tuple(name for name in OF_STEP if name in self.system.outputs)
        while simulator.step > SHORTEST_STEP:
            moved, sizes = simulator._divided(values, judged or self.system.outputs, 4)
            excess = float(np.max(moved / np.maximum(sizes, 1.0))) / (SAFE * self.accuracy)
            if not excess > 1.0:
                break
            # the error grows with the fourth power of the step
            share = max(1.0 / LARGEST_DIVISION, min(0.5, excess**-0.25))
            finer = max((s for s in STEPS if s <= share * simulator.step), default=SHORTEST_STEP)
            finer_one = simulator.remade(step=finer, least=1).with_responder(self.responder)
            simulator = finer_one._with_substeps(values)
        return None if simulator is self else simulator

    def growth(self, values: Values) -> float:
        """Logarithm by which a deviation from the rest grows within the test, 0 at a stable rest.

        Raises SimulationError where the start is no rest.
        """
        length = float(self.times[-1] - self.times[0])
        return length * float(np.max(self.rates_at_rest(values).real, initial=0.0))

    def _with_substeps(self, values: Values) -> "Simulator":
        simulator = self
        for _ in range(MOST_REPEATS):
            parts, required = simulator.substeps_along(values)
            if required <= parts:
                break
            simulator = self.remade(least=required).with_responder(self.responder)
        return simulator

    def step_errors(self, values: Values, outputs: tuple[str, ...]) -> dict[str, float]:
        """Largest change of each output by halving every step, per unit.

        With located crossings at the sample times, else at the points of the grid: a record with
        many more samples shows no more. Beside a smooth jump of what is recorded the step itself is
        another there.
        """
        asked = outputs, self._of_system(values)
        moved, _ = self._answer("halved", asked, lambda: self._divided(values, outputs, 2))
        return dict(zip(outputs, map(float, moved), strict=True))

    def _divided(
        self, values: Values, outputs: tuple[str, ...], division: int
    ) -> tuple[Array, Array]:
        """Largest change of outputs (ny,) by dividing every step, and their largest value."""
        coarse = self.remade(memory=inf)  # that of a run allows for this
        if not self.located:
            times = distinct(np.concatenate([segment.times for segment in self._grid]))
            for change in self.inputs.steps:
                if change.smooth and change.signal not in REFERENCES:
                    times = times[np.abs(times - change.at) > BESIDE_JUMP * self.step]
            coarse = self.remade(times=times, delay=0.0, memory=inf)
        samples, parts = coarse.samples(values, outputs)
        finer = coarse.remade(step=coarse.step / division, least=parts)
        moved = np.max(np.abs(samples - finer.samples(values, outputs)[0]), axis=0)
        return moved, np.max(np.abs(samples), axis=0)

    def response(self, values: Values, outputs: Sequence[str] | None = None) -> Response:
        """Simulate the outputs (those of the responder by default) at the sample times."""
        own = self.system.outputs if self.responder is None else self.responder.outputs(self)
        wanted = own if outputs is None else tuple(outputs)
        samples, parts = self.samples(values, wanted)
        return Response(self.times, dict(zip(wanted, samples.T, strict=True)), parts)

    def samples(self, values: Values, outputs: tuple[str, ...]) -> tuple[Array, int]:
        """Return outputs (M, ny) and the number of sub-steps."""
        samples, parts = self.samples_of_many([values], outputs)
        if parts[0] == NO_SUBSTEPS:
            self.substeps(values)
        return samples[0], int(parts[0])

    def input(self, signal: str) -> Array:
        """Return an input (M,) at the sample times, which the recorder delays."""
        return self._inputs()[:, self.system.inputs.index(signal)]

    def _inputs(self) -> Array:
        """All inputs (M, nu) at the sample times, which the recorder delays."""
        if self._located is not None:
            assert isinstance(self._sampling, SamplePlaces)
            return self._located.inputs_at(self._sampling)
        assert not isinstance(self._sampling, SamplePlaces)
        return self._sampling([segment.u for segment in self._segments])

    def run(self, values: Values) -> Run:
        """Return all outputs and inputs of the system on the grid, without the recorder's delay."""
        if self._located is not None:
            return self._located_run(values)
        system, parts = self.system, self.substeps(values)
        code, p = kernel(system, system.outputs, 1), self.prepared([values])[0].T.copy()
        spans = [Span(segment.u, segment.step, parts) for segment in self._segments]
        outputs = joined(code.run(p, code.start(p), spans))[:, :, 0]
        inputs = joined([segment.u for segment in self._segments])
        return Run(
            np.concatenate([segment.times for segment in self._grid]),
            dict(zip(system.outputs, outputs.T, strict=True)),
            dict(zip(system.inputs, inputs.T, strict=True)),
        )

    def _located_run(self, values: Values) -> Run:
        whole, system = self.on_grid(), self.system
        samples, _ = whole.samples(values, system.outputs)
        return Run(
            whole.times,
            dict(zip(system.outputs, samples.T, strict=True)),
            dict(zip(system.inputs, whole._inputs().T, strict=True)),
        )

    def samples_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: "Sequence[Simulator] | None" = None,
    ) -> tuple[Array, Counts]:
        """Return outputs (K, M, ny) of K sets, each with its own sub-steps (K,).

        ``tests`` are the simulators of the sets, made of this one by ``with_inputs``, where they
        are not all the same. A set without a start at rest has outputs that are no numbers, and
        NO_SUBSTEPS sub-steps; the others are what they are alone.
        """
        if self.responder is not None:
            return self.responder.samples_of_many(self, sets, outputs, tests)
        if self._located is not None:
            return self._located_samples(sets, outputs, tests)
        p, parts = self.prepared(sets)
        courses = [test.course() for test in tests or [self]]
        alike = tests is None or all(test._segments is tests[0]._segments for test in tests)
        samples = np.full((len(sets), len(self.times), len(outputs)), np.nan)
        for lanes, group in groups(parts, SIDE_BY_SIDE if alike else 1):
            own = courses if tests is None else [courses[k] for k in group]
            code = kernel(self.system, outputs, lanes)
            samples[group] = code.samples(p[group], Courses(own, parts[group]))
        return samples, parts

    def _located_samples(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        tests: "Sequence[Simulator] | None",
    ) -> tuple[Array, Counts]:
        p, parts = self.prepared(sets)
        if len(sets) == 1 and tests is None and self._share == 1.0 and parts[0] != NO_SUBSTEPS:
            course = [self.located_course()]
            alone = located_kernel(self.system, outputs, 1).samples(p, course, parts)
            return self.as_asked(alone), parts
        every = tests or [self]
        alike = {(id(test._located), id(test._sampling)) for test in every}
        courses = [test.located_course() for test in (every if len(alike) > 1 else every[:1])]
        samples = np.full((len(sets), len(self.times), len(outputs)), np.nan)
        for lanes, group in groups(parts, self._lanes(len(sets)) if len(courses) == 1 else 1):
            own = courses if len(courses) == 1 else [courses[k] for k in group]
            code = located_kernel(self.system, outputs, lanes)
            samples[group] = code.samples(p[group], own, parts[group])
        if self._share != 1.0:
            samples = samples[:, :1] + (samples - samples[:, :1]) / self._share
        return self.as_asked(samples), parts

    def _lanes(self, sets: int) -> int:
        """Sets side by side with located crossings: many limits part the ways of lanes."""
        return SIDE_BY_SIDE if sets >= FEW and len(self.system.states) <= MOST_STATES else 1

    def as_asked(self, samples: Array) -> Array:
        """Samples (K, M, ...) of machine code with located crossings, in the order of the times."""
        assert isinstance(self._sampling, SamplePlaces)
        return self._sampling.as_asked(samples)

    def located_course(self, moves: "Moves | None" = None) -> LocatedCourse:
        """Segments for machine code with located crossings, with the inputs that move."""
        assert self._located is not None
        assert isinstance(self._sampling, SamplePlaces)
        if moves is not None and moves.shapes:
            return self._located.course(self._sampling, tuple(moves.shapes.values()))
        key = (id(self._located), id(self._sampling))
        if self._course is None or self._course[0] != key:
            self._course = key, self._located.course(self._sampling)
        return self._course[1]

    def instants(self, directions: Sequence[Direction]) -> Array:
        """Moves of the instants at which segments begin, with located crossings."""
        assert self._located is not None
        return self._located.instants(directions)

    @property
    def still(self) -> NDArray[np.bool_]:
        """Samples before the start and after the end, with located crossings."""
        assert isinstance(self._sampling, SamplePlaces)
        return self._sampling.still

    @property
    def share(self) -> float:
        """Share of the inputs that is simulated."""
        return self._share

    def tangents(
        self, values: Values, outputs: tuple[str, ...], directions: Sequence[Direction]
    ) -> tuple[Array, Array]:
        """Return outputs (M, ny) and their exact derivatives (M, ny, directions).

        A direction costs the same whatever moves in it; one of the delay alone costs nothing. The
        last ones are kept: much is made of those at the end of a search. Raises SimulationError as
        ``substeps``, and ValueError where a direction moves the instant of a step that is not
        smooth.
        """
        asked = outputs, self._of_system(values)
        kept = self._kept
        if kept is None or kept.asked != asked or any(d not in kept.directions for d in directions):
            samples, slopes, parts = self.tangents_of_many([values], outputs, [directions])
            if parts[0] == NO_SUBSTEPS:
                self.substeps(values)
            if self.responder is not None or slopes.size > MOST_KEPT:
                return samples[0], slopes[0]
            kept = self._kept = Kept(asked, tuple(directions), samples[0], slopes[0])
        places = [kept.directions.index(direction) for direction in directions]
        return kept.samples.copy(), np.take(kept.slopes, places, axis=-1)

    def tangents_of_many(
        self,
        sets: Sequence[Values],
        outputs: tuple[str, ...],
        directions: Sequence[Sequence[Direction]],
        tests: "Sequence[Simulator] | None" = None,
    ) -> tuple[Array, Array, Counts]:
        """Return outputs (K, M, ny) of K sets, their derivatives (K, M, ny, N), and sub-steps.

        Each set has its own N directions; all else is as in ``samples_of_many``.
        """
        if self.responder is not None:
            return self.responder.tangents_of_many(self, sets, outputs, directions, tests)
        from exfit.simulation.directions import tangents_by_equations

        return tangents_by_equations(self, sets, outputs, directions, tests)

    def course(self, moves: "Moves | None" = None) -> Course:
        """Arrays for the machine code to run through, with the tangents of inputs that move.

        Where a delay moves it is sampled with its time derivative.
        """
        segments = self._segments
        if moves is not None and moves.shapes:
            segments = [
                segment._replace(shapes=self._share * moves.shapes_on(part, self.inputs))
                for segment, part in zip(segments, self._grid, strict=True)
            ]
        assert not isinstance(self._sampling, SamplePlaces)
        reading = self._sampling.reading(changing=moves is not None and bool(moves.delayed))
        return Course(segments, reading.enlarged(1.0 / self._share))

    def _segments_of(self, changed: Container[str] | None = None) -> list[Segment]:
        """Return the inputs at the grid points of each segment, (n + 1, nu).

        Only those ``changed`` are computed anew, where these are given.
        """
        segments: list[Segment] = []
        if self._located is not None:
            return segments
        for k, (part, recorded) in enumerate(zip(self._grid, self._recorded_samples, strict=True)):
            u = np.empty((part.steps + 1, len(self.system.inputs)))
            for column, name in enumerate(self.system.inputs):
                if changed is None or name in changed:
                    whole = self.inputs.stepped(name, part) + recorded.get(name, 0.0)
                    u[:, column] = self._share * whole
                else:
                    u[:, column] = self._segments[k].u[:, column]
            segments.append(Segment(u, part.step))
        return segments
