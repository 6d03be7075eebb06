"""Nonlinear least squares within bounds: one descent, by the method and tolerances chosen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

from numpy.typing import ArrayLike

from exfit.estimate.answer import Result, SolverIteration
from exfit.estimate.arrays import Array
from exfit.estimate.box import checked
from exfit.estimate.lockstep import finish
from exfit.estimate.problem import RELATIVE_STEP, Differences, Problem
from exfit.estimate.requests import Function, Functions, OneByOne, Steps
from exfit.estimate.run import SearchRun
from exfit.estimate.searches import USUAL, Searches
from exfit.estimate.stopping import MOST_ITERATIONS, Rules
from exfit.estimate.strategies import STRATEGIES
from exfit.util.strategies import DEFAULT_STRATEGY


@dataclass(frozen=True, kw_only=True)
class Descent:
    """What is made small, within which bounds, by which method and how far.

    `least_squares` says what the settings mean; ``differences`` takes the Jacobian from residuals.
    """

    functions: Functions
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf)
    method: str = DEFAULT_STRATEGY
    differences: Differences | None = None
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS
    gtol: float = 1e-8
    gtol_absolute: float | None = None
    ftol: float = 1e-10
    xtol: float = 1e-10
    x_scale: ArrayLike | None = None
    jacobian_error: float | None = None
    good_enough: float | None = None
    matches: Callable[[Array], bool] | None = None
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
        scaled = self.x_scale is not None
        problem = Problem(self.functions, self.differences, box, scaled, self.jacobian_error)
        rules = Rules(
            self.max_iterations, self.gtol, self.ftol, self.xtol, self.gtol_absolute, self.matches
        )
        return self._search(SearchRun(problem, rules, self.searches, callback), start)

    def _search(self, run: SearchRun, start: Array) -> Steps[Result]:
        try:
            linear = yield from run.begin(start)
            outcome = yield from STRATEGIES[self.method](run, linear, self.good_enough)
            outcome = yield from run.best_of(outcome)
        except KeyboardInterrupt:
            outcome = run.interrupted()
        return run.result(outcome)


def least_squares(
    fun: Function,
    x0: ArrayLike,
    jac: Differences | Function = "2-point",
    bounds: tuple[ArrayLike, ArrayLike] = (-inf, inf),
    method: str = "auto",
    *,
    max_iterations: int | Mapping[str, int] = MOST_ITERATIONS,
    gtol: float = 1e-8,
    gtol_absolute: float | None = None,
    ftol: float = 1e-10,
    xtol: float = 1e-10,
    x_scale: ArrayLike | None = None,
    jacobian_error: float | None = None,
    good_enough: float | None = None,
    matches: Callable[[Array], bool] | None = None,
    searches: Searches = USUAL,
    callback: Callable[[SolverIteration], object] | None = None,
) -> Result:
    """Minimise f(x) = 1/2 sum(fun(x)^2) within bounds, from x0 (N,).

    fun(x) gives the residuals (M,), jac(x) their derivatives (M, N); "2-point" and "3-point"
    take differences, inside the bounds, and count them in nfev. A trial that is not finite, or
    whose fun raises ArithmeticError, is rejected. fun is never called outside the bounds.

    ``method`` is a name of `exfit.util.strategies.STRATEGIES`, where each is explained.

    x_scale      what counts as one unit of each variable; None takes it from the columns of J.
                 Use 1 for logarithms
    jacobian_error  of jac, as a share of its largest singular value: directions that J sees by
                 less are left alone. None: that of rounding, or of the differences taken here
    good_enough  root mean square of residuals that counts as a match (auto); None: convergence
    matches      whether residuals (M,) are so small that the search may end
    searches     the settings of gn, dgn and lm
    callback     gets every Iteration; KeyboardInterrupt, raised anywhere, ends the search
                 with the best point seen

    It stops when (GRADIENT) the projected gradient is below gtol times its norm at x0 and either
    the full step promises less than ftol f(x) (the gradient alone hardly sees badly determined
    directions) or f(x) is below gtol^2 f(x0); (FLOOR) an iteration neither promised nor brought
    ftol f(x); (STEP) the full step is below xtol; (KINK) no trial is better and the full step
    promises less than a thousandth of f(x), as at a minimum where the derivative jumps; (CREEPING)
    ten iterations, each with rejected trials, gained less than a millionth of f(x), and the full
    step promises less than a thousandth; (MATCH) the residuals match; (FLAT), with gtol_absolute,
    the gradient is below gtol times its norm at x0 plus gtol_absolute, whatever the full step
    promises; or after max_iterations, in each phase anew (a number, or one for each phase).

    Raises ValueError for bounds that cross, x0 outside them or residuals not finite there.
    """
    if not callable(jac) and jac not in RELATIVE_STEP:
        raise ValueError(f"jac: {jac!r} is neither callable nor one of {', '.join(RELATIVE_STEP)}")
    descent = Descent(
        functions=OneByOne(fun, jac if callable(jac) else None),
        bounds=bounds,
        method=method,
        differences=None if callable(jac) else jac,
        max_iterations=max_iterations,
        gtol=gtol,
        gtol_absolute=gtol_absolute,
        ftol=ftol,
        xtol=xtol,
        x_scale=x_scale,
        jacobian_error=jacobian_error,
        good_enough=good_enough,
        matches=matches,
        searches=searches,
    )
    return finish(descent.begin(x0, callback))
