"""What contradicts itself in a plant that another program simulates."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.parts import EXTERNAL, Parts, plants_of_records
from exfit.case.yaml import Fault
from exfit.plants import KINDS
from exfit.util.text import near


def external_faults(content: ContentNode, parts: Parts) -> Iterator[Fault]:
    """Yield keys that the twin does not have, names that are none, and what takes many runs."""
    plant = content.at("plant")
    if plant.at("type").value != EXTERNAL:
        return
    twin = KINDS.get(str(plant.at("twin").value))
    if twin is not None and not twin.on_load:
        for key in ("network", "swing"):
            if key in plant:
                yield plant.at(key).fault(f"not allowed with twin {twin.name}")
    symbols = [part.prefix + symbol for part in parts.all for symbol in part.symbols]
    for name in plant.at("names").content:
        if name not in symbols:
            yield plant.at("names", name).fault(f"not a parameter; {near(name, symbols)}")
    for place in plants_of_records(content.content):
        yield content.at(*place).fault("not allowed with plant external")
    if content.at("estimate", "search").value == "global":
        yield content.at("estimate", "search").fault(
            "global: not allowed with plant external, whose runs take long; must be local"
        )
