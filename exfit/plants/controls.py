"""What controls a unit on load: its turbine governor and its power system stabiliser."""

from collections.abc import Mapping

import numpy as np

from exfit.engine.system import Rest, Signals
from exfit.engine.trace import Signal
from exfit.models.blocks import Limited
from exfit.models.sheet import Model
from exfit.plants.parts import GOVERNOR, STABILISER, Names, named_parameters, output_of
from exfit.plants.plant import Stabilised

ROUNDING_AT_REST = 1e-9  # pu/s
REFERENCE = GOVERNOR + "pref"  # the setpoint that holds the power at the start
# what a stabiliser may listen to; pa is the accelerating power, none an input that is not in use
HEARD = ("speed", "p", "vt", "pa", "none")


def governor_rest(governor: Model, power: Signal, p: Signals) -> Rest:
    """Rest of a governor that holds a power: its states and setpoints by their names there."""
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
    """Test whether a governor with these values holds a power at rest: no limit is in its way."""
    p, x, d = Names(**values), Names(), Names()
    u = Names(dw=0.0, p=np.float64(power))
    with np.errstate(all="ignore"):
        u.pref = governor.rest(u.p, u, p, x)
        governor.equations(x, u, p, d)
    slopes = [slope.slope if isinstance(slope, Limited) else slope for slope in vars(d).values()]
    return bool(np.all(np.abs(slopes) <= ROUNDING_AT_REST))


def listening(stabiliser: Stabilised, heard: Names) -> Names:
    """Inputs of a stabiliser, ``vsi1`` and ``vsi2``; of the speed, its deviation.

    The power ``p`` is there too: some are switched by it, whatever they listen to.
    """
    inputs = {f"vsi{k}": getattr(heard, of) for k, of in enumerate(stabiliser.inputs, 1)}
    return Names(p=heard.p, **inputs)


def rests_with_output(stabiliser: Stabilised, values: Mapping[str, float]) -> bool:
    """Test whether a stabiliser with these values has an output while its unit is at rest."""
    model, p, x = stabiliser.model, Names(**values), Names()
    seen = listening(stabiliser, Names(speed=0.0, p=1.0, vt=1.0, pa=0.0, none=0.0))
    model.rest(0.0, seen, p, x)
    return bool(abs(model.equations(x, seen, p, Names())) > ROUNDING_AT_REST)


def stabiliser_rest(stabiliser: Stabilised, heard: Names, p: Signals) -> dict[str, Signal]:
    """Return the states of a stabiliser that waits, under their names in the system."""
    model, x = stabiliser.model, Names()
    values = named_parameters(p, STABILISER, model.sheet)
    model.rest(0.0, listening(stabiliser, heard), values, x)
    return {STABILISER + name: value for name, value in vars(x).items()}


def stabilising(stabiliser: Stabilised, heard: Names, p: Signals, x: Signals, d: Names) -> Signal:
    """Write the slopes of a stabiliser into ``d`` and return its signal vs."""
    return output_of(STABILISER, stabiliser.model, listening(stabiliser, heard), p, x, d)
