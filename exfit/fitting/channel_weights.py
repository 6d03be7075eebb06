"""Weights of channels by what the model can match: one over the scatter of their own residuals.

Where the variance of each channel's errors is not known, the parameters of greatest likelihood
make the sum of M_k ln(s_k) small, M_k samples and s_k the root mean square of the residuals of
channel k. They are found by weighting with 1 / s_k, fitting, and weighting anew until the s_k stay:
iterated feasible generalised least squares.

Source: Seber & Wild 1989, section 11.2 (its several responses are uncorrelated here); Beal &
Sheiner 1988.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, pairwise

import numpy as np

from exfit.fitting.descents import descent_near
from exfit.fitting.experiment import Channel, Experiment, ExperimentSetup
from exfit.fitting.noise import LEAST_NOISE
from exfit.fitting.problem import FitProblem
from exfit.fitting.residuals import Residuals, SimulationCounter
from exfit.util.arrays import Array

MOST_REWEIGHTINGS = 20  # a handful is enough, unless two channels contradict each other
MOST_SEARCHES = 3  # with weights of another minimum each: two are rare
WEIGHT_TOLERANCE = 0.02  # of a weight: so small a change moves no parameter by a share of its error
OTHER_MINIMUM = 0.1  # of a weight: a larger change shows that another minimum was found


def other_deviations(problem: FitProblem, theta: Array) -> Array | None:
    """Find the deviations (channels,) of residuals in a minimum theta (N,) with other weights.

    None where the weights are those of this minimum.
    """
    deviations = residual_deviations(problem.compressed, theta)
    used = [channel.residual_deviation or np.nan for channel in problem.residuals.channels]
    return None if _agree(deviations, np.array(used), OTHER_MINIMUM) else deviations


def balanced(
    problem: FitProblem,
    theta: Array,
    counter: SimulationCounter | None = None,
    deviations: Array | None = None,
) -> FitProblem:
    """Return the problem with the weights that balance its channels in the minimum near theta (N,).

    ``deviations`` (channels,) are those to begin with; by default those of the records themselves:
    of all signals the same share is matched then.
    """
    before = deviations
    if before is None:
        channels = problem.residuals.channels
        movements = [float(np.std(channel.measured[channel.kept])) for channel in channels]
        before = np.maximum(movements, LEAST_NOISE)
    problem = with_deviations(problem, before, of_residuals=deviations is not None)
    for _ in range(MOST_REWEIGHTINGS):
        theta = descent_near(problem.compressed.counted_by(counter), theta).x
        after = residual_deviations(problem.compressed, theta)
        problem = with_deviations(problem, after)
        if _agree(before, after, WEIGHT_TOLERANCE):
            break
        before = after
    return problem


def residual_deviations(residuals: Residuals, theta: Array) -> Array:
    """Return the standard deviation (channels,) of the residuals of each channel, per unit.

    It is the one by which the noise is reported: the root mean square or, with a robust loss,
    that of the influence over the mean of its derivative (Huber 1981, section 7.6).
    """
    errors, _ = residuals.errors(theta)
    influence, curvature = residuals.influence(errors)
    ends, deviations = [0, *accumulate(residuals.sizes)], list[float]()
    for channel, (a, b) in zip(residuals.channels, pairwise(ends), strict=True):
        own = influence[a:b]
        scale = channel.weight * max(float(np.mean(curvature[a:b])), np.finfo(float).eps)
        spread = float(np.sqrt(own @ own / channel.samples))
        deviations.append(max(spread / scale, LEAST_NOISE))
    return np.array(deviations)


def with_deviations(
    problem: FitProblem, deviations: Array, of_residuals: bool = True
) -> FitProblem:
    """Return the problem with the weights 1 / deviations (channels,), the largest of them 1."""
    whole = _weighted(problem.residuals, deviations, of_residuals)
    if problem.compressed is problem.residuals:
        return FitProblem(whole, whole)
    return FitProblem(whole, _weighted(problem.compressed, deviations, of_residuals))


def _weighted(residuals: Residuals, deviations: Array, of_residuals: bool) -> Residuals:
    finest, own = float(np.min(deviations)), iter(deviations.tolist())

    def weighted(channel: Channel) -> Channel:
        deviation = next(own)
        matched = deviation if of_residuals else None
        return replace(channel, weight=finest / deviation, residual_deviation=matched)

    experiments = [_with_channels(experiment, weighted) for experiment in residuals.experiments]
    return replace(residuals, experiments=experiments)


def _agree(before: Array, after: Array, tolerance: float) -> bool:
    """Test whether two sets of deviations give the same weights."""
    changes = np.log(after / before)
    return float(np.ptp(changes)) <= tolerance


def as_fitted(
    setups: Sequence[ExperimentSetup], problem: FitProblem
) -> tuple[ExperimentSetup, ...]:
    """Return the setups of a problem with the weights of its channels, driven as recorded."""
    pairs = zip(setups, map(as_recorded, problem.residuals.experiments), strict=True)
    return tuple(replace(setup, experiment=experiment) for setup, experiment in pairs)


def as_recorded(experiment: Experiment) -> Experiment:
    """Return an experiment that recorded signals drive as they are, with their noise."""
    if experiment.recorded is None:
        return experiment
    (simulator, own), white = experiment.recorded, experiment.whitening
    if white is not None:  # its errors were shifted to those of the signals as recorded
        white = white._replace(shift=np.zeros_like(white.shift))
    return replace(experiment, simulator=simulator, own=own, recorded=None, whitening=white)


def weighted_alike(
    setups: Iterable[ExperimentSetup], residuals: Residuals
) -> tuple[ExperimentSetup, ...]:
    """Return setups of other records whose channels weigh what those of these residuals weigh."""
    weights = defaultdict(list)
    for channel in residuals.channels:
        weights[channel.signal].append(channel.weight)

    def weighted(channel: Channel) -> Channel:
        own = weights.get(channel.signal, [channel.weight])
        return replace(channel, weight=float(np.mean(own)))

    return tuple(
        replace(setup, experiment=_with_channels(setup.experiment, weighted)) for setup in setups
    )


def _with_channels(experiment: Experiment, changed: Callable[[Channel], Channel]) -> Experiment:
    return replace(experiment, channels=tuple(map(changed, experiment.channels)))


def weight_notes(residuals: Residuals) -> Iterator[str]:
    """Note the weights of channels, where their residuals decide them."""
    several = len(residuals.experiments) > 1
    weighted_by_noise = any(each.whitening is not None for each in residuals.experiments)
    deviations = [
        f"{experiment.name + ' ' if several else ''}{channel.signal} {deviation:.2g}"
        for experiment in residuals.experiments
        for channel in experiment.channels
        if (deviation := channel.residual_deviation) is not None
    ]
    if len(deviations) > 1 and weighted_by_noise:
        yield (
            "weights balanced: only up to the phase noise; from there the covariance of the noise "
            "alone weights the errors"
        )
    elif len(deviations) > 1:
        listed = ", ".join(deviations)
        yield f"weights balanced: one over the scatter of each channel's residuals (pu), {listed}"
