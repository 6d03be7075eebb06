"""Tests of the residuals of every channel of a fit."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.fitting.channels import noise_shape
from exfit.fitting.experiment import Channel
from exfit.fitting.propagated_noise import carried_noise
from exfit.fitting.residuals import LEAST_NOISE, scatter_of
from exfit.inference.noise import whiteness
from exfit.results.comparisons import Overlay
from exfit.results.verdict import ResidualTests
from exfit.verdict.causes import Evidence, FittedRecord
from exfit.verdict.residual_noise import (
    Scatter,
    excess,
    largest_deviation,
    moving_median,
    rest_scatter,
    sample_scatter,
    step_pattern,
    white_scatter,
    with_carried,
)

Array = NDArray[np.float64]
Values = Mapping[str, float]


def residual_tests(evidence: Evidence) -> tuple[ResidualTests, ...]:
    """Return the tests of each channel of each record; none where there is no uncertainty.

    A robust loss counts errors as the fit does: what it takes for spikes does not decide.
    """
    if evidence.uncertainty is None:
        return ()
    return tuple(_tests(evidence))


def _tests(evidence: Evidence) -> Iterator[ResidualTests]:
    residuals, values = evidence.residuals, evidence.values
    errors = [_errors(record) for record in evidence.records]
    influence, _ = residuals.influence(np.concatenate(errors))
    each = iter(np.split(influence, np.cumsum(residuals.sizes)[:-1]))
    noises = iter(evidence.uncertainty.confidence.noise if evidence.uncertainty else ())
    for record in evidence.records:
        instants = _step_instants(record, values)
        for channel, (size, scatter) in zip(
            record.setup.channels, _sizes(record, values), strict=True
        ):
            rmse = next(noises).estimated * size
            yield _tests_of(record, channel, next(each) * size, rmse, scatter, instants)


def _sizes(record: FittedRecord, values: Values) -> Iterator[tuple[float, list[Scatter]]]:
    """Yield how much of a weighted error is one of each channel, pu, and the channel's scatter.

    That of white errors is what they were before, whose size their noise foretells.
    """
    experiment, first = record.setup.experiment, 0
    whitening = experiment.whitening
    carried = carried_noise(record.setup, values) if whitening is None else []
    for k, channel in enumerate(experiment.channels):
        if whitening is None:
            own = _scatter(record, channel, values, carried[k] if carried else None)
            yield 1.0 / channel.weight, own
        else:
            before = whitening.deviations[first : first + channel.size] / channel.weight
            std = float(np.sqrt(np.mean(before**2)))
            yield std / whitening.scale, [white_scatter(std, channel.samples)]
        first += channel.size


def _errors(record: FittedRecord) -> Array:
    """Return the weighted errors of all channels of a record, white where the fit makes them so."""
    experiment = record.setup.experiment
    errors = [
        channel.weight * _compared(record.comparison.overlays[channel.signal].error)
        for channel in experiment.channels
    ]
    together = np.concatenate(errors)
    return (
        together if experiment.whitening is None else experiment.whitening.errors(together[None])[0]
    )


def _scatter(
    record: FittedRecord, channel: Channel, values: Values, carried: Array | None
) -> list[Scatter]:
    """Return the scatter of a channel's record as the fit scales it, as far as it is known."""
    shape = noise_shape(channel)
    samples = max(1, channel.samples // shape.apart)
    measured = record.setup.experiment.measured(channel, values)
    own = scatter_of(replace(channel, measured=measured)) * shape.gain
    at_rest = rest_scatter(_at_rest(record, channel.signal), samples)
    scatter = [sample_scatter(own, samples), *([] if at_rest is None else [at_rest])]
    return scatter if carried is None else [with_carried(each, carried) for each in scatter]


def _tests_of(
    record: FittedRecord,
    channel: Channel,
    errors: Array,
    rmse: float,
    scatter: Sequence[Scatter],
    instants: Sequence[float],
) -> ResidualTests:
    """Return the tests of a channel, whose steps are at ``instants`` (s).

    ``errors`` (M,) are as the loss counts them. What deviates for long is none that a loss bears.
    """
    comparison, name = record.comparison, record.comparison.name
    overlay, largest = comparison.overlays[channel.signal], max(each.std for each in scatter)
    if not rmse > LEAST_NOISE:
        return ResidualTests(
            name, channel.signal, None, None, 1.0, largest, rmse / largest, 0.0, 0.0
        )
    apart = noise_shape(channel).apart
    steps = np.searchsorted(comparison.time[np.isfinite(overlay.error)][::apart], instants)
    deviation = largest_deviation(_compared(overlay.error), largest)
    return ResidualTests(
        record=name,
        signal=channel.signal,
        whiteness=whiteness(errors[::apart]),
        pattern=step_pattern(errors[::apart], steps.tolist()),
        excess=max(excess(rmse, each) for each in scatter),
        scatter=largest,
        times=rmse / largest,
        deviation=deviation,
        share=deviation / max(_range(overlay), LEAST_NOISE),
        carried=max(each.carried for each in scatter),
    )


def _compared(errors: Array) -> Array:
    """Return the errors that are compared."""
    return errors[np.isfinite(errors)]


def _at_rest(record: FittedRecord, signal: str) -> Array:
    """Return what was measured before the first step, where the record should be at rest."""
    overlay = record.comparison.overlays[signal]
    until = -np.inf if record.steady_until is None else record.steady_until
    return overlay.measured[(record.comparison.time < until) & np.isfinite(overlay.error)]


def _step_instants(record: FittedRecord, values: Values) -> list[float]:
    """Return when (s) the record shows the steps of its test."""
    simulator = record.setup.experiment.with_inputs(values)
    return [step.at + simulator.delay for step in simulator.inputs.steps]


def _range(overlay: Overlay) -> float:
    """Return by how much a signal moves (pu): as simulated, or as measured but for its noise."""
    compared = np.isfinite(overlay.error)
    smooth = moving_median(overlay.measured[compared])
    return float(max(np.ptp(overlay.simulated[compared]), np.ptp(smooth)))
