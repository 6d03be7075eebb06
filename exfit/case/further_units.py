"""The further units of a case: their parts, named as those of its own unit behind a prefix."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from exfit.case.load_controller import with_load_controller
from exfit.case.parts import Contradictions, Data, Part, Parts, added_part, machine_part
from exfit.models import GOVERNORS, MODELS, STABILISERS
from exfit.models.machines import MACHINES
from exfit.plants import FURTHER, NETWORK, PlantKind, Stabilised
from exfit.plants.further import FurtherUnit
from exfit.util.text import Place

OF_UNIT: Mapping[str, Mapping[str, Any]] = {
    "exciter": MODELS,
    "machine": MACHINES,
    "stabiliser": STABILISERS,
    "governor": GOVERNORS,
}


def with_further_units(
    own: Parts, entries: Sequence[Any], kind: PlantKind, named: Callable[..., Any]
) -> Parts:
    """Return parts with those of further units, and the units that have exciter and machine.

    ``named`` finds what a section names in a catalogue, and adds a fault where there is none.
    """
    units, parts = list[FurtherUnit](), list[Part]()
    for at, given in enumerate(entries):
        entry: Data = given if isinstance(given, dict) else {}
        place, prefix = ("further_units", at), f"{FURTHER}{at + 2}."
        found: dict[str, Any] = {
            key: named(entry.get(key), (*place, key, "model"), catalogue, key)
            for key, catalogue in OF_UNIT.items()
        }
        for key, model in found.items():
            if model is not None:
                machine = key == "machine"
                part = machine_part(model, True) if machine else added_part(key, "", model)
                begin = prefix if key == "exciter" else f"{prefix}{key}."
                parts.append(replace(part, kind=begin[:-1], prefix=begin, section=(*place, key)))
        if isinstance(entry.get("governor"), dict):
            moved = with_load_controller(found["governor"], entry, place, prefix, named)
            found["governor"], controller = moved
            parts += controller
        parts.append(_place_part(entry.get("network"), prefix + NETWORK, place, kind))
        if (model := found["stabiliser"]) is not None:
            heard = entry["stabiliser"].get("inputs")
            inputs = tuple(heard) if isinstance(heard, list) and heard else model.inputs
            found["stabiliser"] = Stabilised(model, inputs)
        if found["exciter"] is not None and found["machine"] is not None:
            units.append(FurtherUnit(**found, prefix=prefix))
    return own._replace(all=(*own.all, *parts), further=tuple(units))


def _place_part(given: Any, prefix: str, place: Place, kind: PlantKind) -> Part:
    """Return the part of what lies between a further unit and the point of measurement."""

    def check(values: Mapping[str, float]) -> Contradictions:
        for symbol in ("base", "share_P", "share_Q"):
            if not isinstance(given, dict) or symbol not in given:
                yield symbol, "is missing"

    return Part(prefix[:-1], "the network", prefix, kind.beside, place, "network", check)
