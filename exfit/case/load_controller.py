"""The load controller of a case's governor."""

from collections.abc import Callable
from typing import Any

from exfit.case.parts import Data, Parts, added_part
from exfit.models import LOAD_CONTROLLERS
from exfit.models.load_control import controlled
from exfit.plants import LOAD_CONTROLLER, MOVING_PREF

PLACE = ("governor", "load_controller")


def with_load_controller(found: Parts, section: Data, named: Callable[..., Any]) -> Parts:
    """Return parts whose governor has the load controller of its section, with that as a part.

    ``named`` finds what a section names in a catalogue, and adds a fault where there is none.
    """
    own, model = section[PLACE[-1]], (*PLACE, "model")
    controller = named(own, model, LOAD_CONTROLLERS, LOAD_CONTROLLER)
    if controller is None or found.governor is None:
        return found
    part = added_part(LOAD_CONTROLLER, MOVING_PREF, controller, PLACE)
    governor = controlled(found.governor, controller)
    return found._replace(governor=governor, all=(*found.all, part))
