"""When to stop, and why."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import nan, sqrt
from typing import Self

import numpy as np

from exfit.estimate.answer import SolverIteration, Stop
from exfit.estimate.arrays import EPS, TINY, Array, Mask
from exfit.estimate.box import Box
from exfit.estimate.linear import LinearModel
from exfit.estimate.search import Move

LULL = 10  # iterations
CREEP = 1e-6  # of the cost: less than the noise of any record leaves open
ROUNDING = 10.0 * EPS  # of what the residuals are made of: what is left is no more than this
ORTHOGONAL = 1e-6  # cosine of the residuals and a column of J: what rounding of f leaves open
KINK = 1e-3  # of the cost: what a derivative from one side may promise at a minimum
MOST_ITERATIONS = 100  # of a phase for which nothing is given


@dataclass(frozen=True)
class Rules:
    """The tolerances, of which `least_squares` says what they mean, and what they refer to.

    ``scaled``: whether units are given; ``seen``: the variables that no end may lose sight of.
    """

    max_iterations: int | Mapping[str, int]
    gtol: float
    ftol: float
    xtol: float
    gtol_absolute: float | None = None
    matches: Callable[[Array], bool] | None = None
    scaled: bool = True
    first_cost: float = nan
    first_gradient: float = nan
    seen: Mask = field(default_factory=lambda: np.zeros(1, dtype=np.bool_))

    def starting_at(self, start: LinearModel, scaled: bool) -> Self:
        """Return the rules that measure by the start.

        Without units (``scaled``) nothing says that the start is sensible: a cost is not small
        because that of the start was large, and variables that were seen there may get lost.
        """
        rules = replace(self, scaled=scaled, first_gradient=start.gradient_norm)
        if scaled:
            return replace(rules, first_cost=start.point.cost)
        return replace(rules, first_cost=0.0, seen=seen(start))

    def most_iterations(self, phase: str) -> int:
        """Return how many iterations a phase may have."""
        if isinstance(self.max_iterations, int):
            return self.max_iterations
        return self.max_iterations.get(phase, MOST_ITERATIONS)

    def at_rest(self, linear: LinearModel) -> Stop | None:
        """Return why there is nothing to gain from a point, if so."""
        if not linear.finite:
            return Stop.JACOBIAN
        cost = linear.point.cost
        nothing = cost <= self.gtol**2 * self.first_cost
        flat = linear.gradient_norm <= self.gtol * self.first_gradient + TINY
        if flat and (nothing or linear.full.promise <= self.ftol * cost):
            return Stop.GRADIENT
        if not linear.surely_longer(self.xtol):
            full = linear.full
            if self.tiny(full.target, full.origin, linear.box):
                return Stop.STEP
        return self.good_enough(linear)

    def good_enough(self, linear: LinearModel) -> Stop | None:
        """Return which tolerance of the user's own a point is within, if any."""
        if self.matches is not None and self.matches(linear.point.residuals):
            return Stop.MATCH
        if self.gtol_absolute is None:
            return None
        flat = linear.gradient_norm <= self.gtol * self.first_gradient + self.gtol_absolute
        return Stop.FLAT if flat else None

    def after(self, before: LinearModel, linear: LinearModel, move: Move) -> Stop | None:
        """Return why to stop after an iteration, if so."""
        cost = before.point.cost
        if not linear.finite:
            return Stop.JACOBIAN
        if move.point is None:
            return self.stuck(before, move.stop)
        gained = cost - linear.point.cost > self.ftol * cost
        if not gained and before.full.promise <= self.ftol * cost:
            return Stop.FLOOR
        if move.stop is None and self.tiny(linear.point.x, before.point.x, linear.box):
            return self.at_rest(linear) or self.stuck(linear, Stop.STALLED)
        return move.stop

    def creeping(self, log: Sequence[SolverIteration], linear: LinearModel) -> Stop | None:
        """Return why to stop after these iterations of a phase: a valley of kinks has no end.

        It is no minimum where the linear model still promises much: then the search has stalled.
        """
        last = log[-LULL:]
        if len(log) <= LULL or min(line.inner for line in last) == 0:
            return None
        gain, cost = log[-1 - LULL].cost - log[-1].cost, log[-1].cost
        if gain > CREEP * cost:
            return None
        resting = linear.full.promise <= KINK * cost or self.orthogonal(linear)
        return Stop.CREEPING if resting else Stop.STALLED

    def stuck(self, linear: LinearModel, stop: Stop | None) -> Stop | None:
        """Return why to stop at a point from where no step led lower."""
        promise = linear.full.promise / linear.point.cost
        if stop is Stop.ILL_CONDITIONED:
            return stop
        if promise <= sqrt(EPS) or rounding(linear):
            return Stop.FLOOR
        if self.orthogonal(linear):
            return Stop.GRADIENT
        return Stop.KINK if stop is Stop.STALLED and promise <= KINK else stop

    def orthogonal(self, linear: LinearModel) -> bool:
        """Return whether the residuals are at right angles to what each free variable changes.

        Without units that makes a minimum, whatever the linear model promises for a direction that
        it hardly sees: J may be singular at the minimum.
        """
        r = float(np.linalg.norm(linear.point.residuals))
        norms = np.linalg.norm(linear.jacobian, axis=0)
        flat = np.all(abs(linear.projected) <= ORTHOGONAL * r * norms)
        return not self.scaled and bool(flat)

    def lost(self, linear: LinearModel) -> bool:
        """Return whether the residuals depend no longer on a variable that they depended on."""
        return bool(np.any(self.seen & ~seen(linear)))

    def tiny(self, there: Array, here: Array, box: Box) -> bool:
        """Return whether a step is below the tolerance in every variable."""
        size = np.maximum(abs(here), box.unit)
        return bool(np.all(abs(there - here) <= self.xtol * size))


def seen(linear: LinearModel) -> Mask:
    """Return on which variables the residuals depend by more than rounding, unit by unit."""
    norms = np.linalg.norm(linear.jacobian, axis=0) * linear.box.unit
    return np.asarray(norms > linear.unseen * np.max(norms, initial=0.0))


def rounding(linear: LinearModel) -> bool:
    """Return whether the residuals are no more than what rounding leaves of their parts."""
    parts = abs(linear.jacobian) @ abs(linear.point.x)
    return linear.point.cost <= 0.5 * ROUNDING**2 * float(parts @ parts)
