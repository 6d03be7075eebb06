"""The experiments of a case: its tests, ready to be simulated, with or without a record."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import (
    BumpTest,
    RecordFile,
    Recording,
    StepSection,
    Switch,
    Unknown,
    start_value,
)
from exfit.engine.system import System
from exfit.errors import CaseError, SimulationError
from exfit.fitting.channels import channel_of, filtered_end, with_filter, without_masked
from exfit.fitting.experiment import (
    Channel,
    Experiment,
    ExperimentSetup,
    Switching,
    Values,
    with_enough_substeps,
)
from exfit.fitting.nuisances import TURN, Found, nuisances_of, prefix_from
from exfit.fitting.recordings import deviation, levels_of, record_of, span_of, speed_at_start
from exfit.fitting.system import system_of
from exfit.plants import BREAKER, FAULT, NETWORK, REFERENCES, SPEED, SWITCHED, VT0
from exfit.records.record import Record
from exfit.simulation.inputs import Inputs, InputStep, RecordedInput, SplinedInput
from exfit.simulation.simulator import LARGEST_STEP, Simulator
from exfit.util.arrays import Array

MOST_SAMPLES = 1e7
TWIN_STEP = 1e-3  # s, of what simulates beside another program


def build_experiments(case: Case, start: Values | None = None) -> tuple[ExperimentSetup, ...]:
    """Build the tests of a case with the records that it is fitted to.

    Raises CaseError without any, and where their fit needs more memory than it may take.
    """
    from exfit.fitting.memory import check_memory

    values, setups = case.values() if start is None else start, list[ExperimentSetup]()
    for recording in recordings_to_fit(case):
        setups.append(build_experiment(case, recording, values))
        check_memory(case, [setup.experiment for setup in setups])
    return tuple(setups)


def recordings_to_fit(case: Case) -> Sequence[Recording]:
    """Return the recordings that a case is fitted to; raises CaseError without any."""
    if not case.recordings:
        raise CaseError(f"{case.path}: record: missing; a fit needs a record")
    return case.recordings


def build_unseen(
    case: Case,
    recordings: Iterable[Recording],
    values: Values,
    fitted: Iterable[ExperimentSetup] = (),
) -> tuple[ExperimentSetup, ...]:
    """Build the experiments of records that are compared and not fitted, beside those ``fitted``.

    Raises CaseError where they need more memory together than a command may take.
    """
    from exfit.fitting.memory import check_memory

    setups, beside = list[ExperimentSetup](), [setup.experiment for setup in fitted]
    for recording in recordings:
        setups.append(build_experiment(case, recording, values))
        check_memory(case, beside, [setup.experiment for setup in setups])
    return tuple(setups)


def build_experiment(case: Case, recording: Recording, values: Values) -> ExperimentSetup:
    """Read the record of a test of a case and build its experiment, which begins with ``values``.

    Raises RecordError where the record cannot be used, CaseError where a signal is not simulated.
    """
    view, file = case.seen_from(recording), recording.record
    kind, system = view.kind, system_of(view, recording)
    driven = (*system.inputs, *kind.required_one_of)  # some in another form
    driving = [signal for signal in file.channels if signal in driven]
    whole, record, switchings = _records(case, recording, driving, kind.finds_rest)
    test, references, files = _as_recorded(case, recording, record, kind.finds_rest)
    network = {} if view is case else _network_values(view)
    at = {**values, **network}
    inputs, found = _moved(view, recording, test, record, driving, switchings, references, at)
    simulator = _simulator(case, system, inputs, record.time)
    delay = start_value(file.delay)
    compared = {*system.outputs}.difference(driving)
    experiment = Experiment(
        simulator.with_inputs(inputs.steps, delay) if delay else simulator,
        tuple(channel_of(case, file, record, name) for name in file.channels if name in compared),
        {**network, **levels_of(case, test, record)},
        tuple(nuisance for nuisance, _ in found),
        recording.name,
    )
    setup = ExperimentSetup(
        case.path,
        test,
        record,
        experiment,
        tuple(free for _, free in found),
        files,
        tuple(name for name in kind.driving if name in driving) if kind.plays_back else (),
        switchings=() if file.switchings == "compare" else switchings,
        whole=whole,
    )
    if any(file.channels[channel.signal].sine is not None for channel in setup.channels):
        from exfit.fitting.sines import with_sines

        setup = with_sines(case, file, setup, values)
    return _with_given_starts(case, setup)


def _network_values(view: Case) -> dict[str, float]:
    """Return the values of the network that a record has in place of the case's."""
    return {name: value for name, value in view.values().items() if name.startswith(NETWORK)}


def _records(
    case: Case, recording: Recording, driving: Sequence[str], of_event: bool
) -> tuple[Record, Record, tuple[Switching, ...]]:
    """Read a record, filtered: whole, without what is masked, the switchings of an event."""
    record, file, switchings = record_of(case, recording), recording.record, tuple[Switching, ...]()
    if of_event:
        from exfit.fitting.event import switchings_of, with_even_clock

        whole = with_filter(with_even_clock(record), file.filter)
        switchings = switchings_of(whole)
    else:
        whole = with_filter(record, file.filter)
    mask = (*file.mask, *filtered_end(file, whole))
    if file.switchings != "compare":
        mask = (*mask, *(switching.masked for switching in switchings))
    return whole, without_masked(whole, mask, driving), switchings


def _as_recorded(
    case: Case, recording: Recording, record: Record, of_event: bool
) -> tuple[BumpTest, Mapping[str, RecordedInput], Mapping[str, Record]]:
    """Return a test with all that its record shows of it, its recorded references, their files."""
    test, file = recording.test, recording.record
    references, files = dict[str, RecordedInput](), dict[str, Record]()
    if test.files or any(test.reference(signal) == "recorded" for signal in REFERENCES):
        from exfit.fitting.recorded_steps import references_of

        test, references, files = references_of(case, test, span_of(test, record), record, file)
    events = [event for signal in REFERENCES for event in test.events(signal)]
    sought = [test.vt0, test.breaker, file.delay, *(event.at for event in events)]
    sought += [event.step for event in events]
    delay = start_value(file.delay)
    if not all(isinstance(each, float | None) for each in sought) or (delay or 0.0) < 0.0:
        from exfit.fitting.recorded_steps import with_detected_steps

        place = f"{case.path}: {prefix_from(recording.name)}test"
        test = with_detected_steps(place, test, file, record)
    if of_event:
        from exfit.fitting.event import with_rest

        test = with_rest(test, record)
    return test, references, files


def _driving(
    case: Case,
    test: BumpTest,
    record: Record,
    file: RecordFile,
    driving: Sequence[str],
    switchings: Sequence[Switching],
) -> dict[str, RecordedInput | SplinedInput]:
    """Return recorded signals that drive a simulation; a found scale is divided by its start."""
    inputs: dict[str, RecordedInput | SplinedInput] = {}
    if case.kind.finds_rest:
        driving = [signal for signal in driving if signal in REFERENCES]
    elif not case.kind.plays_back:
        driving = [signal for signal in driving if signal not in REFERENCES]
    for signal in driving:
        scale = getattr(file.channels[signal], "scale", 1.0)
        start = start_value(scale) if isinstance(scale, Unknown) else None
        moved = deviation(test, record, signal) / (1.0 if start is None else start)
        inputs[signal] = RecordedInput(record.time, moved)
    if case.kind.finds_rest:
        from exfit.fitting.event import event_inputs

        inputs |= event_inputs(test, record, switchings)
    return inputs


def _moved(
    case: Case,
    recording: Recording,
    test: BumpTest,
    record: Record,
    driving: Sequence[str],
    switchings: Sequence[Switching],
    references: Mapping[str, RecordedInput],
    values: Values,
) -> tuple[Inputs, list[Found]]:
    """Return what moves the unit in a test, and what a fit finds about its record."""
    file, prefix = recording.record, prefix_from(recording.name)
    begin, end = span_of(test, record)
    steps, found = input_steps(case, test, values), list[Found]()
    played = _driving(case, test, record, file, driving, switchings)
    if file.switchings == "find" and switchings:
        from exfit.fitting.event import switchings_as_steps

        played, switched, found = switchings_as_steps(played, switchings, prefix, len(steps))
        steps += switched
    offset = start_value(test.frequency_offset)
    if offset is not None:
        length = end - begin
        steps.append(InputStep(begin, offset * TURN * length, "angle", ramp=length))
    steps += speed_steps(test, begin, end)
    scaled = case.kind.scaled
    found = [*nuisances_of(prefix, test, file, steps, not references, scaled), *found]
    if any(nuisance.kind == "shift" for nuisance, _ in found):
        steps = [step._replace(smooth=False) for step in steps]
    delays = (free for nuisance, free in found if nuisance.kind in ("delay", "shift"))
    earlier = sum(free.start - free.low for free in delays)  # that a fit may read it
    end += max(0.0, earlier - (start_value(file.delay) or 0.0))
    return Inputs(begin, end, tuple(steps), {**played, **references}), found


def _with_given_starts(case: Case, setup: ExperimentSetup) -> ExperimentSetup:
    """Return what is found about a record with given starts; CaseError for one out of bounds."""
    free = []
    for own in setup.free:
        given = case.given_values.get(own.name)
        if given is not None and not own.low <= given.value <= own.high:
            limits = f"{own.low:g} ... {own.high:g}"
            text = f"{own.name}: {given.value:g} lies outside its bounds {limits} in {case.path}"
            raise CaseError(f"{given.source}: {text}")
        free.append(own if given is None else replace(own, start=given.value))
    return replace(setup, free=tuple(free))


def input_steps(case: Case, test: BumpTest, values: Values) -> list[InputStep]:
    """List the changes that a test makes, in the order of time.

    ``values`` are those of the network at the start. Raises CaseError where the source would lose
    its voltage.
    """
    steps = list[InputStep]()
    for signal in REFERENCES:
        for change in test.events(signal):
            at, size = start_value(change.at) or 0.0, start_value(change.step) or 0.0
            smooth = isinstance(change.at, Unknown)
            steps.append(InputStep(at, size, signal, smooth, change.ramp or 0.0))
    for turn in test.angle_steps:
        steps.append(InputStep(turn.at, turn.radians, "angle", ramp=turn.ramp or 0.0))
    for fault in test.fault:
        for name, size in zip(FAULT, fault.admittance, strict=True):
            if size != 0.0:
                steps += [InputStep(fault.at, size, name), InputStep(fault.cleared, -size, name)]
    if test.breaker is not None:
        opens = test.breaker.opens
        steps.append(InputStep(start_value(opens) or 0.0, 1.0, BREAKER, isinstance(opens, Unknown)))
    steps += _network_steps(case, test, values)
    return sorted(steps, key=lambda step: step.at)


def _network_steps(case: Case, test: BumpTest, values: Values) -> Iterator[InputStep]:
    """Yield the changes of R, X, E and a load; a switch sets a value from then on."""
    now = {name: values.get(NETWORK + name) for name in SWITCHED}
    events: list[StepSection | Switch] = [*test.E, *test.network]
    for event in sorted(events, key=lambda event: event.at):
        for name, level in now.items():
            if isinstance(event, StepSection):
                step = event.step if name == "E" else None
            else:
                then = getattr(event, name)
                step = None if then is None or level is None else then - level
            if step is not None:
                yield InputStep(event.at, step, name)
                now[name] = None if level is None else level + step
        if now["E"] is not None and now["E"] <= 0.0:
            text = f"at {event.at:g} s the source falls to {now['E']:g} pu; it must stay above 0"
            raise CaseError(f"{case.path}: test: {text}")


def speed_steps(test: BumpTest, begin: float, end: float) -> list[InputStep]:
    """List the even change of the speed between two instants (s), none where it holds."""
    change = start_value(test.speed_change)
    return [] if change is None else [InputStep(begin, change, SPEED, ramp=end - begin)]


def plain_simulator(case: Case, values: Values) -> tuple[Simulator, dict[str, float]]:
    """Return the simulator and the initial levels of a case without a record.

    Raises CaseError where the case does not say how long and from which voltage.
    """
    test = case.test or BumpTest()
    vt0, duration = start_value(test.vt0), test.duration
    missing = [name for name in ("vt0", "duration") if getattr(test, name) is None]
    if vt0 is None or duration is None:
        raise CaseError(
            f"{case.path}: test.{name}: missing; there is no record to take it from"
            for name in missing
        )
    count = max(1.0, duration / case.simulation.output_step)
    if count > MOST_SAMPLES:
        raise CaseError(
            f"{case.path}: simulation.output_step: {case.simulation.output_step:g} s divides "
            f"the duration of {duration:g} s into more than {MOST_SAMPLES:.0e} samples"
        )
    times = np.linspace(0.0, duration, round(count) + 1)
    recorded: Mapping[str, RecordedInput] = {}
    if test.files:
        from exfit.fitting.recorded_steps import references_of

        test, recorded, _ = references_of(case, test, (0.0, duration))
    steps = (*input_steps(case, test, values), *speed_steps(test, 0.0, duration))
    inputs, levels = Inputs(0.0, duration, steps, recorded), {VT0: vt0, **speed_at_start(test)}
    return _simulator(case, system_of(case), inputs, times), levels


def _simulator(case: Case, system: System, inputs: Inputs, times: Array) -> Simulator:
    """Simulator on the grid that a case gives, or the first one that is tried for its accuracy."""
    given = case.simulation
    try:
        of_case = partial(Simulator, system, inputs, times, memory=given.memory)
        if given.step != "auto":
            return of_case(given.step)
        if case.external is not None:  # another program has a step of its own
            return of_case(TWIN_STEP)
        return of_case(LARGEST_STEP, located=True, accuracy=given.accuracy)
    except SimulationError as fault:
        raise CaseError(f"{case.path}: {fault}") from None


def planned(case: Case, signals: Sequence[str] = ("vt",)) -> Experiment:
    """Return the test of a case without a record, of which some signals are recorded."""
    values = case.values()
    simulator, levels = plain_simulator(case, values)
    simulator = with_enough_substeps(simulator, {**values, **levels}, case.path)
    still = np.zeros(len(simulator.times))
    channels = tuple(Channel(signal, still) for signal in signals)
    return Experiment(simulator, channels, levels)
