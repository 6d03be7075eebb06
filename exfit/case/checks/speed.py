"""What contradicts itself in a speed that is not the rated one."""

from collections.abc import Iterator

from exfit.case.checks.node import ContentNode
from exfit.case.yaml import Fault
from exfit.plants import PlantKind
from exfit.util.text import show

FARTHEST = 0.3  # pu, from the rated one


def speed_faults(test: ContentNode, kind: PlantKind) -> Iterator[Fault]:
    """Yield the faults of the speed of a test, and of its change."""
    for key, rated in (("speed", 1.0), ("speed_change", 0.0)):
        node = test.at(key)
        if key in test and not kind.off_line:
            yield node.fault(f"not allowed with plant {kind.name}")
        for place in (node, *map(node.at, ("min", "start", "max"))):
            if place.number is not None and abs(place.number - rated) > FARTHEST:
                limits = f"{rated - FARTHEST:g} ... {rated + FARTHEST:g}"
                yield place.fault(f"{show(place.number)} pu lies outside {limits}")
