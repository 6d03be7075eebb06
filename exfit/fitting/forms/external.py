"""The search for the parameters of a unit that another program simulates.

The program gives the residuals, its twin their derivatives. Where two steps with these fail in a
row, difference quotients of the program's runs, side by side, show by how much they are wrong; all
later derivatives of the twin are corrected by that.

Source: the correction is that of manifold mapping, Echeverria & Hemker 2005.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from math import inf
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from exfit import estimate
from exfit.case.case import Case
from exfit.errors import CaseError, SimulationError
from exfit.estimate import half_square
from exfit.external.program import ExternalProgram, running
from exfit.fitting.descents import Announce, following
from exfit.fitting.experiment import Channel
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup
from exfit.simulation.external import CorrectedSimulator, ExternalSimulator, TwinSimulator
from exfit.simulation.simulator import Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

QUOTIENT_STEP = 1e-3  # of scaled parameters: far above the tolerances of programs that integrate
FAILED_STEPS = 2  # in a row, after which the derivatives of the twin are doubted
VISIBLE_GAIN = 1e-3  # of the cost: what a step must promise to be missed
DISTINCT = 0.3  # of the residuals: by how much program and twin may differ
NEGLIGIBLE_DIFFERENCE = 1e-4  # of what the record moves
MOST_CORRECTIONS = 5
PROGRAM_TOLERANCE = 1e-5  # of the cost: no gain that is less is worth a run
PROGRAM_STEP = 1e-4  # of scaled parameters: no step that is less


@contextmanager
def program_of(case: Case) -> Iterator[ExternalProgram | None]:
    """Provide the program that simulates a case, None where exfit does; end it afterwards."""
    section = case.external
    if section is None:
        yield None
        return
    folder = case.folder.absolute()
    program = ExternalProgram(section.command, folder, section.parallel, section.time_limit)
    with running(program):
        yield program


def simulated_by(
    program: ExternalProgram, case: Case, setups: Sequence[ExperimentSetup]
) -> tuple[ExperimentSetup, ...]:
    """Return the tests of a case as a program simulates them.

    Raises CaseError for a test whose inputs are more than steps and ramps.
    """
    return tuple(
        replace(
            setup,
            experiment=replace(
                setup.experiment,
                simulator=external_simulator(
                    program, case, setup.experiment.simulator, setup.experiment.signals
                ),
            ),
        )
        for setup in setups
    )


def external_simulator(
    program: ExternalProgram, case: Case, twin: Simulator, signals: tuple[str, ...] = ("vt",)
) -> ExternalSimulator:
    """Return the simulator of a test whose signals a program gives; CaseError as `simulated_by`."""
    if twin.inputs.recorded:
        driving = ", ".join(twin.inputs.recorded)
        text = f"{driving}: steps and ramps only are allowed with plant external"
        raise CaseError([f"{case.path}: test: {text}"])
    names = {} if case.external is None else case.external.names
    return ExternalSimulator(twin, program, signals, names)


def refuse_external(case: Case, command: str) -> None:
    """Raise CaseError where another program simulates a case, for a command that has no use of it.

    It would show the twin in place of the program.
    """
    if case.external is not None:
        raise CaseError([f"{case.path}: plant.type: external: not allowed with {command}"])


def settled(setups: Sequence[ExperimentSetup], values: Values) -> tuple[ExperimentSetup, ...]:
    """Return tests whose twin is corrected by its difference to the program at the values.

    What follows a search simulates no more in the program. Raises SimulationError where the program
    has no run there.
    """
    return tuple(
        replace(setup, experiment=replace(setup.experiment, simulator=_corrected(setup, values)))
        for setup in setups
    )


def with_setups(problem: FitProblem, setups: Sequence[ExperimentSetup]) -> FitProblem:
    """Return a problem whose tests are these setups."""
    experiments = [setup.experiment for setup in setups]
    residuals = replace(problem.residuals, experiments=experiments)
    return FitProblem(residuals, residuals)


def _corrected(setup: ExperimentSetup, values: Values) -> CorrectedSimulator:
    at = setup.with_start_values(values)
    simulator, signals = setup.experiment.with_inputs(at), setup.experiment.signals
    parameters = setup.experiment.parameters(at)
    own = cast(ExternalSimulator, setup.experiment.simulator)
    try:
        outside, _ = simulator.samples(parameters, signals)
    except SimulationError as fault:
        raise SimulationError(f"{setup.case}: record {setup.name}: {fault}") from fault
    twin, _ = cast(ExternalSimulator, simulator).twin.samples(parameters, signals)
    return CorrectedSimulator(own, dict(zip(signals, (outside - twin).T, strict=True)))


class TwinDoubtedError(Exception):
    """Steps by the derivatives of the twin failed, though they promised a visible gain."""


class LinearisedAt(NamedTuple):
    """A point (N,) with the residuals (M,) and the Jacobian (M, N) that a search uses there."""

    theta: Array
    residuals: Array
    jacobian: Array

    def promise(self, theta: Array) -> float:
        """Return by how much of the cost a step to another point lowers the linear model's."""
        cost = half_square(self.residuals)
        step = self.residuals + self.jacobian @ (theta - self.theta)
        return (cost - half_square(step)) / cost if cost > 0.0 else 0.0


class ProgramFunctions:
    """Residuals of the program, with the derivatives of its twin and their correction.

    Raises TwinDoubtedError after FAILED_STEPS finite trials in a row that promised a gain and had
    none, once at each best point. ``quotients`` counts the corrections.
    """

    def __init__(self, residuals: Residuals) -> None:
        self.residuals_of = residuals
        self.quotients = 0
        self.best = residuals.start
        self._correction: Array | None = None
        self._linear: LinearisedAt | None = None
        self._lowest, self._corrected_cost, self._failed = inf, inf, 0

    @property
    def is_corrected(self) -> bool:
        """Whether the correction was taken at the best point, or at one that is hardly worse."""
        return self._lowest > (1.0 - VISIBLE_GAIN) * self._corrected_cost

    def residuals(self, theta: Array) -> Array:
        """Return the residuals (M,) at a point (N,), infinite where the run failed."""
        residuals = self.residuals_of(theta)
        cost = half_square(residuals)
        if cost < self._lowest:
            self.best, self._lowest, self._failed = theta.copy(), cost, 0
        elif np.isfinite(cost) and self._linear and self._linear.promise(theta) > VISIBLE_GAIN:
            self._failed += 1
            if self._failed >= FAILED_STEPS and not self.is_corrected:
                raise TwinDoubtedError
        return residuals

    def jacobian(self, theta: Array) -> Array:
        """Return the Jacobian (M, N) of the twin, corrected."""
        exact = self.residuals_of.exact(theta)
        jacobian = exact if self._correction is None else exact + self._correction
        self._linear = LinearisedAt(theta.copy(), self.residuals_of(theta), jacobian)
        return jacobian

    def correct(self) -> None:
        """Take the correction from quotients at the best point; a run that failed gives none."""
        best, (low, high) = self.best, self.residuals_of.bounds
        steps = np.where(best + QUOTIENT_STEP <= high, QUOTIENT_STEP, -QUOTIENT_STEP)
        points = [best + step * unit for step, unit in zip(steps, np.eye(len(best)), strict=True)]
        here, *others = self.residuals_of.of_many([best, *(np.maximum(p, low) for p in points)])
        exact = self.residuals_of.exact(best)
        self._correction = np.zeros_like(exact)
        for k, (step, residuals) in enumerate(zip(steps, others, strict=True)):
            if np.isfinite(residuals).all():
                self._correction[:, k] = (residuals - here) / step - exact[:, k]
        self._corrected_cost, self._failed = self._lowest, 0
        self.quotients += 1

    def is_distinct(self) -> bool:
        """Return whether program and twin differ visibly at the best point.

        Only then the derivatives of the twin can lead to another end than those of the program.
        """
        count = self.residuals_of.count
        own = self.residuals_of(self.best)[:count]
        twin = twin_of(self.residuals_of)(self.best)[:count]
        moves = np.concatenate(
            [channel.weight * (channel.record - channel.record[0]) for channel in self._channels]
        )
        difference = _rms(own - twin)
        return difference > max(DISTINCT * _rms(own), NEGLIGIBLE_DIFFERENCE * _rms(moves))

    @property
    def _channels(self) -> Sequence[Channel]:
        return self.residuals_of.channels


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def twin_of(residuals: Residuals) -> Residuals:
    """Return the residuals of the twin alone."""
    experiments = [
        replace(experiment, simulator=cast(TwinSimulator, experiment.simulator).twin)
        for experiment in residuals.experiments
    ]
    return replace(residuals, experiments=experiments, counter=None)


def descent_by_twin(
    residuals: Residuals,
    descent: Callable[[estimate.Functions], estimate.Descent],
    announce: Announce,
) -> estimate.Result:
    """Return the end of a descent from the start by the derivatives of the twin, corrected."""
    functions, start = ProgramFunctions(residuals), residuals.start
    lines: list[estimate.SolverIteration] = []

    def join(line: estimate.SolverIteration) -> None:
        lines.append(following(last, line) if last else line)
        announce(lines[-1])

    while True:
        last = lines[-1] if lines else None
        search = descent(estimate.OneByOne(functions.residuals, functions.jacobian))
        try:
            end = search.run(start, join)
        except TwinDoubtedError:
            functions.correct()
            start = functions.best
            continue
        interrupted = end.stop is estimate.Stop.INTERRUPTED
        if interrupted or functions.is_corrected or functions.quotients >= MOST_CORRECTIONS:
            break
        if not functions.is_distinct():
            break
        functions.correct()
        start = functions.best
    if last is None:
        return end
    nfev, njev = last.nfev + end.nfev, last.njev + end.njev
    return replace(end, history=tuple(lines), nfev=nfev, njev=njev)


def is_external(residuals: Residuals) -> bool:
    """Return whether another program simulates the records."""
    return any(isinstance(each.simulator, ExternalSimulator) for each in residuals.experiments)


def start_tried(case: Case, residuals: Residuals, program: ExternalProgram) -> None:
    """Run the start of a search, a second time where it failed.

    Raises SimulationError with the reason where it failed again.
    """
    if np.isfinite(residuals(residuals.start)).all():
        return
    program.forget_failures()
    values = residuals.values(residuals.start)
    for experiment in residuals.experiments:
        try:
            experiment.samples(values)
        except SimulationError as fault:
            raise SimulationError(f"{case.path}: {fault} (at the start values, twice)") from fault


def as_by_program(
    program: ExternalProgram | None, case: Case, setup: ExperimentSetup, values: Values
) -> ExperimentSetup:
    """Return a test as a program simulates it at the values; as it is without a program."""
    if program is None:
        return setup
    (by_program,) = settled(simulated_by(program, case, [setup]), values)
    return by_program


def differences_from_twin(
    case: Case, setups: Sequence[ExperimentSetup], values: Values
) -> dict[str, dict[str, float]]:
    """Return by how much, at most and per unit, program and twin differ: by record, by signal.

    Nothing where no other program simulates the case. Raises ExfitError where it has no run.
    """
    with program_of(case) as program:
        if program is None:
            return {}
        return _differences(settled(simulated_by(program, case, setups), values))


def _differences(setups: Sequence[ExperimentSetup]) -> dict[str, dict[str, float]]:
    return {
        setup.name: {
            signal: float(np.max(np.abs(difference)))
            for signal, difference in setup.experiment.simulator.differences.items()
        }
        for setup in setups
        if isinstance(setup.experiment.simulator, CorrectedSimulator)
    }


def program_notes(
    case: Case, program: ExternalProgram, setups: Sequence[ExperimentSetup]
) -> Iterator[str]:
    """Yield what a program was asked for, and by how much its twin differs at the result."""
    section = case.external
    if section is None:
        return
    counts = program.counts
    failed = f", of which {counts.failed} failed" if counts.failed else ""
    restarts = f"; it was started anew {counts.restarts} times" if counts.restarts else ""
    yield f"simulated by {' '.join(section.command)}: {counts.runs} runs{failed}{restarts}"
    yield (
        f"derivatives by the twin {section.twin}; search and intervals are local; intervals and "
        "diagnoses are by the twin, corrected by its difference to the program at the result"
    )
    for name, differences in _differences(setups).items():
        listed = ", ".join(f"{signal} {largest:.2g} pu" for signal, largest in differences.items())
        yield f"{name}: largest difference of program and twin: {listed}"
