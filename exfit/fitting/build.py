"""The experiments of a case: its tests, ready to be simulated, with or without a record."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.case.case import Case
from exfit.case.schema import BumpTest, RecordFile, Recording, Unknown, start_value
from exfit.errors import CaseError
from exfit.fitting.channels import channel_of, with_filter, without_masked
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.input_steps import input_steps
from exfit.fitting.levels import deviation, levels_of
from exfit.fitting.nuisances.kinds import Nuisance
from exfit.fitting.nuisances.parameters import nuisance_parameters, prefix_of
from exfit.fitting.nuisances.sine_parameters import with_sines
from exfit.fitting.parameters import FreeParameter
from exfit.fitting.recorded.detected_steps import with_detected_steps
from exfit.fitting.recorded.event import (
    event_inputs,
    offset_step,
    with_even_clock,
    with_rest,
)
from exfit.fitting.recorded.references import references_of, span_of
from exfit.fitting.recorded.switchings import (
    Switching,
    announced,
    masked,
    switchings_as_steps,
    switchings_of,
)
from exfit.fitting.recordings import record_of
from exfit.fitting.setup import ExperimentSetup, with_enough_substeps
from exfit.fitting.system import system_of
from exfit.plants import NETWORK, REFERENCES, VT0, PlantKind
from exfit.records.record import Record
from exfit.simulation.inputs import MOST_STEPS, Inputs, RecordedInput, SplinedInput
from exfit.simulation.simulator import Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]


def build_experiment(case: Case, recording: Recording, values: Values) -> ExperimentSetup:
    """Read the record of a test of a case and build its experiment, which begins with ``values``.

    Raises RecordError where the record cannot be used, CaseError where a signal is not simulated.
    """
    view, file = case.seen_from(recording), recording.record
    system = system_of(view, recording)
    driven = (*system.inputs, *view.kind.required_one_of)  # some in another form
    driving = [signal for signal in file.channels if signal in driven]
    read = record_of(case, recording)
    whole = with_filter(with_even_clock(read) if view.kind.finds_rest else read, file.filter)
    switchings = switchings_of(view, whole)
    record = without_masked(whole, masked(file, whole, switchings), driving)
    references = references_of(case, recording.test, span_of(recording.test, record), record, file)
    resolved = recording.model_copy(update={"test": references.test})
    test = with_detected_steps(case, resolved, record)
    test = with_rest(test, record) if view.kind.finds_rest else test
    network = {} if view is case else _network_values(view)
    begin, end = span_of(test, record)
    offset = offset_step(test, begin, end)
    given = input_steps(view, test, {**values, **network})
    played = _driving(view, test, record, file, driving, switchings)
    switched = switchings_as_steps(played, file, switchings, prefix_of(recording), len(given))
    steps = (*given, *switched.steps, *offset)
    nuisances, free = nuisance_parameters(
        prefix_of(recording),
        test,
        file,
        steps,
        alone=not references.recorded,
        scaled=view.kind.scaled,
    )
    if any(nuisance.kind == "shift" for nuisance in nuisances):
        steps = tuple(step._replace(smooth=False) for step in steps)
    delay = start_value(file.delay) or 0.0
    recorded = {**switched.inputs, **references.recorded}
    inputs = Inputs(begin, end + _beyond(nuisances, free, delay), steps, recorded)
    simulator = Simulator(system, inputs, record.time, case.simulation.step)
    experiment = Experiment(
        simulator.with_inputs(steps, delay) if delay else simulator,
        _channels(case, file, record, [s for s in system.outputs if s not in driving]),
        {**network, **levels_of(case, test, record)},
        (*nuisances, *switched.nuisances),
        recording.name,
    )
    plain = ExperimentSetup(
        case.path,
        test,
        record,
        experiment,
        (*free, *switched.free),
        references.files,
        _played(view.kind, driving),
        switchings=announced(file, switchings),
        whole=whole,
    )
    setup = with_sines(case, recording, plain, values)
    return replace(setup, free=tuple(_with_given_start(case, each) for each in setup.free))


def _played(kind: PlantKind, driving: Collection[str]) -> tuple[str, ...]:
    """Return the channels that drive a simulation in place of a plant, in the order of the kind."""
    return tuple(signal for signal in kind.driving if signal in driving and kind.plays_back)


def _with_given_start(case: Case, parameter: FreeParameter) -> FreeParameter:
    """Return what is found about a record, with the start that was given, if one was.

    Raises CaseError where that lies out of its bounds.
    """
    given = case.given_values.get(parameter.name)
    if given is None:
        return parameter
    if not parameter.low <= given.value <= parameter.high:
        limits = f"{parameter.low:g} ... {parameter.high:g}"
        text = f"{parameter.name}: {given.value:g} lies outside its bounds {limits} in {case.path}"
        raise CaseError([f"{given.source}: {text}"])
    return replace(parameter, start=given.value)


def _network_values(view: Case) -> dict[str, float]:
    """Return the values of the network that a record has in place of the case's."""
    return {name: value for name, value in view.values().items() if name.startswith(NETWORK)}


def _beyond(nuisances: Sequence[Nuisance], free: Sequence[FreeParameter], delay: float) -> float:
    """Time (s) after the end of the record that a fit simulates which may read it earlier."""
    earlier = sum(
        parameter.start - parameter.low
        for parameter, nuisance in zip(free, nuisances, strict=True)
        if nuisance.kind in ("delay", "shift")
    )
    return max(0.0, earlier - delay)


def _driving(
    case: Case,
    test: BumpTest,
    record: Record,
    file: RecordFile,
    driving: Sequence[str],
    switchings: Sequence[Switching],
) -> dict[str, RecordedInput | SplinedInput]:
    """Return the signals of a record that drive the simulation, but for recorded references.

    One whose scale is found is divided by its start, by which it was read: the system multiplies.
    """

    def start_of_scale(signal: str) -> float:
        scale = getattr(file.channels[signal], "scale", 1.0)
        start = start_value(scale) if isinstance(scale, Unknown) else None
        return 1.0 if start is None else start

    event = event_inputs(test, record, switchings) if case.kind.finds_rest else {}
    if event:
        driving = [signal for signal in driving if signal in REFERENCES]
    elif not case.kind.plays_back:
        driving = [signal for signal in driving if signal not in REFERENCES]
    return {
        signal: RecordedInput(record.time, deviation(test, record, signal) / start_of_scale(signal))
        for signal in driving
    } | event


def _channels(
    case: Case, file: RecordFile, record: Record, compared: Sequence[str]
) -> tuple[Channel, ...]:
    """Return the channels of a record that are compared, in the order of the case."""
    return tuple(
        channel_of(case, file, record, signal) for signal in file.channels if signal in compared
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
    vt0 = start_value(test.vt0)
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
    references = references_of(case, test, (0.0, test.duration))
    steps = tuple(input_steps(case, references.test, values))
    inputs = Inputs(0.0, test.duration, steps, references.recorded)
    return Simulator(system_of(case), inputs, times, case.simulation.step), {VT0: vt0}


def planned(case: Case, signals: Sequence[str] = ("vt",)) -> Experiment:
    """Return the test of a case without a record, of which some signals are recorded."""
    values = case.values()
    simulator, levels = plain_simulator(case, values)
    simulator = with_enough_substeps(simulator, {**values, **levels}, case.path)
    still = np.zeros(len(simulator.times))
    channels = tuple(Channel(signal, still) for signal in signals)
    return Experiment(simulator, channels, levels)
