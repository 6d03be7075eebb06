"""The load controller of a governor of a case."""

from collections.abc import Callable
from typing import Any

from exfit.case.parts import Data, Part, added_part
from exfit.models import LOAD_CONTROLLERS
from exfit.models.load_control import controlled
from exfit.models.sheet import Model
from exfit.plants import LOAD_CONTROLLER, MOVING_PREF
from exfit.util.text import Place

PLACE = ("governor", "load_controller")


def with_load_controller(
    governor: Model | None, unit: Data, at: Place, prefix: str, named: Callable[..., Any]
) -> tuple[Model | None, tuple[Part, ...]]:
    """Return a unit's governor with the load controller beside it, and that as a part.

    ``at`` is the place of the unit, and ``prefix`` begins the names of its parameters. ``named``
    finds what a section names in a catalogue, and adds a fault where there is none.
    """
    place, section = (*at, *PLACE), unit[PLACE[0]].get(PLACE[1])
    controller = named(section, (*place, "model"), LOAD_CONTROLLERS, LOAD_CONTROLLER)
    if controller is None or governor is None:
        return governor, ()
    kind = f"{prefix}{MOVING_PREF}"[:-1] if prefix else LOAD_CONTROLLER
    part = added_part(kind, prefix + MOVING_PREF, controller, place)
    return controlled(governor, controller), (part,)
