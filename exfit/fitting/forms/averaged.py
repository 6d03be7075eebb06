"""The averages of a recorder of which a case does not speak."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.filtering import Filtering, MovingAverage
from exfit.fitting.experiment import Channel, Experiment

Array = NDArray[np.float64]


def finds_instant(experiment: Experiment) -> bool:
    """Tell whether a fit finds an instant of a test, which makes up for a delay."""
    return any(nuisance.kind in ("at", "shift", "delay") for nuisance in experiment.nuisances)


def with_averages(experiment: Experiment, window: float, late: float = 0.0) -> Experiment:
    """Return an experiment whose record holds averages over a window (s), and is ``late`` (s)."""
    simulator = experiment.simulator
    channels = tuple(_averaging(each, simulator.times, window) for each in experiment.channels)
    delayed = simulator.with_inputs(simulator.inputs.steps, simulator.delay + late)
    return replace(experiment, channels=channels, simulator=delayed)


def _averaging(channel: Channel, time: Array, window: float) -> Channel:
    filter = None if channel.filtering is None else channel.filtering.filter
    return replace(channel, filtering=Filtering(time, channel.kept, filter, MovingAverage(window)))
