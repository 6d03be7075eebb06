"""Levenberg-Marquardt within a trust region (lm)."""

from dataclasses import dataclass, replace
from math import inf, sqrt
from typing import Self

import numpy as np

from exfit.estimate.answer import Stop
from exfit.estimate.arrays import TINY, Array, norm
from exfit.estimate.linear import DampedStep, LinearModel, solve
from exfit.estimate.problem import Point, Problem
from exfit.estimate.requests import Steps
from exfit.estimate.search import (
    ARMIJO,
    MOST_TRIALS,
    Move,
    gain_ratio,
    shorten,
    to_parabola,
    worth_trying,
)

BAD, PROVED, GOOD = 0.25, 0.5, 0.75  # gain ratios that shrink, hand over, enlarge
TIMID = 0.1  # share of what the full step promises: an iteration that gains less gained little
PATIENCE = 2  # iterations that may gain little
BOLD_TRIALS = 2
SLACK = 0.1  # of the radius: how far the step may be from it
NEWTON_STEPS = 30
VALLEY = 10  # damped steps in a row: the search follows a valley
PROBE = 0.1  # of a step: where its curvature is looked at
STRAIGHT = 0.75  # of a step: what its curvature may add, at most


@dataclass(frozen=True)
class TrustRegion:
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
        return replace(self, hand_over=True)

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Shrink the radius until a trial lowers the cost, and enlarge it after a good one."""
        if self.timid < self.patience:
            return (yield from self.within(problem, linear))
        move = yield from shorten(
            problem, linear, solve(linear, reach=1.0), 1.0, BOLD_TRIALS, self.armijo
        )
        if move.point is None:
            wary = replace(self, timid=0, patience=2 * self.patience)
            second, search = yield from wary.within(problem, linear, move.inner)
            return replace(second, capped=move.capped), search
        radius = max(self.radius, linear.scaled_length(move.point.x))
        return replace(move, damping=0.0), replace(self, timid=0, patience=PATIENCE, radius=radius)

    def within(
        self, problem: Problem, linear: LinearModel, spent: int = 0
    ) -> Steps[tuple[Move, Self]]:
        """Return the best move that the trust region allows."""
        cost, search = linear.point.cost, self
        if self.radius == inf:
            search = replace(self, radius=first_radius(problem, linear, self.first))
        capped = False
        for rejections in range(spent, spent + MOST_TRIALS):
            nu = damping(linear, search.radius)
            if rejections == spent:
                capped = nu > 0.0
            step = solve(linear, nu)
            if not worth_trying(linear, step.promise, rejections):
                break
            trial = yield from self.trial(problem, linear, step, nu)
            decrease = cost - trial.cost
            search = search.resized(linear, step, nu, decrease)
            quality = gain_ratio(decrease, step.promise)
            if quality > self.armijo:
                trusted = self.hand_over and nu == 0.0 and quality > PROVED
                stop = Stop.TRUSTED if trusted else None
                move = Move(trial, nu, rejections, quality, stop, capped)
                return move, search.after(linear, nu, decrease)
        return Move(None, nu, rejections, stop=Stop.STALLED, capped=capped), search

    def trial(
        self, problem: Problem, linear: LinearModel, step: DampedStep, nu: float
    ) -> Steps[Point]:
        """Return the end of a step, bent where the search follows a valley."""
        if self.bends and nu > 0.0 and self.damped >= VALLEY:
            return (yield from problem.evaluate((yield from bent(problem, linear, step, nu))))
        return (yield from problem.evaluate(step.target))

    def after(self, linear: LinearModel, nu: float, decrease: float) -> Self:
        """Return the search after an accepted trial: how many were timid, or damped, in a row."""
        bold = decrease >= TIMID * linear.highest_promise
        timid = not bold and decrease < TIMID * linear.full.promise
        return replace(
            self, timid=self.timid + 1 if timid else 0, damped=self.damped + 1 if nu > 0.0 else 0
        )

    def resized(self, linear: LinearModel, step: DampedStep, nu: float, decrease: float) -> Self:
        """Return the search with the radius that the trial suggests."""
        quality = gain_ratio(decrease, step.promise)
        length = linear.scaled_length(step.target)
        if quality >= GOOD or (quality > BAD and nu == 0.0):
            return replace(self, radius=max(self.radius, 2.0 * length))
        if quality > BAD:
            return self
        share = to_parabola(-decrease, step.slope) if decrease < 0.0 else 0.5
        return replace(self, radius=share * min(self.radius, 10.0 * length))


def bent(problem: Problem, linear: LinearModel, step: DampedStep, nu: float) -> Steps[Array]:
    """Return where a step ends that follows the curvature of the residuals, if that is small.

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


def first_radius(problem: Problem, linear: LinearModel, first: float) -> float:
    """Return the radius to begin with, no longer than the full step."""
    full = linear.scaled_length(linear.full.target)
    size = norm(linear.scale * linear.box.unit)
    return min(first * (1.0 if problem.scaled else size), max(full, TINY))


def damping(linear: LinearModel, radius: float) -> float:
    """Return nu for which the free part of the step is as long as the radius, to a tenth.

    Source: Moré 1978, section 5 (Newton's iteration on 1/|y|, safeguarded).
    """
    s, b = free_part(linear)
    if norm(b / s) <= (1.0 + SLACK) * radius:
        return 0.0
    low, high = 0.0, norm(s * b) / radius
    nu = 1e-3 * high
    for _ in range(NEWTON_STEPS):
        length = norm(s * b / (s**2 + nu))
        if abs(length - radius) <= SLACK * radius:
            break
        low, high = (nu, high) if length > radius else (low, nu)
        fall = float(np.sum((s * b) ** 2 / (s**2 + nu) ** 3))
        nu += (length / radius - 1.0) * length**2 / fall
        if not low < nu < high:
            nu = max(1e-3 * high, sqrt(low * high))
    return nu


def free_part(linear: LinearModel) -> tuple[Array, Array]:
    """Return singular values and amounts of the variables that no bound holds; both (K,)."""
    free, k = linear.projected != 0.0, linear.rank
    if free.all():
        return linear.singular[:k], linear.amounts[:k]
    A = linear.singular[:k, None] * linear.directions[:k, free]
    left, s, _ = np.linalg.svd(A, full_matrices=False)
    determined = s > linear.unseen * max(np.max(s, initial=0.0), TINY)
    return s[determined], (left.T @ linear.amounts[:k])[determined]
