"""What the noise of recorded signals that drive a simulation does to its response."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.dsp.noise import noise
from exfit.errors import SimulationError
from exfit.fitting.experiment import ExperimentSetup
from exfit.simulation.inputs import RecordedInput, SplinedInput
from exfit.simulation.simulator import Simulator

Array = NDArray[np.float64]
Values = Mapping[str, float]

SEED = 0
REALISATIONS = 4


def propagated_noise(
    setup: ExperimentSetup, values: Values, realisations: int = REALISATIONS
) -> list[Array]:
    """Draw moves of each channel, pu, by more noise on the recorded inputs.

    White noise as strong as that of each input is added to it, several times: what the response
    then does (realisations, errors) is what the record's own noise does to it. It is empty without
    recorded inputs, or where the response to them diverges.
    """
    experiment, at = setup.experiment, setup.with_start_values(values)
    if not experiment.simulator.inputs.recorded:
        return []
    generator = np.random.default_rng(SEED)
    steady = -np.inf if setup.test.steady is None else setup.test.steady

    def noisy_response() -> Array:
        simulator = _noisier(experiment.simulator, generator, steady)
        return replace(experiment, simulator=simulator).samples(at)[0]

    try:
        usual = experiment.samples(at)[0]
        noisy = [noisy_response() for _ in range(realisations)]
    except SimulationError:
        return []
    return [
        np.stack([channel.filtered(own[:, k] - usual[:, k]) for own in noisy])
        for k, channel in enumerate(experiment.channels)
    ]


def _noisier(simulator: Simulator, generator: "np.random.Generator", steady: float) -> Simulator:
    """Return a simulator whose recorded inputs have as much white noise again.

    Their level is the mean until the instant ``steady`` (s), and as uncertain.
    """

    def noisier(recorded: RecordedInput | SplinedInput) -> RecordedInput | SplinedInput:
        added = generator.normal(0.0, noise(recorded.samples), len(recorded.samples))
        at_rest = recorded.time < steady
        level = float(np.mean(added[at_rest])) if at_rest.any() else 0.0
        return replace(recorded, samples=recorded.samples + added - level)

    recorded = {signal: noisier(own) for signal, own in simulator.inputs.recorded.items()}
    inputs = replace(simulator.inputs, recorded=recorded)
    return Simulator(
        simulator.system, inputs, simulator.times, simulator.step, simulator.least, simulator.delay
    )
