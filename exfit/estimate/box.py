"""Where a search may go, in what units, and whether it can start at a given point."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.arrays import Array


@dataclass(frozen=True)
class Box:
    """The bounds, and the distance that counts as one unit of each variable; all (N,)."""

    low: Array
    high: Array
    unit: Array

    def projected(self, x: Array, gradient: Array) -> Array:
        """Return the gradient without the components that push out of an active bound."""
        held = ((x <= self.low) & (gradient > 0.0)) | ((x >= self.high) & (gradient < 0.0))
        return np.where(held, 0.0, gradient)

    def inside(self, x: Array) -> Array:
        """Return x without the rounding error that may have carried it outside."""
        return np.minimum(np.maximum(x, self.low), self.high)


def checked(
    x0: ArrayLike, bounds: tuple[ArrayLike, ArrayLike], x_scale: ArrayLike | None
) -> tuple[Array, Box]:
    """Return the start and its box, or raise ValueError."""
    x = np.array(x0, dtype=np.float64, ndmin=1)
    if x.ndim != 1 or x.size == 0 or not np.isfinite(x).all():
        raise ValueError("x0 must be finite numbers in one dimension")
    low, high = (alike(b, x, "bounds") for b in bounds)
    for j in np.flatnonzero(~(low <= high)):
        raise ValueError(f"bounds[{j}]: {low[j]} exceeds {high[j]}")
    for j in np.flatnonzero((x < low) | (x > high)):
        raise ValueError(f"x0[{j}]: {x[j]} lies outside {low[j]} ... {high[j]}")
    unit = typical(x, high - low) if x_scale is None else alike(x_scale, x, "x_scale")
    if not (np.isfinite(unit).all() and (unit > 0.0).all()):
        raise ValueError("x_scale must be finite and positive")
    return x, Box(low, high, unit)


def alike(values: ArrayLike, x: Array, name: str) -> Array:
    """Return the values, one for each variable, or raise ValueError."""
    try:
        return np.broadcast_to(np.asarray(values, dtype=np.float64), x.shape)
    except ValueError:
        raise ValueError(f"{name} must be a number or have the shape {x.shape}") from None


def typical(x: Array, width: Array) -> Array:
    """Return the size a variable seems to have: its start's, or a tenth of its range."""
    size = np.maximum(abs(x), np.where(np.isfinite(width), 0.1 * width, 0.0))
    return np.where(size > 0.0, size, 1.0)
