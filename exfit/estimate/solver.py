"""Nonlinear least squares within bounds: the one function that chooses and runs a method."""

from collections.abc import Callable, Mapping
from math import inf

from numpy.typing import ArrayLike

from exfit.estimate.answer import Result, SolverIteration
from exfit.estimate.arrays import Array
from exfit.estimate.box import checked
from exfit.estimate.problem import RELATIVE_STEP, Differences, Function, Problem
from exfit.estimate.run import SearchRun
from exfit.estimate.searches import USUAL, Searches
from exfit.estimate.stopping import MOST_ITERATIONS, Rules
from exfit.estimate.strategies import STRATEGIES


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
    start, box = checked(x0, bounds, x_scale)
    if method not in STRATEGIES:
        raise ValueError(f"method: {method!r} is none of {', '.join(STRATEGIES)}")
    if not callable(jac) and jac not in RELATIVE_STEP:
        raise ValueError(f"jac: {jac!r} is neither callable nor one of {', '.join(RELATIVE_STEP)}")
    problem = Problem(fun, jac, box, x_scale is not None, jacobian_error)
    rules = Rules(max_iterations, gtol, ftol, xtol, gtol_absolute, matches)
    run = SearchRun(problem, rules, searches, callback)
    try:
        outcome = run.best_of(STRATEGIES[method](run, run.begin(start), good_enough))
    except KeyboardInterrupt:
        outcome = run.interrupted()
    return run.result(outcome)
