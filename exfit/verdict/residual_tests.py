"""Tests of the residuals of every channel of a fit."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from math import log, sqrt
from statistics import NormalDist
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from exfit.dsp.noise import MEDIAN_DEVIATION, spread
from exfit.fitting.experiment import Channel
from exfit.fitting.noise import LEAST_NOISE, noise_shape, propagated_noise, scatter_of
from exfit.inference.noise import effective_samples, whiteness
from exfit.inference.quantiles import chi_square_tail
from exfit.results.verdict import ResidualTests
from exfit.util.arrays import Array, median
from exfit.verdict.causes import Evidence, FittedRecord

Values = Mapping[str, float]

# variance of the logarithm of a standard deviation, times the number of samples it is taken from
OF_RMS = 0.5  # (Kendall & Stuart 1977, section 10.9)
OF_SCATTER = 2.0  # by the median of second differences: simulated, for 100 to 5000 samples
OF_FOURTH_DIFFERENCES = 2.8  # by theirs: simulated, for 720 samples
OF_SPREAD = 1.36  # by the median deviation (Rousseeuw & Croux 1993)
FEWEST_AT_REST = 20  # samples from which a record's scatter at rest is taken
MOST_STEPS = 10  # whose patterns are tested
STRETCHES = 50  # of a record: a deviation that lasts as long is seen in a figure of it
FEWEST_IN_STRETCH = 10  # samples
OVERLAPS = 4  # windows that a sample lies in
MEDIAN_ERROR = 1.17  # relative, of the median magnitude of noise, times the root of the samples
RARE = 3.0  # standard errors that the largest of all stretches of noise hardly exceeds


class Scatter(NamedTuple):
    """A standard deviation, the variance of its logarithm, the share that inputs carry."""

    std: float
    log_variance: float
    carried: float = 0.0


def sample_scatter(std: float, samples: int) -> Scatter:
    """Return the scatter from sample to sample, by the median of second differences (`dsp.noise`).

    The residuals are as many ``samples``; so is their own share of the variance here.
    """
    return Scatter(std, (OF_RMS + OF_SCATTER) / samples)


def rest_scatter(at_rest: Array, samples: int) -> Scatter | None:
    """Return the scatter of a record at rest (K,), for residuals of so many ``samples``.

    A straight line is removed: a drift is no scatter. Samples that are alike at rest count as
    fewer, and residuals alike. None where there are too few, or all are equal.
    """
    count = len(at_rest)
    if count < FEWEST_AT_REST:
        return None
    clock = np.linspace(-1.0, 1.0, count)
    level = at_rest - np.mean(at_rest)
    level -= clock * float(clock @ level) / float(clock @ clock)
    std = float(spread(level))
    if std == 0.0:
        return None
    independent = effective_samples(level)
    return Scatter(std, OF_SPREAD / independent + OF_RMS * count / (independent * samples))


def with_carried(scatter: Scatter, carried: Array) -> Scatter:
    """Return a scatter with the noise that recorded inputs carry into the response.

    Given are realisations (K, M) of it; what the residuals hold of it is one more.
    """
    variance = float(np.mean(carried**2))
    total = scatter.std**2 + variance
    if variance == 0.0 or not np.isfinite(variance):
        return scatter
    share = variance / total
    own = (1.0 - share) ** 2 * scatter.log_variance
    independent = float(np.mean([effective_samples(realisation) for realisation in carried]))
    of_carried = share**2 * (1.0 + 1.0 / len(carried)) * OF_RMS / independent
    return Scatter(sqrt(total), own + of_carried, share)


def excess(rmse: float, scatter: Scatter) -> float:
    """Probability that noise of this scatter leaves residuals as large as ``rmse``.

    The logarithm of their ratio is taken as normal.
    """
    if rmse <= 0.0 or scatter.std <= 0.0:
        return float(rmse <= scatter.std)
    return 1.0 - NormalDist().cdf(log(rmse / scatter.std) / sqrt(scatter.log_variance))


def step_pattern(errors: Array, steps: Sequence[int]) -> float | None:
    """Probability that white noise has sums as large as this after its steps.

    From the beginning and from each of the places ``steps`` on, the errors (M,) are divided into
    parts of 1, 2, 4 ... samples. Each part's sum, over the root of its length and the standard
    deviation of all errors, is standard normal; the sum of their squares is chi-square, its
    degrees of freedom as many as the parts. None without errors.
    """
    if not np.any(errors):
        return None
    inside = sorted({step for step in steps if 0 < step < len(errors)})[:MOST_STEPS]
    starts = [
        first + 2**k - 1
        for first, last in pairwise([0, *inside, len(errors)])
        for k in range((last - first).bit_length())
        if first + 2**k - 1 < last
    ]
    sums = np.add.reduceat(errors, starts)
    lengths = np.diff([*starts, len(errors)])
    statistic = float(np.sum(sums**2 / lengths)) / float(np.mean(errors**2))
    return chi_square_tail(statistic, len(starts))


def largest_deviation(errors: Array, scatter: float) -> float:
    """Largest deviation of some fiftieth of a record: median of its errors, noise deducted.

    It is the largest median magnitude in windows of at least ten samples, less (in squares) what
    that of noise of this scatter hardly exceeds. Spikes do not move it.
    """
    largest = float(np.max(moving_median(np.abs(errors))))
    rare = 1.0 + RARE * MEDIAN_ERROR / sqrt(stretch(len(errors)))
    return sqrt(max(largest**2 - (MEDIAN_DEVIATION * scatter * rare) ** 2, 0.0))


def moving_median(samples: Array) -> Array:
    """Return the medians of samples (M,) in windows of a stretch, which overlap."""
    width = stretch(len(samples))
    return np.asarray(median(sliding_window_view(samples, width)[:: max(1, width // OVERLAPS)]))


def stretch(count: int) -> int:
    """Samples, of ``count``, for which a deviation must last to be seen in their figure."""
    return min(max(count // STRETCHES, FEWEST_IN_STRETCH), count)


def residual_tests(evidence: Evidence) -> tuple[ResidualTests, ...]:
    """Test the residuals of each channel of each record; none where there is no uncertainty.

    A robust loss counts errors as the fit does: what it takes for spikes does not decide.
    """
    if evidence.uncertainty is None:
        return ()
    residuals, values, tests = evidence.residuals, evidence.values, list[ResidualTests]()
    errors = [_errors(record) for record in evidence.records]
    influence, _ = residuals.influence(np.concatenate(errors))
    each = iter(np.split(influence, np.cumsum(residuals.sizes)[:-1]))
    noises = iter(evidence.uncertainty.confidence.noise)
    for record in evidence.records:
        simulator = record.setup.experiment.with_inputs(values)
        # the instants (s) of the steps, as the record shows them
        instants = [step.at + simulator.delay for step in simulator.inputs.steps]
        for channel, (size, scatter) in zip(
            record.setup.channels, _sizes(record, values), strict=True
        ):
            rmse = next(noises).estimated * size
            errors_of_one = next(each) * size
            tests.append(_tests_of(record, channel, errors_of_one, rmse, scatter, instants))
    return tuple(tests)


def _errors(record: FittedRecord) -> Array:
    """Return the weighted errors of all channels of a record, white where the fit makes them so."""
    experiment, errors = record.setup.experiment, list[Array]()
    for channel in experiment.channels:
        error = record.comparison.overlays[channel.signal].error
        errors.append(channel.weight * error[np.isfinite(error)])
    whole, whitening = np.concatenate(errors), experiment.whitening
    return whole if whitening is None else whitening.errors(whole[None])[0]


def _sizes(record: FittedRecord, values: Values) -> Iterator[tuple[float, list[Scatter]]]:
    """Yield the factor from a weighted error to one of the channel, pu, and the channel's scatter.

    That of white errors is what they were before, whose size their noise predicts: it is as
    certain as the scatter of the signals that drive, by the median of fourth differences.
    """
    experiment, first = record.setup.experiment, 0
    whitening = experiment.whitening
    carried = propagated_noise(record.setup, values) if whitening is None else []
    for k, channel in enumerate(experiment.channels):
        if whitening is None:
            shape = noise_shape(channel)
            samples = max(1, channel.samples // shape.apart)
            measured = record.setup.experiment.measured(channel, values)
            own = scatter_of(replace(channel, measured=measured)) * shape.gain
            overlay = record.comparison.overlays[channel.signal]
            until = -np.inf if record.steady_until is None else record.steady_until
            resting = (record.comparison.time < until) & np.isfinite(overlay.error)
            at_rest = rest_scatter(overlay.measured[resting], samples)
            scatter = [sample_scatter(own, samples), *([] if at_rest is None else [at_rest])]
            if carried:
                scatter = [with_carried(each, carried[k]) for each in scatter]
            yield 1.0 / channel.weight, scatter
        else:
            before = whitening.deviations[first : first + channel.size] / channel.weight
            std = float(np.sqrt(np.mean(before**2)))
            uncertain = (OF_RMS + OF_FOURTH_DIFFERENCES) / channel.samples
            yield std / whitening.scale, [Scatter(std, uncertain)]
        first += channel.size


def _tests_of(
    record: FittedRecord,
    channel: Channel,
    errors: Array,
    rmse: float,
    scatter: Sequence[Scatter],
    instants: Sequence[float],
) -> ResidualTests:
    """Test a channel with steps at ``instants`` (s) by errors (M,) as the loss counts them."""
    name, signal = record.comparison.name, channel.signal
    overlay, largest = record.comparison.overlays[signal], max(each.std for each in scatter)
    if not rmse > LEAST_NOISE:
        return ResidualTests(name, signal, None, None, 1.0, largest, rmse / largest, 0.0, 0.0)
    apart, compared = noise_shape(channel).apart, np.isfinite(overlay.error)
    steps = np.searchsorted(record.comparison.time[compared][::apart], instants)
    deviation = largest_deviation(overlay.error[compared], largest)
    # the range of the signal: as simulated, or as measured but for its noise
    smooth = moving_median(overlay.measured[compared])
    span = float(max(np.ptp(overlay.simulated[compared]), np.ptp(smooth)))
    return ResidualTests(
        record=name,
        signal=signal,
        whiteness=whiteness(errors[::apart]),
        pattern=step_pattern(errors[::apart], steps.tolist()),
        excess=max(excess(rmse, each) for each in scatter),
        scatter=largest,
        times=rmse / largest,
        deviation=deviation,
        share=deviation / max(span, LEAST_NOISE),
        carried=max(each.carried for each in scatter),
    )
