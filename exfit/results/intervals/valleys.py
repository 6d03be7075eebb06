"""Flat valleys: minima between which no point of a way is so high that the records refute it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from exfit.estimate import half_square
from exfit.fitting.descents import short_descent
from exfit.fitting.residuals import Residuals

Array = NDArray[np.float64]

STEPS = 8  # of a way from one minimum to another
JUMP = 2.5  # steps: what moves by more at once has left the valley
MOST_ITERATIONS = 10  # down to the floor of a valley, from a point that lies nearly on it


def valleys(
    residuals: Residuals, minima: Sequence[Array], first: int, allowed: float
) -> list[int | None]:
    """Return in which valley each minimum (N,) lies, that of the ``first`` one being valley 0.

    None for one whose cost exceeds the ``allowed`` one, beyond which the records refute a point.
    """
    costs = residuals.costs(minima)
    order = sorted(range(len(minima)), key=lambda place: (place != first, costs[place]))
    found: list[list[int]] = []
    for place in order:
        if place != first and not costs[place] <= allowed:
            continue
        ways = (
            valley
            for valley in found
            for member in valley
            if is_way(residuals, minima[member], minima[place], allowed)
        )
        valley = next(ways, None)
        if valley is None:
            found.append([place])
        else:
            valley.append(place)
    number = {place: k for k, valley in enumerate(found) for place in valley}
    return [number.get(place) for place in range(len(minima))]


def is_way(residuals: Residuals, one: Array, other: Array, allowed: float) -> bool:
    """Return whether a way leads from one point (N,) to another on which no cost is too high.

    The parameter that differs most goes from one to the other in even steps, and the others follow.
    Where they would have to jump there is none.
    """
    k = int(np.argmax(np.abs(other - one)))
    farthest = JUMP * abs(float(other[k] - one[k])) / STEPS
    here = one
    for left in range(STEPS, 1, -1):
        there = _on_floor(residuals, here + (other - here) / left, k, allowed)
        if there is None or np.max(np.abs(there - here)) > farthest:
            return False
        here = there
    return bool(np.max(np.abs(other - here)) <= farthest)


def _on_floor(residuals: Residuals, point: Array, k: int, allowed: float) -> Array | None:
    """Return a point (N,) itself, or one below it with the same k; None where none is allowed."""
    if residuals.costs([point])[0] <= allowed:
        return point
    held = residuals.free[k]
    fixed = {**residuals.fixed, held.name: held.value(float(point[k]))}
    free = [parameter for parameter in residuals.free if parameter is not held]
    others = replace(residuals, free=free, fixed=fixed, counter=None)
    end = short_descent(
        others,
        np.delete(point, k),
        MOST_ITERATIONS,
        matches=lambda errors: half_square(errors) <= allowed,
    )
    return None if end is None or end.cost > allowed else np.insert(end.x, k, point[k])
