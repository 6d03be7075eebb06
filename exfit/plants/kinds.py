"""The kinds of plant, by the names that a case file gives them."""

from collections.abc import Iterator, Mapping

from exfit.plants.alone import ALONE
from exfit.plants.infinite_bus import INFINITE_BUS
from exfit.plants.machine_on_load import MACHINE_ON_LOAD
from exfit.plants.machine_playback import MACHINE_PLAYBACK
from exfit.plants.open_circuit import OPEN_CIRCUIT
from exfit.plants.outside import FMU, OUTSIDE
from exfit.plants.plant import PlantKind
from exfit.plants.playback import PLAYBACK
from exfit.registry import parts

CORE: Mapping[str, PlantKind] = {
    kind.name: kind
    for kind in (
        OPEN_CIRCUIT,
        INFINITE_BUS,
        MACHINE_ON_LOAD,
        PLAYBACK,
        MACHINE_PLAYBACK,
        ALONE,
        OUTSIDE,
        FMU,
    )
}
PLUG = "PLANTS"


class Kinds(Mapping[str, PlantKind]):
    """The kinds of the core, and those of features, each imported when it is asked for."""

    def __getitem__(self, name: str) -> PlantKind:
        if name in CORE:
            return CORE[name]
        kind: PlantKind = parts(PLUG)[name].load()
        return kind

    def __iter__(self) -> Iterator[str]:
        return iter([*CORE, *parts(PLUG)])

    def __len__(self) -> int:
        return len(CORE) + len(parts(PLUG))


KINDS = Kinds()
# a kind of a feature has some of these
EVENTS = tuple(dict.fromkeys(event for kind in CORE.values() for event in kind.events))
