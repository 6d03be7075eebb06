"""Which values only one branch of a choice needs: they are computed there, or not at all."""

from collections.abc import Callable, Container, Sequence

from exfit.engine.trace import Node, in_order

Region = tuple[tuple[int, int], ...]  # the choices around it, outermost first, with the branch


def regions(
    targets: Sequence[Node], known: Container[object], branches: Callable[[Node], bool]
) -> dict[Region, list[Node]]:
    """Return what the targets need beyond the known nodes, in order, by where it is computed."""
    places: dict[Node, Region] = dict.fromkeys(targets, ())
    contents: dict[Region, list[Node]] = {}
    for node in reversed(list(in_order(targets))):
        if node not in places or node in known or node.constant is not None:
            continue
        region = places[node]
        contents.setdefault(region, []).append(node)
        apart = branches(node)
        for position, operand in enumerate(node.operands):
            place = (*region, (node.index, position)) if apart and position else region
            places[operand] = _around(places.get(operand, place), place)
    return {region: nodes[::-1] for region, nodes in contents.items()}


def _around(a: Region, b: Region) -> Region:
    """Return the innermost region around both."""
    shared = 0
    while shared < min(len(a), len(b)) and a[shared] == b[shared]:
        shared += 1
    return a[:shared]
