"""The noise of channels: given or estimated, as filters leave it, as driving signals make it."""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from exfit.dsp.noise import NEIGHBOURS, noise
from exfit.errors import SimulationError
from exfit.fitting.experiment import Channel, ExperimentSetup
from exfit.util.arrays import Array

LEAST_NOISE = 1e-7  # pu: no recorder's noise is less
MISFIT = 2.0  # times the noise: three quarters of the squared error are not noise then
WHITE_NOISE_SEED = 0
INDEPENDENT = 2.0  # times the length over which filtered noise is correlated
SEED = 0
REALISATIONS = 4


def noise_of(channel: Channel) -> float:
    """Find the standard deviation of a channel's noise, per unit: given, or estimated."""
    return scatter_of(channel) if channel.noise is None else channel.noise


def scatter_of(channel: Channel) -> float:
    """Estimate the standard deviation (pu) of a channel's noise by its scatter, before a filter."""
    measured = channel.measured[channel.kept]
    apart = 1 if channel.filtering is None else channel.filtering.smooth_over
    # neighbours in one window of an average scatter little: they share most of it
    far = measured[::apart] if len(measured) > NEIGHBOURS * apart else measured
    return max(noise(far), LEAST_NOISE)


class NoiseShape(NamedTuple):
    """White noise as it comes out of a channel: its ``gain``, and its correlation.

    Of samples that are ``apart`` by so many, each is independent of the one before.
    """

    gain: float
    apart: int


def noise_shape(channel: Channel) -> NoiseShape:
    """Shape of white noise after the averages of a channel's record and its filter."""
    from exfit.inference.noise import effective_samples

    filtering = channel.filtering
    if filtering is None:
        return NoiseShape(1.0, 1)
    if filtering.filter is None:
        return NoiseShape(1.0, filtering.smooth_over)
    white = np.random.default_rng(WHITE_NOISE_SEED).standard_normal(len(channel.measured))
    filtered = channel.filtered(white)
    correlated = INDEPENDENT * len(filtered) / effective_samples(filtered)
    apart = max(round(correlated), filtering.smooth_over)
    return NoiseShape(float(np.std(filtered)), apart)


def propagated_noise(
    setup: ExperimentSetup, values: Mapping[str, float], realisations: int = REALISATIONS
) -> list[Array]:
    """Draw moves of each channel, pu, by more noise on the recorded inputs.

    White noise as strong as that of each input is added to it, several times: what the response
    then does (realisations, errors) is what the record's own noise does to it. The level of an
    input is its mean at rest, and as uncertain. It is empty without recorded inputs, or where the
    response to them diverges.
    """
    experiment, at = setup.experiment, setup.with_start_values(values)
    own = experiment.simulator
    if not own.inputs.recorded:
        return []
    generator = np.random.default_rng(SEED)
    steady = -np.inf if setup.test.steady is None else setup.test.steady
    try:
        usual, noisy = experiment.samples(at)[0], []
        for _ in range(realisations):
            recorded = {}
            for signal, given in own.inputs.recorded.items():
                added = generator.normal(0.0, noise(given.samples), len(given.samples))
                at_rest = given.time < steady
                level = float(np.mean(added[at_rest])) if at_rest.any() else 0.0
                recorded[signal] = replace(given, samples=given.samples + added - level)
            changed = own.remade(inputs=replace(own.inputs, recorded=recorded))
            noisy.append(replace(experiment, simulator=changed).samples(at)[0])
    except SimulationError:
        return []
    return [
        np.stack([channel.filtered(each[:, k] - usual[:, k]) for each in noisy])
        for k, channel in enumerate(experiment.channels)
    ]
