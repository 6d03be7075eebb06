"""A test of a case, ready to be simulated: its system, its course, its record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from traceback import extract_tb
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from exfit.case import schema
from exfit.case.case import Case
from exfit.case.schema import (
    SINGLE,
    BumpTest,
    Filter,
    RecordFile,
    Recording,
    StepSection,
    Switch,
    Unknown,
    known,
)
from exfit.case.ties import Ties
from exfit.dsp.filtering import Filtering, LowPass, Median, MovingAverage, outliers
from exfit.dsp.robust_loss import LOSSES
from exfit.engine.system import System, trace
from exfit.errors import CaseError, ModelError, RecordError, SimulationError
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.nuisance import nuisance_parameters, prefix_of, with_detected_steps
from exfit.fitting.parameters import FreeParameter, Prior
from exfit.fitting.recordings import column_of, initial_level, initial_voltage, record_of
from exfit.fitting.residuals import Residuals, Robust
from exfit.models.sheet import Model
from exfit.plants import (
    DRIVING,
    NETWORK,
    SATURATION,
    VT0,
    Equipment,
    SaturationForm,
    Stabilised,
    initial,
    playback,
)
from exfit.records.record import Record
from exfit.simulation.inputs import MOST_STEPS, Inputs, InputStep, RecordedInputs
from exfit.simulation.simulator import Response, Simulator, parameters_used

Array = NDArray[np.float64]
Values = Mapping[str, float]
Securable = TypeVar("Securable", Simulator, Experiment)

WIDEST = 10  # windows of a running median that a record holds: a wider one hides the response
FEWEST = 3  # samples of a channel: fewer do not show its noise
POSSIBLE = (0.1, 2.0)  # pu: voltages beyond are those of another unit or base


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
    kind, parts = case.kind, case.parts
    if kind.has_exciter and parts.exciter is None:
        raise CaseError([f"{case.path}: model: missing"])
    equipment = Equipment(
        exciter=parts.exciter,
        machine=parts.machine,
        saturation=SATURATION[case.saturation],
        inputs=inputs_of(case),
        recorded=recorded_in_all(case),
        given=frozenset(case.plant.given),
        stabiliser=stabilised(case),
    )
    if kind.plays_back and parts.exciter is not None:
        _refuse_missing_drivers(case, parts.exciter, equipment.saturation)
    return kind.build(equipment)


def inputs_of(case: Case) -> tuple[str, ...]:
    """Return the inputs that the tests of a case change; the reference always is one."""
    changed = {"vref"}
    for test in case.tests:
        changed |= {name for name in ("vs", "E") if getattr(test, name)}
        for switch in test.network:
            changed |= {name for name in ("R", "X", "E") if getattr(switch, name) is not None}
    return tuple(name for name in ("vref", "vs", "E", "R", "X") if name in changed)


def stabilised(case: Case) -> Stabilised | None:
    """Return the stabiliser of a case with the signals that it listens to."""
    model = case.parts.stabiliser
    if model is None or case.stabiliser is None:
        return None
    return Stabilised(model, case.stabiliser.inputs or model.inputs)


def recorded_in_all(case: Case) -> frozenset[str]:
    """Return the signals that all records of a case hold."""
    records = [{*file.channels} for file in _record_files(case).values()]
    return frozenset(set.intersection(*records) if records else ())


def _refuse_missing_drivers(case: Case, exciter: Model, saturation: SaturationForm) -> None:
    """Raise CaseError where a record lacks a signal that the exciter uses."""
    used = driven_by(exciter, saturation)
    required = [signal for signal in case.kind.required_if_used if signal in used]
    for place, file in _record_files(case).items():
        for signal in required:
            if signal not in file.channels:
                text = f"channels.{signal}: is missing: it drives {exciter.name}"
                raise CaseError([f"{case.path}: {place}: {text}"])


def _record_files(case: Case) -> dict[str, RecordFile]:
    """Return the records of a case by their place in its file."""
    files = {"record" if one.name == SINGLE else one.name: one.record for one in case.recordings}
    return files | {f"validate.{one.name}": one.record for one in case.validations}


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
    """Return every value of a case: as it has them, with changes upon them, and what follows."""
    following = {name: tie for name, tie in case.ties.by_name.items() if name not in changed}
    return Ties(following).apply({**case.values(), **changed})


def with_enough_substeps(one: Securable, values: Values, case: Path) -> Securable:
    """Return a simulator, or what has one, with sub-steps enough all along the response to values.

    Raises SimulationError, naming the case, where they have no start or no finite response.
    """
    try:
        return one.with_enough_substeps(values)
    except SimulationError as fault:
        raise SimulationError(f"{case}: {fault}") from fault


@dataclass(frozen=True)
class ExperimentSetup:
    """A test of a case beside its record, ready to be simulated.

    ``test`` has a number for everything; ``free`` are those of its values that a fit finds.
    """

    case: Path
    test: BumpTest
    record: Record
    experiment: Experiment
    free: tuple[FreeParameter, ...]

    @property
    def name(self) -> str:
        """The name of the record."""
        return self.experiment.name

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The signals that are compared."""
        return self.experiment.channels

    def with_start_values(self, values: Values) -> dict[str, float]:
        """Return the values with a start for what the fit finds about this record."""
        return {**{one.name: one.start for one in self.free}, **values}

    def with_enough_substeps(self, values: Values) -> "ExperimentSetup":
        """Return the trial with sub-steps enough all along the response to the values."""
        experiment = with_enough_substeps(
            self.experiment, self.with_start_values(values), self.case
        )
        return replace(self, experiment=experiment)

    def response(self, values: Values) -> Response:
        """Return everything that the simulation gives, on the clock of the record."""
        at = self.with_start_values(values)
        return self.experiment.with_inputs(at).response(self.experiment.parameters(at))


def compared(channel: Channel, samples: Array) -> Array:
    """Return samples (M,) as they are compared, nan where they are left out."""
    if channel.filtering is None:
        return samples
    found = np.full(len(samples), np.nan)
    found[channel.kept] = channel.filtered(samples)
    return found


def input_steps(case: Case, test: BumpTest, values: Values) -> list[InputStep]:
    """Return what a test changes, in the order of time; a switch says what is from then on.

    ``values`` are those of the network at the start. Raises CaseError where the source would lose
    its voltage.
    """
    found = [
        InputStep(
            known(step.at) or 0.0, known(step.step) or 0.0, signal, isinstance(step.at, Unknown)
        )
        for signal in ("vref", "vs")
        for step in getattr(test, signal)
    ]
    now = {name: values.get(NETWORK + name) for name in ("R", "X", "E")}
    events: list[StepSection | Switch] = [*test.E, *test.network]
    for event in sorted(events, key=lambda event: event.at):
        for name, level in now.items():
            step = _step_of(event, name, level)
            if step is not None:
                found.append(InputStep(event.at, step, name))
                now[name] = None if level is None else level + step
        if now["E"] is not None and now["E"] <= 0.0:
            text = f"at {event.at:g} s the source falls to {now['E']:g} pu; it must stay above 0"
            raise CaseError([f"{case.path}: test: {text}"])
    return sorted(found, key=lambda change: change.at)


def _step_of(event: StepSection | Switch, name: str, level: float | None) -> float | None:
    """Return by how much an event changes R, X or E; None where it leaves it."""
    if isinstance(event, StepSection):
        return event.step if name == "E" else None
    then: float | None = getattr(event, name)
    return None if then is None or level is None else then - level


def build_experiment(case: Case, recording: Recording, values: Values) -> ExperimentSetup:
    """Return a test of a case with its record read; ``values`` are those it begins with.

    Raises RecordError where the record cannot be used, CaseError where a signal is not simulated.
    """
    view, file = case.seen_from(recording), recording.record
    system = system_of(view)
    driving = [signal for signal in file.channels if signal in system.inputs]
    record = _without_masked(record_of(case, recording), file, driving)
    test = with_detected_steps(case, recording, record)
    if view is not case:
        own = {name: v for name, v in view.values().items() if name.startswith(NETWORK)}
        values = {**values, **own}
    else:
        own = {}
    prefix = prefix_of(recording)
    begin = float(record.time[0]) if test.begin is None else test.begin
    steps = tuple(input_steps(view, test, values))
    nuisances, free = nuisance_parameters(prefix, test, file, steps)
    if any(one.kind == "shift" for one in nuisances):
        steps = tuple(change._replace(smooth=False) for change in steps)
    delay = known(file.delay) or 0.0
    # what is read early asks for a simulation beyond the record
    early = [
        one.start - one.low
        for one, nuisance in zip(free, nuisances, strict=True)
        if nuisance.kind in ("delay", "shift")
    ]
    course = Inputs(begin, float(record.time[-1]) + max(0.0, sum(early) - delay), steps)
    if driving:
        heard: dict[str, Array] = {signal: _moved(test, record, signal) for signal in driving}
        course = replace(course, recorded=RecordedInputs(record.time, heard))
    simulator = Simulator(system, course, record.time, case.simulation.step)
    experiment = Experiment(
        simulator.with_inputs(steps, delay) if delay else simulator,
        tuple(
            channel_of(case, file, record, signal)
            for signal in file.channels
            if signal not in driving and signal in system.outputs
        ),
        {**own, **levels_of(case, test, record)},
        nuisances,
        recording.name,
    )
    return ExperimentSetup(case.path, test, record, experiment, free)


def _without_masked(record: Record, file: RecordFile, driving: Sequence[str]) -> Record:
    """Return a record with nan in place of what is masked; what drives stays as it is.

    Raises RecordError where a signal that drives has a gap.
    """
    masked = np.zeros(len(record.time), dtype=bool)
    for first, last in file.mask:
        masked |= (record.time >= first) & (record.time <= last)
    signals = dict(record.signals)
    for signal, samples in record.signals.items():
        if signal not in driving:
            signals[signal] = np.where(masked, np.nan, samples)
        elif np.isnan(samples).any():
            at = record.time[np.isnan(samples)][0]
            raise RecordError(f"{record.source}: {signal}: it drives, and has a gap at {at:g} s")
    return replace(record, signals=signals)


def channel_of(case: Case, file: RecordFile, record: Record, signal: str) -> Channel:
    """Return a channel of a record, with what is done to it before it is compared."""
    entry, samples = file.channels[signal], record.signals[signal]
    kept = np.isfinite(samples)
    if entry.outliers is not None:
        try:
            kept[kept] = ~outliers(record.time[kept], samples[kept], entry.outliers)
        except ValueError as fault:
            raise RecordError(f"{record.source}: {signal}: outliers: {fault}") from fault
    if np.count_nonzero(kept) < FEWEST:
        raise RecordError(f"{record.source}: {signal}: fewer than {FEWEST} samples are left")
    most = len(samples) // WIDEST
    if isinstance(entry.filter, schema.MedianSection) and entry.filter.median > most:
        text = (
            f"filter: median: {entry.filter.median} samples; at most {most}, a tenth of the record"
        )
        raise RecordError(f"{record.source}: {signal}: {text}")
    window = record.averaged.get(signal, entry.averaged)
    conditioning = None
    if entry.filter is not None or window is not None or not kept.all():
        average = None if window is None else MovingAverage(window)
        try:
            conditioning = Filtering(record.time, kept, _filter(entry.filter), average)
        except ValueError as fault:
            what = "filter" if window is None else "filter or average"
            raise RecordError(f"{record.source}: {signal}: {what}: {fault}") from fault
    weight = entry.weight if entry.noise is None else finest_noise(case, entry.noise) / entry.noise
    if not isinstance(entry, schema.ChannelSection):
        return Channel(signal, samples, weight, conditioning, entry.noise)
    own = column_of(entry)
    return Channel(signal, samples, weight, conditioning, entry.noise, own.scale, own.offset)


def _filter(chosen: Filter | None) -> LowPass | Median | None:
    if chosen is None:
        return None
    if isinstance(chosen, schema.MedianSection):
        return Median(chosen.median)
    return LowPass(chosen.lowpass)


def finest_noise(case: Case, own: float) -> float:
    """Return the least noise that a case gives for a fitted channel, its ``own`` where none has."""
    channels = [entry for one in case.recordings for entry in one.record.channels.values()]
    return min((entry.noise for entry in channels if entry.noise is not None), default=own)


def _moved(test: BumpTest, record: Record, signal: str) -> Array:
    """Return by how much a recorded signal deviates from where it starts."""
    if signal == "vt":
        return record.signals[signal] - initial_voltage(test, record)
    return record.signals[signal] - initial_level(test, record, signal)


def levels_of(case: Case, test: BumpTest, record: Record) -> dict[str, float]:
    """Return the parameters that a record gives: the levels of its signals at the start."""
    kind, vt0 = case.kind, initial_voltage(test, record)
    if kind.per_unit and not kind.levels:
        _refuse_impossible(vt0, record)
    levels = {
        initial(signal): initial_level(test, record, signal)
        for signal in kind.levels
        if signal in record.signals
    }
    given = {initial(name): v for name, v in case.plant.given.items() if name in kind.driving}
    return {**levels, VT0: vt0, **given}


def _refuse_impossible(vt0: float, record: Record) -> None:
    """Raise a RecordError where a voltage is none that a machine is at rest with."""
    low, high = POSSIBLE
    if not low <= vt0 <= high:
        raise RecordError(
            f"{record.source}: vt rests at {vt0:.4g} pu, outside {low:g} ... {high:g}: its unit, "
            "base or scale is another"
        )


def build_experiments(case: Case, start: Values | None = None) -> tuple[ExperimentSetup, ...]:
    """Return the tests of a case with the records that it is fitted to; CaseError without any.

    ``start`` are the case's values, where they are at hand.
    """
    if not case.recordings:
        raise CaseError([f"{case.path}: record: missing; a fit needs a record"])
    values = case.values() if start is None else start
    return tuple(build_experiment(case, recording, values) for recording in case.recordings)


def plain_simulator(case: Case, values: Values) -> tuple[Simulator, dict[str, float]]:
    """Return the simulator and the initial levels of a case without a record.

    Raises CaseError where the case does not say how long and from which voltage.
    """
    test = case.test or BumpTest()
    vt0 = known(test.vt0)
    missing = [name for name in ("vt0", "duration") if getattr(test, name) is None]
    if vt0 is None or test.duration is None:
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
    course = Inputs(0.0, test.duration, tuple(input_steps(case, test, values)))
    return Simulator(system_of(case), course, times, case.simulation.step), {VT0: vt0}


def planned(case: Case, signals: Sequence[str] = ("vt",)) -> Experiment:
    """Return the test of a case without a record, of which some signals are seen."""
    values = case.values()
    simulator, levels = plain_simulator(case, values)
    simulator = with_enough_substeps(simulator, {**values, **levels}, case.path)
    still = np.zeros(len(simulator.times))
    seen = tuple(Channel(signal, still) for signal in signals)
    return Experiment(simulator, seen, levels)


def residuals_of(
    case: Case, setups: Sequence[ExperimentSetup], start: Values | None = None
) -> Residuals:
    """Return the residuals of a case as functions of its free parameters.

    ``start`` are the case's values, where they are at hand. Raises CaseError where nothing is free.
    """
    free = free_parameters(case, setups)
    if not free:
        raise CaseError([f"{case.path}: parameters.free: empty; a fit needs a free parameter"])
    names = {parameter.name for parameter in free}
    values = case.values() if start is None else start
    fixed = {name: value for name, value in values.items() if name not in names}
    experiments = [setup.experiment for setup in setups]
    return Residuals(experiments, free, fixed, case.ties, robust_of(case))


def robust_of(case: Case) -> Robust | None:
    """Return the loss that a case asks for in place of the squares."""
    asked = case.estimate
    if asked.loss == "least-squares":
        return None
    return Robust(LOSSES[asked.loss], asked.loss_scale)


def free_parameters(case: Case, trials: Sequence[ExperimentSetup] = ()) -> list[FreeParameter]:
    """Return the free parameters of a case, then what is found about its records."""
    shared = [
        FreeParameter(
            name,
            one.start,
            one.min,
            one.max,
            one.scale == "log",
            None if one.prior is None else Prior(one.prior.mean, one.prior.sigma),
        )
        for name, one in case.free().items()
    ]
    return [*shared, *(one for trial in trials for one in trial.free)]
