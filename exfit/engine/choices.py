"""In which order a graph is computed, with branches: what only one of them needs is in it alone."""

import heapq
from collections import Counter
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass

from exfit.engine.trace import Node, in_order

Branch = tuple[int, int]  # of which choice, and the position of what it chooses: 1 or 2
OUTSIDE: Branch = (-1, 0)


@dataclass(frozen=True)
class Choice:
    """Values that one condition chooses together, and what is computed before in either case."""

    nodes: tuple[Node, ...]
    branches: tuple["Plan", "Plan"]

    @property
    def condition(self) -> Node:
        """The condition that they share."""
        return self.nodes[0].operands[0]


Plan = tuple[Node | Choice, ...]


def plan(
    targets: Sequence[Node], known: Container[object], branches: Callable[[Node], bool]
) -> Plan:
    """Return the order in which to compute what the targets need beyond the known nodes."""
    needed = dict.fromkeys(targets, True)
    for node in reversed(list(in_order(targets))):
        if node in needed and (node in known or node.constant is not None):
            del needed[node]
        elif node in needed:
            needed.update(dict.fromkeys(node.operands, True))
    return _plan(sorted(needed, key=lambda node: node.index), targets, branches)


def _plan(nodes: Sequence[Node], targets: Iterable[Node], branches: Callable[[Node], bool]) -> Plan:
    """Return the order of some nodes, which come after their operands."""
    selects = {node: node.index for node in nodes if branches(node)}
    if not selects:
        return tuple(nodes)
    places = _places(nodes, targets, selects)
    choices = _choices(nodes, {node for node in selects if places[node] == OUTSIDE})
    places = _places(nodes, targets, choices)
    contents: dict[Branch, list[Node]] = {}
    for node in nodes:
        contents.setdefault(places[node], []).append(node)
    members: dict[int, list[Node]] = {}
    for node in contents[OUTSIDE]:
        if node in choices:
            members.setdefault(choices[node], []).append(node)

    def branch(choice: int, position: int) -> Plan:
        chosen = [node.operands[position] for node in members[choice]]
        return _plan(contents.get((choice, position), ()), chosen, branches)

    at = {node.index: node for node in contents[OUTSIDE]}
    order = _order(_followers(nodes, places, choices))
    return tuple(
        Choice(tuple(members[unit]), (branch(unit, 1), branch(unit, 2)))
        if unit in members
        else at[unit]
        for unit in order
    )


def _places(
    nodes: Sequence[Node], targets: Iterable[Node], choices: Mapping[Node, int]
) -> dict[Node, Branch]:
    """Return the branch that alone needs a node, or OUTSIDE."""
    places = dict.fromkeys(targets, OUTSIDE)
    for node in reversed(nodes):
        place = places[node]
        apart = place == OUTSIDE and node in choices
        for position, operand in enumerate(node.operands):
            here = (choices[node], position) if apart and position else place
            places[operand] = here if places.get(operand, here) == here else OUTSIDE
    return places


def _choices(nodes: Sequence[Node], selects: Container[Node]) -> dict[Node, int]:
    """Put selects of the same condition into one choice if none needs another's value.

    A choice is named by the index of its first node; sets of choices are the bits of a number.
    """
    choices: dict[Node, int] = {}
    needs: dict[int, int] = {}
    alike: dict[Node, list[int]] = {}
    before: dict[Node, int] = {}
    for node in nodes:
        needed = 0
        for operand in node.operands:
            needed |= before.get(operand, 0)
        if node in selects:
            for choice, others in needs.items():
                needed |= others if needed >> choice & 1 else 0
            same = alike.setdefault(node.operands[0], [])
            choice = next((c for c in same if not needed >> c & 1), node.index)
            if choice == node.index:
                same.append(choice)
            needs[choice] = needs.get(choice, 0) | needed
            for other, others in needs.items():
                needs[other] |= needed if others >> choice & 1 else 0
            choices[node], needed = choice, 1 << choice
        before[node] = needed
    return choices


def _followers(
    nodes: Sequence[Node], places: Mapping[Node, Branch], choices: Mapping[Node, int]
) -> dict[int, set[int]]:
    """Return, for each node and choice outside by its index, those that need it."""
    units = {
        node: choices.get(node, node.index) if places[node] == OUTSIDE else places[node][0]
        for node in nodes
    }
    followers: dict[int, set[int]] = {unit: set() for unit in units.values()}
    for node, unit in units.items():
        for operand in node.operands:
            if operand in units and units[operand] != unit:
                followers[units[operand]].add(unit)
    return followers


def _order(followers: Mapping[int, set[int]]) -> list[int]:
    """Order nodes by what they follow, else by their indices."""
    waits = Counter(unit for after in followers.values() for unit in after)
    ready = sorted(followers.keys() - waits.keys())
    order = []
    while ready:
        order.append(heapq.heappop(ready))
        for unit in followers[order[-1]]:
            waits[unit] -= 1
            if not waits[unit]:
                heapq.heappush(ready, unit)
    return order
