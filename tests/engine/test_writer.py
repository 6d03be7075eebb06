"""The order of computing: in a branch what it alone needs, and one branch for equal conditions."""

from exfit.engine.trace import Graph, exp, log, sqrt, where
from exfit.engine.writer import Choice, plan


def steps(targets, known):
    """Return a plan by the numbers of its nodes, every select being a branch."""

    def numbers(plan):
        return [
            ([n.index for n in step.nodes], *map(numbers, step.branches))
            if isinstance(step, Choice)
            else step.index
            for step in plan
        ]

    return numbers(plan(targets, known))


def symbols(names="xy"):
    graph = Graph()
    return [graph.symbol(name, varies=True) for name in names]


def test_a_value_is_computed_in_the_innermost_branch_around_all_its_uses():
    x, y = symbols()
    root, both, known, shared = sqrt(x), exp(y), 2.0 * y, log(y)
    below, rooted = y < 1.0, shared + root
    inner = where(below, rooted, shared)
    negative, first, second = x < 0.0, both + known, both + inner
    outer = where(negative, first, second)
    choice = ([inner.index], [root.index, rooted.index], [])
    assert steps([outer], {x, y, known}) == [
        both.index,
        negative.index,
        ([outer.index], [first.index], [shared.index, below.index, choice, second.index]),
    ]


def test_a_value_that_is_a_target_itself_is_computed_outside():
    (x,) = symbols("x")
    root, negative = sqrt(x), x < 0.0
    choice = where(negative, 0.0, root)
    assert steps([choice, root], {x}) == [root.index, negative.index, ([choice.index], [], [])]


def test_one_condition_is_decided_once_for_all_that_it_chooses():
    x, y = symbols()
    negative, root = x < 0.0, sqrt(x)
    first, half = where(negative, y, root), 0.5 * root
    second = where(negative, 1.0, half)
    after = first + second
    together = ([first.index, second.index], [], [root.index, half.index])
    assert steps([after], {x, y}) == [negative.index, together, after.index]


def test_a_choice_that_needs_another_of_the_same_condition_comes_after_it():
    x, y = symbols()
    negative = x < 0.0
    first = where(negative, y, 1.0)
    product = first * y
    second = where(negative, x, product)
    assert steps([second, product], {x, y}) == [
        negative.index,
        ([first.index], [], []),
        product.index,
        ([second.index], [], []),
    ]


def test_choices_that_would_wait_for_each_other_stay_apart():
    x, y = symbols()
    a, b = x < 0.0, y < 0.0
    first_a, first_b = where(a, x, 1.0), where(b, y, 2.0)
    second_b = where(b, 3.0 + first_a, x)
    second_a = where(a, 4.0 + first_b, y)
    targets = [first_a, first_b, second_a, second_b]
    chosen = [step for step in steps(targets, {x, y}) if isinstance(step, tuple)]
    assert [nodes for nodes, *_ in chosen] == [
        [first_a.index],
        [first_b.index, second_b.index],
        [second_a.index],
    ]
