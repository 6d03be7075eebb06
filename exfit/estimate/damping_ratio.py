"""Levenberg-Marquardt whose damping nu follows the gain ratio (lm with update: ratio)."""

from dataclasses import dataclass, replace
from math import isnan, nan, sqrt
from typing import Self

import numpy as np

from exfit.estimate.answer import Stop
from exfit.estimate.arrays import EPS
from exfit.estimate.bounded import bounded_minimum
from exfit.estimate.linear import DampedStep, LinearModel, step_to
from exfit.estimate.problem import Problem
from exfit.estimate.requests import Steps
from exfit.estimate.search import MOST_TRIALS, Move, gain_ratio

LOW, HIGH = 0.25, 0.75  # gain ratios: nu is raised below the first, lowered above the second


@dataclass(frozen=True)
class RatioDamping:
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
        nu = first_nu = self.at_start(linear) if isnan(self.nu) else self.nu
        for rejections in range(MOST_TRIALS):
            step = damped_step(linear, nu)
            promise = -0.5 * step.slope
            if not promise > EPS * cost:
                break
            trial = yield from problem.evaluate(step.target)
            ratio = gain_ratio(cost - trial.cost, promise)
            if ratio >= 0.0:
                move = Move(trial, nu, rejections, ratio, capped=first_nu > 0.0)
                return move, replace(self, nu=self.after(nu, ratio))
            nu = self.raised(nu)
        move = Move(None, nu, rejections, stop=Stop.STALLED, capped=first_nu > 0.0)
        return move, replace(self, nu=nu)

    def at_start(self, linear: LinearModel) -> float:
        """Return nu to begin with."""
        return linear.gradient_norm if self.first is None else self.first

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
