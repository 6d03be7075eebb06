"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from exfit.plants.alone import alone
from exfit.plants.breaker import BREAKER, SPEED
from exfit.plants.governing import rests_at
from exfit.plants.infinite_bus import INFINITE_BUS, flow_sheet, infinite_bus
from exfit.plants.kinds import EVENTS, KINDS
from exfit.plants.limiting import PLACES, acts_without_load, inputs_at, inputs_for_limiters
from exfit.plants.machine_on_load import machine_on_load
from exfit.plants.machine_playback import machine_playback
from exfit.plants.open_circuit import OPEN_CIRCUIT, open_circuit
from exfit.plants.outside import model_of_names
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
from exfit.plants.playback import DRIVING, PLAYBACK, initial, playback
from exfit.plants.stabilising import HEARD, rests_with_output
from exfit.plants.unit import UnitOnLoad

__all__ = [
    "BREAKER",
    "DRIVING",
    "DRIVING_SCALE",
    "EVENTS",
    "GOVERNOR",
    "HEARD",
    "INFINITE_BUS",
    "KINDS",
    "LIMITER_KINDS",
    "MACHINE",
    "MEASURED",
    "NETWORK",
    "OPEN_CIRCUIT",
    "PLACES",
    "PLAYBACK",
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
    "UnitOnLoad",
    "acts_without_load",
    "alone",
    "exciter_inputs",
    "exciter_parameters",
    "flow_sheet",
    "infinite_bus",
    "initial",
    "inputs_at",
    "inputs_for_limiters",
    "kind_of_limiter",
    "machine_on_load",
    "machine_playback",
    "model_of_names",
    "open_circuit",
    "playback",
    "rests_at",
    "rests_with_output",
]
