"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from exfit.plants.breaker import BREAKER, SPEED
from exfit.plants.kinds import EVENTS, KINDS
from exfit.plants.limiting import PLACES, acts_without_load, inputs_at, inputs_for_limiters
from exfit.plants.parts import (
    DRIVING_SCALE,
    GOVERNOR,
    MACHINE,
    MEASURED,
    NETWORK,
    SATURATION,
    STABILISER,
    VT0,
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
)
from exfit.plants.plant import (
    LIMITER_KINDS,
    REFERENCES,
    Attached,
    Equipment,
    PlantKind,
    PowerAt,
    Stabilised,
    Swing,
    kind_of_limiter,
)

__all__ = [
    "BREAKER",
    "DRIVING_SCALE",
    "EVENTS",
    "GOVERNOR",
    "KINDS",
    "LIMITER_KINDS",
    "MACHINE",
    "MEASURED",
    "NETWORK",
    "PLACES",
    "REFERENCES",
    "SATURATION",
    "SPEED",
    "STABILISER",
    "VT0",
    "Attached",
    "Equipment",
    "Names",
    "PlantKind",
    "PowerAt",
    "SaturationForm",
    "Stabilised",
    "Swing",
    "acts_without_load",
    "exciter_inputs",
    "exciter_parameters",
    "inputs_at",
    "inputs_for_limiters",
    "kind_of_limiter",
]
