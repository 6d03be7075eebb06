"""What noise of each sample of the signals that drive a simulation does to its errors."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import noise
from exfit.fitting.experiment import Channel, Experiment
from exfit.fitting.residuals import LEAST_NOISE
from exfit.fitting.setup import ExperimentSetup
from exfit.inference.whitening import CarriedNoise
from exfit.plants.playback import initial
from exfit.simulation.simulator import Simulator
from exfit.simulation.splines import SplinedInput

Array = NDArray[np.float64]
Rows = NDArray[np.intp]
Values = Mapping[str, float]

ORDER = 4  # of the differences that show the noise of a signal which swings
PULSE = 1e-5  # pu or rad: the response to it is linear, and far above rounding
LONGEST_BETWEEN_PULSES = 1.0  # s: the response changes little while the unit swings
FEWEST_PULSES, MOST_PULSES = 9, 33
SAMPLES_AT_ENDS = 4  # of a record, where a spline through them is another: each has a pulse


class RestNoise(NamedTuple):
    """What noise of the samples (R,) at ``rest`` does to all errors (M,) by what they decide.

    That is the level at which the simulation starts and, for an angle, how fast it turns:
    ``moved`` (M, R) is without what the samples do themselves.
    """

    rest: Rows
    moved: Array


def noise_of_inputs(simulator: Simulator) -> dict[str, float]:
    """Return the standard deviation of the noise of the recorded inputs, by their own scatter."""
    recorded = simulator.inputs.recorded
    return {name: noise(own.samples, ORDER) for name, own in recorded.items()}


def noise_of_channel(channel: Channel) -> float:
    """Return the standard deviation of a channel's own noise, per unit: given, or estimated."""
    if channel.noise is not None:
        return channel.noise
    return max(noise(channel.measured[channel.kept], ORDER), LEAST_NOISE)


def carried_noise(setup: ExperimentSetup, values: Values) -> CarriedNoise:
    """Return the noise of the errors of a test: that of its channels and what inputs carry.

    The response to noise is that of the simulation, linear in it, about the values.
    """
    experiment = setup.experiment
    by_rest = rest_noise(setup, values)
    columns = []
    for signal, deviation in noise_of_inputs(experiment.with_inputs(values)).items():
        responses = responses_to_samples(experiment, values, signal)
        if signal in by_rest:
            responses[:, by_rest[signal].rest] += by_rest[signal].moved
        columns.append(deviation * responses)
    own, first = [], 0
    for channel in experiment.channels:
        deviation = noise_of_channel(channel)
        variance = np.full(channel.size, (channel.weight * deviation) ** 2)
        if channel.signal in by_rest:  # its mean at rest is in all errors
            rest, moved = by_rest[channel.signal]
            by_level = deviation * moved
            # at rest the mean of the errors is zero: with a variance of zero, rounding of the
            # record and of the simulation would have all the weight; no parameter moves it
            by_level[first + np.flatnonzero(np.isin(np.flatnonzero(channel.kept), rest))] = 0.0
            columns.append(by_level)
        own.append(variance)
        first += channel.size
    return CarriedNoise(np.concatenate(own), np.hstack(columns))


def responses_to_samples(experiment: Experiment, values: Values, signal: str) -> Array:
    """Return by how much each sample (D,) of a recorded input moves each error: (M, D).

    Pulses at some samples show it, and between two of them the response is that of both, each as
    much later or earlier.
    """
    simulator = experiment.with_inputs(values)
    places = pulse_places(simulator.inputs.recorded[signal].time)
    pulses = PULSE * np.eye(len(simulator.inputs.recorded[signal].time))[places]
    tests = [*(with_added(simulator, {signal: pulse}) for pulse in pulses), simulator]
    sets = [experiment.parameters(values)] * len(tests)
    samples, _ = simulator.samples_of_many(sets, experiment.signals, tests)
    responses = (samples[:-1] - samples[-1]) / PULSE
    every = [between_pulses(responses[:, :, k], places) for k in range(responses.shape[2])]
    return errors_of(experiment, np.stack(every, axis=2))


def with_added(simulator: Simulator, added: Mapping[str, Array]) -> Simulator:
    """Return a simulator with something added to the samples (M,) of recorded inputs."""
    recorded = {
        signal: replace(own, samples=own.samples + added[signal]) if signal in added else own
        for signal, own in simulator.inputs.recorded.items()
    }
    inputs = replace(simulator.inputs, recorded=recorded)
    return Simulator(
        simulator.system, inputs, simulator.times, simulator.step, simulator.least, simulator.delay
    )


def pulse_places(time: Array) -> Rows:
    """Return the samples (M,) at which pulses show the response."""
    wanted = int(np.ptp(time) / LONGEST_BETWEEN_PULSES) + 1
    count, last = min(max(wanted, FEWEST_PULSES), MOST_PULSES), len(time) - 1
    inside = np.linspace(SAMPLES_AT_ENDS, last - SAMPLES_AT_ENDS, count)
    ends = np.arange(SAMPLES_AT_ENDS)
    places = np.concatenate([ends, np.round(inside), last - ends])
    return np.unique(places.clip(0, last).astype(np.intp))


def between_pulses(pulses: Array, places: Rows) -> Array:
    """Return the responses (M, M) to a pulse at each sample, of those (P, M) at some places."""
    count = pulses.shape[1]
    every = np.arange(count)
    before = np.clip(np.searchsorted(places, every, "right") - 1, 0, len(places) - 2)
    responses = np.empty((count, count))
    for sample, first in zip(every.tolist(), before.tolist(), strict=True):
        low, high = int(places[first]), int(places[first + 1])
        share = (sample - low) / (high - low)
        earlier = _delayed(pulses[first], sample - low)
        later = _delayed(pulses[first + 1], sample - high)
        seen = every < count - (high - sample)  # beyond, the record ends before the later one's
        responses[sample] = np.where(seen, (1.0 - share) * earlier + share * later, earlier)
    return responses


def _delayed(response: Array, by: int) -> Array:
    """Return a response (M,) that comes so many samples later."""
    delayed = np.zeros_like(response)
    if by >= 0:
        delayed[by:] = response[: len(response) - by]
    else:
        delayed[:by] = response[-by:]
    return delayed


def rest_noise(setup: ExperimentSetup, values: Values) -> dict[str, RestNoise]:
    """Return what noise at rest does by the levels of the signals, beside what it does itself."""
    experiment, steady = setup.experiment, setup.test.steady
    if steady is None:
        return {}
    simulator, own = experiment.with_inputs(values), experiment.own
    driving, rest = simulator.inputs.recorded, np.flatnonzero(setup.record.time < steady)
    usual = experiment.samples(values)[0]

    def response(signal: str, course: Array, first: bool) -> Array:
        level = initial(signal)
        at = {**own, level: own[level] + PULSE} if first and level in own else own
        taken = {signal: -PULSE * course} if signal in driving else {}
        moved = replace(experiment, own=at, simulator=with_added(simulator, taken))
        return errors_of(experiment, ((moved.samples(values)[0] - usual) / PULSE)[None])[:, 0]

    noises = {}
    for signal in dict.fromkeys([*driving, *experiment.signals]):
        given = signal == "vt" and setup.test.vt0 is not None
        if given or not (signal in driving or initial(signal) in own):
            continue
        angle = driving.get(signal) if signal == "angle" else None
        turning = isinstance(angle, SplinedInput) and not angle.integrated
        courses = courses_at_rest(setup.record.time, turning)
        weights = np.linalg.pinv(courses[:, rest].T)
        moved = np.stack([response(signal, course, k == 0) for k, course in enumerate(courses)])
        noises[signal] = RestNoise(rest, moved.T @ weights)
    return noises


def courses_at_rest(time: Array, turning: bool) -> Array:
    """Return the courses (K, M) that are taken from a signal as they are at rest, the level first.

    What is ``turning``, as an angle, may do so evenly (`fitting.recorded.event`).
    """
    level = np.ones(len(time))
    return np.stack([level, time - time[0]]) if turning else level[None]


def errors_of(experiment: Experiment, changes: Array) -> Array:
    """Return changes of signals (K, M, channels) as those of the weighted errors (errors, K)."""
    return np.concatenate(
        [
            channel.weight * channel.compared(changes[:, :, k]).T
            for k, channel in enumerate(experiment.channels)
        ]
    )
