"""A stabiliser as a part of a plant on load: what it listens to, how it waits, what it gives."""

from collections.abc import Mapping

from exfit.engine.system import Signals
from exfit.engine.trace import Signal
from exfit.plants.parts import STABILISER, Names, named_parameters, output_of
from exfit.plants.plant import Stabilised

ROUNDING_AT_REST = 1e-9  # pu
# what a stabiliser may listen to; pa is the accelerating power, none an input that is not in use
HEARD = ("speed", "p", "vt", "pa", "none")


def listening(stabiliser: Stabilised, heard: Names) -> Names:
    """Return what a stabiliser sees, ``vsi1`` and ``vsi2``; of the speed, what it deviates.

    The power ``p`` is there too: some are switched by it, whatever they listen to.
    """
    inputs = {f"vsi{k}": getattr(heard, of) for k, of in enumerate(stabiliser.inputs, 1)}
    return Names(p=heard.p, **inputs)


def rests_with_output(stabiliser: Stabilised, values: Mapping[str, float]) -> bool:
    """Return whether a stabiliser with these values has an output while its unit is at rest."""
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
