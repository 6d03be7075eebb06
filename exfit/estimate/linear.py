"""The linear model fun(x + d) = fun(x) + J d at a point, and the steps it proposes."""

from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, nan, sqrt
from typing import NamedTuple

import numpy as np

from exfit.estimate.problem import (
    EPS,
    TINY,
    UNSEEN,
    Box,
    Point,
    Problem,
    SingularValuesOf,
    Steps,
    TriangleOf,
    norm,
)
from exfit.util.arrays import Array


def bounded_minimum(A: Array, b: Array, low: Array, high: Array, unseen: float = UNSEEN) -> Array:
    """Return y (N,), of small norm, that minimises |A y + b| over low <= y <= high; 0 lies within.

    A (M, N), b (M,); ``unseen``: the error of A, as a share of its largest singular value, below
    which a direction does not exist.

    An active set: every variable starts free unless the slope holds it on a bound; one that meets a
    bound is fixed there, and let go where the slope pulls it back.

    Source: Stark & Parker 1995, bounded-variable least squares; Lawson & Hanson 1974, ch. 23.
    """
    y, slope = np.zeros_like(low), A.T @ b
    fixed = (low == high) | ((low == 0.0) & (slope > 0.0)) | ((high == 0.0) & (slope < 0.0))
    tolerance = 10.0 * EPS * norm(A.ravel()) * norm(b)
    for _ in range(10 * len(y)):
        goal, rest = y.copy(), -(b + A[:, fixed] @ y[fixed])
        goal[~fixed] = np.linalg.lstsq(A[:, ~fixed], rest, rcond=unseen)[0]
        blocked = (goal < low) | (goal > high)
        if blocked.any():  # go until a variable meets its bound
            bound = np.where(goal < low, low, high)
            share = np.full(len(y), inf)
            share[blocked] = (bound - y)[blocked] / (goal - y)[blocked]
            hit = share <= share.min()
            between = np.minimum(np.maximum(y + share.min() * (goal - y), low), high)
            y, fixed = np.where(hit, bound, between), fixed | hit
            continue
        y, slope = goal, A.T @ (A @ goal + b)
        pull = np.where(fixed & (low < high), np.where(y == low, -slope, slope), 0.0)
        strongest = int(np.argmax(pull))
        if pull[strongest] <= tolerance:
            break
        fixed[strongest] = False
    return y


WEAKEST = 0.03  # of the norm of the largest column, in units: a smaller one counts as this


class DampedStep(NamedTuple):
    """Where the full step leads, its slope g^T d, and the decrease the model promises for it."""

    origin: Array
    target: Array
    slope: float
    promise: float

    def at(self, length: float) -> Array:
        """Return the point a fraction of the way along."""
        return self.target if length == 1.0 else self.origin + length * (self.target - self.origin)

    def promised(self, length: float) -> float:
        """Return the decrease the model promises for a fraction of the way."""
        return -self.slope * length + (self.promise + self.slope) * length**2


@dataclass(frozen=True)
class LinearModel:
    """The linear model at a point, in scaled variables y = scale * d within low <= y <= high.

    J / scale = U diag(singular) directions; amounts = U^T residuals; unseen: the share of the
    largest singular value below which a direction does not exist.
    """

    point: Point
    jacobian: Array
    gradient: Array
    projected: Array
    scale: Array
    singular: Array
    directions: Array
    amounts: Array
    low: Array
    high: Array
    unseen: float
    box: Box

    @property
    def finite(self) -> bool:
        """Whether the model can be used."""
        return bool(np.isfinite(self.jacobian).all())

    @cached_property
    def rank(self) -> int:
        """How many directions exist."""
        return int(np.count_nonzero(self.singular > self.unseen * max(self.singular[0], TINY)))

    @cached_property
    def full(self) -> DampedStep:
        """The Gauss-Newton step: least squares within the bounds, of minimum norm."""
        return solve(self)

    @property
    def highest_promise(self) -> float:
        """What the full step promised if there were no bounds: no step promises more."""
        amounts = self.amounts[: self.rank]
        return 0.5 * float(amounts @ amounts)

    def surely_longer(self, share: float) -> bool:
        """Tell whether the full step is longer than a share of its unit in some variable.

        That is so where the gradient of a variable that is no such share from a bound exceeds what
        such steps of all together change in it. It takes a tenth of the time of the step itself.
        """
        columns = self.singular[:, None] * self.directions * self.scale
        sizes = share * np.maximum(abs(self.point.x), self.box.unit)
        norms = np.sqrt(np.sum(columns**2, axis=0))
        unseen = self.unseen * self.singular[0] * self.scale * norm(self.amounts)
        limit = 2.0 * (norms * float(norms @ sizes) + unseen)
        room = np.minimum(self.point.x - self.box.low, self.box.high - self.point.x) > sizes
        return bool(np.any(room & (abs(self.gradient) > limit)))

    def carried_to(self, point: Point) -> "LinearModel":
        """Return the model at another point whose Jacobian is taken for the same."""
        gradient = self.jacobian.T @ point.residuals
        along = self.directions @ (gradient / self.scale)
        return replace(
            self,
            point=point,
            gradient=gradient,
            projected=self.box.projected(point.x, gradient),
            amounts=np.divide(
                along, self.singular, np.zeros_like(along), where=self.singular > 0.0
            ),
            low=self.scale * (self.box.low - point.x),
            high=self.scale * (self.box.high - point.x),
        )

    @cached_property
    def gradient_norm(self) -> float:
        """The Euclidean norm of the projected gradient."""
        return norm(self.projected)

    def scaled_length(self, x: Array) -> float:
        """Distance of x from here, in scaled variables."""
        return norm(self.scale * (x - self.point.x))


def blind(problem: Problem, point: Point, J: Array) -> LinearModel:
    """Return the model at a point where J is not finite: there are no directions."""
    unknown, none = np.full(len(point.x), nan), np.zeros(0)
    return LinearModel(
        point=point,
        jacobian=J,
        gradient=unknown,
        projected=unknown,
        scale=unknown,
        singular=none,
        directions=np.zeros((0, len(point.x))),
        amounts=none,
        low=unknown,
        high=unknown,
        unseen=problem.unseen,
        box=problem.box,
    )


def linearise(
    problem: Problem, point: Point, before: LinearModel | None = None
) -> Steps[LinearModel]:
    """Return the linear model at a point, scaled no less than the one before.

    It is factored by QR first, for the many residuals, then by the singular values of the corner.
    """
    J = yield from problem.jacobian(point)
    if not np.isfinite(J).all():
        return blind(problem, point, J)
    box, n = problem.box, len(point.x)
    gradient = J.T @ point.residuals
    scale = 1.0 / box.unit if problem.scaled else column_scale(J, box.unit, before)
    corner: Array = yield TriangleOf(np.column_stack([J, point.residuals]))
    left, singular, directions = yield SingularValuesOf(corner[:, :n] / scale)
    return LinearModel(
        point=point,
        jacobian=J,
        gradient=gradient,
        projected=box.projected(point.x, gradient),
        scale=scale,
        singular=singular,
        directions=directions,
        amounts=left.T @ corner[:, n],
        low=scale * (box.low - point.x),
        high=scale * (box.high - point.x),
        unseen=problem.unseen,
        box=box,
    )


def column_scale(J: Array, unit: Array, before: LinearModel | None) -> Array:
    """Return the largest norm each column has had (Moré 1978, section 6), or what counts as one.

    A variable that is hardly seen from here would else be free to go anywhere: no step may change
    it, in units, by more than 1 / `WEAKEST` times what the one that is seen best may change.
    """
    norms: Array = np.linalg.norm(J, axis=0)
    norms = np.maximum(norms, WEAKEST * np.max(norms * unit) / unit)
    if before is not None and before.finite:
        return np.maximum(norms, before.scale)
    return np.where(norms > 0.0, norms, 1.0)


def solve(linear: LinearModel, nu: float = 0.0, reach: float = inf) -> DampedStep:
    """Minimise |J d + R|^2 + nu |scale d|^2 within the bounds and |d| <= reach, unit by unit."""
    k = linear.rank
    s, V, b = linear.singular[:k], linear.directions[:k], linear.amounts[:k]
    limit = reach * linear.scale * linear.box.unit
    low, high = np.maximum(linear.low, -limit), np.minimum(linear.high, limit)
    y = -V.T @ (s * b / (s**2 + nu))
    if (y < low).any() or (y > high).any():
        rows = s[:, None] * V
        if nu > 0.0:
            rows, b = np.vstack([rows, sqrt(nu) * np.eye(len(y))]), np.append(b, np.zeros(len(y)))
        y = bounded_minimum(rows, b, low, high, linear.unseen)
    return step_to(linear, y)


def step_to(linear: LinearModel, y: Array) -> DampedStep:
    """Return the step d = y / scale; where it reaches a bound it ends on it exactly."""
    x, box = linear.point.x, linear.box
    target = box.inside(x + y / linear.scale)
    target = np.where(y <= linear.low, box.low, np.where(y >= linear.high, box.high, target))
    d = target - x
    change = linear.singular * (linear.directions @ (linear.scale * d))
    promise = -float(change @ (linear.amounts + 0.5 * change))
    return DampedStep(x, target, float(linear.gradient @ d), promise)
