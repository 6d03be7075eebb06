"""A turbine governor as a part of a plant on load: how it holds the power, and what it gives."""

from collections.abc import Mapping

import numpy as np

from exfit.engine.system import Rest, Signals
from exfit.engine.trace import Signal
from exfit.models.blocks import Limited
from exfit.models.sheet import Model
from exfit.plants.parts import GOVERNOR, Names, named_parameters, output_of

ROUNDING_AT_REST = 1e-9  # pu/s
REFERENCE = GOVERNOR + "pref"  # the setpoint that holds the power at the start


def governor_rest(governor: Model, power: Signal, p: Signals) -> Rest:
    """Return how a governor holds a power: its states and setpoints by their names there."""
    x, u = Names(), Names(dw=0.0, p=power)
    pref = governor.rest(power, u, named_parameters(p, GOVERNOR, governor.sheet), x)
    written = {GOVERNOR + name: value for name, value in vars(x).items()}
    setpoints = {GOVERNOR + name: written.pop(GOVERNOR + name) for name in governor.setpoints}
    return Rest(written, {REFERENCE: pref, **setpoints})


def governing(governor: Model, u: Names, p: Signals, r: Signals, x: Signals, d: Names) -> Signal:
    """Write the slopes of a governor into ``d`` and return the power Pm of its turbine.

    ``u`` holds the speed less 1, ``dw``, the electrical power ``p``, and in ``pref`` by how much
    its reference has changed since the start.
    """
    u.pref = r[REFERENCE] + u.pref
    return output_of(GOVERNOR, governor, u, p, {**r, **x}, d)


def rests_at(governor: Model, values: Mapping[str, float], power: float) -> bool:
    """Return whether a governor with these values holds a power at rest: no limit is in its way."""
    p, x, d = Names(**values), Names(), Names()
    u = Names(dw=0.0, p=np.float64(power))
    with np.errstate(all="ignore"):
        u.pref = governor.rest(u.p, u, p, x)
        governor.equations(x, u, p, d)
    slopes = [slope.slope if isinstance(slope, Limited) else slope for slope in vars(d).values()]
    return bool(np.all(np.abs(slopes) <= ROUNDING_AT_REST))
