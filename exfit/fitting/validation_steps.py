"""The test of a record that its case does not describe: its steps, as the record shows them."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from exfit.case.case import Case
from exfit.case.schema import (
    BumpTest,
    ChannelSection,
    FindableStep,
    RecordFile,
    Recording,
    Unknown,
    start_value,
)
from exfit.dsp.quality import noise_of
from exfit.errors import CaseError, RecordError
from exfit.fitting.build import build_experiment
from exfit.fitting.experiment import ExperimentSetup, Values
from exfit.fitting.recordings import clock_of, read_section
from exfit.plants import REFERENCES
from exfit.records.formats import open_table
from exfit.records.inspection import Inspection, inspect
from exfit.records.record import Record
from exfit.records.steps import (
    INSTANT_WITHIN,
    RecordedStep,
    bounds_about,
    steps_of_record,
    with_sizes,
)
from exfit.util.arrays import Array
from exfit.util.text import show

Test = Mapping[str, Any]  # keys of a test with what they become

OWN_REFERENCE = "the reference is the one recorded beside the response"
EARLIER_STEPS = "the steps before the record are those of the case under validate"
GIVE_STEP = "give it by --step SIZE and --at TIME (step and at in Python)"
REST_SHARE = 0.5  # of the rest before a step: its instant is not sought farther back
FIRST_SAMPLE_WITHIN = 8.0  # times the noise: how far a level may be from one sample
SAME_LEVEL = 0.1  # of the largest step: how far a record may begin from where earlier steps led


class GivenSteps(NamedTuple):
    """The sizes (pu) and instants (s) of steps that a user gives; empty: the record shows them."""

    sizes: tuple[float, ...] = ()
    instants: tuple[float, ...] = ()


class SetupOfRecord(NamedTuple):
    """A record with its test, and what must be known of where that is from."""

    setup: ExperimentSetup
    notes: tuple[str, ...] = ()


def with_steps_of_record(
    case: Case, recording: Recording, values: Values, given: GivenSteps
) -> SetupOfRecord:
    """Return the setup of a record whose steps are those that it shows, or that are ``given``.

    The test of the ``recording`` is that of another record of its kind: it says which signal is
    stepped. A reference that the file holds is taken as it is, in place of steps. The size of a
    step starts from the change of vt and the gain of the simulation; it and the instant are left to
    be found within bounds. Raises RecordError where the record shows no step, CaseError where the
    steps given cannot be used.
    """

    def built(recording: Recording, test: Test, *notes: str) -> SetupOfRecord:
        changed = recording.test.model_copy(update=test)
        other = recording.model_copy(update={"test": changed})
        return SetupOfRecord(build_experiment(case, other, values), notes)

    given_record, file = case.given_records.get(recording.name), recording.record
    record = given_record or read_section(file, case.folder, case.kind.per_unit)
    anew: Test = dict.fromkeys(("vt0", "begin", "steady_until"))
    if case.kind.finds_rest:  # it has a rest, no steps
        if any(given):
            text = f"step and at: not allowed with plant {case.kind.name}: the record drives it"
            raise CaseError(f"{case.path}: {text}")
        return built(recording, {**anew, "vref": (), "vs": ()})
    signal = _stepped(case, recording.test)
    inspection = None if given_record else _inspected(file, case.folder)
    if signal == "vref" and not any(given) and not case.kind.plays_back:
        recording = _with_own_reference(recording, inspection)
        if recording.test.vref == "recorded":
            return built(recording, anew, OWN_REFERENCE)
    steps = _lasting(record, _shown(record, inspection, given), given)
    if signal is None:
        return built(recording, {"steady_until": _earliest(record, steps, 0), "vt0": None})

    def setup_with(sizes: Sequence[float], earlier: Test, *notes: str) -> SetupOfRecord:
        events = tuple(_events(record, steps, sizes, given))
        test = {**_start(record, steps), **earlier, signal: (*earlier.get(signal, ()), *events)}
        return built(recording, test, *notes)

    sizes = _sizes(record, steps, given)
    if not given.sizes:
        simulated = setup_with(sizes, {}).setup.response(values).signals.get("vt")
        if simulated is not None:  # else it drives
            sizes = _through_gain(record, steps, sizes, simulated)
    earlier = _earlier(recording.test, signal, record)
    if earlier:
        test = setup_with(sizes, earlier, EARLIER_STEPS)
        if _begins_there(test.setup, values, steps[0], sizes):
            return test
    return setup_with(sizes, {})


def _stepped(case: Case, test: BumpTest) -> str | None:
    """Name the signal that is stepped, None with a plant whose tests have no steps.

    Raises CaseError where the test of the case changes the network, or opens the breaker.
    """
    if test.E or test.angle or test.network or test.fault or test.breaker:
        text = (
            "changes the network or opens the breaker: the steps of a record by hand are those of "
            "vref, vs, pref or fs"
        )
        raise CaseError(f"{case.path}: test: {text}; give the record under validate")
    if not case.kind.events:
        return None
    return next((signal for signal in REFERENCES if test.reference(signal)), "vref")


# ---- the steps


def _inspected(file: RecordFile, folder: Path) -> Inspection:
    """Inspect all channels of a file: more than those that the case names."""
    clock = clock_of(file.time)
    table = open_table(folder / file.file, file.sheet, file.memory)
    return inspect(table, clock.columns, clock.unit)


def _with_own_reference(recording: Recording, inspection: Inspection | None) -> Recording:
    """Return a recording with the reference that its file holds per unit, if it holds one."""
    reference = None if inspection is None else inspection.reference
    if reference is None or not reference.seems_per_unit or recording.test.vref == "recorded":
        return recording
    channels = {**recording.record.channels, "vref": ChannelSection(column=reference.name)}
    test = recording.test.model_copy(update={"vref": "recorded"})
    file = recording.record.model_copy(update={"channels": channels})
    return recording.model_copy(update={"test": test, "record": file})


def _shown(
    record: Record, inspection: Inspection | None, given: GivenSteps
) -> tuple[RecordedStep, ...]:
    """Return the steps at the instants given, or those that a file or else a record shows."""
    if given.instants:
        first, last = float(record.time[0]), float(record.time[-1])
        for at in given.instants:
            if not first <= at < last:
                span = f"{record.source}, {show(first)} ... {show(last)} s"
                raise CaseError(f"at: {show(at)} s lies outside {span}")
        for before, at in pairwise(given.instants):
            if at <= before:
                text = f"{show(at)} s is not after {show(before)} s, the step before"
                raise CaseError(f"at: {text}")
        return tuple(RecordedStep(at, 0.0, (), {}, False) for at in given.instants)
    if inspection is not None:
        return inspection.steps
    return steps_of_record(record.time, record.signals).steps


def _lasting(
    record: Record, steps: tuple[RecordedStep, ...], given: GivenSteps
) -> tuple[RecordedStep, ...]:
    """Return the steps that change vt for good, all where they are given; RecordError for none."""
    if not steps:
        raise RecordError(f"{record.source}: no step found in its channels; {GIVE_STEP}")
    noises = {name: noise_of(y[np.isfinite(y)]) for name, y in record.signals.items()}
    sized = with_sizes(steps, record.signals.items(), noises, record.time)
    if given.instants or given.sizes:
        return sized
    lasting = tuple(step for step in sized if "vt" in step.sizes)
    if not lasting:
        at = ", ".join(f"{step.at:.4g}" for step in sized)
        text = f"the step at {at} s leaves no lasting change of vt to find its size from"
        raise RecordError(f"{record.source}: {text}; {GIVE_STEP}")
    return lasting


def _sizes(record: Record, steps: Sequence[RecordedStep], given: GivenSteps) -> tuple[float, ...]:
    """Sizes given, else those of vt; CaseError for another count, RecordError if none."""
    if given.sizes:
        if len(given.sizes) != len(steps):
            instants = ", ".join(f"{step.at:.4g}" for step in steps)
            number = f"{len(steps)} step{'s' if len(steps) > 1 else ''}"
            text = f"{len(given.sizes)} given for {number}, at {instants} s: give one for each"
            raise CaseError(f"step: {text}")
        return given.sizes
    for step in steps:
        if "vt" not in step.sizes:
            text = f"no lasting change of vt at {step.at:.4g} s"
            raise RecordError(f"{record.source}: {text}; {GIVE_STEP}")
    return tuple(step.sizes["vt"] for step in steps)


def _through_gain(
    record: Record, steps: Sequence[RecordedStep], sizes: Sequence[float], simulated: Array
) -> tuple[float, ...]:
    """Divide sizes of steps by the gain of the simulated vt (M,), where that moves the same way."""
    through = []
    changes = with_sizes(steps, [("vt", simulated)], {}, record.time)
    for size, change in zip(sizes, changes, strict=True):
        gain = change.sizes.get("vt", 0.0) / size
        through.append(size / gain if gain > 0.0 and isfinite(size / gain) else size)
    return tuple(through)


def _events(
    record: Record, steps: Sequence[RecordedStep], sizes: Sequence[float], given: GivenSteps
) -> Iterator[FindableStep]:
    """Yield the steps of a test: numbers where they are given, else with bounds."""
    last = float(record.time[-1])
    ends = [*(_earliest(record, steps, k) for k in range(1, len(steps))), last]
    for k, (step, size, end) in enumerate(zip(steps, sizes, ends, strict=True)):
        at: float | Unknown = step.at
        if not given.instants and not step.from_start:
            # one that is sought farther off would hide a response that is late
            low = max(step.at - step.error, _earliest(record, steps, k))
            at = Unknown(start=step.at, min=low, max=min(step.at + step.error, end))
        low, high = bounds_about(size)
        found = Unknown(start=size, min=low, max=high)
        yield FindableStep(at=at, step=size if given.sizes else found)


def _earliest(record: Record, steps: Sequence[RecordedStep], k: int) -> float:
    """Return the earliest instant of a step, s: until then the record is at rest."""
    before = steps[k - 1].at if k else float(record.time[0])
    return steps[k].at - min(INSTANT_WITHIN, REST_SHARE * (steps[k].at - before))


# ---- where the record begins


def _start(record: Record, steps: Sequence[RecordedStep]) -> Test:
    """Keys of a test that say where it starts: at rest, at the level of the record."""
    test: dict[str, Any] = dict.fromkeys(("vt0", "begin", "duration", "steady_until"))
    test |= dict.fromkeys(REFERENCES, ())
    vt = record.signals.get("vt")
    if vt is None or not steps[0].from_start:
        return {**test, "steady_until": _earliest(record, steps, 0)}
    vt = vt[np.isfinite(vt)]
    level, within = float(vt[0]), FIRST_SAMPLE_WITHIN * noise_of(vt)
    sought = Unknown(start=level, min=level - within, max=level + within)
    return {**test, "vt0": sought if within > 0.0 else level}


def _earlier(test: BumpTest, signal: str, record: Record) -> Test:
    """Keys of a test for the steps before a record, as the case gives them; {} for none."""
    steps = tuple(
        event
        for event in test.events(signal)
        if (at := start_value(event.at)) is not None and at < record.time[0]
    )
    if test.begin is None or not steps:
        return {}
    return {"begin": test.begin, "vt0": test.vt0, "steady_until": None, signal: steps}


def _begins_there(
    setup: ExperimentSetup, values: Values, first: RecordedStep, sizes: Sequence[float]
) -> bool:
    """Test whether a record begins where the steps before it have led the simulation."""
    vt = setup.record.signals.get("vt")
    if vt is None:
        return True
    rest = (setup.record.time < first.at) & np.isfinite(vt)
    simulated = setup.response(values).signals["vt"]
    off = abs(float(np.mean(vt[rest]) - np.mean(simulated[rest])))
    return off < SAME_LEVEL * max(map(abs, sizes))
