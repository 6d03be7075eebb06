"""What contradicts itself in a plant that exfit does not simulate."""

from collections.abc import Iterable, Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.parts import OF_RECORD, Parts, kind_of, plants_of_records
from exfit.case.yaml import Fault
from exfit.plants import KINDS
from exfit.util.text import near

OF_TWIN = ("machine", "parameters", "free", "network", "dialect")


def external_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield keys that the twin does not have, names that are none, and what takes many runs."""
    plant = content.at("plant")
    kind = plant.at("type").value
    yield from _twin_faults(plant) if "twin" in plant else _named_faults(content, plant, parts)
    symbols = [part.prefix + symbol for part in parts.all for symbol in part.symbols]
    yield from _unknown(plant.at("names"), [*symbols, OF_RECORD[0]], "a parameter")
    plant_kind = kind_of(plant.content)
    yield from _unknown(plant.at("inputs"), plant_kind.events, f"an input of {plant_kind.name}")
    yield from _unknown(plant.at("outputs"), plant_kind.signals, f"a signal of {plant_kind.name}")
    for place in plants_of_records(content.content):
        yield content.at(*place).fault(f"not allowed with plant {kind}")
    if content.at("estimate", "search").value == "global":
        yield content.at("estimate", "search").fault(
            f"global: not allowed with plant {kind}, whose runs take long; must be local"
        )


def _twin_faults(plant: ContentNode) -> Iterator[Fault]:
    """Yield the missing and the superfluous keys of a twin."""
    if "machine" not in plant:
        yield plant.at("machine").fault("is missing")
    twin = KINDS.get(str(plant.at("twin").value))
    if twin is not None and not twin.on_load and "network" in plant:
        yield plant.at("network").fault(f"not allowed with twin {twin.name}")


def _named_faults(content: ContentNode, plant: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield the keys of a twin that is missing, and parameters that cannot be named as they are."""
    for key in OF_TWIN:
        if key in plant:
            yield plant.at(key).fault("only with plant.twin")
    if "model" in content.at("as_found"):
        yield content.at("as_found", "model").fault("only with plant.twin")
    for part in parts.all:
        for symbol in part.symbols:
            place = next(
                key for key in ("fixed", "free") if symbol in content.at("parameters", key)
            )
            if not symbol.isidentifier() or symbol in OF_RECORD:
                text = "not a name such as KA; give the program's name in plant.names"
                yield content.at("parameters", place, symbol).fault(text)


def _unknown(names: ContentNode, possible: Iterable[str], what: str) -> Iterator[Fault]:
    """Yield the keys that give a name to what does not exist."""
    words = [*possible]
    for name in names.content:
        if name not in words:
            yield names.at(name).fault(f"not {what}; {near(name, words)}")
