"""Where values are computed: in the branch that alone needs them, else before the choice."""

from exfit.engine.choices import regions
from exfit.engine.trace import Graph, exp, log, sqrt, where


def places(targets, known):
    """Return the numbers of the nodes in each region, every choice being a branch."""
    contents = regions(targets, known, lambda node: node.op == "select")
    return {region: [node.index for node in nodes] for region, nodes in contents.items()}


def test_a_value_is_computed_in_the_innermost_branch_around_all_its_uses():
    graph = Graph()
    x, y = (graph.symbol(name, varies=True) for name in "xy")
    root, both, known, shared = sqrt(x), exp(y), 2.0 * y, log(y)
    below, rooted = y < 1.0, shared + root
    inner = where(below, rooted, shared)
    negative, first, second = x < 0.0, both + known, both + inner
    outer = where(negative, first, second)
    assert places([outer], {x, y, known}) == {
        (): [both.index, negative.index, outer.index],
        ((outer.index, 1),): [first.index],
        ((outer.index, 2),): [shared.index, below.index, inner.index, second.index],
        ((outer.index, 2), (inner.index, 1)): [root.index, rooted.index],
    }


def test_a_value_that_is_a_target_itself_is_computed_outside():
    graph = Graph()
    x = graph.symbol("x", varies=True)
    root, negative = sqrt(x), x < 0.0
    choice = where(negative, 0.0, root)
    assert places([choice, root], {x}) == {(): [root.index, negative.index, choice.index]}
