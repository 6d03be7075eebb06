"""What a search is, and the shortening of a step that searches share."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, nan
from typing import Protocol, Self

import numpy as np

from exfit.estimate.answer import Stop
from exfit.estimate.arrays import EPS
from exfit.estimate.linear import DampedStep, LinearModel
from exfit.estimate.problem import Point, Problem
from exfit.estimate.requests import Steps

ARMIJO = 1e-4  # share of the promised decrease that makes a trial good enough
MOST_TRIALS = 60
LEAST_AGAIN = 1e-10  # of the cost: where the full step promises less, one trial shows it or none
SAME = 1e-9  # units: a step that differs by less is the same

Cut = Callable[[float, float], float]


@dataclass(frozen=True)
class Move:
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
    """Return whether a trial may show what it promises, or one more after some rejections."""
    cost = linear.point.cost
    if rejections and linear.full.promise <= LEAST_AGAIN * cost:
        return False
    return promise > EPS * cost


def held_back(linear: LinearModel, step: DampedStep, reach: float) -> bool:
    """Return whether a step, the best within reach, is another than the full Gauss-Newton step."""
    farthest = np.max(abs(step.target - linear.point.x) / linear.box.unit)
    if linear.rank == len(linear.scale) and farthest < reach * (1.0 - SAME):
        return False
    apart = abs(step.target - linear.full.target)
    return bool(np.any(apart > SAME * linear.box.unit))


def to_parabola(rise: float, slope: float) -> float:
    """Return by how much to shorten a trial: to the minimum of the parabola, 0.2 ... 0.5.

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
    capped = held_back(linear, step, reach)
    while reductions < trials and worth_trying(linear, -length * step.slope, reductions):
        trial = yield from problem.evaluate(step.at(length))
        if trial.cost < cost and trial.cost <= cost + armijo * length * step.slope:
            quality = gain_ratio(cost - trial.cost, step.promised(length))
            return Move(trial, length, reductions, quality, capped=capped)
        length *= cut(trial.cost - cost, length * step.slope)
        reductions += 1
    return Move(None, length, reductions, stop=Stop.STALLED, capped=capped)
