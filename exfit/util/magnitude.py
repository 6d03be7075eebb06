"""How large and how small the numbers are that exfit computes with."""

from math import isfinite

LARGEST = 1e100  # its squares and cubes are numbers still
SMALLEST = 1e-100  # but 0: of a smaller one the square loses its digits


def magnitude_fault(value: float) -> str | None:
    """Give the fault of a number that is too large or too near 0, None where it has none."""
    if not isfinite(value):
        return f"{value:g} is not a finite number"
    if abs(value) > LARGEST:
        return f"{value:g} exceeds {LARGEST:g}"
    if 0.0 < abs(value) < SMALLEST:
        return f"{value:g} is not 0, but below {SMALLEST:g}"
    return None
