"""Samples at the very instant of a step, in channels that jump with it.

A sampled value at a jump is that before it or that behind it, by the rounding of a clock alone. The
simulation gives the value before an exact step; one whose instant is found acts over a grid step on
either side. A sample there that contradicts all others would move the instant, and with it the
parameters, by far more than their errors: it is left out.

Source: cf. Cook & Weisberg 1982 (an outlier is what all other cases predict to be different).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.filtering import Filtering
from exfit.errors import SimulationError
from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import Experiment
from exfit.fitting.nuisances import prefix_from
from exfit.fitting.problem import FitProblem, problem_of
from exfit.signals import SIGNALS
from exfit.util.arrays import Array

Rows = NDArray[np.intp]

AT_GIVEN_INSTANT = 1e-3  # of the width of a jump: so near, rounding decides on the side
CONTRADICTING = 1e-6  # probability: samples that are less likely contradict all others
NEGLIGIBLE_ERROR = 1e-6  # pu: where a record has no noise, errors of the simulation are as large
NEGLIGIBLE_SINGULAR_VALUE = 1e-10  # of the largest: the record does not determine that direction


class ChannelSamples(NamedTuple):
    """Samples (rows of the record) of a channel, by the places of its test and among its own."""

    test: int
    channel: int
    rows: Rows

    def overlaps(self, other: "ChannelSamples") -> bool:
        """Test whether some of these samples are among others."""
        alike = (self.test, self.channel) == (other.test, other.channel)
        return alike and bool(np.isin(self.rows, other.rows).any())


def without_contradicting_samples(
    problem: FitProblem, x: Array
) -> tuple[FitProblem, tuple[str, ...]]:
    """Return the problem without the samples at steps that contradict all others near x (N,).

    With notes of these; without any, the problem as it is. The minimum without them must have the
    step there as well: beside that of an instant between other samples, they are right. Raises
    KeyboardInterrupt at an interruption.
    """
    contradicting = _contradicting(problem, x)
    if not contradicting:
        return problem, ()
    fewer = _without(problem, contradicting)
    near = [*_samples_at_steps(problem, descent_near(fewer.compressed, x).x)]
    if not all(any(samples.overlaps(other) for other in near) for samples in contradicting):
        return problem, ()
    return fewer, tuple(_note(problem, samples) for samples in contradicting)


def _samples_at_steps(problem: FitProblem, x: Array) -> Iterator[ChannelSamples]:
    """Yield the samples at the instants of steps, of the channels that jump with these."""
    values = problem.residuals.values(x)
    for test, experiment in enumerate(problem.residuals.experiments):
        simulator = experiment.with_inputs(values)
        times, at_step = simulator.times - simulator.delay, np.zeros(len(simulator.times), bool)
        for step in simulator.inputs.steps:
            if not step.ramp:
                reach = simulator.jump * (1.0 if step.smooth else AT_GIVEN_INSTANT)
                at_step |= np.abs(times - step.at) <= reach
        for k, channel in enumerate(experiment.channels):
            if SIGNALS[channel.signal].jumps and channel.plain:
                rows = np.flatnonzero(at_step & channel.kept)
                if len(rows):
                    yield ChannelSamples(test, k, rows)


def _contradicting(problem: FitProblem, x: Array) -> list[ChannelSamples]:
    """Return the samples at steps that all others, by linear theory, predict to be different."""
    near = [*_samples_at_steps(problem, x)]
    if not near:
        return []
    from scipy.special import chdtrc

    residuals = problem.residuals
    try:
        errors, slopes = residuals.errors(x)
    except SimulationError:
        return []
    if not np.isfinite(slopes).all():
        return []
    owner = np.repeat(np.arange(len(residuals.sizes)), residuals.sizes)
    places = [_places(problem, samples) for samples in near]
    others = np.ones(len(errors), dtype=bool)
    others[np.concatenate(places)] = False
    inverse = np.linalg.pinv(slopes[others], rcond=NEGLIGIBLE_SINGULAR_VALUE)
    left = errors - slopes @ (inverse @ errors[others])
    counts = np.bincount(owner[others], minlength=len(residuals.sizes))
    squares = np.bincount(owner[others], left[others] ** 2, len(residuals.sizes))
    weights = np.array([channel.weight for channel in residuals.channels])
    variance = (squares / np.maximum(counts, 1) + (weights * NEGLIGIBLE_ERROR) ** 2)[owner]

    def contradicts(place: Rows) -> bool:
        by_others = slopes[place] @ inverse
        covariance = np.diag(variance[place]) + (by_others * variance[others]) @ by_others.T
        surprise = float(left[place] @ np.linalg.solve(covariance, left[place]))
        return bool(chdtrc(len(place), surprise) < CONTRADICTING)

    return [each for each, place in zip(near, places, strict=True) if contradicts(place)]


def _places(problem: FitProblem, samples: ChannelSamples) -> Rows:
    """Return the places of samples among the errors of all records."""
    experiments = problem.residuals.experiments
    before = sum(sum(experiment.sizes) for experiment in experiments[: samples.test])
    experiment = experiments[samples.test]
    before += sum(experiment.sizes[: samples.channel])
    kept = experiment.channels[samples.channel].kept
    return np.asarray(before + np.cumsum(kept)[samples.rows] - 1)


def _without(problem: FitProblem, left_out: Sequence[ChannelSamples]) -> FitProblem:
    """Return a problem whose channels are compared without some samples."""
    experiments: list[Experiment] = list(problem.residuals.experiments)
    for samples in left_out:
        experiment = experiments[samples.test]
        channels = list(experiment.channels)
        channel = channels[samples.channel]
        kept = channel.kept.copy()
        kept[samples.rows] = False
        channels[samples.channel] = replace(
            channel,
            measured=np.where(kept, channel.measured, np.nan),  # as what is masked: no outlier
            filtering=Filtering(experiment.simulator.times, kept),
        )
        experiments[samples.test] = replace(experiment, channels=tuple(channels))
    return problem_of(replace(problem.residuals, experiments=experiments))


def _note(problem: FitProblem, samples: ChannelSamples) -> str:
    experiment = problem.residuals.experiments[samples.test]
    signal = experiment.channels[samples.channel].signal
    times = experiment.simulator.times[samples.rows]
    which = (
        f"the sample at {times[0]:.6g} s is"
        if len(times) == 1
        else f"the {len(times)} samples from {times[0]:.6g} to {times[-1]:.6g} s are"
    )
    return (
        f"{prefix_from(experiment.name)}{signal}: {which} left out: at the time of a step, "
        f"where {signal} may jump, and inconsistent with all others"
    )
