"""A simulated response beside its record."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.features import Features, RemovedLine, features
from exfit.dsp.recorded_features import FoundByRecord, RecordedResponse, recorded_features
from exfit.fitting.experiment import Channel
from exfit.fitting.setup import ExperimentSetup, compared
from exfit.results.comparisons import (
    Comparison,
    Overlay,
    StepFeatures,
    match_of,
)
from exfit.results.played_records import (
    LeftOut,
    PlayedRecord,
    driving_signals,
    left_out_of,
    played_errors,
)
from exfit.simulation.inputs import Inputs, InputStep
from exfit.simulation.limit_hits import limiter_actions

Array = NDArray[np.float64]
Values = Mapping[str, float]

SMALL = 1e-6  # of a move: the instant of a step is linear in what moves it


def compare_with_record(
    setup: ExperimentSetup,
    name: str,
    values: Values,
    start: Values | None = None,
    of_record: Values | None = None,
    moves: Sequence[Values] | None = None,
) -> Comparison:
    """Return the response to the values, and to the ``start`` values, beside the record.

    The setup has sub-steps enough for both; ``of_record`` is what was found about the record
    itself. ``moves`` are what was found by the record: which values each moves, and how fast; by
    default what was found about it. The comparison is not judged.
    """
    at = setup.with_start_values(values)
    samples, substeps = setup.experiment.samples(at)
    first = None if start is None else setup.experiment.samples(setup.with_start_values(start))[0]
    overlays = {
        channel.signal: Overlay(
            compared(channel, setup.experiment.measured(channel, at)),
            compared(channel, samples[:, k]),
            None if first is None else compared(channel, first[:, k]),
            _reference(setup, at, samples[0, k]) if channel.signal == "vt" else None,
        )
        for k, channel in enumerate(setup.channels)
    }
    errors = setup.experiment.compared(samples, at)
    channels = {signal: match_of(overlay) for signal, overlay in overlays.items()}
    if moves is None:
        moves = [{parameter.name: 1.0} for parameter in setup.free]
    return Comparison(
        name=name,
        record=setup.record.source.name,
        cost=0.5 * float(errors @ errors),
        accepted=True,
        channels=channels,
        features=_step_features(setup, overlays, samples, at, moves),
        notes=setup.record.notes,
        of_record={} if of_record is None else of_record,
        sha256=setup.record.sha256,
        substeps=substeps,
        time=setup.record.time,
        overlays=overlays,
        played=_played(setup, overlays, samples) if setup.driving else None,
        limiters=limiter_actions(setup.experiment.with_inputs(at), setup.experiment.parameters(at)),
    )


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
    left_out = dict(_left_out(setup, samples))
    return PlayedRecord(begins, driving_signals(time, begins, recorded), errors, left_out)


def _left_out(setup: ExperimentSetup, samples: Array) -> Iterator[tuple[str, LeftOut]]:
    """Yield the signals of which masks leave something out, with that."""
    for k, channel in enumerate(setup.channels):
        if setup.whole is not None:
            whole = setup.whole.signals[channel.signal]
            left_out = left_out_of(whole, setup.record.signals[channel.signal], samples[:, k])
            if left_out is not None:
                yield channel.signal, left_out


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
) -> StepFeatures:
    """Return the features of vt without its periodic disturbances, in the record and simulated.

    ``samples`` (M, channels) are the simulated ones.
    """
    vt = overlays.get("vt")
    if vt is None:
        return StepFeatures(None, None)
    k = list(overlays).index("vt")
    channel = setup.channels[k]
    alone = samples[:, k] - setup.experiment.disturbances(values)[:, k]
    simulated = compared(channel, alone)
    measured = vt.measured - (vt.simulated - simulated)
    return StepFeatures(
        _measured_features(setup, channel, Overlay(measured, simulated), values, moves),
        _simulated_features(setup, simulated, values),
    )


def _measured_features(
    setup: ExperimentSetup, channel: Channel, vt: Overlay, values: Values, moves: Sequence[Values]
) -> Features | None:
    """Return the features of the record, with the error that its noise leaves them."""
    kept = np.isfinite(vt.measured) & np.isfinite(vt.simulated)
    time = setup.record.time[kept]
    window = _first_move(setup, time, values)
    if window is None:
        return None
    found = _found_by_record(setup, channel, time, values, moves)
    response = RecordedResponse(time, vt.measured[kept], vt.simulated[kept], *window, found)
    measured = recorded_features(response)
    if measured is None:
        return None
    removed = (
        RemovedLine(sine.frequency_at(values), sine.amplitude_at(values))
        for sine in setup.experiment.sines
        if sine.signal == channel.signal
    )
    return replace(measured, without=(*removed, *measured.without))


def _found_by_record(
    setup: ExperimentSetup, channel: Channel, time: Array, values: Values, moves: Sequence[Values]
) -> FoundByRecord | None:
    """Compute the dependence of the response on what the record gave; None on nothing."""
    if not moves:
        return None
    curve, errors = setup.experiment.undisturbed_slopes(channel.signal, values, moves)
    instants = [_first_move(setup, time, values)] + [
        _first_move(setup, time, {**values, **{n: values[n] + SMALL * d for n, d in move.items()}})
        for move in moves
    ]
    at = np.array([np.nan if window is None else window[0] for window in instants])
    found = FoundByRecord(curve, errors, (at[1:] - at[0]) / SMALL)
    return found if all(np.isfinite(each).all() for each in vars(found).values()) else None


def _simulated_features(
    setup: ExperimentSetup, simulated: Array, values: Values
) -> Features | None:
    """Return the features of the response."""
    kept = np.isfinite(simulated)
    time = setup.record.time[kept]
    window = _first_move(setup, time, values)
    return None if window is None else features(time, simulated[kept], *window)


def _first_move(setup: ExperimentSetup, time: Array, values: Values) -> tuple[float, float] | None:
    """Find the instants between which the reference stays after its first move, s."""
    inside = [change for change in _changes(setup, values) if change.at >= time[0]]
    if not inside or inside[0].signal != "vref":
        return None
    first = Inputs(float(time[0]), float(time[-1]), tuple(inside)).moves("vref")[0]
    later = [change.at for change in inside if change.at > first.end]
    return inside[0].at, later[0] if later else float(time[-1])


def _changes(setup: ExperimentSetup, values: Values) -> list[InputStep]:
    """List the changes of a test, as the recorder shows them, in the order of time.

    A recorded reference may move before it jumps, from the end of the steady part on.
    """
    simulator = setup.experiment.with_inputs(values)
    steps = [step._replace(at=step.at + simulator.delay) for step in simulator.inputs.steps]
    steady = setup.test.steady
    if "vref" in simulator.inputs.recorded and steady is not None:
        first = steps[0].at if steps else float(setup.record.time[-1])
        return [InputStep(steady, 0.0), *steps] if steady < first else steps
    return steps
