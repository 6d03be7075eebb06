"""What a search makes small: asked for, counted, differentiated, and never trusted to be finite."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Literal

import numpy as np

from exfit.estimate.arrays import EPS, UNSEEN, Array
from exfit.estimate.box import Box
from exfit.estimate.requests import Functions, Steps, jacobian_at, residuals_at

Differences = Literal["2-point", "3-point"]

RELATIVE_STEP = {"2-point": EPS ** (1 / 2), "3-point": EPS ** (1 / 3)}
JACOBIAN_ERROR = {"2-point": 1e-7, "3-point": 1e-9, "exact": UNSEEN}  # with a margin


class EvaluationLimit(Exception):
    """More residuals were asked for than a search may have."""


@dataclass(frozen=True)
class Point:
    """A point, its residuals (M,) and their cost."""

    x: Array
    residuals: Array
    cost: float


def half_square(residuals: Array) -> float:
    """Return half the sum of squares; what is not a number costs infinity."""
    total = 0.5 * float(residuals @ residuals)
    return total if isfinite(total) else inf


class Problem:
    """Asks for residuals and Jacobians, counts them and remembers the best trial.

    ``differences`` takes the Jacobian from residuals nearby; without it the functions give it.
    """

    def __init__(
        self,
        functions: Functions,
        differences: Differences | None,
        box: Box,
        scaled: bool,
        jacobian_error: float | None = None,
        most_evaluations: int | None = None,
    ) -> None:
        self.functions, self.differences, self.box, self.scaled = (
            functions,
            differences,
            box,
            scaled,
        )
        usual = JACOBIAN_ERROR[differences or "exact"]
        self.unseen = usual if jacobian_error is None else jacobian_error
        self.most_evaluations = most_evaluations
        self.nfev = self.njev = 0
        self.best: Point | None = None

    def evaluate(self, x: Array) -> Steps[Point]:
        """Return the point x."""
        (r,) = yield from self.residuals([x])
        point = Point(x, r, half_square(r))
        if self.best is None or point.cost < self.best.cost:
            self.best = point
        return point

    def residuals(self, points: Sequence[Array]) -> Steps[Sequence[Array]]:
        """Return the residuals (M,) at some points, or raise EvaluationLimit."""
        most = self.most_evaluations
        if most is not None and self.nfev + len(points) > most:
            raise EvaluationLimit
        self.nfev += len(points)
        return (yield from residuals_at(self.functions, points))

    def jacobian(self, point: Point) -> Steps[Array]:
        """Return J, shape (M, N); not finite where there is none."""
        self.njev += 1
        shape = (len(point.residuals), len(point.x))
        if self.differences is not None:
            return (yield from self.quotients(point))
        J = yield from jacobian_at(self.functions, point.x)
        if J.shape == (1, 1) and not isfinite(J[0, 0]):
            return np.full(shape, nan)
        if J.shape != shape:
            raise ValueError(f"jac must return shape {shape}, not {J.shape}")
        return J

    def quotients(self, point: Point) -> Steps[Array]:
        """Return J by differences: the slope of the line or parabola through residuals nearby."""
        offsets = [self.offsets(x, j) for j, x in enumerate(point.x)]
        nearby = [
            self.shifted(point.x, j, h) for j, distances in enumerate(offsets) for h in distances
        ]
        residuals = iter((yield from self.residuals(nearby)) if nearby else ())
        J = np.zeros((len(point.residuals), len(point.x)))
        for j, distances in enumerate(offsets):
            rises = [next(residuals) - point.residuals for _ in distances]
            if len(distances) == 1:
                J[:, j] = rises[0] / distances[0]
            elif distances:
                near, far = distances
                J[:, j] = (rises[0] * (far / near) - rises[1] * (near / far)) / (far - near)
        return J

    def offsets(self, x: float, j: int) -> tuple[float, ...]:
        """Return how far to go: both ways, or towards the farther bound; none if it is fixed."""
        below, above = x - self.box.low[j], self.box.high[j] - x
        if below == above == 0.0:
            return ()
        central = self.differences == "3-point"
        h = RELATIVE_STEP["3-point" if central else "2-point"] * max(abs(x), self.box.unit[j])
        if central and h <= min(below, above):
            wanted = [h, -h]
        else:
            h = min(h, 0.5 * max(below, above)) * (1.0 if above >= below else -1.0)
            wanted = [h, 2.0 * h] if central else [h]
        offsets = tuple(float((x + w) - x) for w in wanted)
        return offsets if all(offsets) else ()  # a box as narrow as rounding leaves no room

    def shifted(self, x: Array, j: int, h: float) -> Array:
        """Return the point a distance h away along one variable."""
        x = x.copy()
        x[j] += h
        return self.box.inside(x)
