"""The user's functions: called, counted, differentiated, and never trusted to be finite."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.arrays import EPS, UNSEEN, Array
from exfit.estimate.box import Box

Function = Callable[[Array], ArrayLike]
Differences = Literal["2-point", "3-point"]

RELATIVE_STEP = {"2-point": EPS ** (1 / 2), "3-point": EPS ** (1 / 3)}
JACOBIAN_ERROR = {"2-point": 1e-7, "3-point": 1e-9, "exact": UNSEEN}  # with a margin


@dataclass(frozen=True)
class Point:
    """A point, its residuals (M,) and their cost."""

    x: Array
    residuals: Array
    cost: float


def half_square(residuals: Array) -> float:
    """Return half the sum of squares; what is not a number costs infinity."""
    with np.errstate(all="ignore"):
        total = 0.5 * float(residuals @ residuals)
    return total if isfinite(total) else inf


class Problem:
    """Calls fun and jac, counts the calls and remembers the best trial."""

    def __init__(
        self,
        fun: Function,
        jac: Differences | Function,
        box: Box,
        scaled: bool,
        jacobian_error: float | None = None,
    ) -> None:
        self.fun, self.jac, self.box, self.scaled = fun, jac, box, scaled
        usual = JACOBIAN_ERROR["exact" if callable(jac) else jac]
        self.unseen = usual if jacobian_error is None else jacobian_error
        self.nfev = self.njev = 0
        self.best: Point | None = None

    def evaluate(self, x: Array) -> Point:
        """Return the point x."""
        r = self.residuals(x)
        point = Point(x, r, half_square(r))
        if self.best is None or point.cost < self.best.cost:
            self.best = point
        return point

    def residuals(self, x: Array) -> Array:
        """Return fun(x), shape (M,), or one nan where arithmetic fails."""
        self.nfev += 1
        return residuals_at(self.fun, x)

    def jacobian(self, point: Point) -> Array:
        """Return J, shape (M, N); not finite where fun or jac fail."""
        self.njev += 1
        shape = (len(point.residuals), len(point.x))
        try:
            J = exact(self.jac, point.x) if callable(self.jac) else self.differences(point)
        except ArithmeticError:
            return np.full(shape, nan)
        if J.shape != shape:
            raise ValueError(f"jac must return shape {shape}, not {J.shape}")
        return J

    def differences(self, point: Point) -> Array:
        """Return J by differences, column by column."""
        return np.column_stack([self.column(point, j) for j in range(len(point.x))])

    def column(self, point: Point, j: int) -> Array:
        """Differentiate the line or parabola through the residuals here and nearby."""
        offsets = self.offsets(point.x[j], j)
        rises = [self.moved(point.x, j, h) - point.residuals for h in offsets]
        if not offsets:
            return np.zeros_like(point.residuals)
        if len(offsets) == 1:
            return rises[0] / offsets[0]
        near, far = offsets
        return (rises[0] * (far / near) - rises[1] * (near / far)) / (far - near)

    def offsets(self, x: float, j: int) -> tuple[float, ...]:
        """Return how far to go: both ways, or towards the farther bound; none if it is fixed."""
        below, above = x - self.box.low[j], self.box.high[j] - x
        if below == above == 0.0:
            return ()
        central = self.jac == "3-point"
        h = RELATIVE_STEP["3-point" if central else "2-point"] * max(abs(x), self.box.unit[j])
        if central and h <= min(below, above):
            wanted = [h, -h]
        else:
            h = min(h, 0.5 * max(below, above)) * (1.0 if above >= below else -1.0)
            wanted = [h, 2.0 * h] if central else [h]
        offsets = tuple(float((x + w) - x) for w in wanted)
        return offsets if all(offsets) else ()  # a box as narrow as rounding leaves no room

    def moved(self, x: Array, j: int, h: float) -> Array:
        """Return the residuals a distance h along one variable."""
        x = x.copy()
        x[j] += h
        return self.residuals(self.box.inside(x))


def residuals_at(fun: Function, x: Array) -> Array:
    """Return fun(x), shape (M,), or one nan where arithmetic fails."""
    try:
        with np.errstate(all="ignore"):
            r = np.array(fun(x.copy()), dtype=np.float64, ndmin=1)
    except ArithmeticError:
        return np.full(1, nan)
    if r.ndim != 1:
        raise ValueError(f"fun must return residuals in one dimension, not {r.shape}")
    return r


def exact(jac: Function, x: Array) -> Array:
    """Return J as the given function has it."""
    with np.errstate(all="ignore"):
        return np.array(jac(x.copy()), dtype=np.float64, ndmin=2)
