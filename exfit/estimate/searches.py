"""The searches that the strategies are made of: each finds the next point by a linear model.

Gauss-Newton, in full steps (gn) or damped by capping and shortening them (dgn); Levenberg-Marquardt
by a trust region, or as textbooks have it, by the gain ratio or Armijo's rule.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from math import hypot, inf, isfinite, isnan, nan, sqrt
from typing import NamedTuple, Protocol, Self

import numpy as np

from exfit.estimate.linear import DampedStep, LinearModel, bounded_minimum, solve, step_to
from exfit.estimate.problem import EPS, TINY, Point, Problem, Steps, Stop, norm
from exfit.util.arrays import Array

ARMIJO = 1e-4  # share of the promised decrease that makes a trial good enough
MOST_TRIALS = 60
LEAST_AGAIN = 1e-10  # of the cost: where the full step promises less, one trial shows it or none
SAME = 1e-9  # units: a step that differs by less is the same

Cut = Callable[[float, float], float]


class Move(NamedTuple):
    """What one iteration came to: a better point, or a reason to stop, or both.

    ``capped``: the step that was tried first was not the full Gauss-Newton step.
    """

    point: Point | None
    damping: float
    inner: int
    quality: float = nan
    stop: Stop | None = None
    capped: bool = False


class Search(Protocol):
    """Finds the next point with the help of a linear model."""

    @property
    def phase(self) -> str:
        """The name in the log."""

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Return the move made, and the search to go on with."""


def gain_ratio(decrease: float, promise: float) -> float:
    """Return the decrease in units of what was promised, nan if that was nothing."""
    return decrease / promise if promise > 0.0 else nan


def worth_trying(linear: LinearModel, promise: float, rejections: int) -> bool:
    """Tell whether a trial may show its promise, or one more after some rejections."""
    cost = linear.point.cost
    if rejections and linear.full.promise <= LEAST_AGAIN * cost:
        return False
    return promise > EPS * cost


def to_parabola(rise: float, slope: float) -> float:
    """Shorten a trial to the minimum of the parabola, by 0.2 ... 0.5.

    Source: Dennis & Schnabel 1983, section 6.3.2. slope: of the whole trial step.
    """
    curvature = rise - slope
    if not (isfinite(curvature) and curvature > 0.0):
        return 0.2
    return min(0.5, max(0.2, -0.5 * slope / curvature))


def to_half(rise: float, slope: float) -> float:
    """Return one half, whatever a trial came to."""
    return 0.5


def shorten(
    problem: Problem,
    linear: LinearModel,
    step: DampedStep,
    reach: float = inf,
    trials: int = MOST_TRIALS,
    armijo: float = ARMIJO,
    cut: Cut = to_parabola,
) -> Steps[Move]:
    """Shorten the best step within reach until Armijo's rule holds or its promise is rounding.

    Source: Armijo 1966.
    """
    cost, length, reductions = linear.point.cost, 1.0, 0
    capped, unit = False, linear.box.unit  # whether it is another than the full step
    farthest = np.max(abs(step.target - linear.point.x) / unit)
    if linear.rank < len(linear.scale) or farthest >= reach * (1.0 - SAME):
        capped = bool(np.any(abs(step.target - linear.full.target) > SAME * unit))
    while reductions < trials and worth_trying(linear, -length * step.slope, reductions):
        trial = yield from problem.evaluate(step.at(length))
        if trial.cost < cost and trial.cost <= cost + armijo * length * step.slope:
            quality = gain_ratio(cost - trial.cost, step.promised(length))
            return Move(trial, length, reductions, quality, capped=capped)
        length *= cut(trial.cost - cost, length * step.slope)
        reductions += 1
    return Move(None, length, reductions, stop=Stop.STALLED, capped=capped)


WORST_CONDITION = 1e8  # beyond it a full Gauss-Newton step is a guess
LEAST_REACH = 0.3
LENGTH_PROVED = 0.25  # gain ratio from which the model was right about the length
TOO_SHORT = 1.2  # gain ratio of a full step from which the next one is a fifth of it or more
FAST, SLOW = 0.02, 0.95  # of the length of the full step before: between, extrapolation pays


class FullStep(NamedTuple):
    """Gauss-Newton: the full step or nothing; ``retries``: a first one that fails is shortened."""

    retries: bool = False
    phase: str = "gn"

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Take the full step, the first one shortened once where that is necessary."""
        if linear.singular[0] > WORST_CONDITION * linear.singular[linear.rank - 1]:
            return Move(None, 1.0, 0, stop=Stop.ILL_CONDITIONED), self
        full, length, once = linear.full, 1.0, self._replace(retries=False)
        for rejections in range(2 if self.retries else 1):
            trial = yield from problem.evaluate(full.at(length))
            decrease = linear.point.cost - trial.cost
            if decrease > 0.0:
                quality = gain_ratio(decrease, full.promised(length))
                return Move(trial, length, rejections, quality), once
            length *= to_parabola(-decrease, length * full.slope)
        return Move(None, 1.0, rejections + 1, stop=Stop.FULL_STEP), once


def extrapolated(before: DampedStep, linear: LinearModel, reach: float) -> DampedStep | None:
    """Return the step to where full steps that shrink slowly would end, within reach.

    Source: Walker & Ni 2011, Anderson acceleration for fixed-point iterations, with one step
    ``before``, in the norm of the linear model.
    """
    full, (x, unit) = linear.full, (linear.point.x, linear.box.unit)
    if not FAST**2 * before.promise < full.promise < SLOW**2 * before.promise:
        return None
    step, change = full.target - x, full.target - x - (before.target - before.origin)
    seen = linear.singular[:, None] * linear.directions * linear.scale
    along, across = seen @ step, seen @ change
    share = float(across @ along) / float(across @ across)
    target = full.target - share * (x - before.origin + change)
    slope = float(linear.gradient @ (target - x))
    near = np.max(abs(target - x) / unit) <= reach and slope < 0.0
    inside = np.array_equal(target, linear.box.inside(target))
    return DampedStep(x, target, slope, full.promise) if near and inside else None


class LineSearch(NamedTuple):
    """Damped Gauss-Newton: a step, shortened until Armijo's rule holds.

    Capped, the step is the best of the linear model that moves no variable farther than the reach
    (in units of each variable, a trust region), which grows after good steps. It keeps the badly
    determined directions at bay: without it one such direction makes the whole step so long that
    lambda must be tiny for all. Where full steps shrink slowly, because residuals are far from
    zero, each as a share of the one ``before``, it tries where they would end. Not capped it is the
    full Gauss-Newton step: with ``to_half`` as its cut that is the damped Gauss-Newton method of
    Kelley 1999, section 2.3.
    """

    capped: bool = True
    cut: Cut = to_parabola
    armijo: float = ARMIJO
    reach: float = 1.0
    before: DampedStep | None = None
    phase: str = "dgn"

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Try lambda = 1, then less."""
        step = solve(linear, reach=self.reach) if self.capped else linear.full
        reach = self.reach if self.capped else inf
        end = self.before and extrapolated(self.before, linear, reach)
        if end:
            trial = yield from problem.evaluate(end.target)
            decrease = linear.point.cost - trial.cost
            if decrease >= max(end.promise, -self.armijo * end.slope):
                move = Move(trial, 1.0, 0, gain_ratio(decrease, end.promise))
                return move, self._replace(before=self._base(linear, move))
        move = yield from shorten(problem, linear, step, reach, armijo=self.armijo, cut=self.cut)
        if move.point is None:
            return move, self
        farthest = float(np.max(abs(move.point.x - linear.point.x) / linear.box.unit))
        useful = move.damping == 1.0 and move.quality > LENGTH_PROVED
        least = self.reach if useful else LEAST_REACH
        before = None if end else self._base(linear, move)
        return move, self._replace(reach=max(least, 2.0 * farthest), before=before)

    def _base(self, linear: LinearModel, move: Move) -> DampedStep | None:
        """Return the full step if it was taken and fell short: the next one may go on from it."""
        whole = self.capped and move.damping == 1.0 and not move.capped
        return linear.full if whole and move.quality > TOO_SHORT else None


BAD, PROVED, GOOD = 0.25, 0.5, 0.75  # gain ratios that shrink, hand over, enlarge
TIMID = 0.1  # share of what the full step promises: an iteration that gains less gained little
PATIENCE = 2  # iterations that may gain little
BOLD_TRIALS = 2
SLACK = 0.1  # of the radius: how far the step may be from it
NEWTON_STEPS = 30
VALLEY = 10  # damped steps in a row: the search follows a valley
PROBE = 0.1  # of a step: where its curvature is looked at
STRAIGHT = 0.75  # of a step: what its curvature may add, at most


class TrustRegion(NamedTuple):
    """Levenberg-Marquardt: nu keeps the scaled step within a radius (Moré 1978).

    A cost with kinks (limits that are met a step earlier or later) makes a small radius smaller
    still. So after two steps in a row that gained less than a tenth of what the full step
    promises, the next one is the full step, shortened a few times at most; if that
    fails, it is tried half as often.

    ``first`` is the first radius in units of each variable. ``bends``: ten damped steps in a row
    follow a valley, and from then on a step bends with it, by the second derivative of the
    residuals along it (one evaluation; Transtrum & Sethna 2012).
    """

    first: float = 1.0
    armijo: float = ARMIJO
    radius: float = inf
    hand_over: bool = False
    bends: bool = False
    timid: int = 0
    damped: int = 0
    patience: int = PATIENCE
    phase: str = "lm"

    def handing_over(self) -> Self:
        """Return the search that ends where full Gauss-Newton steps prove good."""
        return self._replace(hand_over=True)

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Shrink the radius until a trial lowers the cost, and enlarge it after a good one."""
        if self.timid < self.patience:
            return (yield from self.within(problem, linear))
        move = yield from shorten(
            problem, linear, solve(linear, reach=1.0), 1.0, BOLD_TRIALS, self.armijo
        )
        if move.point is None:
            wary = self._replace(timid=0, patience=2 * self.patience)
            second, search = yield from wary.within(problem, linear, move.inner)
            return second._replace(capped=move.capped), search
        radius = max(self.radius, linear.scaled_length(move.point.x))
        return move._replace(damping=0.0), self._replace(timid=0, patience=PATIENCE, radius=radius)

    def within(
        self, problem: Problem, linear: LinearModel, spent: int = 0
    ) -> Steps[tuple[Move, Self]]:
        """Return the best move that the trust region allows."""
        cost, search = linear.point.cost, self
        if self.radius == inf:
            unit = 1.0 if problem.scaled else norm(linear.scale * linear.box.unit)
            longest = max(linear.scaled_length(linear.full.target), TINY)
            search = self._replace(radius=min(self.first * unit, longest))
        capped = False
        for rejections in range(spent, spent + MOST_TRIALS):
            nu = damping(linear, search.radius)
            if rejections == spent:
                capped = nu > 0.0
            step = solve(linear, nu)
            if not worth_trying(linear, step.promise, rejections):
                break
            target = step.target
            if self.bends and nu > 0.0 and self.damped >= VALLEY:
                target = yield from bent(problem, linear, step, nu)
            trial = yield from problem.evaluate(target)
            decrease = cost - trial.cost
            search = search.resized(linear, step, nu, decrease)
            quality = gain_ratio(decrease, step.promise)
            if quality > self.armijo:
                trusted = self.hand_over and nu == 0.0 and quality > PROVED
                stop = Stop.TRUSTED if trusted else None
                move = Move(trial, nu, rejections, quality, stop, capped)
                return move, search.after(linear, nu, decrease)
        return Move(None, nu, rejections, stop=Stop.STALLED, capped=capped), search

    def after(self, linear: LinearModel, nu: float, decrease: float) -> Self:
        """Return the search after an accepted trial: how many were timid, or damped, in a row."""
        bold = decrease >= TIMID * linear.highest_promise
        timid = not bold and decrease < TIMID * linear.full.promise
        return self._replace(
            timid=self.timid + 1 if timid else 0, damped=self.damped + 1 if nu > 0.0 else 0
        )

    def resized(self, linear: LinearModel, step: DampedStep, nu: float, decrease: float) -> Self:
        """Return the search with the radius that the trial suggests."""
        quality = gain_ratio(decrease, step.promise)
        length = linear.scaled_length(step.target)
        if quality >= GOOD or (quality > BAD and nu == 0.0):
            return self._replace(radius=max(self.radius, 2.0 * length))
        if quality > BAD:
            return self
        share = to_parabola(-decrease, step.slope) if decrease < 0.0 else 0.5
        return self._replace(radius=share * min(self.radius, 10.0 * length))


def bent(problem: Problem, linear: LinearModel, step: DampedStep, nu: float) -> Steps[Array]:
    """End a step along the curvature of the residuals, if that is small.

    Source: Transtrum & Sethna 2012, Improvements to the Levenberg-Marquardt algorithm, section 4.
    """
    d = step.target - linear.point.x
    probe = yield from problem.evaluate(linear.box.inside(linear.point.x + PROBE * d))
    rise = probe.residuals - linear.point.residuals
    second = 2.0 / PROBE * (rise / PROBE - linear.jacobian @ d)
    if not np.isfinite(second).all():
        return step.target
    k = linear.rank
    s, V = linear.singular[:k], linear.directions[:k]
    y = -V.T @ (V @ (linear.jacobian.T @ second / linear.scale) / (s**2 + nu))
    if 2.0 * float(np.linalg.norm(y)) > STRAIGHT * linear.scaled_length(step.target):
        return step.target
    return linear.box.inside(step.target + 0.5 * y / linear.scale)


def damping(linear: LinearModel, radius: float) -> float:
    """Return nu for which the free part of the step is as long as the radius, to a tenth.

    Source: Moré 1978, section 5 (Newton's iteration on 1/|y|, safeguarded).
    """
    free, k = linear.projected != 0.0, linear.rank
    s, b = linear.singular[:k], linear.amounts[:k]
    if not free.all():  # of the variables that no bound holds
        A = s[:, None] * linear.directions[:k, free]
        left, s, _ = np.linalg.svd(A, full_matrices=False)
        determined = s > linear.unseen * max(np.max(s, initial=0.0), TINY)
        s, b = s[determined], (left.T @ b)[determined]
    if norm(b / s) <= (1.0 + SLACK) * radius:
        return 0.0
    low, high = 0.0, hypot(*(s * b)) / radius
    nu = 1e-3 * high
    for _ in range(NEWTON_STEPS):
        y = s * b / (s**2 + nu)
        length = norm(y)
        if abs(length - radius) <= SLACK * radius:
            break
        low, high = (nu, high) if length > radius else (low, nu)
        fall = float(np.sum(y**2 / (s**2 + nu)))
        nu += (length / radius - 1.0) * length**2 / fall
        if not low < nu < high:
            nu = max(1e-3 * high, sqrt(low) * sqrt(high))
    return nu


LOW, HIGH = 0.25, 0.75  # gain ratios: nu is raised below the first, lowered above the second


class RatioDamping(NamedTuple):
    """Levenberg-Marquardt: (nu I + J^T J) d = -g, nu raised and lowered by the gain ratio.

    A trial that lowers f, or leaves it as it is, is accepted; one that does not multiplies nu by
    ``raising`` and is followed by another. Of an accepted trial the ratio of the decrease to the
    promised one, -g^T d / 2, decides: below 1/4 nu is raised, too; above 3/4 it is multiplied by
    ``lowering``. nu is never raised to less than ``least``, and what is lowered below is zero.
    ``first`` is nu at the start, by default the norm of the gradient there. Unlike in
    `TrustRegion`, the identity is that of x itself, whatever its units.

    Source: Kelley 1999, sections 3.3.3 and 3.3.5.
    """

    first: float | None = None
    least: float = 1e-3
    raising: float = 2.0
    lowering: float = 0.5
    nu: float = nan
    phase: str = "lm"

    def handing_over(self) -> Self:
        """Return the same search: it goes on until it converges or meets its limit."""
        return self

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Raise nu until a trial does not raise the cost."""
        cost = linear.point.cost
        nu = linear.gradient_norm if self.first is None else self.first
        nu = first_nu = nu if isnan(self.nu) else self.nu
        for rejections in range(MOST_TRIALS):
            step = damped_step(linear, nu)
            promise = -0.5 * step.slope
            if not promise > EPS * cost:
                break
            trial = yield from problem.evaluate(step.target)
            ratio = gain_ratio(cost - trial.cost, promise)
            if ratio >= 0.0:
                move = Move(trial, nu, rejections, ratio, capped=first_nu > 0.0)
                return move, self._replace(nu=self.after(nu, ratio))
            nu = self.raised(nu)
        move = Move(None, nu, rejections, stop=Stop.STALLED, capped=first_nu > 0.0)
        return move, self._replace(nu=nu)

    def raised(self, nu: float) -> float:
        """Return nu after a bad trial."""
        return max(self.raising * nu, self.least)

    def after(self, nu: float, ratio: float) -> float:
        """Return nu after an accepted trial."""
        if ratio < LOW:
            return self.raised(nu)
        if ratio <= HIGH:
            return nu
        lowered = self.lowering * nu
        return lowered if lowered >= self.least else 0.0


def damped_step(linear: LinearModel, nu: float) -> DampedStep:
    """Minimise |J d + R|^2 + nu |d|^2 within the bounds."""
    scale, count = linear.scale, len(linear.scale)
    rows = linear.singular[:, None] * linear.directions * scale
    rows, b = (
        np.vstack([rows, sqrt(nu) * np.eye(count)]),
        np.append(linear.amounts, np.zeros(count)),
    )
    low, high = linear.low / scale, linear.high / scale
    return step_to(linear, scale * bounded_minimum(rows, b, low, high, linear.unseen))


class ArmijoDamping(NamedTuple):
    """Levenberg-Marquardt: (nu I + J^T J) d = -g, of which lambda = 1, 1/2, 1/4 ... is tried.

    ``nu`` is the same everywhere; None: the norm of the gradient at each point. As in
    `RatioDamping` the identity is that of x itself, whatever its units.
    """

    nu: float | None = None
    armijo: float = ARMIJO
    phase: str = "lm"

    def handing_over(self) -> Self:
        """Return the same search: it goes on until it converges or meets its limit."""
        return self

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Try the whole damped step, then half of it."""
        nu = linear.gradient_norm if self.nu is None else self.nu
        step = damped_step(linear, nu)
        move = yield from shorten(problem, linear, step, armijo=self.armijo, cut=to_half)
        return move._replace(damping=nu, capped=nu > 0.0), self


@dataclass(frozen=True)
class Searches:
    """One search for each phase, with its settings."""

    gn: FullStep = field(default_factory=lambda: FullStep(retries=True))
    dgn: LineSearch = field(default_factory=LineSearch)
    lm: TrustRegion | RatioDamping | ArmijoDamping = field(default_factory=TrustRegion)


USUAL = Searches()
BENDING = Searches(lm=TrustRegion(bends=True))  # smooth residuals, of which nothing is known
