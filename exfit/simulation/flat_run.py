"""A run without any change: it stays where it starts if the start is a state of rest."""

from collections.abc import Mapping, Sequence

import numpy as np

from exfit.simulation.inputs import Inputs
from exfit.simulation.simulator import Simulator

Values = Mapping[str, float]

FLAT_SECONDS = 60.0
FLAT_TIMES = np.linspace(0.0, FLAT_SECONDS, 601)
FLAT_DRIFT = 1e-9  # pu


def flat_drift(simulator: Simulator, values: Values, signals: Sequence[str]) -> float:
    """Measure the stray of signals from their start (pu) in FLAT_SECONDS without any change.

    ``values`` are the parameters of the simulator's system. Raises SimulationError where the start
    is no rest.
    """
    at_rest = Inputs(0.0, FLAT_SECONDS, ())
    still = simulator.remade(inputs=at_rest, times=FLAT_TIMES, least=1, delay=0.0)
    flat, _ = still.samples(values, tuple(signals))
    return float(np.max(np.abs(flat - flat[0])))
