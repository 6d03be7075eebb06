"""The one loop of all methods, its log, its rules to stop, and the methods by name."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf, nan, sqrt
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from exfit.estimate.linear import LinearModel, blind, linearise
from exfit.estimate.lockstep import finish
from exfit.estimate.problem import (
    EPS,
    RELATIVE_STEP,
    STATUS,
    TINY,
    Box,
    Differences,
    EvaluationLimit,
    Functions,
    OneByOne,
    Point,
    Problem,
    Result,
    SolverIteration,
    Steps,
    Stop,
    checked,
    norm,
)
from exfit.estimate.searches import BENDING, USUAL, FullStep, Move, Search, Searches
from exfit.util.arrays import Array, Mask
from exfit.util.vocabulary import DEFAULT_STRATEGY

LULL = 10  # iterations
CREEP = 1e-6  # of the cost: less than the noise of any record leaves open
HIGH = 2.0  # times the cost of another minimum: no record leaves both open
PACE = 0.01  # of what is missing to it: fifty iterations at that pace come no nearer
ROUNDING = 10.0 * EPS  # of what the residuals are made of: what is left is no more than this
ORTHOGONAL = 1e-6  # cosine of the residuals and a column of J: what rounding of f leaves open
KINK = 1e-3  # of the cost: what a derivative from one side may promise at a minimum
MOST_ITERATIONS = 100  # of a phase for which nothing is given


class Rules:
    """The rules to stop, by the tolerances of a descent and what they refer to at its start.

    Without units nothing says that the start is sensible: a cost is not small because that of the
    start was large, and variables that were seen there may get lost.
    """

    def __init__(self, descent: "Descent", start: LinearModel) -> None:
        self.gtol, self.ftol, self.xtol = descent.gtol, descent.ftol, descent.xtol
        self.gtol_absolute, self.matches = descent.gtol_absolute, descent.matches
        self.scaled, self.known = descent.x_scale is not None, descent.known
        self.first_cost = start.point.cost if self.scaled else 0.0
        self.first_gradient = start.gradient_norm
        moving = np.any(start.jacobian != 0.0, axis=0)  # by however little
        self.seen = np.zeros(1, dtype=np.bool_) if self.scaled else moving

    def at_rest(self, linear: LinearModel) -> Stop | None:
        """Find a reason to stop at a point: there is nothing to gain, or it is good enough."""
        if not linear.finite:
            return Stop.JACOBIAN
        cost, gradient = linear.point.cost, linear.gradient_norm
        nothing = cost <= self.gtol**2 * self.first_cost
        flat = gradient <= self.gtol * self.first_gradient + TINY
        if flat and (nothing or linear.full.promise <= self.ftol * cost):
            return Stop.GRADIENT
        if not linear.surely_longer(self.xtol):
            full = linear.full
            if self.tiny(full.target, full.origin, linear.box):
                return Stop.STEP
        if self.matches is not None and self.matches(linear.point.residuals):
            return Stop.MATCH
        if self.gtol_absolute is None:
            return None
        flat = gradient <= self.gtol * self.first_gradient + self.gtol_absolute
        return Stop.FLAT if flat else None

    def after(self, before: LinearModel, linear: LinearModel, move: Move) -> Stop | None:
        """Find a reason to stop after an iteration."""
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
        """Find a reason to stop after these iterations of a phase: a valley of kinks has no end.

        It is no minimum where the linear model still promises much: then the search has stalled.
        """
        if len(log) <= LULL:
            return None
        gain, cost = log[-1 - LULL].cost - log[-1].cost, log[-1].cost
        if cost > HIGH * self.known and gain < PACE * (cost - self.known):
            return Stop.HIGH
        if gain > CREEP * cost or min(line.inner for line in log[-LULL:]) == 0:
            return None
        resting = linear.full.promise <= KINK * cost or self.orthogonal(linear)
        return Stop.CREEPING if resting else Stop.STALLED

    def stuck(self, linear: LinearModel, stop: Stop | None) -> Stop | None:
        """Name the reason to stop at a point from which no step led lower."""
        promise = linear.full.promise / linear.point.cost
        if stop is Stop.ILL_CONDITIONED:
            return stop
        parts = abs(linear.jacobian) @ abs(linear.point.x)
        rounding = 0.5 * ROUNDING**2 * float(parts @ parts)
        if promise <= sqrt(EPS) or linear.point.cost <= rounding:
            return Stop.FLOOR
        if self.orthogonal(linear):
            return Stop.GRADIENT
        return Stop.KINK if stop is Stop.STALLED and promise <= KINK else stop

    def orthogonal(self, linear: LinearModel) -> bool:
        """Tell whether the residuals are at right angles to the effect of each free variable.

        Without units that makes a minimum, whatever the linear model promises for a direction that
        it hardly sees: J may be singular at the minimum.
        """
        r = float(np.linalg.norm(linear.point.residuals))
        norms = np.linalg.norm(linear.jacobian, axis=0)
        flat = np.all(abs(linear.projected) <= ORTHOGONAL * r * norms)
        return not self.scaled and bool(flat)

    def tiny(self, there: Array, here: Array, box: Box) -> bool:
        """Tell whether a step is below the tolerance in every variable."""
        size = np.maximum(abs(here), box.unit)
        return bool(np.all(abs(there - here) <= self.xtol * size))


def seen(linear: LinearModel) -> Mask:
    """Return on which variables the residuals depend by more than rounding, unit by unit."""
    norms = np.linalg.norm(linear.jacobian, axis=0) * linear.box.unit
    return np.asarray(norms > linear.unseen * np.max(norms, initial=0.0))


NOT_FINITE = "the residuals at x0 are not finite"


class NotFinite(ValueError):
    """Residuals that are not finite where a search should begin."""


class Outcome(NamedTuple):
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
        descent: "Descent",
        problem: Problem,
        callback: Callable[[SolverIteration], object] | None,
    ) -> None:
        self.descent, self.problem, self.callback = descent, problem, callback
        self.searches = descent.searches
        self.history: list[SolverIteration] = []
        self.iterations = 0
        self.best: LinearModel | None = None

    def search(self, x0: Array) -> Steps[Result]:
        """Search from a start, or raise NotFinite."""
        try:
            point = yield from self.problem.evaluate(x0)
            if point.cost == inf:
                raise NotFinite(NOT_FINITE)
            start = yield from self.linearise(point)
            self.rules = Rules(self.descent, start)
            outcome = yield from STRATEGIES[self.descent.method](self, start)
            outcome = yield from self.best_of(outcome)
        except EvaluationLimit:
            outcome = yield from self.exhausted()
        except KeyboardInterrupt:
            outcome = self.interrupted()
        return self.result(outcome)

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
        most = self.descent.max_iterations
        if not isinstance(most, int):
            most = most.get(search.phase, MOST_ITERATIONS)
        for _ in range(most):
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
        """End a phase, at no minimum where a variable got lost."""
        outcome = Outcome(linear, stop)
        lost = outcome.converged and np.any(self.rules.seen & ~seen(linear))
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
        """Make the result for the user."""
        linear, stop = outcome.linear, outcome.stop
        x, box = linear.point.x, linear.box
        return Result(
            x=x,
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
            active_mask=np.where(x <= box.low, -1, np.where(x >= box.high, 1, 0)),
        )


Strategy = Callable[[SearchRun, LinearModel], Steps[Outcome]]


def alone(search: Callable[[Searches], Search]) -> Strategy:
    """Return the strategy that is one method from start to end."""
    return lambda run, start: run.descend(search(run.searches), start)


def lm_then_dgn(run: SearchRun, start: LinearModel) -> Steps[Outcome]:
    """Let lm find the valley and dgn follow it; where a kink stops that, lm goes on.

    Where both stalled at one point it would stall there again.
    """
    lm, dgn = run.searches.lm, run.searches.dgn
    first = yield from run.descend(lm.handing_over(), start)
    if first.converged or first.stop in (Stop.JACOBIAN, Stop.HIGH):
        return first
    second = yield from run.descend(dgn, first.linear)
    costs = first.linear.point.cost, second.linear.point.cost
    stuck = first.stop is Stop.STALLED and costs[0] - costs[1] <= CREEP * costs[0]
    if second.stop is not Stop.STALLED or stuck:
        return second
    return (yield from run.descend(lm, second.linear))


def robust(run: SearchRun, start: LinearModel) -> Steps[Outcome]:
    """Go on with lm where gn quits."""
    return relay(run, start, FullStep(), run.searches.lm)


def relay(run: SearchRun, start: LinearModel, first: Search, second: Search) -> Steps[Outcome]:
    """Go on with the second search where the first ends short of a minimum."""
    outcome = yield from run.descend(first, start)
    if outcome.converged or outcome.stop is Stop.JACOBIAN:
        return outcome
    return (yield from run.descend(second, outcome.linear))


def auto(run: SearchRun, start: LinearModel) -> Steps[Outcome]:
    """Try dgn; where that did not converge, or not to a match, lm and dgn from the same start."""
    first = yield from run.descend(run.searches.dgn, start)
    point, good_enough = first.linear.point, run.descent.good_enough
    if good_enough is None:
        matches = first.converged
    else:
        matches = sqrt(2.0 * point.cost / len(point.residuals)) <= good_enough
    if matches:
        return first
    second = yield from lm_then_dgn(run, start)
    return second if second.linear.point.cost <= point.cost else first


STRATEGIES: dict[str, Strategy] = {
    "gn": alone(lambda searches: searches.gn),
    "dgn": alone(lambda searches: searches.dgn),
    "lm": alone(lambda searches: searches.lm),
    "lm-then-dgn": lm_then_dgn,
    "auto": auto,
    "robust": robust,
}


@dataclass(frozen=True, kw_only=True)
class Descent:
    """What is made small, within which bounds, by which method and how far.

    `least_squares` says what the settings mean; ``differences`` takes the Jacobian from residuals.
    ``known`` is the cost of a minimum found before: who creeps far above it does so to no end.
    """

    functions: Functions
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf)
    method: str = DEFAULT_STRATEGY
    differences: Differences | None = None
    most_evaluations: int | None = None
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS
    gtol: float = 1e-8
    gtol_absolute: float | None = None
    ftol: float = 1e-10
    xtol: float = 1e-10
    x_scale: ArrayLike | None = None
    jacobian_error: float | None = None
    good_enough: float | None = None
    matches: Callable[[Array], bool] | None = None
    known: float = inf
    searches: Searches = USUAL

    def begin(
        self, x0: ArrayLike, callback: Callable[[SolverIteration], object] | None = None
    ) -> Steps[Result]:
        """Return the search from x0 (N,), to be advanced by `lockstep`.

        Raises ValueError as `least_squares` does.
        """
        start, box = checked(x0, self.bounds, self.x_scale)
        if self.method not in STRATEGIES:
            raise ValueError(f"method: {self.method!r} is none of {', '.join(STRATEGIES)}")
        problem = Problem(
            self.functions,
            self.differences,
            box,
            self.x_scale is not None,
            self.jacobian_error,
            self.most_evaluations,
        )
        return SearchRun(self, problem, callback).search(start)

    def run(
        self, x0: ArrayLike, callback: Callable[[SolverIteration], object] | None = None
    ) -> Result:
        """Search from x0 (N,) alone and return the result."""
        return finish(self.begin(x0, callback))


def least_squares(
    fun: Callable[..., ArrayLike],
    x0: ArrayLike,
    jac: Differences | Callable[..., ArrayLike] = "2-point",
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf),
    method: str = "auto",
    *,
    ftol: float = 1e-15,
    xtol: float = 1e-10,
    gtol: float = 1e-10,
    x_scale: ArrayLike | Literal["jac"] | None = None,
    max_nfev: int | None = None,
    args: Sequence[Any] = (),
    kwargs: Mapping[str, Any] | None = None,
    callback: Callable[[SolverIteration], object] | None = None,
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS,
    gtol_absolute: float | None = None,
    jacobian_error: float | None = None,
    good_enough: float | None = None,
    matches: Callable[[Array], bool] | None = None,
    searches: Searches = BENDING,
) -> Result:
    """Minimise f(x) = 1/2 sum(fun(x)^2) within bounds, from x0 (N,).

    ``fun(x, *args, **kwargs)`` gives the residuals (M,), jac of the same arguments their
    derivatives (M, N); "2-point" and "3-point" take differences, inside the bounds, and count them
    in nfev. A trial that is not finite, or whose fun raises ArithmeticError, is rejected. fun is
    never called outside the bounds.

    ``method`` is a name of `exfit.util.vocabulary.STRATEGIES`, where each is explained.

    x_scale      what counts as one unit of each variable; None or "jac" takes it from the columns
                 of J. Use 1 for logarithms
    max_nfev     how often fun may be called, for differences too; the Jacobian at the end may take
                 N calls more
    callback     gets every SolverIteration; StopIteration ends the search with the best point
                 seen, as KeyboardInterrupt does wherever it is raised
    jacobian_error  of jac, as a share of its largest singular value: directions that J sees by
                 less are left alone. None: that of rounding, or of the differences taken here
    good_enough  root mean square of residuals that counts as a match (auto); None: convergence
    matches      whether residuals (M,) are so small that the search may end
    searches     the settings of gn, dgn and lm

    It stops when (GRADIENT) the projected gradient is below gtol times its norm at x0 and the full
    step promises less than ftol f(x) (the gradient alone hardly sees badly determined directions)
    or, with x_scale, f(x) is below gtol^2 f(x0); (FLOOR) an iteration neither promised nor brought
    ftol f(x); (STEP) the full step is below xtol; (KINK) no trial is better and the full step
    promises less than a thousandth of f(x), as at a minimum where the derivative jumps; (CREEPING)
    ten iterations, each with rejected trials, gained less than a millionth of f(x), and the full
    step promises less than a thousandth; (MATCH) the residuals match; (FLAT), with gtol_absolute,
    the gradient is below gtol times its norm at x0 plus gtol_absolute, whatever the full step
    promises; or after max_iterations, in each phase anew (a number, or one for each phase). Where
    the residuals depend no longer on a variable that they depended on at x0 that is no success
    (LOST), unless x_scale is given.

    Raises ValueError for bounds that cross, x0 outside them or residuals not finite there.
    """
    if not callable(jac) and jac not in RELATIVE_STEP:
        raise ValueError(f"jac: {jac!r} is neither callable nor one of {', '.join(RELATIVE_STEP)}")
    if max_nfev is not None and max_nfev < 1:
        raise ValueError(f"max_nfev: {max_nfev} is less than 1")
    more = kwargs or {}
    descent = Descent(
        functions=OneByOne(
            lambda x: fun(x, *args, **more),
            (lambda x: jac(x, *args, **more)) if callable(jac) else None,
        ),
        bounds=bounds,
        method=method,
        differences=None if callable(jac) else jac,
        most_evaluations=max_nfev,
        max_iterations=max_iterations,
        gtol=gtol,
        gtol_absolute=gtol_absolute,
        ftol=ftol,
        xtol=xtol,
        x_scale=None if isinstance(x_scale, str) and x_scale == "jac" else x_scale,
        jacobian_error=jacobian_error,
        good_enough=good_enough,
        matches=matches,
        searches=searches,
    )
    return descent.run(x0, callback)
