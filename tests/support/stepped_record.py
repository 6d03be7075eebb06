"""A record of several tests, each a step of its own size."""

import numpy as np
from records import write

STEPS = ((30.0, 0.05), (60.0, -0.05), (90.0, -0.02), (120.0, 0.02))  # s, pu
LAG = 0.4  # s


def stepped_record(path, base=15.75):
    """Write a voltage that follows the steps as a second-order response does."""
    time = np.arange(0.0, 150.0, 0.02)
    vt = np.ones_like(time)
    for at, step in STEPS:
        since = np.maximum(time - at, 0.0) / LAG
        vt += step * (1.0 - (1.0 + since) * np.exp(-since))
    vt += 1e-4 * np.random.default_rng(15).standard_normal(time.size)
    return write(path, **{"t": time, "Ugen (kV)": base * vt})
