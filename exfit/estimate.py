"""Nonlinear least squares within bounds: Gauss-Newton, Levenberg-Marquardt and strategies of both.

Arrays in, result out: minimise f(x) = 1/2 sum(fun(x)^2) over low <= x <= high.

One loop (`Run.descend`) serves all methods. In each iteration a *search* tries points that the
linear model fun(x + d) = fun(x) + J d proposes. That linear problem is itself solved within the
bounds, by an active set that starts afresh every time: a variable rests on a bound exactly as
long as the model wants it there. Directions that J does not see at all are left alone; those it
sees weakly are taken in full, but no variable moves farther than recent steps have proved good.

Sources: Levenberg 1944; Marquardt 1963; Armijo 1966; Moré 1978 (the Levenberg-Marquardt
algorithm: implementation and theory); Dennis & Schnabel 1983, chapters 6 and 10.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property
from math import inf, isfinite, nan, sqrt
from typing import Literal, Protocol, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Function = Callable[[Array], ArrayLike]
Differences = Literal["2-point", "3-point"]
Method = Literal["gn", "dgn", "lm", "lm-then-dgn", "auto", "robust"]

EPS = float(np.finfo(np.float64).eps)
TINY = float(np.finfo(np.float64).tiny)

RELATIVE_STEP = {"2-point": EPS ** (1 / 2), "3-point": EPS ** (1 / 3)}
UNSEEN = {"2-point": 1e-7, "3-point": 1e-9, "exact": 1e-11}  # the error of J, with a margin
WORST_CONDITION = 1e8  # beyond it a full Gauss-Newton step is a guess
ARMIJO = 1e-4  # share of the promised decrease that makes a trial good enough
LEAST_REACH = 0.3
FIRST_RADIUS = 100.0  # as MINPACK; in units of x_scale the first radius is 1
MOST_TRIALS = 60
TIMID = 2  # iterations that gained little
BOLD_TRIALS = 2
KINK = 1e-3  # of the cost: what a derivative from one side may promise at a minimum


class Stop(Enum):
    """Why an estimation ended."""

    GRADIENT = "the gradient vanished"
    FLOOR = "the cost is at its floor: neither the linear model nor a trial finds a lower one"
    STEP = "the Gauss-Newton step fell below the tolerance"
    KINK = (
        "no trial lowers the cost, which has a kink here: the linear model sees nothing beyond it"
    )
    ITERATIONS = "the iteration limit was reached"
    INTERRUPTED = "interrupted: this is the best point seen until then"
    JACOBIAN = "the Jacobian is not finite here"
    STALLED = "no trial lowers the cost visibly, although the linear model promises a lower one"
    FULL_STEP = "the full Gauss-Newton step did not lower the cost"
    ILL_CONDITIONED = "the Jacobian is too ill-conditioned for full Gauss-Newton steps"
    TRUSTED = "a full Gauss-Newton step fits the trust region and proved good"  # only inside


STATUS = {
    Stop.GRADIENT: 1,
    Stop.FLOOR: 2,
    Stop.STEP: 3,
    Stop.KINK: 4,
    Stop.ITERATIONS: 0,
    Stop.INTERRUPTED: -1,
    Stop.JACOBIAN: -2,
    Stop.STALLED: -3,
    Stop.FULL_STEP: -4,
    Stop.ILL_CONDITIONED: -5,
    Stop.TRUSTED: -6,
}


@dataclass(frozen=True)
class Iteration:
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


@dataclass(frozen=True)
class Result:
    """The best point seen and how it was reached; fun (M,), jac (M, N), grad (N,) belong to x.

    status: 1 gradient, 2 floor, 3 step (converged); 0 iteration limit; -1 interrupted,
    -2 Jacobian not finite, -3 stalled, -4 full step failed, -5 ill-conditioned (not converged).
    message is the sentence, stop the member of Stop. optimality is the largest component of the
    projected gradient. After an interruption jac and grad may be nan.
    """

    x: Array
    cost: float
    fun: Array
    jac: Array
    grad: Array
    optimality: float
    nfev: int
    njev: int
    nit: int
    status: int
    message: str
    success: bool
    history: tuple[Iteration, ...]
    stop: Stop


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


@dataclass(frozen=True)
class Tolerances:
    """When to stop; `least_squares` says what they mean."""

    max_iterations: int
    gtol: float
    ftol: float
    xtol: float


def least_squares(
    fun: Function,
    x0: ArrayLike,
    jac: Differences | Function = "2-point",
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf),
    method: Method = "auto",
    *,
    max_iterations: int = 100,
    gtol: float = 1e-8,
    ftol: float = 1e-10,
    xtol: float = 1e-10,
    x_scale: ArrayLike | None = None,
    good_enough: float | None = None,
    callback: Callable[[Iteration], object] | None = None,
) -> Result:
    """Minimise f(x) = 1/2 sum(fun(x)^2) within bounds, from x0 (N,).

    fun(x) gives the residuals (M,), jac(x) their derivatives (M, N); "2-point" and "3-point"
    take differences, inside the bounds, and count them in nfev. A trial that is not finite, or
    whose fun raises ArithmeticError, is rejected. fun is never called outside the bounds.

    method    gn           full Gauss-Newton steps, or nothing
              dgn          the same direction, shortened until Armijo's rule holds
              lm           Levenberg-Marquardt within a trust region
              lm-then-dgn  lm until a full Gauss-Newton step proves good, then dgn
              auto         dgn; if that is not good enough, lm-then-dgn from x0; the better one
              robust       gn while it works, then lm

    x_scale      what counts as one unit of each variable; None takes it from the columns of J.
                 Use 1 for logarithms
    good_enough  root mean square of residuals that counts as a match (auto); None: convergence
    callback     is told every Iteration; KeyboardInterrupt, raised anywhere, ends the search
                 with the best point seen

    It stops when (GRADIENT) the projected gradient is below gtol times its norm at x0 and either
    the full step promises less than ftol f(x) (the gradient alone hardly sees badly determined
    directions) or f(x) is below gtol^2 f(x0); (FLOOR) an iteration neither promised nor brought
    ftol f(x); (STEP) the full step is below xtol; (KINK) no trial is better and the full step
    promises less than a thousandth of f(x), as at a minimum where the derivative jumps; or after
    max_iterations, in each phase anew.

    Raises ValueError for bounds that cross, x0 outside them or residuals not finite there.
    """
    start, box = checked(x0, bounds, x_scale)
    if method not in STRATEGIES:
        raise ValueError(f"method: {method!r} is none of {', '.join(STRATEGIES)}")
    if not callable(jac) and jac not in RELATIVE_STEP:
        raise ValueError(f"jac: {jac!r} is neither callable nor one of {', '.join(RELATIVE_STEP)}")
    problem = Problem(fun, jac, box, x_scale is not None)
    run = Run(problem, Tolerances(max_iterations, gtol, ftol, xtol), callback)
    try:
        outcome = run.best_of(STRATEGIES[method](run, run.begin(start), good_enough))
    except KeyboardInterrupt:
        outcome = run.interrupted()
    return run.result(outcome)


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
    """Return the values, one for each variable."""
    try:
        return np.broadcast_to(np.asarray(values, dtype=np.float64), x.shape)
    except ValueError:
        raise ValueError(f"{name} must be a number or have the shape {x.shape}") from None


def typical(x: Array, width: Array) -> Array:
    """Return the size a variable seems to have: its start's, or a tenth of its range."""
    size = np.maximum(abs(x), np.where(np.isfinite(width), 0.1 * width, 0.0))
    return np.where(size > 0.0, size, 1.0)


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

    def __init__(self, fun: Function, jac: Differences | Function, box: Box, scaled: bool) -> None:
        self.fun, self.jac, self.box, self.scaled = fun, jac, box, scaled
        self.unseen = UNSEEN["exact" if callable(jac) else jac]
        self.nfev = self.njev = 0
        self.best: Point | None = None

    def residuals(self, x: Array) -> Array:
        """Return fun(x), shape (M,), or one nan where arithmetic fails."""
        self.nfev += 1
        try:
            with np.errstate(all="ignore"):
                r = np.array(self.fun(x.copy()), dtype=np.float64, ndmin=1)
        except ArithmeticError:
            return np.full(1, nan)
        if r.ndim != 1:
            raise ValueError(f"fun must return residuals in one dimension, not {r.shape}")
        return r

    def evaluate(self, x: Array) -> Point:
        """Return the point x."""
        r = self.residuals(x)
        point = Point(x, r, half_square(r))
        if self.best is None or point.cost < self.best.cost:
            self.best = point
        return point

    def jacobian(self, point: Point) -> Array:
        """Return J, shape (M, N); not finite where fun or jac fail."""
        self.njev += 1
        shape = (len(point.residuals), len(point.x))
        try:
            J = self.exact(point.x) if callable(self.jac) else self.differences(point)
        except ArithmeticError:
            return np.full(shape, nan)
        if J.shape != shape:
            raise ValueError(f"jac must return shape {shape}, not {J.shape}")
        return J

    def exact(self, x: Array) -> Array:
        """Return J as the given function has it."""
        assert callable(self.jac)
        with np.errstate(all="ignore"):
            return np.array(self.jac(x.copy()), dtype=np.float64, ndmin=2)

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
        return tuple(float((x + w) - x) for w in wanted)

    def moved(self, x: Array, j: int, h: float) -> Array:
        """Return the residuals a distance h along one variable."""
        x = x.copy()
        x[j] += h
        return self.residuals(self.box.inside(x))


@dataclass(frozen=True)
class Step:
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
class Linear:
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
    def full(self) -> Step:
        """The Gauss-Newton step: least squares within the bounds, of minimum norm."""
        return solve(self)


def linearise(problem: Problem, point: Point, before: Linear | None = None) -> Linear:
    """Return the linear model at a point, scaled no less than the one before."""
    return modelled(problem, point, problem.jacobian(point), before)


def modelled(problem: Problem, point: Point, J: Array, before: Linear | None) -> Linear:
    """Factor J: QR first, for the many residuals, then the singular values of the corner."""
    box, n = problem.box, len(point.x)
    if not np.isfinite(J).all():
        no, none = np.full(n, nan), np.zeros((0, n))
        return Linear(point, J, no, no, no, no[:0], none, no[:0], no, no, problem.unseen, box)
    gradient = J.T @ point.residuals
    scale = 1.0 / box.unit if problem.scaled else column_scale(J, before)
    both = np.column_stack([J / scale, point.residuals])
    corner = np.asarray(np.linalg.qr(both, mode="r"), dtype=np.float64)
    left, singular, directions = np.linalg.svd(corner[:, :n], full_matrices=False)
    return Linear(
        point,
        J,
        gradient,
        box.projected(point.x, gradient),
        scale,
        singular,
        directions,
        left.T @ corner[:, n],
        scale * (box.low - point.x),
        scale * (box.high - point.x),
        problem.unseen,
        box,
    )


def column_scale(J: Array, before: Linear | None) -> Array:
    """Return the largest norm each column has had (Moré 1978, section 6)."""
    norms: Array = np.linalg.norm(J, axis=0)
    if before is not None and before.finite:
        return np.maximum(norms, before.scale)
    return np.where(norms > 0.0, norms, 1.0)


def solve(linear: Linear, nu: float = 0.0, reach: float = inf) -> Step:
    """Minimise |J d + R|^2 + nu |scale d|^2 within the bounds and |d| <= reach, unit by unit."""
    k = linear.rank
    s, V, b = linear.singular[:k], linear.directions[:k], linear.amounts[:k]
    limit = reach * linear.scale * linear.box.unit
    low, high = np.maximum(linear.low, -limit), np.minimum(linear.high, limit)
    y = -V.T @ (s * b / (s**2 + nu))
    if np.any(y < low) or np.any(y > high):
        rows = np.vstack([s[:, None] * V, sqrt(nu) * np.eye(len(y))])
        y = bounded_minimum(rows, np.append(b, np.zeros(len(y))), low, high)
    return step_to(linear, y)


def step_to(linear: Linear, y: Array) -> Step:
    """Return the step d = y / scale; where it reaches a bound it ends on it exactly."""
    x, box = linear.point.x, linear.box
    target = box.inside(x + y / linear.scale)
    target = np.where(y <= linear.low, box.low, np.where(y >= linear.high, box.high, target))
    d = target - x
    change = linear.singular * (linear.directions @ (linear.scale * d))
    promise = -float(change @ (linear.amounts + 0.5 * change))
    return Step(x, target, float(linear.gradient @ d), promise)


def bounded_minimum(A: Array, b: Array, low: Array, high: Array) -> Array:
    """Return y, of small norm, that minimises |A y + b| over low <= y <= high; 0 lies within.

    Source: Stark & Parker 1995, bounded-variable least squares; Lawson & Hanson 1974, ch. 23.
    """
    y, slope = np.zeros_like(low), A.T @ b
    fixed = (low == high) | ((low == 0.0) & (slope > 0.0)) | ((high == 0.0) & (slope < 0.0))
    for _ in range(10 * len(y)):
        goal = y.copy()
        rest = -(b + A[:, fixed] @ y[fixed])
        goal[~fixed] = np.linalg.lstsq(A[:, ~fixed], rest, rcond=UNSEEN["exact"])[0]
        blocked = (goal < low) | (goal > high)
        if blocked.any():
            y, hit = first_bound(y, goal, low, high, blocked)
            fixed = fixed | hit
            continue
        y, slope = goal, A.T @ (A @ goal + b)
        pull = np.where(fixed & (low < high), np.where(y == low, -slope, slope), 0.0)
        strongest = int(np.argmax(pull))
        if pull[strongest] <= 10.0 * EPS * np.linalg.norm(A) * np.linalg.norm(b):
            break
        fixed[strongest] = False
    return y


def first_bound(
    y: Array, goal: Array, low: Array, high: Array, blocked: Mask
) -> tuple[Array, Mask]:
    """Go from y towards the goal until a variable meets its bound; return where, and which."""
    bound = np.where(goal < low, low, high)
    share = np.full(len(y), inf)
    share[blocked] = (bound - y)[blocked] / (goal - y)[blocked]
    hit = share <= share.min()
    between = np.minimum(np.maximum(y + share.min() * (goal - y), low), high)
    return np.where(hit, bound, between), hit


@dataclass(frozen=True)
class Move:
    """What one iteration came to: a better point, or a reason to stop, or both."""

    point: Point | None
    damping: float
    inner: int
    quality: float = nan
    stop: Stop | None = None


class Search(Protocol):
    """Finds the next point with the help of a linear model."""

    @property
    def phase(self) -> str:
        """The name in the log."""

    def advance(self, problem: Problem, linear: Linear) -> tuple[Move, Self]:
        """Return the move made, and the search to go on with."""


@dataclass(frozen=True)
class FullStep:
    """Gauss-Newton: the full step or nothing."""

    phase: str = "gn"

    def advance(self, problem: Problem, linear: Linear) -> tuple[Move, Self]:
        """Take the full step."""
        if linear.singular[0] > WORST_CONDITION * linear.singular[linear.rank - 1]:
            return Move(None, 1.0, 0, stop=Stop.ILL_CONDITIONED), self
        trial = problem.evaluate(linear.full.target)
        decrease = linear.point.cost - trial.cost
        if not decrease > 0.0:
            return Move(None, 1.0, 1, stop=Stop.FULL_STEP), self
        return Move(trial, 1.0, 0, gain_ratio(decrease, linear.full.promise)), self


def gain_ratio(decrease: float, promise: float) -> float:
    """Return the decrease in units of what was promised, nan if that was nothing."""
    return decrease / promise if promise > 0.0 else nan


@dataclass(frozen=True)
class LineSearch:
    """Damped Gauss-Newton: the step within reach, shortened until Armijo's rule holds.

    The reach (in units of each variable) keeps the badly determined directions at bay: without
    it one such direction makes the whole step so long that lambda must be tiny for all.
    """

    reach: float = 1.0
    phase: str = "dgn"

    def advance(self, problem: Problem, linear: Linear) -> tuple[Move, Self]:
        """Try lambda = 1, then less."""
        move = shorten(problem, linear, solve(linear, reach=self.reach), MOST_TRIALS)
        if move.point is None:
            return move, self
        moved = float(np.max(abs(move.point.x - linear.point.x) / linear.box.unit))
        useful = move.damping == 1.0 and move.quality > 0.25
        least = self.reach if useful else LEAST_REACH
        return move, replace(self, reach=max(least, 2.0 * moved))


def shorten(problem: Problem, linear: Linear, step: Step, trials: int) -> Move:
    """Shorten the step until Armijo's rule holds or its promise can no longer be seen."""
    cost, length, reductions = linear.point.cost, 1.0, 0
    while reductions < trials and -length * step.slope > EPS * cost:
        trial = problem.evaluate(step.at(length))
        if trial.cost < cost and trial.cost <= cost + ARMIJO * length * step.slope:
            quality = gain_ratio(cost - trial.cost, step.promised(length))
            return Move(trial, length, reductions, quality)
        length *= shortened(trial.cost - cost, length * step.slope)
        reductions += 1
    return Move(None, length, reductions, stop=Stop.STALLED)


def shortened(rise: float, slope: float) -> float:
    """Return by how much to shorten a trial: to the minimum of the parabola, 0.2 ... 0.5.

    Source: Dennis & Schnabel 1983, section 6.3.2. slope: of the whole trial step.
    """
    curvature = rise - slope
    if not (isfinite(curvature) and curvature > 0.0):
        return 0.2
    return min(0.5, max(0.2, -0.5 * slope / curvature))


@dataclass(frozen=True)
class TrustRegion:
    """Levenberg-Marquardt: nu keeps the scaled step within a radius (Moré 1978).

    A cost with kinks (limits that are met a step earlier or later) makes a small radius smaller
    still. So after two steps in a row that gained less than a tenth of what the full step
    promises, the next one is the full step, shortened a few times at most; if that
    fails, it is tried half as often.
    """

    radius: float = inf
    hand_over: bool = False
    timid: int = 0
    patience: int = TIMID
    phase: str = "lm"

    def advance(self, problem: Problem, linear: Linear) -> tuple[Move, Self]:
        """Shrink the radius until a trial lowers the cost, and enlarge it after a good one."""
        if self.timid < self.patience:
            return self.within(problem, linear, 0)
        move = shorten(problem, linear, solve(linear, reach=1.0), BOLD_TRIALS)
        if move.point is None:
            wary = replace(self, timid=0, patience=2 * self.patience)
            return wary.within(problem, linear, move.inner)
        radius = max(self.radius, scaled_length(linear, move.point.x))
        return replace(move, damping=0.0), replace(self, timid=0, patience=TIMID, radius=radius)

    def within(self, problem: Problem, linear: Linear, spent: int) -> tuple[Move, Self]:
        """Return the best move that the trust region allows."""
        cost, search = linear.point.cost, self
        if self.radius == inf:
            search = replace(self, radius=first_radius(problem, linear))
        for rejections in range(spent, spent + MOST_TRIALS):
            nu = damping(linear, search.radius)
            step = solve(linear, nu)
            if not step.promise > EPS * cost:
                break
            trial = problem.evaluate(step.target)
            search = search.resized(linear, step, nu, trial.cost - cost)
            quality = gain_ratio(cost - trial.cost, step.promise)
            if quality > ARMIJO:
                good = self.hand_over and nu == 0.0 and quality > 0.5
                timid = self.timid + 1 if cost - trial.cost < 0.1 * linear.full.promise else 0
                move = Move(trial, nu, rejections, quality, Stop.TRUSTED if good else None)
                return move, replace(search, timid=timid)
        return Move(None, nu, rejections, stop=Stop.STALLED), search

    def resized(self, linear: Linear, step: Step, nu: float, rise: float) -> Self:
        """Return the search with the radius that the trial suggests."""
        quality = gain_ratio(-rise, step.promise)
        length = scaled_length(linear, step.target)
        if quality >= 0.75 or (quality > 0.25 and nu == 0.0):
            return replace(self, radius=max(self.radius, 2.0 * length))
        if quality > 0.25:
            return self
        share = shortened(rise, step.slope) if rise > 0.0 else 0.5
        return replace(self, radius=share * min(self.radius, 10.0 * length))


def scaled_length(linear: Linear, x: Array) -> float:
    """Return how far x is in scaled variables."""
    return float(np.linalg.norm(linear.scale * (x - linear.point.x)))


def first_radius(problem: Problem, linear: Linear) -> float:
    """Return the radius to begin with, no longer than the full step."""
    full = scaled_length(linear, linear.full.target)
    size = float(np.linalg.norm(linear.scale * linear.box.unit))
    return min(1.0 if problem.scaled else FIRST_RADIUS * size, max(full, TINY))


def damping(linear: Linear, radius: float) -> float:
    """Return nu for which the free part of the step is as long as the radius, to a tenth.

    Source: Moré 1978, section 5 (Newton's iteration on 1/|y|, safeguarded).
    """
    free, k = linear.projected != 0.0, linear.rank
    A = linear.singular[:k, None] * linear.directions[:k, free]
    left, s, _ = np.linalg.svd(A, full_matrices=False)
    kept = s > linear.unseen * max(np.max(s, initial=0.0), TINY)
    s, b = s[kept], (left.T @ linear.amounts[:k])[kept]
    if float(np.linalg.norm(b / s)) <= 1.1 * radius:
        return 0.0
    low, high = 0.0, float(np.linalg.norm(s * b)) / radius
    nu = 1e-3 * high
    for _ in range(30):
        length = float(np.linalg.norm(s * b / (s**2 + nu)))
        if abs(length - radius) <= 0.1 * radius:
            break
        low, high = (nu, high) if length > radius else (low, nu)
        fall = float(np.sum((s * b) ** 2 / (s**2 + nu) ** 3))
        nu += (length / radius - 1.0) * length**2 / fall
        if not low < nu < high:
            nu = max(1e-3 * high, sqrt(low * high))
    return nu


@dataclass(frozen=True)
class Outcome:
    """Where a phase ended and why."""

    linear: Linear
    stop: Stop

    @property
    def converged(self) -> bool:
        """Whether it ended at a minimum."""
        return STATUS[self.stop] > 0


class Run:
    """The loop, its log and its stopping rules."""

    def __init__(
        self,
        problem: Problem,
        tolerances: Tolerances,
        callback: Callable[[Iteration], object] | None,
    ) -> None:
        self.problem, self.tolerances, self.callback = problem, tolerances, callback
        self.history: list[Iteration] = []
        self.iterations = 0
        self.best: Linear | None = None
        self.first_cost = self.first_gradient = nan

    def begin(self, x0: Array) -> Linear:
        """Return the linear model at the start."""
        point = self.problem.evaluate(x0)
        if point.cost == inf:
            raise ValueError("the residuals at x0 are not finite")
        linear = self.linearise(point)
        self.first_cost = point.cost
        self.first_gradient = float(np.linalg.norm(linear.projected))
        return linear

    def linearise(self, point: Point, before: Linear | None = None) -> Linear:
        """Return the linear model at a point; remember the best one."""
        linear = linearise(self.problem, point, before)
        if self.best is None or point.cost <= self.best.point.cost:
            self.best = linear
        return linear

    def descend(self, search: Search, linear: Linear) -> Outcome:
        """Go down from a point until there is a reason to stop."""
        if not self.history or not np.array_equal(self.history[-1].x, linear.point.x):
            self.announce(search.phase, linear)
        for count in range(self.tolerances.max_iterations + 1):
            stop = self.at_rest(linear)
            if stop is None and count == self.tolerances.max_iterations:
                stop = Stop.ITERATIONS
            if stop is not None:
                return Outcome(linear, stop)
            move, search = search.advance(self.problem, linear)
            before = linear
            if move.point is not None:
                linear = self.linearise(move.point, before)
            self.iterations += 1
            self.announce(search.phase, linear, move, before)
            stop = self.after(before, linear, move)
            if stop is not None:
                return Outcome(linear, stop)
        raise AssertionError("unreachable")

    def at_rest(self, linear: Linear) -> Stop | None:
        """Return why there is nothing to gain from a point, if so."""
        if not linear.finite:
            return Stop.JACOBIAN
        t, full, cost = self.tolerances, linear.full, linear.point.cost
        flat = float(np.linalg.norm(linear.projected)) <= t.gtol * self.first_gradient + TINY
        if flat and (full.promise <= t.ftol * cost or cost <= t.gtol**2 * self.first_cost):
            return Stop.GRADIENT
        return Stop.STEP if self.tiny(full.target, full.origin, linear.box) else None

    def tiny(self, there: Array, here: Array, box: Box) -> bool:
        """Tell whether a step is below the tolerance in every variable."""
        size = np.maximum(abs(here), box.unit)
        return bool(np.all(abs(there - here) <= self.tolerances.xtol * size))

    def after(self, before: Linear, linear: Linear, move: Move) -> Stop | None:
        """Return why to stop after an iteration, if so."""
        cost = before.point.cost
        if not linear.finite:
            return Stop.JACOBIAN
        if move.point is None:
            return self.stuck(before, move.stop)
        if max(before.full.promise, cost - linear.point.cost) <= self.tolerances.ftol * cost:
            return Stop.FLOOR
        if move.stop is None and self.tiny(linear.point.x, before.point.x, linear.box):
            return self.at_rest(linear) or self.stuck(linear, Stop.STALLED)
        return move.stop

    def stuck(self, linear: Linear, stop: Stop | None) -> Stop | None:
        """Return why to stop at a point from where no step led lower."""
        promise = linear.full.promise / linear.point.cost
        if stop is Stop.ILL_CONDITIONED:
            return stop
        if promise <= sqrt(EPS):
            return Stop.FLOOR
        return Stop.KINK if stop is Stop.STALLED and promise <= KINK else stop

    def announce(
        self, phase: str, linear: Linear, move: Move | None = None, before: Linear | None = None
    ) -> None:
        """Write a line of the log and tell the callback."""
        x = linear.point.x
        move = move or Move(None, nan, 0)
        line = Iteration(
            number=len(self.history),
            phase=phase,
            x=x.copy(),
            cost=linear.point.cost,
            gradient_norm=float(np.linalg.norm(linear.projected)),
            step_norm=float(np.linalg.norm(x - before.point.x)) if before else 0.0,
            damping=move.damping,
            inner=move.inner,
            nfev=self.problem.nfev,
            njev=self.problem.njev,
            quality=move.quality,
        )
        self.history.append(line)
        if self.callback is not None:
            self.callback(line)

    def best_of(self, outcome: Outcome) -> Outcome:
        """Return the outcome, moved to a trial that was rejected and yet is the best."""
        best = self.problem.best
        if best is not None and best.cost < outcome.linear.point.cost:
            return Outcome(linearise(self.problem, best), outcome.stop)
        return outcome

    def interrupted(self) -> Outcome:
        """Return the best point seen, with its Jacobian if that was there in time."""
        point = self.problem.best
        if point is None or point.cost == inf:
            raise KeyboardInterrupt
        if self.best is not None and self.best.point.cost <= point.cost:
            return Outcome(self.best, Stop.INTERRUPTED)
        unknown = np.full((len(point.residuals), len(point.x)), nan)
        return Outcome(modelled(self.problem, point, unknown, None), Stop.INTERRUPTED)

    def result(self, outcome: Outcome) -> Result:
        """Return what the user gets."""
        linear, stop = outcome.linear, outcome.stop
        return Result(
            x=linear.point.x,
            cost=linear.point.cost,
            fun=linear.point.residuals,
            jac=linear.jacobian,
            grad=linear.gradient,
            optimality=float(np.max(abs(linear.projected))),
            nfev=self.problem.nfev,
            njev=self.problem.njev,
            nit=self.iterations,
            status=STATUS[stop],
            message=stop.value,
            success=outcome.converged,
            history=tuple(self.history),
            stop=stop,
        )


Strategy = Callable[[Run, Linear, float | None], Outcome]


def alone(search: Search) -> Strategy:
    """Return the strategy that is one method from start to end."""
    return lambda run, start, _: run.descend(search, start)


def lm_then_dgn(run: Run, start: Linear, _: float | None) -> Outcome:
    """Let lm find the valley and dgn follow it."""
    outcome = run.descend(TrustRegion(hand_over=True), start)
    if outcome.converged or outcome.stop is Stop.JACOBIAN:
        return outcome
    return run.descend(LineSearch(), outcome.linear)


def auto(run: Run, start: Linear, good_enough: float | None) -> Outcome:
    """Try dgn; where that is not good enough, lm and dgn from the same start."""
    first = run.descend(LineSearch(), start)
    if matches(first, good_enough):
        return first
    second = lm_then_dgn(run, start, good_enough)
    return second if second.linear.point.cost <= first.linear.point.cost else first


def matches(outcome: Outcome, good_enough: float | None) -> bool:
    """Tell whether the residuals are as small as asked; unasked, whether the search converged."""
    if good_enough is None:
        return outcome.converged
    point = outcome.linear.point
    return sqrt(2.0 * point.cost / len(point.residuals)) <= good_enough


def robust(run: Run, start: Linear, _: float | None) -> Outcome:
    """Go on with lm where gn quits."""
    outcome = run.descend(FullStep(), start)
    if outcome.converged or outcome.stop is Stop.JACOBIAN:
        return outcome
    return run.descend(TrustRegion(), outcome.linear)


STRATEGIES: dict[str, Strategy] = {
    "gn": alone(FullStep()),
    "dgn": alone(LineSearch()),
    "lm": alone(TrustRegion()),
    "lm-then-dgn": lm_then_dgn,
    "auto": auto,
    "robust": robust,
}
