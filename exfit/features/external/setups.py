"""A unit that another program simulates: its tests, what is reported of its runs."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import cast

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import FmuPlant
from exfit.errors import CaseError, SimulationError
from exfit.features.external.fmu_setups import (
    fmu_program,
    own_value_notes,
    refuse_unknown_variables,
)
from exfit.features.external.program import ExternalProgram, running
from exfit.features.external.simulator import (
    CorrectedSimulator,
    ExternalSimulator,
    LinearSimulator,
    ProgramSimulator,
    QuotientSimulator,
)
from exfit.fitting.problem import FitProblem, free_parameters
from exfit.fitting.residuals import Residuals
from exfit.fitting.setup import ExperimentSetup
from exfit.simulation.inputs import Direction
from exfit.simulation.simulator import Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

BY_QUOTIENTS = "no twin: derivatives are quotients of its runs; the search is local"
LINEAR_ALONE = "no twin: intervals are those of linear theory, by quotients at the result"


@contextmanager
def program_of(case: Case) -> Iterator[ExternalProgram | None]:
    """Provide the program that simulates a case, None where exfit does; end it afterwards.

    Raises CaseError for an FMU that cannot be run.
    """
    section = case.external
    if section is None:
        yield None
        return
    if isinstance(section, FmuPlant):
        with fmu_program(case, section) as program:
            yield program
        return
    folder = case.folder.absolute()
    program = ExternalProgram(section.command, folder, section.parallel, section.time_limit)
    with running(program):
        yield program


def simulated_by(
    program: ExternalProgram, case: Case, setups: Sequence[ExperimentSetup]
) -> tuple[ExperimentSetup, ...]:
    """Return the tests of a case as a program simulates them.

    Raises CaseError for a test whose inputs are more than steps and ramps, and with all variables
    that an FMU has not.
    """
    tests = [(setup.experiment.simulator, setup.experiment.signals) for setup in setups]
    _refuse_recorded_inputs(case, [twin for twin, _ in tests])
    refuse_unknown_variables(case, program, tests)
    return tuple(
        replace(
            setup, experiment=replace(setup.experiment, simulator=_simulator(program, case, *test))
        )
        for setup, test in zip(setups, tests, strict=True)
    )


def external_simulator(
    program: ExternalProgram, case: Case, twin: Simulator, signals: tuple[str, ...] = ("vt",)
) -> ExternalSimulator:
    """Return the simulator of a test whose signals a program gives; CaseError as `simulated_by`."""
    _refuse_recorded_inputs(case, [twin])
    refuse_unknown_variables(case, program, [(twin, signals)])
    return _simulator(program, case, twin, signals)


def _simulator(
    program: ExternalProgram, case: Case, twin: Simulator, signals: tuple[str, ...]
) -> ExternalSimulator:
    names = {} if case.external is None else case.external.names
    if not case.has_no_equations:
        return ExternalSimulator(twin, program, signals, names)
    limits = {
        parameter.name: (parameter.low, parameter.high) for parameter in free_parameters(case)
    }
    return QuotientSimulator(twin, program, signals, names, limits)


def refuse_without_equations(case: Case, command: str) -> None:
    """Raise CaseError where a program without a twin simulates a case, for what simulates much."""
    if case.has_no_equations:
        text = f"missing; {command} needs the equations of a plant of exfit"
        raise CaseError([f"{case.path}: plant.twin: {text}"])


def _refuse_recorded_inputs(case: Case, twins: Iterable[Simulator]) -> None:
    recorded = dict.fromkeys(signal for twin in twins for signal in twin.inputs.recorded)
    if recorded and case.external is not None:
        text = f"steps and ramps only are allowed with plant {case.external.type}"
        raise CaseError([f"{case.path}: test: {', '.join(recorded)}: {text}"])


def settled(
    setups: Sequence[ExperimentSetup], values: Values, moving: Residuals | None = None
) -> tuple[ExperimentSetup, ...]:
    """Return tests whose twin is corrected by its difference to the program at the values.

    What follows a search simulates no more in the program. Without a twin the response is linear in
    what is free in the residuals ``moving``; where none are given, the tests stay as they are.
    Raises SimulationError where the program has no run there.
    """
    return tuple(
        replace(setup, experiment=replace(setup.experiment, simulator=simulator))
        for setup in setups
        for simulator in [_settled(setup, values, moving)]
    )


def with_setups(problem: FitProblem, setups: Sequence[ExperimentSetup]) -> FitProblem:
    """Return a problem whose tests are these setups."""
    experiments = [setup.experiment for setup in setups]
    residuals = replace(problem.residuals, experiments=experiments)
    return FitProblem(residuals, residuals)


def _settled(setup: ExperimentSetup, values: Values, moving: Residuals | None) -> ProgramSimulator:
    at = setup.with_start_values(values)
    simulator, signals = setup.experiment.with_inputs(at), setup.experiment.signals
    parameters = setup.experiment.parameters(at)
    own = cast(ExternalSimulator, setup.experiment.simulator)
    try:
        outside, _ = simulator.samples(parameters, signals)
    except SimulationError as fault:
        raise SimulationError(f"{setup.case}: record {setup.name}: {fault}") from fault
    if isinstance(simulator, QuotientSimulator):
        if moving is None:
            return own
        return LinearSimulator(simulator, parameters, _directions(moving, setup, at))
    twin, _ = cast(ExternalSimulator, simulator).twin.samples(parameters, signals)
    return CorrectedSimulator(own, dict(zip(signals, (outside - twin).T, strict=True)))


def _directions(residuals: Residuals, setup: ExperimentSetup, values: Values) -> list[Direction]:
    """Return how each free parameter moves the simulation of a test at values."""
    theta = np.array([each.scaled(values.get(each.name, each.start)) for each in residuals.free])
    return [setup.experiment.direction(move) for move in residuals.moves(theta)]


def is_external(residuals: Residuals) -> bool:
    """Return whether another program simulates the records."""
    return any(isinstance(each.simulator, ExternalSimulator) for each in residuals.experiments)


def has_twin(residuals: Residuals) -> bool:
    """Return whether the derivatives of a program's responses are those of a plant of exfit."""
    simulators = [each.simulator for each in residuals.experiments]
    return is_external(residuals) and not any(
        isinstance(simulator, QuotientSimulator) for simulator in simulators
    )


def start_tried(case: Case, residuals: Residuals) -> None:
    """Run the start of a search; raises SimulationError with the reason where it has no run."""
    if np.isfinite(residuals(residuals.start)).all():
        return
    values = residuals.values(residuals.start)
    for experiment in residuals.experiments:
        try:
            experiment.samples(values)
        except SimulationError as fault:
            raise SimulationError(f"{case.path}: {fault} (at the start values, twice)") from fault


def run_by_program(setup: ExperimentSetup, values: Values) -> None:
    """Have a program run a settled test at other values too, so that it responds with that run.

    Nothing where exfit simulates it. Raises SimulationError where the program has no run there.
    """
    at = setup.with_start_values(values)
    simulator = setup.experiment.with_inputs(at)
    if not isinstance(simulator, ProgramSimulator):
        return
    (run,) = simulator.program.runs([simulator.request(setup.experiment.parameters(at))])
    if run.failure:
        raise SimulationError(f"{setup.case}: record {setup.name}: {run.failure}")


def simulation_by_twin_notes(
    case: Case, simulator: Simulator, shown: Iterable[str]
) -> Iterator[str]:
    """Yield which of the shown signals the twin of a program gives, without a correction."""
    section = case.external
    if section is None or section.twin is None or not isinstance(simulator, ProgramSimulator):
        return
    if {*shown} - {*simulator.signals}:
        yield (
            f"{section.simulator} gives {', '.join(simulator.signals)}; all other signals are by "
            f"the twin {section.twin}, not corrected"
        )


def as_by_program(
    program: ExternalProgram | None, case: Case, setup: ExperimentSetup, values: Values
) -> ExperimentSetup:
    """Return a test as a program simulates it at the values; as it is without a program."""
    if program is None:
        return setup
    (by_program,) = settled(simulated_by(program, case, [setup]), values)
    return by_program


def differences_of_program(
    case: Case, setups: Sequence[ExperimentSetup], values: Values
) -> dict[str, dict[str, float]]:
    """Return by how much, at most and per unit, a program differs: by record, by signal.

    From its twin or, where it has none, from the record. Nothing where no other program simulates
    the case. Raises ExfitError where it has no run.
    """
    with program_of(case) as program:
        if program is None:
            return {}
        tests = settled(simulated_by(program, case, setups), values)
        if case.has_no_equations:
            return {setup.name: _differences_from_record(setup, values) for setup in tests}
        return differences_from_twin(tests)


def _differences_from_record(setup: ExperimentSetup, values: Values) -> dict[str, float]:
    at = setup.with_start_values(values)
    simulated, _ = setup.experiment.samples(at)
    return {
        channel.signal: float(np.nanmax(np.abs(samples - setup.experiment.measured(channel, at))))
        for channel, samples in zip(setup.experiment.channels, simulated.T, strict=True)
    }


def differences_from_twin(
    setups: Sequence[ExperimentSetup],
) -> dict[str, dict[str, float]]:
    """Return by how much a program differs from its twin where tests were settled."""
    return {
        setup.name: {
            signal: float(np.max(np.abs(difference)))
            for signal, difference in setup.experiment.simulator.differences.items()
        }
        for setup in setups
        if isinstance(setup.experiment.simulator, CorrectedSimulator)
    }


def program_notes(
    case: Case,
    program: ExternalProgram,
    setups: Sequence[ExperimentSetup],
    followed: str = "intervals and diagnoses",
) -> Iterator[str]:
    """Yield what a program was asked for, and by how much its twin differs at the result.

    ``followed`` is what followed the search, by the twin.
    """
    section = case.external
    if section is None:
        return
    counts = program.counts
    failed = f", of which {counts.failed} failed" if counts.failed else ""
    restarts = f"; it was started anew {counts.restarts} times" if counts.restarts else ""
    yield f"simulated by {section.simulator}: {counts.runs} runs{failed}{restarts}"
    yield from own_value_notes(case, program)
    if section.twin is None:
        yield BY_QUOTIENTS
        return
    yield (
        f"derivatives by the twin {section.twin}; the search is local; {followed} are by the twin, "
        "corrected by its difference to the program at the result"
    )
    for name, differences in differences_from_twin(setups).items():
        listed = ", ".join(f"{signal} {largest:.2g} pu" for signal, largest in differences.items())
        yield f"{name}: largest difference of program and twin: {listed}"
