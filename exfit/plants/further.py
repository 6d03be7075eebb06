"""A further unit at the point where that of a case is measured."""

from typing import NamedTuple

from exfit.models.machines import Machine
from exfit.models.sheet import Model
from exfit.plants import Stabilised


class FurtherUnit(NamedTuple):
    """A unit beside the case's at the same point of measurement; ``prefix`` begins its names."""

    exciter: Model
    machine: Machine
    stabiliser: Stabilised | None
    governor: Model | None
    prefix: str
