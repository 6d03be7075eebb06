"""The kinds of plant, by the names that a case file gives them."""

from collections.abc import Iterator, Mapping

from exfit.plants.plant import PlantKind
from exfit.registry import LazyPart, parts

CORE: Mapping[str, LazyPart] = {
    name: LazyPart(f"exfit.plants.{path}")
    for name, path in {
        "open-circuit": "open_circuit:OPEN_CIRCUIT",
        "infinite-bus": "infinite_bus:INFINITE_BUS",
        "machine-on-load": "machine_on_load:MACHINE_ON_LOAD",
        "playback": "playback:PLAYBACK",
        "machine-playback": "machine_playback:MACHINE_PLAYBACK",
        "none": "alone:ALONE",
        "external": "outside:OUTSIDE",
        "fmu": "outside:FMU",
    }.items()
}
PLUG = "PLANTS"
# what a test may change in any of them, those of features among them
EVENTS = ("vref", "vs", "pref", "E", "angle", "network", "breaker")


class Kinds(Mapping[str, PlantKind]):
    """The kinds of the core and those of features, each imported when it is asked for."""

    def __getitem__(self, name: str) -> PlantKind:
        kind: PlantKind = (CORE[name] if name in CORE else parts(PLUG)[name]).load()
        return kind

    def __contains__(self, name: object) -> bool:
        return name in CORE or name in parts(PLUG)

    def __iter__(self) -> Iterator[str]:
        return iter([*CORE, *parts(PLUG)])

    def __len__(self) -> int:
        return len(CORE) + len(parts(PLUG))


KINDS = Kinds()
