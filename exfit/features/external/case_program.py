"""A functional mock-up unit (FMU) that simulates a case: its program, its variables."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.parts import OF_RECORD
from exfit.case.schema import ExternalPlant, FmuPlant
from exfit.errors import CaseError, SimulationError
from exfit.estimate import Descent, Functions, Result
from exfit.features.external.fmu import (
    FmuDescription,
    FmuError,
    Interface,
    Use,
    fmu_description,
    laid_out,
    worker_command,
)
from exfit.features.external.program import ExternalProgram, running
from exfit.features.external.responders import (
    QUOTIENT_STEP,
    CorrectedResponder,
    LinearResponder,
    ProgramSignals,
    QuotientResponder,
    RunResponder,
)
from exfit.features.external.twin_descent import descent_by_twin
from exfit.fitting.descents import Announce
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.problem import free_parameters
from exfit.fitting.program import Differences, Setups
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import jacobian_error
from exfit.simulation.simulator import Simulator
from exfit.util.files import on_disk
from exfit.util.text import near

Test = tuple[Simulator, tuple[str, ...]]  # with the signals that are compared


class FmuProgram(ExternalProgram):
    """The program that runs an FMU, with the description that was read when it was laid out."""

    def __init__(
        self, section: FmuPlant, settings: str, folder: Path, description: FmuDescription
    ) -> None:
        limits = (section.parallel, section.time_limit)
        super().__init__(worker_command(settings), folder, *limits, "plant.file")
        self.description = description


@contextmanager
def fmu_program(case: Case, section: FmuPlant) -> Iterator[ExternalProgram]:
    """Provide the program that runs the FMU of a case; end it afterwards.

    Raises CaseError for a file that cannot be run.
    """
    file = on_disk(case.folder / section.file)
    try:
        description = fmu_description(file)
        interface = _interface(case, section, description)
        with laid_out(file) as folder:
            settings = {
                "folder": str(folder),
                "interface": interface,
                "inputs": dict(section.inputs),
                "outputs": dict(section.outputs),
            }
            program = FmuProgram(section, json.dumps(settings), folder, description)
            with running(program):
                yield program
    except FmuError as fault:
        text = f"{case.path}: plant.file: {section.simulator} {fault}"
        raise CaseError([text]) from None


def refuse_unknown_variables(case: Case, program: ExternalProgram, tests: Sequence[Test]) -> None:
    """Raise CaseError with all that an FMU cannot be given, or asked for, in the tests of a case.

    Nothing where no FMU simulates it.
    """
    section = case.external
    if isinstance(section, FmuPlant) and isinstance(program, FmuProgram):
        faults = [*_variable_faults(case, section, program.description, tests)]
        if faults:
            raise CaseError([f"{case.path}: {fault}" for fault in dict.fromkeys(faults)])


def own_value_notes(case: Case, program: ExternalProgram) -> Iterator[str]:
    """Name the parameters of a case that an FMU does not take, and has its own values of."""
    section = case.external
    if not isinstance(section, FmuPlant) or not isinstance(program, FmuProgram):
        return
    taken = program.description.usable_as("parameter")
    symbols = [part.prefix + symbol for part in case.parts.all for symbol in part.symbols]
    missing = [
        name for name in (*symbols, OF_RECORD[0]) if section.names.get(name, name) not in taken
    ]
    if missing:
        yield f"{section.simulator} has values of its own in place of {', '.join(missing)}"


def _variable_faults(
    case: Case, section: FmuPlant, description: FmuDescription, tests: Sequence[Test]
) -> Iterator[str]:
    """Yield the variables that the FMU does not have, or that cannot be used so."""
    variables = description.variables
    changed = {step.signal: "" for twin, _ in tests for step in twin.inputs.steps}
    compared = {signal: "" for _, signals in tests for signal in signals}
    # without a twin it is the case that says which parameters there are
    needed = dict.fromkeys(case.values() if case.has_no_equations else case.free(), "")
    uses: tuple[tuple[str, Mapping[str, str], Use, str], ...] = (
        ("names", {**needed, **section.names}, "parameter", "a parameter that can be set"),
        ("inputs", {**changed, **section.inputs}, "input", "an input"),
        ("outputs", {**compared, **section.outputs}, "output", "an output"),
    )
    for key, names, use, what in uses:
        possible = description.usable_as(use)
        for name, given in names.items():
            variable = given or name
            if variable in possible:
                continue
            text = f"{section.simulator} has no variable {variable}; {near(variable, possible)}"
            if variable in variables:
                text = f"{variable} is not {what} but {variables[variable].kind}"
            yield f"plant.{key}.{name}: {text}"


def _interface(case: Case, section: FmuPlant, description: FmuDescription) -> Interface:
    """Choose the interface by which an FMU is run; raises CaseError where it has not that one."""
    interface = section.interface or description.interfaces[0]
    if interface not in description.interfaces:
        text = f"{section.simulator} has {' and '.join(description.interfaces)} only"
        raise CaseError([f"{case.path}: plant.interface: {interface}: {text}"])
    return interface


Array = NDArray[np.float64]
Values = Mapping[str, float]

TOLERANCE = 1e-5  # of the cost: no gain that is less is worth a run
STEP = 1e-4  # of scaled parameters: no step that is less
BY_QUOTIENTS = "no twin: derivatives are quotients of its runs; the search is local"


@contextmanager
def opened(case: Case) -> Iterator["CaseProgram | None"]:
    """Provide the program that simulates a case; end it afterwards.

    Raises CaseError for an FMU that cannot be run.
    """
    section = case.external
    if isinstance(section, FmuPlant):
        with fmu_program(case, section) as program:
            yield CaseProgram(case, section, program)
    elif section is not None:
        folder = case.folder.absolute()
        program = ExternalProgram(section.command, folder, section.parallel, section.time_limit)
        with running(program):
            yield CaseProgram(case, section, program)


@dataclass(frozen=True, eq=False)
class CaseProgram:
    """What simulates a case in place of exfit, as `exfit.fitting.program.Program` asks it."""

    case: Case
    section: ExternalPlant | FmuPlant
    program: ExternalProgram

    @property
    def runs(self) -> int:
        """How many runs it was asked for."""
        return self.program.counts.runs

    @property
    def failed(self) -> int:
        """How many of them failed."""
        return self.program.counts.failed

    @property
    def has_twin(self) -> bool:
        """Whether there is a plant of exfit beside it."""
        return not self.case.has_no_equations

    def simulator(self, twin: Simulator) -> Simulator:
        """Make the simulator of a test whose signals it gives; raises CaseError as `simulated`."""
        (simulator,) = self._simulators([(twin, ("vt",))])
        return simulator

    def simulated(self, setups: Setups) -> tuple[ExperimentSetup, ...]:
        """Make tests that it simulates.

        Raises CaseError for a test whose inputs are more than steps and ramps, and with all
        variables that an FMU has not.
        """
        tests = [(setup.experiment.simulator, setup.experiment.signals) for setup in setups]
        return tuple(map(_with_simulator, setups, self._simulators(tests)))

    def _simulators(self, tests: Sequence[tuple[Simulator, tuple[str, ...]]]) -> list[Simulator]:
        recorded = dict.fromkeys(signal for twin, _ in tests for signal in twin.inputs.recorded)
        if recorded:
            text = f"steps and ramps only are allowed with plant {self.section.type}"
            raise CaseError([f"{self.case.path}: test: {', '.join(recorded)}: {text}"])
        refuse_unknown_variables(self.case, self.program, tests)
        return [twin.with_responder(self._responder(signals)) for twin, signals in tests]

    def _responder(self, signals: tuple[str, ...]) -> RunResponder:
        given = ProgramSignals(self.program, signals, self.section.names)
        if self.has_twin:
            return RunResponder(given)
        limits = {each.name: (each.low, each.high) for each in free_parameters(self.case)}
        return QuotientResponder(given, limits)

    def try_start(self, residuals: Residuals) -> None:
        """Run the start of a search; raises SimulationError where there is no run."""
        if np.isfinite(residuals(residuals.start)).all():
            return
        values = residuals.values(residuals.start)
        for experiment in residuals.experiments:
            try:
                experiment.samples(values)
            except SimulationError as fault:
                text = f"{self.case.path}: {fault} (at the start values, twice)"
                raise SimulationError(text) from fault

    def coarser(self, descent: Descent) -> Descent:
        """Give a descent the tolerances that its runs allow."""
        error = descent.jacobian_error
        if error is None and not self.has_twin:
            error = jacobian_error("forward", QUOTIENT_STEP)
        xtol = max(descent.xtol, STEP)
        return replace(descent, ftol=TOLERANCE, xtol=xtol, jacobian_error=error)

    def descend(
        self,
        residuals: Residuals,
        descent: Callable[[Functions], Descent],
        announce: Announce,
    ) -> Result:
        """Descend from the start by the derivatives of the twin, corrected."""
        return descent_by_twin(residuals, descent, announce)

    def settled(
        self, setups: Setups, values: Values, moving: Residuals | None = None
    ) -> tuple[ExperimentSetup, ...]:
        """Correct the twin of its tests by the difference at the values: no more run follows.

        Without a twin the response is linear in what is free in the residuals ``moving``; where
        none are given, the tests stay as they are. Raises SimulationError where there is no run at
        the values.
        """
        return tuple(_settled(setup, values, moving) for setup in setups)

    def run(self, setup: ExperimentSetup, values: Values) -> None:
        """Run a settled test at other values too; raises SimulationError where there is no run."""
        at = setup.with_start_values(values)
        simulator = setup.experiment.with_inputs(at)
        given = _given(simulator)
        if given is not None:
            run = given.run(simulator, setup.experiment.parameters(at))
            if run.failure:
                raise SimulationError(f"{setup.case}: record {setup.name}: {run.failure}")

    def deviations(self, setups: Setups, values: Values) -> Differences:
        """Run tests at values: the largest difference from the twin, without one from the record.

        Raises ExfitError where there is no run.
        """
        tests = self.settled(self.simulated(setups), values)
        if self.has_twin:
            return self.differences(tests)
        return {test.name: _differences_from_record(test, values) for test in tests}

    def differences(self, setups: Setups) -> Differences:
        """Find the largest difference from the twin where tests were settled."""
        return {
            setup.name: {
                signal: float(np.max(np.abs(difference)))
                for signal, difference in responder.differences.items()
            }
            for setup in setups
            if isinstance(responder := setup.experiment.simulator.responder, CorrectedResponder)
        }

    def own_value_notes(self) -> Iterator[str]:
        """Name the parameters of the case that an FMU does not take, and has its own values of."""
        return own_value_notes(self.case, self.program)

    def response_notes(self, simulator: Simulator, shown: Iterable[str]) -> Iterator[str]:
        """Name the shown signals that the twin gives, without a correction."""
        given = _given(simulator)
        if self.has_twin and given is not None and {*shown} - {*given.signals}:
            yield (
                f"{self.section.simulator} gives {', '.join(given.signals)}; all other signals are "
                f"by the twin {self.section.twin}, not corrected"
            )

    def notes(self, setups: Setups, followed: str = "intervals and diagnoses") -> Iterator[str]:
        """Report the runs it was asked for, and the difference of its twin at the result.

        ``followed`` is what followed the search, by the twin.
        """
        counts = self.program.counts
        failed = f", of which {counts.failed} failed" if counts.failed else ""
        restarts = f"; it was started anew {counts.restarts} times" if counts.restarts else ""
        yield f"simulated by {self.section.simulator}: {counts.runs} runs{failed}{restarts}"
        yield from self.own_value_notes()
        if not self.has_twin:
            yield BY_QUOTIENTS
            return
        yield (
            f"derivatives by the twin {self.section.twin}; the search is local; {followed} are by "
            "the twin, corrected by its difference to the program at the result"
        )
        for name, differences in self.differences(setups).items():
            listed = ", ".join(f"{signal} {most:.2g} pu" for signal, most in differences.items())
            yield f"{name}: largest difference of program and twin: {listed}"


def _with_simulator(setup: ExperimentSetup, simulator: Simulator) -> ExperimentSetup:
    return replace(setup, experiment=replace(setup.experiment, simulator=simulator))


def _given(simulator: Simulator) -> ProgramSignals | None:
    responder = simulator.responder
    kinds = RunResponder | LinearResponder | CorrectedResponder
    return responder.given if isinstance(responder, kinds) else None


def _settled(setup: ExperimentSetup, values: Values, moving: Residuals | None) -> ExperimentSetup:
    at = setup.with_start_values(values)
    simulator, signals = setup.experiment.with_inputs(at), setup.experiment.signals
    parameters = setup.experiment.parameters(at)
    try:
        outside, _ = simulator.samples(parameters, signals)
    except SimulationError as fault:
        raise SimulationError(f"{setup.case}: record {setup.name}: {fault}") from fault
    responder = simulator.responder
    if isinstance(responder, QuotientResponder):
        if moving is None:
            return setup
        free = moving.free
        theta = np.array([each.scaled(at.get(each.name, each.start)) for each in free])
        directions = [setup.experiment.direction(move) for move in moving.moves(theta)]
        linear = LinearResponder(responder, simulator, parameters, directions)
        return _with_simulator(setup, simulator.with_responder(linear))
    assert isinstance(responder, RunResponder)
    twin, _ = simulator.with_responder(None).samples(parameters, signals)
    differences = dict(zip(signals, (outside - twin).T, strict=True))
    corrected = CorrectedResponder(responder.given, differences)
    return _with_simulator(setup, setup.experiment.simulator.with_responder(corrected))


def _differences_from_record(setup: ExperimentSetup, values: Values) -> dict[str, float]:
    at = setup.with_start_values(values)
    simulated, _ = setup.experiment.samples(at)
    return {
        channel.signal: float(np.nanmax(np.abs(samples - setup.experiment.measured(channel, at))))
        for channel, samples in zip(setup.experiment.channels, simulated.T, strict=True)
    }
