"""A simulated response beside its record."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, partial
from math import nan, pi

import numpy as np

from exfit.dsp.features import Features, RemovedLine, features
from exfit.dsp.recorded_features import FoundByRecord, RecordedResponse, recorded_features
from exfit.fitting.experiment import Channel, ExperimentSetup, compared
from exfit.results.comparisons import (
    Comparison,
    DrivingSignal,
    Event,
    Excursion,
    LeftOut,
    Overlay,
    PlayedErrors,
    PlayedRecord,
    StepFeatures,
    match_of,
)
from exfit.signals import label_of, unit_of_signal
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.limit_hits import limiter_actions
from exfit.util.arrays import Array
from exfit.util.vocabulary import Criteria

Values = Mapping[str, float]

FREQUENCY, HERTZ = "frequency", "Hz"
FROM_ANGLE = "frequency less rated (Hz)"
SMALL = 1e-6  # of a move: the instant of a step is linear in what moves it


def compare_with_record(
    setup: ExperimentSetup,
    values: Values,
    start: Values | None = None,
    of_record: Values | None = None,
    moves: Sequence[Values] | None = None,
    measured: Features | None = None,
    criteria: Criteria | None = None,
    described: bool = True,
) -> Comparison:
    """Return the response to the values, and to the ``start`` values, beside the record.

    The setup has sub-steps enough for both; ``of_record`` is what was found about the record
    itself, ``moves`` which values each thing found by the record moves, and how fast. ``measured``
    are its features, if known; none are read unless ``described``. ``criteria`` alone judge it.
    """
    at = setup.with_start_values(values)
    samples, substeps = setup.experiment.samples(at)
    first = None if start is None else setup.experiment.samples(setup.with_start_values(start))[0]
    overlays = _overlays(setup, at, samples, first)
    errors = setup.experiment.compared(samples[None], [at])[0]
    channels = {signal: match_of(overlay) for signal, overlay in overlays.items()}
    if moves is None:
        moves = [{parameter.name: 1.0} for parameter in setup.free]
    event = _event(setup, setup.record.time, at)
    stepped = event is not None and event.of_vref
    # an argument left out would be another key
    step_of = cache(partial(_step_features, setup, overlays, samples, at, moves, measured))
    comparison = Comparison(
        name=setup.name,
        record=setup.record.source.name,
        cost=0.5 * float(errors @ errors),
        accepted=True,
        channels=channels,
        features=step_of("vt", None) if stepped and described else StepFeatures(None, None),
        notes=setup.record.notes,
        of_record={} if of_record is None else of_record,
        sha256=setup.record.sha256,
        substeps=substeps,
        step=setup.experiment.simulator.step,
        time=setup.record.time,
        event=event,
        overlays=overlays,
        played=_played(setup, overlays, samples) if setup.driving else None,
        limiters=limiter_actions(*setup.experiment.at(at)),
    )
    if criteria is None:
        return comparison
    from exfit.results.criteria import SignalToJudge, with_criteria

    signals = {
        signal: SignalToJudge(
            setup.record.time,
            overlay.measured,
            overlay.simulated,
            None if event is None else event.at,
            stepped,
            partial(step_of, signal),
        )
        for signal, overlay in overlays.items()
    }
    return with_criteria(comparison, criteria, signals)


def overlays_of(setup: ExperimentSetup, values: Values) -> dict[str, Overlay]:
    """Return the response to the values beside the record, signal by signal, and nothing else."""
    at = setup.with_start_values(values)
    return _overlays(setup, at, setup.experiment.samples(at)[0])


def _overlays(
    setup: ExperimentSetup, at: Values, samples: Array, first: Array | None = None
) -> dict[str, Overlay]:
    """Lay samples (M, channels), and those of the start values, over what was measured."""
    return {
        channel.signal: Overlay(
            compared(channel, setup.experiment.measured(channel, at)),
            compared(channel, samples[:, k]),
            None if first is None else compared(channel, first[:, k]),
            _reference(setup, at, samples[0, k]) if channel.signal == "vt" else None,
        )
        for k, channel in enumerate(setup.channels)
    }


def _played(
    setup: ExperimentSetup, overlays: Mapping[str, Overlay], samples: Array
) -> PlayedRecord:
    """Collect what drove a simulation, and the errors of its samples (M, channels)."""
    time, steady = setup.record.time, setup.test.steady
    begins = float(time[0]) if steady is None else steady
    recorded = {signal: setup.record.signals[signal] for signal in setup.driving}
    errors = {
        signal: played_errors(time, begins, overlay.measured, overlay.simulated)
        for signal, overlay in overlays.items()
    }
    left_out = {}
    if setup.whole is not None:
        for k, signal in enumerate(overlays):
            whole, kept = setup.whole.signals[signal], setup.record.signals[signal]
            masked = left_out_of(whole, kept, samples[:, k])
            if masked is not None:
                left_out[signal] = masked
    return PlayedRecord(begins, driving_signals(time, begins, recorded), errors, left_out)


def _reference(setup: ExperimentSetup, values: Values, vt0: float) -> Array | None:
    """Sample the reference (M,) from where vt rests; None where it moved by steps."""
    simulator = setup.experiment.with_inputs(values)
    inputs = simulator.inputs
    ramps = any(step.ramp for step in inputs.steps if step.signal == "vref")
    if not ramps and "vref" not in inputs.recorded:
        return None
    return vt0 + simulator.input("vref")


def _step_features(
    setup: ExperimentSetup,
    overlays: Mapping[str, Overlay],
    samples: Array,
    values: Values,
    moves: Sequence[Values],
    read: Features | None,
    signal: str,
    end: float | None,
) -> StepFeatures:
    """Return the features of a signal without its periodic disturbances, after the first event.

    ``samples`` are (M, channels); it ends with the next event, or at most ``end`` s after it.
    Those of vt in the record are ``read`` already where they are given.
    """
    if signal not in overlays:
        return StepFeatures(None, None)
    whole, k = overlays[signal], list(overlays).index(signal)
    channel = setup.channels[k]
    alone = samples[:, k] - setup.experiment.disturbances(values)[:, k]
    simulated = compared(channel, alone)
    kept = np.isfinite(simulated)
    time = setup.record.time[kept]
    event = _event(setup, time, values)
    if event is None:
        return StepFeatures(None, None)
    until = event.until_within(end)
    if read is None or signal != "vt" or end is not None:
        undisturbed = Overlay(whole.measured - (whole.simulated - simulated), simulated)
        read = _measured_features(setup, channel, undisturbed, values, moves, until)
    return StepFeatures(read, features(time, simulated[kept], event.at, until))


def _measured_features(
    setup: ExperimentSetup,
    channel: Channel,
    signal: Overlay,
    values: Values,
    moves: Sequence[Values],
    until: float,
) -> Features | None:
    """Return the features of the record, with the error that its noise leaves them."""
    kept = np.isfinite(signal.measured) & np.isfinite(signal.simulated)
    time = setup.record.time[kept]
    event = _event(setup, time, values)
    if event is None:
        return None
    found = None
    if moves:
        curve, errors = setup.experiment.undisturbed_slopes(channel.signal, values, moves)
        moved = [{**values, **{n: values[n] + SMALL * d for n, d in m.items()}} for m in moves]
        instants = [event, *(_event(setup, time, each) for each in moved)]
        at = np.array([np.nan if instant is None else instant.at for instant in instants])
        found = FoundByRecord(curve, errors, (at[1:] - at[0]) / SMALL)
        if not all(np.isfinite(each).all() for each in found):
            found = None
    both = signal.measured[kept], signal.simulated[kept]
    response = RecordedResponse(time, *both, event.at, until, found)
    measured = recorded_features(response)
    if measured is None:
        return None
    removed = (
        RemovedLine(sine.frequency_at(values), sine.amplitude_at(values))
        for sine in setup.experiment.sines
        if sine.signal == channel.signal
    )
    return replace(measured, without=(*removed, *measured.without))


def _event(setup: ExperimentSetup, time: Array, values: Values) -> Event | None:
    """Find the first disturbance of a record: a move of the reference, or what else changes.

    A recorded reference may move before it jumps, from the end of the steady part on; so may what
    is played in.
    """
    simulator = setup.experiment.with_inputs(values)
    changes = [step._replace(at=step.at + simulator.delay) for step in simulator.inputs.steps]
    steady = setup.test.steady
    jumps = changes[0].at if changes else float(setup.record.time[-1])
    if steady is not None and steady < jumps:
        if "vref" in simulator.inputs.recorded:
            changes = [InputStep(steady, 0.0), *changes]
        elif setup.driving:
            changes = [InputStep(steady, 0.0, setup.driving[0]), *changes]
    inside = [change for change in changes if change.at >= time[0]]
    if not inside:
        return None
    of_vref, end = inside[0].signal == "vref", inside[0].end
    if of_vref:
        end = Inputs(float(time[0]), float(time[-1]), tuple(inside)).moves("vref")[0].end
    later = [change.at for change in inside if change.at > end]
    return Event(inside[0].at, later[0] if later else float(time[-1]), of_vref)


def left_out_of(whole: Array, compared: Array, simulated: Array) -> LeftOut | None:
    """Collect the samples of a recorded signal (M,) that masks leave out, None for nothing.

    A sample of what is compared comes with it on each side, so that lines meet.
    """
    masked = np.isfinite(whole) & ~np.isfinite(compared)
    if not masked.any():
        return None
    wider = masked.copy()
    wider[:-1] |= masked[1:]
    wider[1:] |= masked[:-1]
    return LeftOut(np.where(masked, whole, nan), np.where(wider, simulated, nan))


def driving_signals(
    time: Array, begins: float, recorded: Mapping[str, Array]
) -> dict[str, DrivingSignal]:
    """Return the signals that drive a simulation as figures show them: of an angle its frequency.

    ``time`` (M,) is in s, the ``recorded`` signals (M,) are those of the plant; ``begins`` is the
    end of their rest, s.
    """
    signals = {}
    for signal, samples in recorded.items():
        label, unit, drawn = label_of(signal), unit_of_signal(signal), samples
        if signal == "angle":
            signal, label, unit = FREQUENCY, FROM_ANGLE, HERTZ
            drawn = np.gradient(np.unwrap(samples), time) / (2.0 * pi)
        signals[signal] = DrivingSignal(label, unit, drawn, excursion(time, begins, drawn))
    return signals


def excursion(time: Array, begins: float, samples: Array) -> Excursion | None:
    """Largest departure of a signal (M,) from its mean before ``begins`` (s); None of gaps."""
    rest = _mean_before(time, begins, samples)
    if not np.isfinite(samples).any():
        return None
    departure = samples - (samples[np.isfinite(samples)][0] if np.isnan(rest) else rest)
    k = int(np.nanargmax(np.abs(departure)))
    return Excursion(float(departure[k]), float(time[k]))


def played_errors(time: Array, begins: float, measured: Array, simulated: Array) -> PlayedErrors:
    """Compute the errors of simulated samples (M,); nan is left out of both."""
    error = simulated - measured
    compared = np.isfinite(error)
    if not compared.any():
        return PlayedErrors(nan, nan, nan, None, None)
    k = int(np.nanargmax(np.abs(error)))
    return PlayedErrors(
        largest=float(error[k]),
        largest_at=float(time[k]),
        at_rest=_mean_before(time, begins, error),
        measured=excursion(time, begins, np.where(compared, measured, nan)),
        simulated=excursion(time, begins, np.where(compared, simulated, nan)),
    )


def _mean_before(time: Array, begins: float, samples: Array) -> float:
    """Return the mean of a signal (M,) before an instant (s); nan where it has no sample there."""
    rest = samples[(time < begins) & np.isfinite(samples)]
    return float(np.mean(rest)) if len(rest) else nan
