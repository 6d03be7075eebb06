"""The field current that holds a machine at rest on load, by the machine model's own equations."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.models.machines import Machine
from exfit.plants.loaded_machine import Flow, loaded_at_rest
from exfit.plants.parts import Names

Array = NDArray[np.float64]


def field_on_load(
    machine: Machine, data: Mapping[str, float], p: ArrayLike, q: ArrayLike, vt: ArrayLike
) -> Array:
    """Return ifd (M,) that holds p, q and vt, each (M,), all per unit; efd at rest is the same.

    ``data`` has a value for every symbol of the machine's sheet. It is nan where no rest exists.

    Source: Kundur, Power System Stability and Control, 3.6.3 to 3.6.5 (steady state, on the
    machine's rotor axes); saturation as the machine's model has it.
    """
    active, reactive, voltage = (np.asarray(signal, np.float64) for signal in (p, q, vt))
    terminals = Flow(active / voltage, reactive / voltage, voltage, np.zeros_like(voltage))
    with np.errstate(all="ignore"):
        ifd = loaded_at_rest(voltage, terminals, machine, Names(**data)).ifd
    return np.asarray(ifd, np.float64)
