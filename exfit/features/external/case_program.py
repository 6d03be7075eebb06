"""The program of a case: its tests as that program simulates them, what is reported of its runs."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from exfit.case.case import Case
from exfit.case.named_code import program_code
from exfit.case.parts import OF_RECORD
from exfit.case.schema import ExternalPlant, FmuPlant
from exfit.errors import CaseError, SimulationError
from exfit.estimate import Descent, Functions, OneByOne, Result, SolverIteration, Stop, half_square
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
from exfit.fitting.descents import Announce, following
from exfit.fitting.experiment import ExperimentSetup, Values
from exfit.fitting.problem import free_parameters
from exfit.fitting.program import Differences, Setups
from exfit.fitting.residuals import Residuals
from exfit.fitting.search import jacobian_error
from exfit.simulation.simulator import Simulator
from exfit.util.arrays import Array
from exfit.util.files import on_disk
from exfit.util.gate import refuse_untrusted
from exfit.util.text import near

Test = tuple[Simulator, tuple[str, ...]]  # with the signals that are compared

TOLERANCE = 1e-5  # of the cost: no gain that is less is worth a run
STEP = 1e-4  # of scaled parameters: no step that is less
BY_QUOTIENTS = "no twin: derivatives are difference quotients of its runs; the search is local"


# ---- the local optimisation by a twin

FAILED_STEPS = 2  # in a row, after which the derivatives of the twin are doubted
VISIBLE_GAIN = 1e-3  # of the cost: what a step must promise to be missed
DISTINCT = 0.3  # of the residuals: by how much program and twin may differ
NEGLIGIBLE_DIFFERENCE = 1e-4  # of what the record moves
MOST_CORRECTIONS = 5


class TwinDoubtedError(Exception):
    """Steps by the derivatives of the twin failed, though they promised a visible gain."""


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
        self._linear: tuple[Array, Array, Array] | None = None  # where, residuals, Jacobian
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
        elif np.isfinite(cost) and self._promise(theta) > VISIBLE_GAIN:
            self._failed += 1
            if self._failed >= FAILED_STEPS and not self.is_corrected:
                raise TwinDoubtedError
        return residuals

    def _promise(self, theta: Array) -> float:
        """Share of the cost by which a step to a point (N,) lowers the linear model's."""
        if self._linear is None:
            return 0.0
        here, residuals, jacobian = self._linear
        cost = half_square(residuals)
        step = residuals + jacobian @ (theta - here)
        return (cost - half_square(step)) / cost if cost > 0.0 else 0.0

    def jacobian(self, theta: Array) -> Array:
        """Return the Jacobian (M, N) of the twin, corrected."""
        exact = self.residuals_of.exact(theta)
        jacobian = exact if self._correction is None else exact + self._correction
        self._linear = theta.copy(), self.residuals_of(theta), jacobian
        return jacobian

    def correct(self) -> None:
        """Take the correction from quotients at the best point; a run that failed gives none."""
        best, (low, high) = self.best, self.residuals_of.bounds
        aims = np.where(best + QUOTIENT_STEP <= high, best + QUOTIENT_STEP, best - QUOTIENT_STEP)
        ends = np.maximum(aims, low)
        points = [np.where(np.arange(len(best)) == k, ends, best) for k in range(len(best))]
        here, *others = self.residuals_of.residuals([best, *points])
        exact = self.residuals_of.exact(best)
        self._correction = np.zeros_like(exact)
        for k, (step, residuals) in enumerate(zip(ends - best, others, strict=True)):
            if step and np.isfinite(residuals).all():
                self._correction[:, k] = (residuals - here) / step - exact[:, k]
        self._corrected_cost, self._failed = self._lowest, 0
        self.quotients += 1

    def is_final(self, end: Result) -> bool:
        """Tell whether an end needs no correction: it has one, or program and twin agree."""
        if end.stop is Stop.INTERRUPTED or self.quotients >= MOST_CORRECTIONS:
            return True
        return self.is_corrected or not self.is_distinct()

    def is_distinct(self) -> bool:
        """Tell whether program and twin differ visibly at the best point.

        Only then the derivatives of the twin can lead to another end than those of the program.
        """
        channels, count = self.residuals_of.channels, self.residuals_of.count
        own = self.residuals_of(self.best)[:count]
        twin = twin_of(self.residuals_of)(self.best)[:count]
        moves = [channel.weight * (channel.record - channel.record[0]) for channel in channels]
        least = max(DISTINCT * _rms(own), NEGLIGIBLE_DIFFERENCE * _rms(np.concatenate(moves)))
        return _rms(own - twin) > least


def _interrupt(_: SolverIteration) -> None:
    """End a search at its start, as an interruption does."""
    raise KeyboardInterrupt


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(np.square(errors))))


def twin_of(residuals: Residuals) -> Residuals:
    """Return the residuals of the twin alone."""
    experiments = [
        replace(experiment, simulator=experiment.simulator.with_responder(None))
        for experiment in residuals.experiments
    ]
    return replace(residuals, experiments=experiments, counter=None)


def descent_by_twin(
    residuals: Residuals, descent: Callable[[Functions], Descent], announce: Announce
) -> Result:
    """Descend from the start by the derivatives of the twin, corrected.

    Where two steps with these fail in a row, or program and twin differ visibly at the end,
    difference quotients of the program's runs, side by side, show by how much they are wrong; all
    later derivatives of the twin are corrected by that.

    Source: the correction is that of manifold mapping, Echeverria & Hemker 2005.
    """
    functions, start = ProgramFunctions(residuals), residuals.start
    lines: list[SolverIteration] = []

    def run(start: Array, watch: Announce) -> Result:
        before = lines[-1] if lines else None

        def join(line: SolverIteration) -> None:
            lines.append(following(before, line) if before else line)
            watch(lines[-1])

        search = descent(OneByOne(functions.residuals, functions.jacobian))
        end = search.run(start, join)
        nfev, njev = (before.nfev, before.njev) if before else (0, 0)
        return end._replace(history=tuple(lines), nfev=nfev + end.nfev, njev=njev + end.njev)

    while True:
        with suppress(TwinDoubtedError):
            end = run(start, announce)
            if functions.is_final(end):
                return end
        try:
            functions.correct()
        except KeyboardInterrupt:
            return run(functions.best, _interrupt)
        start = functions.best


# ---- the program of a case


@contextmanager
def opened(case: Case) -> Iterator["CaseProgram | None"]:
    """Provide the program that simulates a case; end it afterwards.

    Raises CaseError for an FMU that cannot be run, and for code that the user has not trusted.
    """
    section = case.external
    if isinstance(section, FmuPlant):
        try:
            with _opened_fmu(case, section) as of_fmu:
                yield of_fmu
        except FmuError as fault:
            text = f"{case.path}: plant.file: {section.simulator} {fault}"
            raise CaseError(text) from None
    elif section is not None:
        refuse_untrusted(program_code(section.command, case.folder))
        folder = case.folder.absolute()
        program = ExternalProgram(section.command, folder, section.parallel, section.time_limit)
        with closing(program):
            yield CaseProgram(case, section, program)


@contextmanager
def _opened_fmu(case: Case, section: FmuPlant) -> Iterator["CaseProgram"]:
    """Lay out the FMU of a case and provide the program that runs it."""
    file = on_disk(case.folder / section.file)
    with suppress(OSError):  # of a file that cannot be read, which is said below
        refuse_untrusted(program_code(section.file, case.folder))
    description = fmu_description(file)
    interface = section.interface or description.interfaces[0]
    if interface not in description.interfaces:
        text = f"{section.simulator} has {' and '.join(description.interfaces)} only"
        raise CaseError(f"{case.path}: plant.interface: {interface}: {text}")
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
            text = f"only steps and ramps are allowed with plant {self.section.type}"
            raise CaseError(f"{self.case.path}: test: {', '.join(recorded)}: {text}")
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
        """Give a local optimisation the tolerances that its runs allow."""
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
        """Name the parameters of the case that cannot be set in an FMU."""
        if self.description is not None:
            taken, names = self.description.usable_as("parameter"), self.section.names
            parts = self.case.parts.all
            symbols = [part.prefix + symbol for part in parts for symbol in part.symbols]
            unset = [
                name for name in (*symbols, OF_RECORD[0]) if names.get(name, name) not in taken
            ]
            if unset:
                listed = ", ".join(unset)
                yield f"no parameters of {self.section.simulator}, which uses its values: {listed}"

    def response_notes(self, simulator: Simulator, shown: Iterable[str]) -> Iterator[str]:
        """Name the shown signals that the twin gives, without a correction."""
        responder = simulator.responder
        if not self.has_twin or not isinstance(responder, ProgramResponder):
            return
        given = responder.given.signals
        if {*shown} - {*given}:
            yield (
                f"{self.section.simulator} gives {', '.join(given)}; all other signals are those "
                f"of the twin {self.section.twin}, not corrected"
            )

    def notes(self, setups: Setups, followed: str = "intervals and diagnoses") -> Iterator[str]:
        """Report the runs it was asked for, and the difference of its twin at the result.

        ``followed`` is what followed the search, by the twin.
        """
        counts = self.program.counts
        failed = f", of which {counts.failed} failed" if counts.failed else ""
        restarts = f"; it was restarted {counts.restarts} times" if counts.restarts else ""
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
