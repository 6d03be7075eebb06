"""Gauss-Newton, in full steps (gn) or damped by capping and shortening them (dgn)."""

from dataclasses import dataclass, replace
from math import inf
from typing import Self

import numpy as np

from exfit.estimate.answer import Stop
from exfit.estimate.linear import LinearModel, solve
from exfit.estimate.problem import Problem
from exfit.estimate.requests import Steps
from exfit.estimate.search import ARMIJO, Cut, Move, gain_ratio, shorten, to_parabola

WORST_CONDITION = 1e8  # beyond it a full Gauss-Newton step is a guess
LEAST_REACH = 0.3
GOOD = 0.25  # gain ratio from which the model was right about the length


@dataclass(frozen=True)
class FullStep:
    """Gauss-Newton: the full step or nothing; ``retries``: a first one that fails is shortened."""

    retries: bool = False
    phase: str = "gn"

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Take the full step, the first one shortened once where that is necessary."""
        if linear.singular[0] > WORST_CONDITION * linear.singular[linear.rank - 1]:
            return Move(None, 1.0, 0, stop=Stop.ILL_CONDITIONED), self
        full, length, once = linear.full, 1.0, replace(self, retries=False)
        for rejections in range(2 if self.retries else 1):
            trial = yield from problem.evaluate(full.at(length))
            decrease = linear.point.cost - trial.cost
            if decrease > 0.0:
                quality = gain_ratio(decrease, full.promised(length))
                return Move(trial, length, rejections, quality), once
            length *= to_parabola(-decrease, length * full.slope)
        return Move(None, 1.0, rejections + 1, stop=Stop.FULL_STEP), once


@dataclass(frozen=True)
class LineSearch:
    """Damped Gauss-Newton: a step, shortened until Armijo's rule holds.

    Capped, the step is the best of the linear model that moves no variable farther than the reach
    (in units of each variable, a trust region), which grows after good steps. It keeps the badly
    determined directions at bay: without it one such direction makes the whole step so long that
    lambda must be tiny for all. Not capped it is the full Gauss-Newton step: with ``to_half`` as
    its cut that is the damped Gauss-Newton method of Kelley 1999, section 2.3.
    """

    capped: bool = True
    cut: Cut = to_parabola
    armijo: float = ARMIJO
    reach: float = 1.0
    phase: str = "dgn"

    def advance(self, problem: Problem, linear: LinearModel) -> Steps[tuple[Move, Self]]:
        """Try lambda = 1, then less."""
        step = solve(linear, reach=self.reach) if self.capped else linear.full
        reach = self.reach if self.capped else inf
        move = yield from shorten(problem, linear, step, reach, armijo=self.armijo, cut=self.cut)
        if move.point is None:
            return move, self
        farthest = float(np.max(abs(move.point.x - linear.point.x) / linear.box.unit))
        useful = move.damping == 1.0 and move.quality > GOOD
        least = self.reach if useful else LEAST_REACH
        return move, replace(self, reach=max(least, 2.0 * farthest))
