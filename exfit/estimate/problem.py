"""What a search makes small: asked for, counted, differentiated, and never trusted to be finite."""

from collections.abc import Callable, Generator, Sequence
from enum import Enum
from math import inf, isfinite, nan, sqrt
from typing import Any, Literal, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from exfit.util.arrays import Array

EPS = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)
UNSEEN = 1e-11  # share of the largest singular value: below it is only rounding


def norm(x: Array) -> float:
    """Return the Euclidean norm of x (N,), in a third of the time of NumPy's."""
    return sqrt(float(x @ x))


class Box(NamedTuple):
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
    if x_scale is None:  # the size of the start, or a tenth of the range
        width = high - low
        size = np.maximum(abs(x), np.where(np.isfinite(width), 0.1 * width, 0.0))
        unit = np.where(size > 0.0, size, 1.0)
    else:
        unit = alike(x_scale, x, "x_scale")
    if not (np.isfinite(unit).all() and (unit > 0.0).all()):
        raise ValueError("x_scale must be finite and positive")
    return x, Box(low, high, unit)


def alike(values: ArrayLike, x: Array, name: str) -> Array:
    """Return the values, one for each variable, or raise ValueError."""
    try:
        return np.broadcast_to(np.asarray(values, dtype=np.float64), x.shape)
    except ValueError:
        raise ValueError(f"{name} must be a number or have the shape {x.shape}") from None


Function = Callable[[Array], ArrayLike]
Done = TypeVar("Done")


class Functions(Protocol):
    """What is made small: residuals of several points at once, and their Jacobians."""

    def residuals(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the residuals (M,) at each of S points (N,), not finite where there are none."""

    def jacobians(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return the Jacobian (M, N) at each of S points (N,), not finite where there is none."""


class ResidualsAt(NamedTuple):
    """Asks for the residuals at some points (N,)."""

    functions: Functions
    points: Sequence[Array]


class JacobianAt(NamedTuple):
    """Asks for the Jacobian at a point (N,)."""

    functions: Functions
    point: Array


class TriangleOf(NamedTuple):
    """Asks for R of the QR decomposition of a matrix (M, N): (min(M, N), N)."""

    matrix: Array


class SingularValuesOf(NamedTuple):
    """Asks for U, s and V' of a matrix."""

    matrix: Array


Request = ResidualsAt | JacobianAt | TriangleOf | SingularValuesOf
Answer = Sequence[Array] | Array
Steps = Generator[Request, Any, Done]  # it is sent the Answer to each Request


class OneByOne(NamedTuple):
    """The user's functions of one point, which are never trusted to be finite.

    Where arithmetic fails the residuals are one nan, and so is the Jacobian.
    """

    fun: Function
    jac: Function | None = None

    def residuals(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return fun at each point."""
        residuals = list[Array]()
        for x in points:
            try:
                residuals.append(np.array(self.fun(x.copy()), dtype=np.float64, ndmin=1))
            except ArithmeticError:
                residuals.append(np.full(1, np.nan))
            if residuals[-1].ndim != 1:
                shape = residuals[-1].shape
                raise ValueError(f"fun must return residuals in one dimension, not {shape}")
        return residuals

    def jacobians(self, points: Sequence[Array]) -> Sequence[Array]:
        """Return jac at each point."""
        if self.jac is None:
            raise TypeError("jac: missing")
        jacobians = list[Array]()
        for x in points:
            try:
                jacobians.append(np.array(self.jac(x.copy()), dtype=np.float64, ndmin=2))
            except ArithmeticError:
                jacobians.append(np.full((1, 1), np.nan))
        return jacobians


Differences = Literal["2-point", "3-point"]

RELATIVE_STEP = {"2-point": EPS ** (1 / 2), "3-point": EPS ** (1 / 3)}
JACOBIAN_ERROR = {"2-point": 1e-7, "3-point": 1e-9, "exact": UNSEEN}  # with a margin


class EvaluationLimit(Exception):
    """More residuals were asked for than a search may have."""


class Point(NamedTuple):
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
        self.functions, self.differences = functions, differences
        self.box, self.scaled = box, scaled
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
        residuals: Sequence[Array] = yield ResidualsAt(self.functions, points)
        return residuals

    def jacobian(self, point: Point) -> Steps[Array]:
        """Return J, shape (M, N); not finite where there is none."""
        self.njev += 1
        shape = (len(point.residuals), len(point.x))
        if self.differences is not None:
            return (yield from self.quotients(point))
        J: Array = yield JacobianAt(self.functions, point.x)
        if J.shape == (1, 1) and not isfinite(J[0, 0]):
            return np.full(shape, nan)
        if J.shape != shape:
            raise ValueError(f"jac must return shape {shape}, not {J.shape}")
        return J

    def quotients(self, point: Point) -> Steps[Array]:
        """Return J by differences: the slope of the line or parabola through residuals nearby."""
        offsets = [self.offsets(x, j) for j, x in enumerate(point.x)]
        nearby = [
            self.box.inside(np.where(np.arange(len(point.x)) == j, point.x + h, point.x))
            for j, distances in enumerate(offsets)
            for h in distances
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
        """Steps of a quotient: both ways, or towards the farther bound; none if it is fixed."""
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


class Stop(Enum):
    """Why an estimation ended."""

    GRADIENT = "the gradient vanished"
    FLOOR = "the cost is at its floor: neither the linear model nor a trial finds a lower one"
    STEP = "the Gauss-Newton step fell below the tolerance"
    KINK = "no trial lowers the cost: it has a kink here, beyond which the linear model is invalid"
    CREEPING = "ten iterations, all with rejected trials, gained less than a millionth of the cost"
    UNCONFIRMED = "the lowest minimum is in doubt, and no other start converged to it"
    ITERATIONS = "the iteration limit was reached"
    EVALUATIONS = "the limit of evaluations was reached"
    INTERRUPTED = "interrupted: this is the best point so far"
    JACOBIAN = "the Jacobian is not finite here"
    HIGH = (
        "ten iterations gained less than a hundredth of what is missing to a minimum found before"
    )
    STALLED = "no trial lowers the cost visibly, although the linear model promises a lower one"
    FULL_STEP = (
        "the full Gauss-Newton step did not lower the cost: "
        "strategy dgn shortens such steps, lm-then-dgn finds a better start first"
    )
    ILL_CONDITIONED = (
        "the Jacobian is too ill-conditioned for full Gauss-Newton steps: "
        "use strategy dgn or lm-then-dgn"
    )
    LOST = (
        "the search left the range where the residuals depend on every variable: "
        "set bounds or x_scale, or another start"
    )
    MATCH = "the curves differ by less than the tolerance given: the search stopped there"
    FLAT = "the gradient fell below the tolerance given: the search stopped there"
    TRUSTED = "a full Gauss-Newton step fits the trust region and proved good"  # only inside


STATUS = {
    Stop.GRADIENT: 1,
    Stop.FLOOR: 2,
    Stop.STEP: 3,
    Stop.KINK: 4,
    Stop.CREEPING: 5,
    Stop.MATCH: 6,
    Stop.FLAT: 7,
    Stop.ITERATIONS: 0,
    Stop.EVALUATIONS: -9,
    Stop.HIGH: -10,
    Stop.INTERRUPTED: -1,
    Stop.JACOBIAN: -2,
    Stop.STALLED: -3,
    Stop.FULL_STEP: -4,
    Stop.ILL_CONDITIONED: -5,
    Stop.TRUSTED: -6,
    Stop.UNCONFIRMED: -7,
    Stop.LOST: -8,
}
AT_TOLERANCE = (Stop.MATCH, Stop.FLAT)  # that the caller named


class SolverIteration(NamedTuple):
    """One line of the log, announced when the iteration is over.

    number         0 is the start; counts on through the phases, and once where one restarts
    phase          "gn", "dgn" or "lm"
    x              where the iteration ended, shape (N,)
    cost           1/2 sum(fun(x)^2)
    gradient_norm  Euclidean norm of the projected gradient at x
    step_norm      Euclidean norm of the step that led there, 0 if none was accepted
    damping        gn: 1; dgn: the step length lambda; lm: nu; nan at a start
    inner          trials rejected before: reductions of lambda, shrinkings of the trust region
    nfev, njev     calls of fun (those for differences included) and Jacobians, until now
    quality        gain ratio: decrease of the cost over the decrease that the model promised
    capped         whether the step that was tried first was held back: dgn by its cap, lm by its
                   damping; it was then not the full Gauss-Newton step; None at a start
    """

    number: int
    phase: str
    x: Array
    cost: float
    gradient_norm: float
    step_norm: float
    damping: float
    inner: int
    nfev: int
    njev: int
    quality: float
    capped: bool | None = None


class Result(NamedTuple):
    """The best point seen and how it was reached; fun (M,), jac (M, N), grad (N,) belong to x.

    status: 1 gradient, 2 floor, 3 step, 4 kink, 5 creeping (converged); 6 match, 7 flat (ended at
    a tolerance given, perhaps before a minimum); 0 iteration limit; -1 interrupted, -2 Jacobian not
    finite, -3 stalled, -4 full step failed, -5 ill-conditioned, -7 unconfirmed, -8 lost, -9
    evaluation limit (not converged). message is the sentence, stop the member of Stop. optimality
    is the largest component of the projected gradient; promise is the decrease of the cost that the
    linear model at x still promises; active_mask is -1 for a variable at its lower bound, 1 at its
    upper one, else 0. After an interruption jac, grad and promise may be nan.
    """

    x: Array
    cost: float
    fun: Array
    jac: Array
    grad: Array
    optimality: float
    promise: float
    nfev: int
    njev: int
    nit: int
    status: int
    message: str
    success: bool
    history: tuple[SolverIteration, ...]
    stop: Stop
    active_mask: NDArray[np.int_]


class Progress(NamedTuple):
    """How far many searches are, side by side or in turn; ``best`` is the lowest cost so far."""

    stage: Literal["screening", "refining", "profiling", "weighing", "causes"]
    done: int
    total: int
    best: float
