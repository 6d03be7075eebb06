"""A machine on load: its system and typical values."""

from oracle import saturated

from exfit.models import MODELS
from exfit.models.sheet import typical
from exfit.plants import MACHINE, NETWORK, SATURATION, VT0
from exfit.plants.infinite_bus import flow_sheet, infinite_bus

QUADRATIC = SATURATION["quadratic"]
ALL_INPUTS = ("vref", "vs", "E", "angle", "R", "X")


def values_on_load(machine, given="Q", exciter="AC8B", **changes):
    """Return typical data of an exciter and a saturated machine at 0.8 pu of power."""
    values = typical(MODELS[exciter].sheet) | {VT0: 1.02}
    values |= {symbol: 99.0 for symbol in ("VFEMAX", "VRMAX") if symbol in values}
    values |= {MACHINE + symbol: value for symbol, value in saturated(machine).items()}
    network = typical(flow_sheet(given)) | {"R": 0.02, "Xc": -0.05, "Rc": 0.01}
    values |= {NETWORK + symbol: value for symbol, value in network.items()}
    return values | {symbol.replace("_", ".", 1): value for symbol, value in changes.items()}


def system(
    machine, given="Q", exciter="AC8B", inputs=ALL_INPUTS, dialect="standard", governor=None
):
    kinds = {"dialect": dialect, "governor": governor}
    return infinite_bus(MODELS[exciter], machine, QUADRATIC, inputs, given, **kinds)
