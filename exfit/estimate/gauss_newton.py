"""Gauss-Newton, in full steps (gn) or damped by shortening them (dgn)."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from exfit.estimate.answer import Stop
from exfit.estimate.linear import LinearModel, solve
from exfit.estimate.problem import Problem
from exfit.estimate.search import MOST_TRIALS, Move, gain_ratio, shorten

WORST_CONDITION = 1e8  # beyond it a full Gauss-Newton step is a guess
LEAST_REACH = 0.3
GOOD = 0.25  # gain ratio from which the model was right about the length


@dataclass(frozen=True)
class FullStep:
    """Gauss-Newton: the full step or nothing."""

    phase: str = "gn"

    def advance(self, problem: Problem, linear: LinearModel) -> tuple[Move, Self]:
        """Take the full step."""
        if linear.singular[0] > WORST_CONDITION * linear.singular[linear.rank - 1]:
            return Move(None, 1.0, 0, stop=Stop.ILL_CONDITIONED), self
        trial = problem.evaluate(linear.full.target)
        decrease = linear.point.cost - trial.cost
        if not decrease > 0.0:
            return Move(None, 1.0, 1, stop=Stop.FULL_STEP), self
        return Move(trial, 1.0, 0, gain_ratio(decrease, linear.full.promise)), self


@dataclass(frozen=True)
class LineSearch:
    """Damped Gauss-Newton: the step within reach, shortened until Armijo's rule holds.

    The reach (in units of each variable) keeps the badly determined directions at bay: without
    it one such direction makes the whole step so long that lambda must be tiny for all.
    """

    reach: float = 1.0
    phase: str = "dgn"

    def advance(self, problem: Problem, linear: LinearModel) -> tuple[Move, Self]:
        """Try lambda = 1, then less."""
        move = shorten(problem, linear, solve(linear, reach=self.reach), MOST_TRIALS)
        if move.point is None:
            return move, self
        moved = float(np.max(abs(move.point.x - linear.point.x) / linear.box.unit))
        useful = move.damping == 1.0 and move.quality > GOOD
        least = self.reach if useful else LEAST_REACH
        return move, replace(self, reach=max(least, 2.0 * moved))
