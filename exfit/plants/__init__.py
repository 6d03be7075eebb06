"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from exfit.plants.alone import alone
from exfit.plants.infinite_bus import Given, Stabilised, flow_sheet, infinite_bus
from exfit.plants.open_circuit import open_circuit
from exfit.plants.parts import (
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
from exfit.plants.playback import DRIVING, EFD0, VREF0, initial, machine_playback, playback

__all__ = [
    "DRIVING",
    "EFD0",
    "MACHINE",
    "MEASURED",
    "NETWORK",
    "SATURATION",
    "STABILISER",
    "VREF0",
    "VT0",
    "Given",
    "Names",
    "SaturationForm",
    "Stabilised",
    "alone",
    "exciter_inputs",
    "exciter_parameters",
    "flow_sheet",
    "infinite_bus",
    "initial",
    "machine_playback",
    "open_circuit",
    "playback",
]
