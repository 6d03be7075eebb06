"""Responses of models beside the transfer functions that their block diagrams print."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

Function = Callable[[complex, Mapping[str, float]], Sequence[complex]]


def assert_is_its_function(
    function: Function,
    response: np.ndarray,
    values: Mapping[str, float],
    frequencies: np.ndarray,
    tolerance: float,
) -> None:
    """Assert that a response (frequencies, inputs) is that of a function of s, to a share."""
    expected = np.array([function(2j * np.pi * f, values) for f in frequencies])
    assert np.abs(response - expected).max() < tolerance * np.abs(expected).max()
