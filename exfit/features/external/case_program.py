"""The program of a case: its tests as that program simulates them, what is reported of its runs."""

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.parts import OF_RECORD
from exfit.case.schema import ExternalPlant, FmuPlant
from exfit.errors import CaseError, SimulationError
from exfit.estimate import Descent
from exfit.features.external.fmu import (
    FmuDescription,
    FmuError,
    Use,
    fmu_description,
    laid_out,
    worker_command,
)
from exfit.features.external.program import ExternalProgram
from exfit.features.external.responders import (
    QUOTIENT_STEP,
    CorrectedResponder,
    LinearResponder,
    ProgramResponder,
    ProgramSignals,
    QuotientResponder,
    RunResponder,
)
from exfit.features.external.twin_descent import descent_by_twin
from exfit.fitting.experiment import ExperimentSetup
from exfit.fitting.problem import free_parameters
from exfit.fitting.program import Differences, Setups
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import jacobian_error
from exfit.simulation.simulator import Simulator
from exfit.util.files import on_disk
from exfit.util.text import near

Array = NDArray[np.float64]
Values = Mapping[str, float]
Test = tuple[Simulator, tuple[str, ...]]  # with the signals that are compared

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
        try:
            with _opened_fmu(case, section) as of_fmu:
                yield of_fmu
        except FmuError as fault:
            text = f"{case.path}: plant.file: {section.simulator} {fault}"
            raise CaseError([text]) from None
    elif section is not None:
        folder = case.folder.absolute()
        program = ExternalProgram(section.command, folder, section.parallel, section.time_limit)
        with closing(program):
            yield CaseProgram(case, section, program)


@contextmanager
def _opened_fmu(case: Case, section: FmuPlant) -> Iterator["CaseProgram"]:
    """Lay out the FMU of a case and provide the program that runs it."""
    file = on_disk(case.folder / section.file)
    description = fmu_description(file)
    interface = section.interface or description.interfaces[0]
    if interface not in description.interfaces:
        text = f"{section.simulator} has {' and '.join(description.interfaces)} only"
        raise CaseError([f"{case.path}: plant.interface: {interface}: {text}"])
    with laid_out(file) as folder:
        settings = {
            "folder": str(folder),
            "interface": interface,
            "inputs": dict(section.inputs),
            "outputs": dict(section.outputs),
        }
        limits = section.parallel, section.time_limit
        command = worker_command(json.dumps(settings))
        with closing(ExternalProgram(command, folder, *limits, "plant.file")) as program:
            yield CaseProgram(case, section, program, description)


@dataclass(frozen=True, eq=False)
class CaseProgram:
    """What simulates a case in place of exfit, as `exfit.fitting.program.Program` asks it.

    ``description`` is what an FMU says of itself.
    """

    case: Case
    section: ExternalPlant | FmuPlant
    program: ExternalProgram
    description: FmuDescription | None = None

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

    def _simulators(self, tests: Sequence[Test]) -> list[Simulator]:
        recorded = dict.fromkeys(signal for twin, _ in tests for signal in twin.inputs.recorded)
        if recorded:
            text = f"steps and ramps only are allowed with plant {self.section.type}"
            raise CaseError([f"{self.case.path}: test: {', '.join(recorded)}: {text}"])
        faults = dict.fromkeys(self._variable_faults(tests))
        if faults:
            raise CaseError([f"{self.case.path}: {fault}" for fault in faults])
        simulators = []
        for twin, signals in tests:
            given = ProgramSignals(self.program, signals, self.section.names)
            responder = RunResponder(given)
            if not self.has_twin:
                free = free_parameters(self.case)
                limits = {each.name: (each.low, each.high) for each in free}
                responder = QuotientResponder(given, limits)
            simulators.append(twin.with_responder(responder))
        return simulators

    def _variable_faults(self, tests: Sequence[Test]) -> Iterator[str]:
        """Yield the variables that an FMU does not have, or that cannot be used so."""
        section, description = self.section, self.description
        if not isinstance(section, FmuPlant) or description is None:
            return
        changed = {step.signal: "" for twin, _ in tests for step in twin.inputs.steps}
        compared = {signal: "" for _, signals in tests for signal in signals}
        # without a twin it is the case that says which parameters there are
        needed = dict.fromkeys(self.case.free() if self.has_twin else self.case.values(), "")
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
                if variable in description.variables:
                    text = f"{variable} is not {what} but {description.variables[variable].kind}"
                yield f"plant.{key}.{name}: {text}"

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

    descend = staticmethod(descent_by_twin)

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
        if isinstance(simulator.responder, ProgramResponder):
            parameters = setup.experiment.parameters(at)
            run = simulator.responder.given.run(simulator, parameters)
            if run.failure:
                raise SimulationError(f"{setup.case}: record {setup.name}: {run.failure}")

    def deviations(self, setups: Setups, values: Values) -> Differences:
        """Run tests at values: the largest difference from the twin, without one from the record.

        Raises ExfitError where there is no run.
        """
        tests = self.settled(self.simulated(setups), values)
        if self.has_twin:
            return self.differences(tests)
        differences: Differences = {}
        for test in tests:
            at, own = test.with_start_values(values), test.experiment
            simulated, _ = own.samples(at)
            differences[test.name] = {
                channel.signal: float(np.nanmax(np.abs(samples - own.measured(channel, at))))
                for channel, samples in zip(own.channels, simulated.T, strict=True)
            }
        return differences

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
        if self.description is not None:
            taken, names = self.description.usable_as("parameter"), self.section.names
            parts = self.case.parts.all
            symbols = [part.prefix + symbol for part in parts for symbol in part.symbols]
            own = [name for name in (*symbols, OF_RECORD[0]) if names.get(name, name) not in taken]
            if own:
                yield f"{self.section.simulator} has values of its own in place of {', '.join(own)}"

    def response_notes(self, simulator: Simulator, shown: Iterable[str]) -> Iterator[str]:
        """Name the shown signals that the twin gives, without a correction."""
        responder = simulator.responder
        if not self.has_twin or not isinstance(responder, ProgramResponder):
            return
        given = responder.given.signals
        if {*shown} - {*given}:
            yield (
                f"{self.section.simulator} gives {', '.join(given)}; all other signals are "
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
        linear = LinearResponder(responder.given, simulator, parameters, directions)
        return _with_simulator(setup, simulator.with_responder(linear))
    assert isinstance(responder, RunResponder)
    twin, _ = simulator.with_responder(None).samples(parameters, signals)
    differences = dict(zip(signals, (outside - twin).T, strict=True))
    corrected = CorrectedResponder(responder.given, differences)
    return _with_simulator(setup, setup.experiment.simulator.with_responder(corrected))
