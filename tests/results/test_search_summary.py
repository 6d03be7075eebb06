"""A search in a sentence: how many descents led where, and what the record says of it."""

import numpy as np
import pytest

from exfit.results.model import Minima, Minimum, multiple


def minima(*others, best=(1.0, 9), unfinished=0, failed=0, own=1):
    """Return minima of which each is given by cost, descents and whether it is refuted."""
    every = [Minimum({}, *best, 0.0, False)]
    every += [Minimum({}, cost, count, 5.0, refuted) for cost, count, refuted in others]
    ends = [each.cost for each in every for _ in range(each.starts)]
    ends += [np.nan] * (unfinished + failed)
    starts = [10.0] * (len(ends) - failed) + [np.inf] * failed
    ways = ("strategy",) * own + ("direct",) * (len(ends) - own)
    return Minima(tuple(every), np.array(starts), np.array(ends), ways)


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (minima(), "from the start of the case and 8 further starts: 9 of 9 descents lead to"),
        (minima(best=(1.0, 2)), "1 further start: 2 of 2 descents"),
        (minima((4.68, 3, True)), "9 of 12 descents lead to this minimum, 3 to one 4.68 times"),
        (minima((1.003, 2, False)), ", 2 to one 1.003 times as high (not refuted)"),
        (minima((1.5, 2, None)), ", 2 to one 1.500 times as high"),
        (
            minima((1.003, 1, False), (2.0, 2, True), (9.0, 1, True)),
            ", 1 to one 1.003 times as high (not refuted), 3 to 2 others, 2.00 times",
        ),
        (minima(failed=2), ", 2 to none: no response"),
        (minima(unfinished=3, own=2), "10 further starts: 9 of 12 descents lead to this"),
        (minima(unfinished=3), "minimum, 3 not done"),
    ],
)  # fmt: skip
def test_the_sentence_counts_every_descent(found, words):
    assert words in found.summary(1.0)


def test_a_point_that_is_no_minimum_is_not_called_one():
    words = "0 of 9 descents lead to this point, 9 to one 2.00 times as high"
    assert words in minima().summary(0.5)


@pytest.mark.parametrize(
    ("ratio", "text"),
    [(1.0032, "1.003"), (0.997, "0.997"), (4.681, "4.68"), (84.32, "84.3"), (12358.4, "12358")],
)
def test_a_multiple_has_the_digits_that_tell_it_from_another(ratio, text):
    assert multiple(ratio) == f"{text} times"
