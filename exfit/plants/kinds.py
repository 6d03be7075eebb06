"""The kinds of plant, by the names that a case file gives them."""

from collections.abc import Mapping

from exfit.plants.alone import ALONE
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.machine_on_load import MACHINE_ON_LOAD
from exfit.plants.machine_playback import MACHINE_PLAYBACK
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.plants.outside import FMU, OUTSIDE
from exfit.plants.plant import PlantKind
from exfit.plants.playback import PLAYBACK
from exfit.registry import parts

OF_CORE = (
    OPEN_CIRCUIT,
    INFINITE_BUS,
    MACHINE_ON_LOAD,
    PLAYBACK,
    MACHINE_PLAYBACK,
    ALONE,
    OUTSIDE,
    FMU,
)
KINDS: Mapping[str, PlantKind] = {
    **{kind.name: kind for kind in OF_CORE},
    **{name: part.load() for name, part in parts("PLANTS").items()},
}

EVENTS = tuple(dict.fromkeys(event for kind in KINDS.values() for event in kind.events))
