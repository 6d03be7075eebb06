"""Which parameters of a test run in the short tier, and which with the long tests alone."""

import pytest


def few_of(values, count, whole=False):
    """Return the parameters of a test, all but so many marked as long; they are spread evenly.

    ``whole``: a tuple is one argument, not several.
    """
    values = [*values]
    short = {index * len(values) // count for index in range(count)}
    return [value if index in short else _long(value, whole) for index, value in enumerate(values)]


def _long(value, whole):
    values = (value,) if whole or not isinstance(value, tuple) else value
    return pytest.param(*values, marks=pytest.mark.long)
