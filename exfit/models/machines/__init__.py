"""The catalogue of synchronous machines, by the names that PSS/E gives them."""

from exfit.models.machines.machine import Axes, Machine, Source
from exfit.models.machines.one_axis import ONE_AXIS
from exfit.models.machines.round_rotor import GENROE, GENROU
from exfit.models.machines.salient_pole import GENSAE, GENSAL

__all__ = ["MACHINES", "Axes", "Machine", "Source"]

MACHINES: dict[str, Machine] = {
    machine.name: machine for machine in (GENROU, GENROE, GENSAL, GENSAE, ONE_AXIS)
}
