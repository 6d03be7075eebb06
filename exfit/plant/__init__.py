"""What surrounds the exciter: the plant makes it a closed system that can be simulated."""

from exfit.plant.alone import alone
from exfit.plant.open_circuit import open_circuit
from exfit.plant.parts import (
    MACHINE,
    SATURATION,
    VT0,
    Names,
    SaturationForm,
    exciter_inputs,
    exciter_parameters,
)

__all__ = [
    "MACHINE",
    "SATURATION",
    "VT0",
    "Names",
    "SaturationForm",
    "alone",
    "exciter_inputs",
    "exciter_parameters",
    "open_circuit",
]
