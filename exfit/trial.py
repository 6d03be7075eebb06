"""A test of a case, ready to be simulated: its system, its course, its record."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from traceback import extract_tb

import numpy as np
from numpy.typing import NDArray

from exfit.case import (
    BumpTest,
    Case,
    InfiniteBus,
    MachinePlayback,
    OpenCircuit,
    Playback,
    RecordFile,
    Step,
    Switch,
    initial_level,
    initial_voltage,
)
from exfit.engine.system import System, trace
from exfit.errors import CaseError, ModelError, SimulationError
from exfit.features import Features, features
from exfit.models.sheet import Model
from exfit.plant import (
    DRIVING,
    NETWORK,
    SATURATION,
    VREF0,
    VT0,
    SaturationForm,
    Stabilised,
    alone,
    infinite_bus,
    initial,
    machine_playback,
    open_circuit,
    playback,
)
from exfit.record import Record
from exfit.residuals import Channel, Free, Residuals
from exfit.result import Comparison, Overlay
from exfit.simulate import MOST_STEPS, Change, Course, Played, Simulator, parameters_used

Array = NDArray[np.float64]
Values = Mapping[str, float]


def system_of(case: Case) -> System:
    """Return the exciter of a case in its plant.

    Raises ModelError where the equations of a user's own model cannot be traced, CaseError where a
    record lacks a signal that drives it.
    """
    system = _system_of(case)
    if case.model is not None and case.model.endswith(".py"):
        _refuse_untraceable(system, (case.folder / case.model).absolute())
    return system


def _system_of(case: Case) -> System:
    plant, parts, saturation = case.plant, case.parts, SATURATION[case.saturation]
    exciter, machine = parts.exciter, parts.machine
    if machine is not None and isinstance(plant, MachinePlayback):
        return machine_playback(machine)
    if exciter is None:
        raise CaseError([f"{case.path}: model: missing"])
    if machine is not None and isinstance(plant, OpenCircuit):
        return open_circuit(exciter, machine, saturation, inputs_of(case))
    if machine is not None and isinstance(plant, InfiniteBus):
        given = "E" if "E" in plant.network else "Q"
        return infinite_bus(exciter, machine, saturation, inputs_of(case), given, stabilised(case))
    if isinstance(plant, Playback):
        driving = driving_signals(case, exciter, saturation)
        return playback(exciter, saturation, driving, plant.vref is not None)
    return alone(exciter)


def inputs_of(case: Case) -> tuple[str, ...]:
    """Return the inputs that the tests of a case change; the reference always is one."""
    values = case.values()
    changed = {change.signal for test in case.tests for change in changes(case, test, values)}
    return tuple(name for name in ("vref", "vs", "E", "R", "X") if name in changed | {"vref"})


def stabilised(case: Case) -> Stabilised | None:
    """Return the stabiliser of a case with the signals that it listens to."""
    model = case.parts.stabiliser
    if model is None or case.stabiliser is None:
        return None
    return Stabilised(model, case.stabiliser.inputs or model.inputs)


def driving_signals(case: Case, exciter: Model, saturation: SaturationForm) -> tuple[str, ...]:
    """Return the recorded signals that drive the exciter of a case in all its records.

    Raises CaseError where the exciter needs the field current and a record lacks it.
    """
    files = {"record": case.record}
    files |= {f"validate.{one.name}": one.record for one in case.validations}
    given = [set(file.channels) for file in files.values() if file is not None]
    needs = driven_by(exciter, saturation)
    for place, file in files.items():
        if file is not None and "ifd" in needs and "ifd" not in file.channels:
            text = f"channels.ifd: is missing: it drives {exciter.name}"
            raise CaseError([f"{case.path}: {place}: {text}"])
    return tuple(signal for signal in DRIVING if all(signal in signals for signals in given))


@cache
def driven_by(exciter: Model, saturation: SaturationForm) -> frozenset[str]:
    """Return the signals of its plant that reach an exciter."""
    used = parameters_used(playback(exciter, saturation, DRIVING))
    return frozenset(signal for signal in DRIVING if initial(signal) in used)


def _refuse_untraceable(system: System, path: Path) -> None:
    """Raise ModelError, naming file and line, where a model's equations fail."""
    try:
        trace(system, system.outputs)
    except Exception as fault:  # whatever a user's Python may raise
        frames = extract_tb(fault.__traceback__)
        lines = [f":{frame.lineno}" for frame in frames if Path(frame.filename) == path]
        kind = "" if isinstance(fault, ModelError) else f"{type(fault).__name__}: "
        raise ModelError(f"{path}{lines[-1] if lines else ''}: {kind}{fault}") from fault


def values_of(case: Case, changed: Values) -> dict[str, float]:
    """Return every parameter of the parts of a case: as it has them, with changes upon them."""
    return {**case.values(), **changed}


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
    """A test of a case and its record, ready to be simulated.

    ``levels`` are the parameters that the record gives: where the signals stand at the start.
    """

    case: Path
    simulator: Simulator
    record: Record
    levels: Mapping[str, float]
    channels: tuple[Channel, ...]

    def secured(self, values: Values) -> "Trial":
        """Return the trial with sub-steps enough all along the response to the values."""
        at = {**values, **self.levels}
        return replace(self, simulator=secured(self.simulator, at, self.case))

    def compare(
        self, name: str, values: Values, start: Values | None = None, limit: float | None = None
    ) -> Comparison:
        """Return the response to the values beside the record; secure it first."""
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
        return self.simulator.samples({**values, **self.levels}, signals)

    def _features(self, signal: Array) -> Features | None:
        """Read off the first step of the reference that the record shows."""
        time = self.record.time
        inside = [change for change in self.simulator.course.steps if change.at >= time[0]]
        if not inside or inside[0].signal != "vref":
            return None
        later = [change.at for change in inside if change.at > inside[0].at]
        until = later[0] if later else float(time[-1])
        return features(time, signal, inside[0].at, until)


def changes(case: Case, test: BumpTest, values: Values) -> list[Change]:
    """Return what a test changes, in the order of time; a switch says what is from then on.

    ``values`` are those of the network at the start. Raises CaseError where the source would lose
    its voltage.
    """
    found = [
        Change(step.at, step.step, signal)
        for signal in ("vref", "vs")
        for step in getattr(test, signal)
    ]
    now = {name: values.get(NETWORK + name) for name in ("R", "X", "E")}
    events: list[Step | Switch] = [*test.E, *test.network]
    for event in sorted(events, key=lambda event: event.at):
        for name, level in now.items():
            step = _step_of(event, name, level)
            if step is not None:
                found.append(Change(event.at, step, name))
                now[name] = None if level is None else level + step
        if now["E"] is not None and now["E"] <= 0.0:
            text = f"at {event.at:g} s the source falls to {now['E']:g} pu; it must stay above 0"
            raise CaseError([f"{case.path}: test: {text}"])
    return sorted(found, key=lambda change: change.at)


def _step_of(event: Step | Switch, name: str, level: float | None) -> float | None:
    """Return by how much an event changes R, X or E; None where it leaves it."""
    if isinstance(event, Step):
        return event.step if name == "E" else None
    then: float | None = getattr(event, name)
    return None if then is None or level is None else then - level


def course_of(case: Case, test: BumpTest, span: tuple[float, float], values: Values) -> Course:
    """Return a test from start to end, s, as the simulator takes it."""
    return Course(*span, tuple(changes(case, test, values)))


def trial_of(case: Case, test: BumpTest, file: RecordFile, values: Values) -> Trial:
    """Return a test of a case with its record read; ``values`` are those it begins with.

    Raises RecordError where the record cannot be used, CaseError where a signal is not simulated.
    """
    record = case.measure(test, file)
    system = system_of(case)
    begin = float(record.time[0]) if test.begin is None else test.begin
    course = course_of(case, test, (begin, float(record.time[-1])), values)
    levels = levels_of(case, test, record)
    driving = [signal for signal in file.channels if signal in system.inputs]
    if driving:
        heard: dict[str, Array] = {signal: _moved(test, record, signal) for signal in driving}
        course = replace(course, played=Played(record.time, heard))
    return Trial(
        case.path,
        Simulator(system, course, record.time, case.simulation.step),
        record,
        levels,
        tuple(
            Channel(signal, record.signals[signal], channel.weight)
            for signal, channel in file.channels.items()
            if signal not in driving and signal in system.outputs
        ),
    )


def _moved(test: BumpTest, record: Record, signal: str) -> Array:
    """Return by how much a recorded signal deviates from where it starts."""
    if signal == "vt":
        return record.signals[signal] - initial_voltage(test, record)
    return record.signals[signal] - initial_level(test, record, signal)


def levels_of(case: Case, test: BumpTest, record: Record) -> dict[str, float]:
    """Return the parameters that a record gives: the levels of its signals at the start."""
    if not isinstance(case.plant, Playback):
        return {VT0: initial_voltage(test, record)}
    levels = {
        initial(signal): initial_level(test, record, signal)
        for signal in (*DRIVING, "efd")
        if signal in record.signals
    }
    known = {} if case.plant.vref is None else {VREF0: case.plant.vref}
    return {**levels, VT0: initial_voltage(test, record), **known}


def fitted_trial(case: Case) -> Trial:
    """Return the test of a case with the record that it is fitted to; raises CaseError without."""
    if case.record is None:
        raise CaseError([f"{case.path}: record: missing; a fit needs a record"])
    return trial_of(case, case.test, case.record, case.values())


def plain_simulator(case: Case, values: Values) -> tuple[Simulator, dict[str, float]]:
    """Return the simulator and the initial levels of a case without a record.

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
    course = course_of(case, test, (0.0, test.duration), values)
    return Simulator(system_of(case), course, times, case.simulation.step), {VT0: test.vt0}


def residuals_of(case: Case, trial: Trial) -> Residuals:
    """Return the residuals of a case as functions of its free parameters.

    Raises CaseError where no parameter is free, or none of the signals depends on one that is.
    """
    free = case.free()
    if not free:
        raise CaseError([f"{case.path}: parameters.free: empty; a fit needs a free parameter"])
    fixed = {**case.values(), **trial.levels}
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
        for name, one in case.free().items()
    ]
