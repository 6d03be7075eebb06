"""The catalogue of synchronous machines, by the names that PSS/E gives them."""

from exfit.errors import ModelError
from exfit.models.machines.machine import Axes, Machine, Source
from exfit.models.machines.one_axis import ONE_AXIS
from exfit.models.machines.round_rotor import GENROE, GENROU
from exfit.models.machines.salient_pole import GENSAE, GENSAL

__all__ = ["MACHINES", "Axes", "Machine", "Source", "find_machine"]

MACHINES: dict[str, Machine] = {
    machine.name: machine for machine in (GENROU, GENROE, GENSAL, GENSAE, ONE_AXIS)
}


def find_machine(name: str) -> Machine:
    """Return the machine of a catalogue name; raises ModelError where there is none."""
    if name.upper() in MACHINES:
        return MACHINES[name.upper()]
    raise ModelError(f"{name} is not a machine model ({', '.join(MACHINES)})")
