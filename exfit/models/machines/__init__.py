"""The catalogue of synchronous machines, by the names that PSS/E gives them."""

from collections.abc import Iterator, Mapping

from exfit.errors import ModelError
from exfit.models.machines.machine import Axes, Machine, Source
from exfit.registry import LazyPart

__all__ = ["MACHINES", "Axes", "Machine", "Source", "find_machine"]


class Machines(Mapping[str, Machine]):
    """Machines by name, each imported when it is asked for."""

    FILES: Mapping[str, str] = {
        "GENROU": "round_rotor",
        "GENROE": "round_rotor",
        "GENSAL": "salient_pole",
        "GENSAE": "salient_pole",
        "GENTPJ": "gentpj",
        "GENQEC": "genqec",
        "GENQEJ": "genqec",
        "ONE_AXIS": "one_axis",
    }

    def __getitem__(self, name: str) -> Machine:
        machine: Machine = LazyPart(f"{__name__}.{self.FILES[name]}:{name}").load()
        return machine

    def __contains__(self, name: object) -> bool:
        return name in self.FILES

    def __iter__(self) -> Iterator[str]:
        return iter(self.FILES)

    def __len__(self) -> int:
        return len(self.FILES)


MACHINES = Machines()


def find_machine(name: str) -> Machine:
    """Find the machine of a catalogue name; raises ModelError where there is none."""
    if name.upper() in MACHINES:
        return MACHINES[name.upper()]
    raise ModelError(f"{name} is not a machine model ({', '.join(MACHINES)})")
