"""The one loop of all methods, its log, and what comes out of it."""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from exfit.estimate.answer import STATUS, Result, SolverIteration, Stop
from exfit.estimate.arrays import Array, norm
from exfit.estimate.box import Box
from exfit.estimate.linear import LinearModel, blind, linearise
from exfit.estimate.problem import Point, Problem
from exfit.estimate.requests import Steps
from exfit.estimate.search import Move, Search
from exfit.estimate.searches import Searches
from exfit.estimate.stopping import Rules

NOT_FINITE = "the residuals at x0 are not finite"


class NotFinite(ValueError):
    """Residuals that are not finite where a search should begin."""


@dataclass(frozen=True)
class Outcome:
    """Where a phase ended and why."""

    linear: LinearModel
    stop: Stop

    @property
    def converged(self) -> bool:
        """Whether it ended at a minimum."""
        return STATUS[self.stop] > 0


class SearchRun:
    """A search from its start to its end, perhaps in several phases."""

    def __init__(
        self,
        problem: Problem,
        rules: Rules,
        searches: Searches,
        callback: Callable[[SolverIteration], object] | None,
    ) -> None:
        self.problem, self.rules, self.callback = problem, rules, callback
        self.searches = searches
        self.history: list[SolverIteration] = []
        self.iterations = 0
        self.best: LinearModel | None = None

    def begin(self, x0: Array) -> Steps[LinearModel]:
        """Return the linear model at the start, or raise NotFinite."""
        point = yield from self.problem.evaluate(x0)
        if point.cost == inf:
            raise NotFinite(NOT_FINITE)
        start = yield from self.linearise(point)
        self.rules = self.rules.starting_at(start, self.problem.scaled)
        return start

    def linearise(self, point: Point, before: LinearModel | None = None) -> Steps[LinearModel]:
        """Return the linear model at a point; remember the best one."""
        linear = yield from linearise(self.problem, point, before)
        if self.best is None or point.cost <= self.best.point.cost:
            self.best = linear
        return linear

    def descend(self, search: Search, linear: LinearModel) -> Steps[Outcome]:
        """Go down from a point until there is a reason to stop."""
        if not self.history or not np.array_equal(self.history[-1].x, linear.point.x):
            self.announce(search.phase, linear)
        first = len(self.history) - 1
        for _ in range(self.rules.most_iterations(search.phase)):
            stop = self.rules.at_rest(linear)
            if stop is not None:
                return self.end(linear, stop)
            before = linear
            move, search = yield from search.advance(self.problem, before)
            if move.point is not None:
                linear = yield from self.linearise(move.point, before)
            self.iterations += 1
            self.announce(search.phase, linear, move, before)
            stop = self.rules.after(before, linear, move)
            stop = stop or self.rules.creeping(self.history[first:], linear)
            if stop is not None:
                return self.end(linear, stop)
        return self.end(linear, self.rules.at_rest(linear) or Stop.ITERATIONS)

    def end(self, linear: LinearModel, stop: Stop) -> Outcome:
        """Return where a phase ended, which is no minimum where a variable got lost."""
        outcome = Outcome(linear, stop)
        lost = outcome.converged and self.rules.lost(linear)
        return Outcome(linear, Stop.LOST) if lost else outcome

    def announce(
        self,
        phase: str,
        linear: LinearModel,
        move: Move | None = None,
        before: LinearModel | None = None,
    ) -> None:
        """Write a line of the log and call the callback."""
        x = linear.point.x
        move = move or Move(None, nan, 0)
        line = SolverIteration(
            number=len(self.history),
            phase=phase,
            x=x.copy(),
            cost=linear.point.cost,
            gradient_norm=linear.gradient_norm,
            step_norm=norm(x - before.point.x) if before else 0.0,
            damping=move.damping,
            inner=move.inner,
            nfev=self.problem.nfev,
            njev=self.problem.njev,
            quality=move.quality,
            capped=move.capped if before else None,
        )
        self.history.append(line)
        if self.callback is not None:
            try:
                self.callback(line)
            except StopIteration:
                raise KeyboardInterrupt from None

    def best_of(self, outcome: Outcome) -> Steps[Outcome]:
        """Return the outcome, moved to a trial that was rejected and yet is the best."""
        best = self.problem.best
        if best is not None and best.cost < outcome.linear.point.cost:
            return Outcome((yield from linearise(self.problem, best)), outcome.stop)
        return outcome

    def exhausted(self) -> Steps[Outcome]:
        """Return the best point seen within the limit of evaluations, with its Jacobian."""
        self.problem.most_evaluations = None
        point = self.problem.best
        if point is None or point.cost == inf:
            raise NotFinite(NOT_FINITE)
        linear = self.best or (yield from linearise(self.problem, point))
        return (yield from self.best_of(Outcome(linear, Stop.EVALUATIONS)))

    def interrupted(self) -> Outcome:
        """Return the best point seen, with its Jacobian if that was there in time.

        Raises KeyboardInterrupt where there is none.
        """
        point = self.problem.best
        if point is None or point.cost == inf:
            raise KeyboardInterrupt
        if self.best is not None and self.best.point.cost <= point.cost:
            return Outcome(self.best, Stop.INTERRUPTED)
        unknown = np.full((len(point.residuals), len(point.x)), nan)
        return Outcome(blind(self.problem, point, unknown), Stop.INTERRUPTED)

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
            promise=linear.full.promise if linear.finite else nan,
            nfev=self.problem.nfev,
            njev=self.problem.njev,
            nit=self.iterations,
            status=STATUS[stop],
            message=stop.value,
            success=outcome.converged,
            history=tuple(self.history),
            stop=stop,
            active_mask=active(linear.point.x, linear.box),
        )


def active(x: Array, box: Box) -> NDArray[np.int_]:
    """Return -1 where a variable is at its lower bound, 1 at its upper one, else 0."""
    return np.where(x <= box.low, -1, np.where(x >= box.high, 1, 0))
