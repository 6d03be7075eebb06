"""What a report simulates again at the fitted values: what no file of the fit holds."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from exfit.analysis.iteration_responses import iteration_response
from exfit.analysis.model_check import FLAT_DRIFT, flat_drift
from exfit.errors import SimulationError
from exfit.fitting.experiment import Experiment
from exfit.fitting.problem import FitProblem, problem_of, residuals_of
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import names_of_records
from exfit.fitting.setup import ExperimentSetup, compared
from exfit.fitting.uncertainty import linearisation, sensitivity
from exfit.output.report.sources import Sources
from exfit.results.model import judged_of

if TYPE_CHECKING:
    from exfit.simulation.limit_hits import LimitHit
    from exfit.simulation.small_signal import SmallSignal

Array = NDArray[np.float64]
Values = Mapping[str, float]

PERCENT = 1e-2
MOST_COURSES = 12  # of iterations in one figure that can be told apart


@dataclass(frozen=True, eq=False)
class Moved:
    """By how much 1 % more of each parameter (K) moves a signal, (M, K) in pu, at ``time`` (M,)."""

    label: str
    time: Array
    names: tuple[str, ...]
    by: Array


@dataclass(frozen=True)
class Flat:
    """How far (pu) the signals of a test move in a minute without a step."""

    name: str
    drift: float

    @property
    def rests(self) -> bool:
        """Whether it stays where it starts."""
        return self.drift <= FLAT_DRIFT


@dataclass(frozen=True)
class Small:
    """The small-signal view of some tests, whose system and state of rest are the same."""

    names: tuple[str, ...]
    found: "SmallSignal | None"
    why: str = ""


@dataclass(frozen=True)
class Limited:
    """The limits that the response of a test was on."""

    name: str
    hits: "tuple[LimitHit, ...]"


@dataclass(frozen=True, eq=False)
class Courses:
    """The signal that a test is judged by, measured and after some iterations, at ``time`` (M,)."""

    name: str
    signal: str
    time: Array
    measured: Array
    simulated: Mapping[int, Array]


@dataclass(frozen=True)
class Simulated:
    """All that is simulated again at the fitted values."""

    moved: tuple[Moved, ...]
    flat: tuple[Flat, ...]
    small: tuple[Small, ...]
    limited: tuple[Limited, ...]
    courses: tuple[Courses, ...]


def simulated(found: Sources) -> Simulated:
    """Return what the fitted values do; raises SimulationError where they cannot be simulated."""
    residuals = residuals_of(found.case, found.trials)
    problem = problem_of(residuals)
    fitted = found.saved.fitted()
    theta = np.array([one.scaled(fitted[one.name]) for one in residuals.free])
    values = residuals.values(theta)
    trials = tuple(one.with_enough_substeps(values) for one in found.trials)
    # what a validation leaves open about its own record is at its start: no limit depends on it
    unseen = tuple(
        one.with_enough_substeps(one.with_start_values(values)) for one in found.validations
    )
    experiments = [one.experiment for one in trials]
    known = found.saved.at("knowledge") is not None
    return Simulated(
        moved=tuple(_moved(problem, theta, trials)) if known else (),
        flat=tuple(_flat(experiments, values)),
        small=tuple(_small(experiments, values)),
        limited=tuple(_limited((*trials, *unseen), values)),
        courses=tuple(_courses(found, trials, residuals, values)),
    )


def _flat(experiments: Sequence[Experiment], values: Values) -> Iterator[Flat]:
    for one in experiments:
        simulator, at = one.with_inputs(values), one.parameters(values)
        yield Flat(one.name, flat_drift(simulator, at, one.signals))


def _moved(problem: FitProblem, theta: Array, trials: Sequence[ExperimentSetup]) -> Iterator[Moved]:
    """Yield what 1 % more of each parameter does; what belongs to a record is left out."""
    try:
        linear = linearisation(problem, theta, names_of_records(trials))
    except SimulationError:
        return
    shown = [k for k, of_record in enumerate(linear.nuisances) if not of_record]
    names = tuple(linear.names[k] for k in shown)
    for one in sensitivity(problem, theta, linear):
        yield Moved(one.label, one.time, names, PERCENT * one.moved[:, shown])


def _small(experiments: Sequence[Experiment], values: Values) -> Iterator[Small]:
    """Yield the small-signal view of each state of rest that the tests start from."""
    from exfit.simulation.small_signal import small_signal

    alike: dict[object, list[Experiment]] = {}
    for one in experiments:
        at = one.parameters(values)
        key = (one.simulator.system, tuple(sorted(at.items())))
        alike.setdefault(key, []).append(one)
    for same in alike.values():
        names, first = tuple(one.name for one in same), same[0]
        if "vref" not in first.simulator.system.inputs:
            yield Small(names, None, "the recorded signals drive the machine: there is no loop")
            continue
        try:
            yield Small(names, small_signal(first.simulator.system, first.parameters(values)))
        except SimulationError as fault:
            yield Small(names, None, str(fault))


def _limited(trials: Sequence[ExperimentSetup], values: Values) -> Iterator[Limited]:
    from exfit.simulation.limit_hits import limits_hit

    for one in trials:
        at = one.with_start_values(values)
        simulator, parameters = one.experiment.with_inputs(at), one.experiment.parameters(at)
        yield Limited(one.name, limits_hit(simulator, parameters))


def _courses(
    found: Sources, trials: Sequence[ExperimentSetup], residuals: Residuals, values: Values
) -> Iterator[Courses]:
    """Yield how the response to each fitted test went from the start to the fit."""
    history = found.saved.entries("history")
    rows = np.unique(np.geomspace(1, max(len(history), 1), MOST_COURSES).round().astype(int) - 1)
    for trial in trials:
        signals = trial.experiment.signals
        column = signals.index(judged_of(signals))
        channel = trial.channels[column]
        samples: dict[int, Array] = {}
        for row in rows[: len(history)]:
            number = int(found.saved.number("history", int(row), "number"))
            moved = found.saved.at("history", int(row), "values")
            course = iteration_response(trial, residuals, signals[column], moved)
            if course is not None:
                samples[number] = course
        measured = compared(channel, trial.experiment.measured(channel, values))
        yield Courses(trial.name, signals[column], trial.record.time, measured, samples)
