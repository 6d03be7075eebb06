"""Which parameters of a test run in the short tier, with the long tests, or in no gate."""

import pytest


def few_of(values, count, whole=False):
    """Return the parameters of a test, all but so many marked as long; they are spread evenly.

    ``whole``: a tuple is one argument, not several.
    """
    values = [*values]
    short = {index * len(values) // count for index in range(count)}
    return [value if index in short else _long(value, whole) for index, value in enumerate(values)]


def examples_of(values, count):
    """Spread so many examples of a law over its parameters; the others run with --models=all."""
    values = [*values]
    taken = {index * len(values) // count for index in range(count)}
    return [
        value if index in taken else _marked(value, pytest.mark.every_example)
        for index, value in enumerate(values)
    ]


def _long(value, whole):
    return _marked(value, pytest.mark.long, whole)


def _marked(value, mark, whole=False):
    values = (value,) if whole or not isinstance(value, tuple) else value
    return pytest.param(*values, marks=mark)
