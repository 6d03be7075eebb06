"""A test of a case, ready to be simulated: its system, its course, its record."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from traceback import extract_tb

import numpy as np
from numpy.typing import NDArray

from exfit.case import BumpTest, Case, NoPlant, RecordFile, initial_voltage
from exfit.engine.system import System, trace
from exfit.errors import CaseError, ModelError, SimulationError
from exfit.features import Features, features
from exfit.plant import MACHINE, SATURATION, VT0, alone, open_circuit
from exfit.record import Record
from exfit.residuals import Channel, Free, Residuals
from exfit.result import Comparison, Overlay
from exfit.simulate import MOST_STEPS, Change, Course, Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]


def system_of(case: Case) -> System:
    """Return the exciter of a case in its plant.

    Raises ModelError where the equations of a user's own model cannot be traced.
    """
    if case.machine is None or isinstance(case.plant, NoPlant):
        system = alone(case.exciter)
    else:
        system = open_circuit(case.exciter, case.machine, SATURATION[case.saturation])
    if case.model.endswith(".py"):
        _refuse_untraceable(system, (case.folder / case.model).absolute())
    return system


def _refuse_untraceable(system: System, path: Path) -> None:
    """Raise ModelError, naming file and line, where a model's equations fail."""
    try:
        trace(system, system.outputs)
    except Exception as fault:  # whatever a user's Python may raise
        frames = extract_tb(fault.__traceback__)
        lines = [f":{frame.lineno}" for frame in frames if Path(frame.filename) == path]
        kind = "" if isinstance(fault, ModelError) else f"{type(fault).__name__}: "
        raise ModelError(f"{path}{lines[-1] if lines else ''}: {kind}{fault}") from fault


def values_of(case: Case, changes: Values) -> dict[str, float]:
    """Return every parameter of the system but vt0: as the case has it, with changes upon it."""
    machine = {MACHINE + name: value for name, value in case.machine_values().items()}
    return {**case.values(), **machine, **changes}


def secured(simulator: Simulator, values: Values, case: Path) -> Simulator:
    """Return a simulator with sub-steps enough all along the response to the values.

    Raises SimulationError, naming the case, where they have no start or no finite response.
    """
    try:
        return simulator.secured(values)
    except SimulationError as fault:
        raise SimulationError(f"{case}: {fault}") from fault


@dataclass(frozen=True)
class Trial:
    """A test of a case and its record, ready to be simulated."""

    case: Path
    simulator: Simulator
    record: Record
    vt0: float
    channels: tuple[Channel, ...]

    def secured(self, values: Values) -> "Trial":
        """Return the trial with sub-steps enough all along the response to the values."""
        at = {**values, VT0: self.vt0}
        return replace(self, simulator=secured(self.simulator, at, self.case))

    def compare(
        self, name: str, values: Values, start: Values | None = None, limit: float | None = None
    ) -> Comparison:
        """Return the response to the values (all but vt0) beside the record; secure it first."""
        samples, substeps = self._samples(values)
        first = None if start is None else self._samples(start)[0]
        overlays = {
            channel.signal: Overlay(
                channel.measured, samples[:, k], None if first is None else first[:, k]
            )
            for k, channel in enumerate(self.channels)
        }
        errors = [channel.weight * overlays[channel.signal].error for channel in self.channels]
        vt = overlays.get("vt")
        return Comparison(
            name=name,
            time=self.record.time,
            overlays=overlays,
            cost=0.5 * sum(float(error @ error) for error in errors),
            measured=None if vt is None else self._features(vt.measured),
            simulated=None if vt is None else self._features(vt.simulated),
            record=self.record.source,
            sha256=self.record.sha256,
            substeps=substeps,
            rmse_limit=limit,
        )

    def _samples(self, values: Values) -> tuple[Array, int]:
        signals = tuple(channel.signal for channel in self.channels)
        return self.simulator.samples({**values, VT0: self.vt0}, signals)

    def _features(self, signal: Array) -> Features | None:
        """Read off the first step of the reference that the record shows."""
        time = self.record.time
        instants = [change.at for change in self.simulator.course.steps if change.at >= time[0]]
        until = instants[1] if len(instants) > 1 else float(time[-1])
        return features(time, signal, instants[0], until) if instants else None


def course_of(test: BumpTest, start: float, end: float) -> Course:
    """Return a test as the simulator takes it."""
    return Course(start, end, tuple(Change(step.at, step.step) for step in test.vref))


def trial_of(case: Case, test: BumpTest, file: RecordFile) -> Trial:
    """Return a test of a case with its record read.

    Raises RecordError where the record cannot be used, CaseError where a signal is not simulated.
    """
    record = case.measure(test, file)
    system = system_of(case)
    for signal in file.channels:
        if signal not in system.outputs:
            raise CaseError(
                [f"{case.path}: record.channels.{signal}: {case.model} has no {signal}"]
            )
    begin = float(record.time[0]) if test.begin is None else test.begin
    course = course_of(test, begin, float(record.time[-1]))
    return Trial(
        case.path,
        Simulator(system, course, record.time, case.simulation.step),
        record,
        initial_voltage(test, record),
        tuple(
            Channel(signal, record.signals[signal], channel.weight)
            for signal, channel in file.channels.items()
        ),
    )


def fitted_trial(case: Case) -> Trial:
    """Return the test of a case with the record that it is fitted to; raises CaseError without."""
    if case.record is None:
        raise CaseError([f"{case.path}: record: missing; a fit needs a record"])
    return trial_of(case, case.test, case.record)


def plain_simulator(case: Case) -> tuple[Simulator, float]:
    """Return the simulator and the initial voltage of a case without a record.

    Raises CaseError where the case does not say how long and from which voltage.
    """
    test = case.test
    missing = [name for name in ("vt0", "duration") if getattr(test, name) is None]
    if test.vt0 is None or test.duration is None:
        raise CaseError(
            f"{case.path}: test.{name}: missing; there is no record to take it from"
            for name in missing
        )
    count = max(1.0, test.duration / case.simulation.output_step)
    if count > MOST_STEPS:
        raise CaseError(
            [
                f"{case.path}: simulation.output_step: {case.simulation.output_step:g} s divides "
                f"the duration of {test.duration:g} s into more than {MOST_STEPS:.0e} samples"
            ]
        )
    times = np.linspace(0.0, test.duration, round(count) + 1)
    course = course_of(test, 0.0, test.duration)
    return Simulator(system_of(case), course, times, case.simulation.step), test.vt0


def residuals_of(case: Case, trial: Trial) -> Residuals:
    """Return the residuals of a case as functions of its free parameters.

    Raises CaseError where no parameter is free, or none of the signals depends on one that is.
    """
    free = case.parameters.free
    if not free:
        raise CaseError([f"{case.path}: parameters.free: empty; a fit needs a free parameter"])
    fixed = {**values_of(case, {}), VT0: trial.vt0}
    return Residuals(
        trial.simulator,
        trial.channels,
        free_of(case),
        {name: value for name, value in fixed.items() if name not in free},
    )


def free_of(case: Case) -> list[Free]:
    """Return the free parameters of a case."""
    return [
        Free(name, one.start, one.min, one.max, one.scale == "log")
        for name, one in case.parameters.free.items()
    ]
